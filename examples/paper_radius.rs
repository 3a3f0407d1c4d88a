//! How the paper's plain method depends on its one free choice, the records' radius: prints FLIP and relative MSE over
//! the photographs of a site, a row a radius.
//!
//! `cargo run --release --example paper_radius -- SITE [RADIUS_M …]`; without radii the method's own default.

#![allow(clippy::print_stdout)]

use clerestory::panorama;
use clerestory::paper::{PaperSettings, Plain, PlainRelit};
use clerestory::render::render;
use clerestory::scene::{self, Health};
use clerestory::shoot::Outside;
use clerestory::site::Site;
use clerestory::study;
use glam::Vec3;
use std::error::Error;
use std::path::Path;

/// Samples a pixel.
const SAMPLES: u32 = 4;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (site, radii) = arguments.split_first().ok_or("usage: paper_radius SITE [RADIUS_M …]")?;
    let site = Site::load(Path::new(site))?;
    let scene = scene::load(&site, &mut Health::default())?;
    let lighting = site.lighting(None)?;
    // the light seen through open windows
    let outside = Outside::of(&site)?;
    let sky = |direction| outside.as_ref().map_or(Vec3::ZERO, |o| o.radiance(direction));
    let mut settings = vec![PaperSettings::default()];
    for radius in radii {
        settings.push(PaperSettings { radius_m: Some(radius.parse()?), ..PaperSettings::default() });
    }
    println!("radius_m,view,flip,relmse,covered_fraction,seconds");
    for settings in settings {
        let plain = Plain::of_probes(&scene, &site.probes, &lighting, settings)?;
        let (mut flip, mut relmse, mut photos) = (0.0, 0.0, 0.0);
        for view in &site.views {
            let Some(photo) = &view.photo else { continue };
            let truth = panorama::read(photo)?;
            let relit = PlainRelit { plain: &plain, sky: &sky };
            let frame = render(&scene, &relit, &view.camera, SAMPLES, &|_, _| ());
            let (f, r) = (study::flip(&frame.radiance, &truth), study::relmse(&frame.radiance.pixels, &truth.pixels));
            let (covered, seconds) = (frame.covered_fraction, frame.rays_s + frame.shade_s);
            println!("{:.4},{},{f:.4},{r:.4},{covered:.3},{seconds:.1}", plain.radius_m, view.name);
            flip += f;
            relmse += r;
            photos += 1.0;
        }
        println!("{:.4},mean,{:.4},{:.4},,", plain.radius_m, flip / photos, relmse / photos);
        let bytes = plain.record_bytes() as f64 / plain.record_count() as f64;
        println!("# {} records of {bytes:.1} bytes, {:.2?}", plain.record_count(), plain.timings);
    }
    Ok(())
}
