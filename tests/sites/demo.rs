//! The bundled chapel: what `demo` writes, what the generator makes, and whether the two agree with `sites/chapel`.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on")]

use crate::support::program::clerestory;
use crate::support::{chapel as bundled, contents, files};
use clerestory::scene::{self, Health, Ray, Scene};
use clerestory::site::Site;
use glam::{Vec3, vec3};
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

/// The chapel, true or as modelled, loaded once.
fn load(name: &str) -> &'static (Site, Scene, Health) {
    static LOADED: [OnceLock<(Site, Scene, Health)>; 2] = [OnceLock::new(), OnceLock::new()];
    LOADED[usize::from(name == "site.toml")].get_or_init(|| {
        let site = Site::load(&bundled().join(name)).unwrap();
        let mut health = Health::default();
        let scene = scene::load(&site, &mut health).unwrap();
        (site, scene, health)
    })
}

#[test]
fn demo_writes_the_bundled_site_byte_for_byte_and_it_loads() {
    let temporary = tempfile::tempdir().unwrap();
    let dir = temporary.path().join("my chapel");
    let said = clerestory(&[&"demo", &dir], &[]).text();
    assert!(said.contains("clerestory check '"), "a path with a space is quoted: {said}");
    assert_eq!(files(&dir), files(&bundled()), "the list in demo.rs is the folder");
    let written = contents(&dir);
    for (name, bytes) in contents(&bundled()) {
        assert!(written[&name] == bytes, "{}", name.display());
    }
    for name in ["site.toml", "as_modelled.toml"] {
        let site = Site::load(&dir.join(name)).unwrap();
        assert_eq!(site.lightings(), ["10:00", "14:30"]);
        assert!(site.views.iter().all(|view| view.photo.is_some()));
    }
    assert_eq!(fs::read_dir(temporary.path()).unwrap().count(), 1, "nothing is left beside the site");
}

#[test]
fn demo_spares_a_folder_in_use_unless_forced() {
    let temporary = tempfile::tempdir().unwrap();
    let dir = temporary.path();
    fs::write(temporary.path().join("notes.txt"), "mine").unwrap();
    fs::write(temporary.path().join("site.toml"), "old").unwrap();
    let refused = clerestory(&[&"demo", &dir], &[]).error();
    assert!(refused.contains("not empty") && refused.contains("--force"), "{refused}");
    assert_eq!(fs::read_to_string(temporary.path().join("site.toml")).unwrap(), "old");

    let told = clerestory(&[&"demo", &dir], &["--force", "--json"]).json();
    assert_eq!(told["files"], files(&bundled()).len());
    assert_eq!(fs::read_to_string(temporary.path().join("notes.txt")).unwrap(), "mine");
    assert!(Site::load(temporary.path()).is_ok());
}

#[test]
fn demo_makes_missing_folders_and_fills_an_empty_one() {
    let temporary = tempfile::tempdir().unwrap();
    let deep = temporary.path().join("a/b/c");
    let demo = |folder: &Path| clerestory(&[&"demo", &folder], &[]);
    demo(&deep).text();
    assert!(Site::load(&deep).is_ok());
    let empty = temporary.path().join("empty");
    fs::create_dir(&empty).unwrap();
    demo(&empty).text();
    assert!(Site::load(&empty).is_ok());
    let file = temporary.path().join("file");
    fs::write(&file, "").unwrap();
    assert!(demo(&file).error().contains("is a file"));
}

#[test]
fn the_generator_makes_the_bundled_models_and_site_files() {
    for (name, bytes) in crate::chapel::files().unwrap() {
        let committed = fs::read(bundled().join(&name)).unwrap();
        assert!(committed == bytes, "{name} differs: run `cargo run --release --example build_chapel -- sites/chapel`");
    }
}

#[test]
fn both_models_are_healthy() {
    for (name, version) in
        [("site.toml", crate::chapel::Version::Truth), ("as_modelled.toml", crate::chapel::Version::AsModelled)]
    {
        let (_, scene, health) = load(name);
        assert_eq!(health.warnings, Vec::<String>::new());
        assert_eq!(scene.mesh.triangles.len(), crate::chapel::model(version).triangles(), "no triangle is dropped");
        assert!((15_000..40_000).contains(&scene.mesh.triangles.len()));
        for i in 0..scene.mesh.triangles.len() as u32 {
            let albedo = scene.filtered_albedo(i, glam::Vec2::splat(1.0 / 3.0), 10.0);
            assert!(albedo.min_element() > 0.02 && albedo.max_element() < 0.8, "triangle {i}: {albedo}");
        }
    }
}

