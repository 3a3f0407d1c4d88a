//! How the paper's plain method depends on its one free choice, the records' radius: prints FLIP and relative MSE over
//! the photographs of a site, a row a radius.
//!
//! `cargo run --release --example paper_radius -- SITE [RADIUS_M …]`; without radii the method's own default.

#![allow(clippy::print_stdout)]

use clerestory::panorama::{self, Panorama, Picture};
use clerestory::paper::{Plain, ProbeLight, Settings};
use clerestory::render::Source;
use clerestory::scene::{self, Health, Ray, Scene};
use clerestory::site::{Camera, Environment, Site};
use clerestory::study;
use glam::Vec3;
use rayon::prelude::*;
use std::error::Error;
use std::f32::consts::PI;
use std::path::Path;
use std::time::Instant;

/// Samples along a pixel's side.
const SIDE: usize = 2;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (site, radii) = arguments.split_first().ok_or("usage: paper_radius SITE [RADIUS_M …]")?;
    let site = Site::load(Path::new(site))?;
    let scene = scene::load(&site, &mut Health::default())?;
    let pictures = site.probes.iter().map(|p| panorama::read(&p.pictures[0].path)).collect::<Result<Vec<_>, _>>()?;
    let probes: Vec<ProbeLight> = site
        .probes
        .iter()
        .zip(&pictures)
        .map(|(probe, picture)| ProbeLight {
            origin: scene.local(probe.pose.position),
            to_world: probe.pose.rotation.as_mat3(),
            picture,
            projection: probe.projection,
            gain: probe.gain,
        })
        .collect();
    let sky = sky(&site)?;
    let mut settings = vec![Settings::default()];
    for radius in radii {
        settings.push(Settings { radius_m: Some(radius.parse()?), ..Settings::default() });
    }
    println!("radius_m,view,flip,relmse,volume_fraction,seconds");
    for settings in settings {
        let plain = Plain::new(&scene, &probes, settings);
        let (mut flip, mut relmse, mut photos) = (0.0, 0.0, 0.0);
        for view in &site.views {
            let Some(photo) = &view.photo else { continue };
            let truth = panorama::read(photo)?;
            let start = Instant::now();
            let (picture, volume) = render(&scene, &plain, &view.camera, &*sky);
            let seconds = start.elapsed().as_secs_f64();
            let (f, r) = (study::flip(&picture, &truth), study::relmse(&picture.pixels, &truth.pixels));
            println!("{:.4},{},{f:.4},{r:.4},{volume:.3},{seconds:.1}", plain.radius_m(), view.name);
            flip += f;
            relmse += r;
            photos += 1.0;
        }
        println!("{:.4},mean,{:.4},{:.4},,", plain.radius_m(), flip / photos, relmse / photos);
        let bytes = plain.record_bytes() as f64 / plain.record_count() as f64;
        println!("# {} records of {bytes:.1} bytes, {:.2?}", plain.record_count(), plain.seconds());
    }
    Ok(())
}

/// The light seen through open windows.
fn sky(site: &Site) -> Result<Box<dyn Fn(Vec3) -> Vec3 + Sync>, Box<dyn Error>> {
    Ok(match &site.environment {
        None => Box::new(|_| Vec3::ZERO),
        Some(Environment::Uniform(radiance)) => {
            let radiance = *radiance;
            Box::new(move |_| radiance)
        }
        Some(Environment::Image { path, rotation, projection }) => {
            let panorama = Panorama::new(panorama::read(path)?, *projection, *rotation);
            Box::new(move |d| panorama.radiance(d))
        }
    })
}

/// A picture, and the share of samples that the volume lights.
fn render(scene: &Scene, plain: &Plain, camera: &Camera, sky: &(dyn Fn(Vec3) -> Vec3 + Sync)) -> (Picture, f64) {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let origin = scene.local(camera.pose.position);
    let sample = |x: f64, y: f64| {
        let ray = Ray { origin, direction: camera.direction(x, y).as_vec3() };
        let Some(hit) = scene.tracer.closest(&ray, 1e-4) else { return (sky(ray.direction), false) };
        let surface = scene.surface(&ray, &hit);
        let (irradiance, source) = plain.irradiance(surface.position, surface.normal);
        let albedo = scene.albedo(surface.triangle, surface.barycentric);
        (albedo * irradiance / PI, source == Source::Volume)
    };
    let pixels: Vec<(Vec3, usize)> = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let at = |k: usize, s: usize| k as f64 + (s as f64 + 0.5) / SIDE as f64;
            let samples = (0..SIDE * SIDE).map(|s| sample(at(i % width, s % SIDE), at(i / width, s / SIDE)));
            samples.fold((Vec3::ZERO, 0), |(sum, n), (l, volume)| (sum + l, n + usize::from(volume)))
        })
        .collect();
    let volume: usize = pixels.iter().map(|p| p.1).sum();
    let samples = (SIDE * SIDE) as f32;
    let pixels: Vec<Vec3> = pixels.into_iter().map(|p| p.0 / samples).collect();
    let share = volume as f64 / (pixels.len() as f64 * f64::from(samples));
    (Picture { width, height, pixels }, share)
}
