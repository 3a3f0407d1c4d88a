//! Loading whole sites.

use clerestory::scene::{self, Health};
use clerestory::site::Site;
use std::path::{Path, PathBuf};

fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

#[test]
fn sibenik_loads_with_its_textures() {
    let Some(path) = shared("truth/sibenik") else { return };
    let site = Site::load(&path).unwrap();
    assert_eq!((site.probes.len(), site.views.len(), site.warnings.len()), (4, 4, 0));
    let mut health = Health::default();
    let scene = scene::load(&site, &mut health).unwrap();
    println!("{:?}", health.warnings);
    println!("{} triangles, {} textures, {:?}", scene.mesh.triangles.len(), scene.textures.len(), scene.mesh.bounds());
    assert!(scene.mesh.triangles.len() > 70_000 && scene.textures.len() >= 4);
}

#[test]
fn room_loads() {
    let Some(path) = shared("truth/room/site.toml") else { return };
    let site = Site::load(&path).unwrap();
    let scene = scene::load(&site, &mut Health::default()).unwrap();
    println!("{} triangles, {:?}", scene.mesh.triangles.len(), scene.mesh.bounds());
}
