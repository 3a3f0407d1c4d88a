//! Scans a site's model from its probes, and from the stations of its plans if they are given, and writes an E57 file with the
//! probes' pictures and the views' photographs, as 8-bit PNG under one exposure: to try clerestory on what scanners give.
//!
//! ```text
//! cargo run --release --example scan_site -- SITE scan.e57 1000 [plan.json…]      (rows of each scan)
//! ```
#![allow(clippy::print_stdout)]

mod scan;

use clerestory::panorama::{self, Picture, linear_to_srgb};
use clerestory::scene::{self, Health};
use clerestory::site::Site;
use glam::{DMat3, DVec3, Vec3};
use std::path::Path;

/// What a scan needs of the file that `plan` writes.
#[derive(serde::Deserialize)]
struct Plan {
    floors: Vec<Floor>,
}

#[derive(serde::Deserialize)]
struct Floor {
    stations: Vec<Station>,
}

#[derive(serde::Deserialize)]
struct Station {
    /// In the site's own axes.
    position: [f64; 3],
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [site, out, rows, plans @ ..] = &words[..] else {
        return Err("expected a site, an E57 file to write, rows, and plans if there are any".into());
    };
    let site = Site::load(Path::new(site))?;
    let scene = scene::load(&site, &mut Health::default())?;
    let (mut setups, mut panoramas) = (Vec::new(), Vec::new());
    for probe in &site.probes {
        let forward = probe.pose.rotation.y_axis;
        let turned_deg = forward.y.atan2(forward.x).to_degrees();
        setups.push(scan::Setup { position: probe.pose.position, turned_deg });
        panoramas.push(panorama::read(&probe.pictures[0].path)?);
    }
    for plan in plans {
        let plan: Plan = serde_json::from_str(&std::fs::read_to_string(plan)?)?;
        let stations = plan.floors.iter().flat_map(|floor| &floor.stations);
        let positions = stations.map(|s| site.frame.point_in(DVec3::from_array(s.position)));
        setups.extend(positions.map(|position| scan::Setup { position, turned_deg: 0.0 }));
    }
    let white = white(&panoramas);
    let mut pictures = Vec::new();
    for (setup, picture) in panoramas.iter().enumerate() {
        let size = [picture.width as u32, picture.height as u32];
        pictures.push(scan::Picture::Panorama { png: png(picture, white)?, size, setup });
    }
    for view in site.views.iter().filter(|v| v.photo.is_some()) {
        let Some(photo) = &view.photo else { continue };
        let camera = &view.camera;
        let r = camera.pose.rotation;
        pictures.push(scan::Picture::Pinhole {
            png: png(&panorama::read(photo)?, white)?,
            size: [camera.width, camera.height],
            focal: camera.focal.y,
            position: camera.pose.position,
            rotation: DMat3::from_cols(r.x_axis, r.z_axis, -r.y_axis),
            mask: None,
        });
    }
    scan::write(Path::new(out), &scene, &setups, rows.parse()?, &pictures)?;
    println!("wrote {} scans and {} pictures to {out}; white is {white}", setups.len(), pictures.len());
    Ok(())
}

/// The radiance that 99 of 100 pixels stay below.
fn white(pictures: &[Picture]) -> f32 {
    let pixels = pictures.iter().flat_map(|p| &p.pixels);
    let mut all: Vec<f32> = pixels.filter(|p| Picture::valid(**p)).map(|p| p.max_element()).collect();
    all.sort_by(f32::total_cmp);
    all.get(all.len() * 99 / 100).copied().unwrap_or(1.0)
}

fn png(picture: &Picture, white: f32) -> Result<Vec<u8>, image::ImageError> {
    let byte = |v: f32| (255.0 * linear_to_srgb((v / white).clamp(0.0, 1.0))).round() as u8;
    let bytes: Vec<u8> = picture.pixels.iter().flat_map(|p: &Vec3| p.to_array().map(byte)).collect();
    let mut out = std::io::Cursor::new(Vec::new());
    let (width, height) = (picture.width as u32, picture.height as u32);
    image::write_buffer_with_format(
        &mut out,
        &bytes,
        width,
        height,
        image::ExtendedColorType::Rgb8,
        image::ImageFormat::Png,
    )?;
    Ok(out.into_inner())
}