/// Rays from inside meet only fronts, and leave only through windows.
#[test]
fn walls_face_the_air_and_leak_nowhere() {
    for name in ["site.toml", "as_modelled.toml"] {
        check_walls(load(name));
    }
}

fn check_walls((site, scene, _): &(Site, Scene, Health)) {
    let eyes = site.probes.iter().map(|p| p.pose.position).chain(site.views.iter().map(|v| v.camera.pose.position));
    let (mut rays, mut backs, mut out) = (0, 0, 0);
    for eye in eyes {
        let origin = scene.local(eye);
        for i in 0..20_000 {
            // Fibonacci's spiral
            let z = 1.0 - (2.0 * i as f32 + 1.0) / 20_000.0;
            let a = i as f32 * 2.399_963;
            let r = (1.0 - z * z).sqrt();
            let ray = Ray { origin, direction: vec3(r * a.cos(), r * a.sin(), z) };
            rays += 1;
            match scene.tracer.closest(&ray, 0.0) {
                Some(hit) => backs += usize::from(scene.mesh.normal(hit.triangle).dot(ray.direction) > 0.0),
                None => {
                    out += 1;
                    assert!(
                        through_a_window(site, scene.origin.as_vec3() + origin, ray.direction),
                        "{origin} {}",
                        ray.direction
                    );
                }
            }
        }
    }
    assert_eq!(backs, 0, "of {rays} rays");
    assert!(out > rays / 200, "windows let light in: {out} of {rays}");
}

/// Whether a ray from inside passes the outer rim of a window, or what stands around it.
fn through_a_window(site: &Site, from: Vec3, direction: Vec3) -> bool {
    crate::chapel::building::windows().into_iter().any(|[centre, a, b]| {
        let centre = site.frame.point_in(centre).as_vec3();
        let [a, b] = [a, b].map(|half| site.frame.direction_in(half).as_vec3());
        let normal = a.cross(b);
        let t = normal.dot(centre - from) / normal.dot(direction);
        let off = from + direction * t - centre;
        t > 0.0 && [a, b].iter().all(|half| off.dot(*half).abs() <= half.length_squared() * 1.001)
    })
}

#[test]
fn probes_and_photographs_hold_light_and_no_fault() {
    let (site, ..) = load("site.toml");
    let pictures = site.probes.iter().flat_map(|p| p.pictures.iter().map(|picture| picture.path.clone()));
    for path in pictures.chain(site.views.iter().filter_map(|v| v.photo.clone())) {
        let picture = clerestory::panorama::read(&path).unwrap();
        let mean = picture.pixels.iter().sum::<Vec3>() / picture.pixels.len() as f32;
        assert!(picture.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0), "{}", path.display());
        assert!(mean.min_element() > 0.01 && mean.max_element() < 10.0, "{}: {mean}", path.display());
    }
}

#[test]
fn every_planted_fault_is_in_sight_of_the_view_that_it_names() {
    let (site, scene, _) = load("site.toml");
    let faults: serde_json::Value = serde_json::from_slice(&fs::read(bundled().join("faults.json")).unwrap()).unwrap();
    let list = faults["faults"].as_array().unwrap();
    assert!(list.len() >= 8);
    for fault in list {
        let at = |k: usize| fault["position"][k].as_f64().unwrap();
        let point = site.frame.point_in(glam::dvec3(at(0), at(1), at(2)));
        for name in fault["views"].as_array().unwrap() {
            let view = site.views.iter().find(|v| v.name == *name).unwrap();
            let pixel = view.camera.project(point).unwrap();
            assert!(pixel.min_element() > 0.0 && pixel.max_element() < 256.0, "{}: {pixel}", fault["id"]);
            let (eye, target) = (scene.local(view.camera.pose.position), scene.local(point));
            let direction = (target - eye).normalize();
            let reach = eye.distance(target) - 0.5;
            assert!(!scene.tracer.occluded(&Ray { origin: eye, direction }, 0.0, reach), "{} is hidden", fault["id"]);
        }
    }
}
