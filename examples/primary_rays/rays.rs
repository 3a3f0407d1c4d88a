//! The rays that are cast: the pixels of a site's views, in tiles.

use clerestory::scene::{self, Health, Hit, Ray, Scene, Tracer};
use clerestory::site::Site;
use glam::Vec3;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Pixels along a picture's side.
const SIDE: u32 = 512;

/// The rays of one picture: tiles of 64, in 2×2 blocks.
pub(crate) struct View {
    pub(crate) origin: Vec3,
    pub(crate) directions: Vec<Vec3>,
}

/// Šibenik cathedral where it lies beside the checkout, else the bundled chapel.
pub(crate) fn site() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    ["../shared/data/truth/sibenik", "sites/chapel"].into_iter().map(|p| root.join(p)).find(|p| p.exists())
}

/// Loads a site and the rays of its views, with `side`² rays a pixel.
pub(crate) fn load(path: &Path, side: u32) -> Result<(Scene, Vec<View>), Box<dyn std::error::Error>> {
    let site = Site::load(path)?;
    let scene = scene::load(&site, &mut Health::default())?;
    let views = site
        .views
        .iter()
        .map(|view| {
            let mut camera = view.camera;
            let zoom = f64::from(SIDE) / f64::from(camera.height);
            camera.focal *= zoom;
            camera.centre *= zoom;
            (camera.width, camera.height) = (SIDE, SIDE);
            let steps = SIDE * side;
            let directions = (0..steps * steps)
                .map(|i| {
                    let (tile, (x, y)) = (i / 64, z_order(i % 64));
                    let (x, y) = (tile % (steps / 8) * 8 + x, tile / (steps / 8) * 8 + y);
                    camera
                        .direction((f64::from(x) + 0.5) / f64::from(side), (f64::from(y) + 0.5) / f64::from(side))
                        .as_vec3()
                })
                .collect();
            View { origin: scene.local(camera.pose.position), directions }
        })
        .collect();
    Ok((scene, views))
}

/// As many rays from the same point, every which way (a golden-angle spiral, shuffled by a large stride).
pub(crate) fn scattered(view: &View) -> View {
    let n = view.directions.len();
    let directions = (0..n)
        .map(|i| {
            let i = i * 611_953 % n;
            let z = 1.0 - (2 * i + 1) as f64 / n as f64;
            let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vec3::new((r * cos) as f32, (r * sin) as f32, z as f32)
        })
        .collect();
    View { origin: view.origin, directions }
}

/// Column and row of the i-th place in an 8×8 tile.
fn z_order(i: u32) -> (u32, u32) {
    let every_other = |bits: u32| bits & 1 | bits >> 1 & 2 | bits >> 2 & 4;
    (every_other(i), every_other(i >> 1))
}

/// Casts all rays of a view one by one; how many hit, and the sum of the distances tile by tile.
pub(crate) fn cast_single(tracer: &Tracer, view: &View) -> (usize, f64) {
    let tile = |directions: &[Vec3]| {
        count(directions.iter().map(|&direction| tracer.closest(&Ray { origin: view.origin, direction }, 1e-4)))
    };
    total(view.directions.par_chunks(64).with_min_len(16).map(tile).collect())
}

/// Casts all rays of a view in packets of 64.
pub(crate) fn cast_packets(tracer: &Tracer, view: &View) -> (usize, f64) {
    let tile = |directions: &[Vec3]| {
        let mut hits = [None; 64];
        tracer.closest_packet(view.origin, directions, 1e-4, &mut hits);
        count(hits.into_iter().take(directions.len()))
    };
    total(view.directions.par_chunks(64).with_min_len(16).map(tile).collect())
}

fn count(hits: impl Iterator<Item = Option<Hit>>) -> (usize, f64) {
    hits.flatten().fold((0, 0.0), |(n, sum), hit| (n + 1, sum + f64::from(hit.t)))
}

fn total(tiles: Vec<(usize, f64)>) -> (usize, f64) {
    tiles.into_iter().fold((0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1))
}
