//! A model without fault, under every nuisance.

use clerestory::audit::{Judged, Photo, Reason, Settings, examine};
use clerestory::scene::{Ray, Scene};
use clerestory::site::Camera;

use crate::Bench;
use crate::measure::mean;
use crate::nuisance::Nuisance;

/// Regions that are told of a model without fault.
pub fn faultless(bench: &Bench, nuisances: &[Nuisance]) {
    let (mut regions, mut pixels) = (0, 0.0);
    for &nuisance in nuisances {
        let cameras: Vec<Camera> = bench.cameras.iter().map(|c| nuisance.camera(c, 5.0)).collect();
        let settings = Settings { longest_px: 4096, ..Settings::default() };
        let mut line = String::new();
        let mut here = 0;
        let right = vec![false; cameras.iter().map(|c| (c.width * c.height) as usize).max().unwrap_or(0)];
        let (mut most, mut left) = (0.0f64, 0.0f64);
        bench.with(&bench.scene, nuisance, &cameras, |prepared, _, _| {
            for (v, camera) in cameras.iter().enumerate() {
                let photo = nuisance.photograph(&bench.photos[v]);
                let maps = examine(prepared, camera, &Photo::new(photo), &settings);
                let judged = maps.judged(prepared).0.regions;
                let (refined, pose) = maps.pose();
                most = most.max(pose.mean_px);
                let off = apart(&refined, &bench.cameras[v], &bench.scene);
                if bench.regions {
                    println!(
                        "#     {} off by {off:.2} px, told ± {:.2} px",
                        bench.site.views[v].name, pose.residual_px
                    );
                }
                left = left.max(off);
                let sure: Vec<&Judged> =
                    judged.iter().filter(|j| j.reason(Settings::default().false_alarms) == Reason::None).collect();
                here += sure.len();
                pixels += (camera.width * camera.height) as f64;
                for j in sure {
                    if bench.regions {
                        println!("#     {}", crate::described(j, &right, 0));
                    }
                    line += &format!(
                        " {}:{}/{}({})",
                        bench.site.views[v].name,
                        j.kind.name(),
                        j.what.name(),
                        j.pixels().len()
                    );
                }
            }
        });
        regions += here;
        println!(
            "{:18} {here:>3} false; camera moved {most:.2} px, off by {left:.2} px in the worst view;{line}",
            nuisance.title()
        );
    }
    println!(
        "{regions} false regions in {:.2} megapixels: {:.2} per megapixel",
        pixels / 1e6,
        regions as f64 * 1e6 / pixels
    );
}

/// Mean distance in pixels between where two cameras show the scene.
fn apart(a: &Camera, b: &Camera, scene: &Scene) -> f64 {
    let mut all = vec![];
    for i in 0..400 {
        let (x, y) = ((i % 20) as f64 + 0.5, (i / 20) as f64 + 0.5);
        let d = b.direction(x / 20.0 * f64::from(b.width), y / 20.0 * f64::from(b.height));
        let ray = Ray { origin: scene.local(b.pose.position), direction: d.as_vec3() };
        if let Some(hit) = scene.tracer.closest(&ray, 1e-3) {
            let p = b.pose.position + d * f64::from(hit.t);
            if let (Some(p), Some(q)) = (a.project(p), b.project(p)) {
                all.push(p.distance(q));
            }
        }
    }
    mean(&all)
}
