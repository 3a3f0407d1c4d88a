//! Times building the tree, primary rays and rays every which way on 2 threads and, where a folder is given, writes triangles
//! and rays there as raw little-endian f32 for another ray caster: `primary_rays [FOLDER]`. See compare_embree.sh beside it.

#![allow(clippy::print_stdout, reason = "its result goes to the console")]

mod rays;

use clerestory::scene::{Scene, Tracer};
use rays::{View, cast_packets, cast_single};
use std::path::Path;
use std::time::Instant;

const REPEATS: usize = 9;

type Cast = fn(&Tracer, &View) -> (usize, f64);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = rays::site().ok_or("no site to cast rays at")?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
    for side in [1, 2] {
        let (scene, views) = rays::load(&path, side)?;
        let triangles = scene.mesh.triangles.len();
        if side == 1 {
            let build = median(|| pool.install(|| Tracer::new(&scene.mesh)).bytes());
            println!(
                "{triangles} triangles, built in {:.3} s, {:.1} bytes a triangle",
                build,
                scene.tracer.bytes() as f64 / triangles as f64
            );
        }
        if let Some(folder) = std::env::args().nth(1) {
            export(Path::new(&folder), side, &scene, &views)?;
        }
        let rays: usize = views.iter().map(|v| v.directions.len()).sum();
        let scattered: Vec<View> = views.iter().map(rays::scattered).collect();
        let kinds: [(&str, &[View], Cast); 4] = [
            ("single", &views, cast_single),
            ("packet", &views, cast_packets),
            ("scattered-single", &scattered, cast_single),
            ("scattered-packet", &scattered, cast_packets),
        ];
        for (name, views, cast) in kinds {
            let mut found = (0, 0.0);
            let seconds = median(|| {
                found = pool.install(|| {
                    views.iter().map(|v| cast(&scene.tracer, v)).fold((0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1))
                });
                found.0
            });
            let samples = side * side;
            println!(
                "{name} {samples} {:.3} Mray/s ({} of {rays} hit, mean distance {:.6} m)",
                rays as f64 / seconds / 1e6,
                found.0,
                found.1 / found.0 as f64
            );
        }
    }
    Ok(())
}

fn median(mut run: impl FnMut() -> usize) -> f64 {
    let mut seconds: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let start = Instant::now();
            std::hint::black_box(run());
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[REPEATS / 2]
}

fn export(folder: &Path, side: u32, scene: &Scene, views: &[View]) -> std::io::Result<()> {
    let bytes = |values: Vec<f32>| values.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let corners = (0..scene.mesh.triangles.len() as u32).flat_map(|i| scene.mesh.corners(i)).flat_map(|p| p.to_array());
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("triangles.f32"), bytes(corners.collect()))?;
    let origins = views.iter().flat_map(|v| v.origin.to_array());
    std::fs::write(folder.join("origins.f32"), bytes(origins.collect()))?;
    let directions = views.iter().flat_map(|v| &v.directions).flat_map(|d| d.to_array());
    std::fs::write(folder.join(format!("directions{}.f32", side * side)), bytes(directions.collect()))
}
