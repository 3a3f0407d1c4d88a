//! Takes a site's probes and photographs.

use clerestory::panorama::EnvironmentSampler;
use clerestory::panorama::{self, Layer, Panorama, Picture, write_exr};
use clerestory::reference::{Eye, Sky};
use clerestory::scene::Scene;
use clerestory::site::{Environment, Site};
use glam::Vec3;
use image::RgbImage;
use std::error::Error;
use std::path::Path;

use super::Options;
use super::develop::Camera;
use super::dice::Dice;
use super::layout::Window;
use super::light::{Field, Lamps, Portal};
use super::shade::{Sampling, Truth, seen};
use super::site::{FRAME, Taken};
use crate::common::pattern::jpeg;

/// Every this many pixels along each side, light is asked for.
pub const STRIDE: usize = 2;

/// Makes every picture that a site names, and says how its photographs were taken.
///
/// # Errors
/// When the sky cannot be read or a picture cannot be written.
pub fn take(
    folder: &Path,
    site: &Site,
    scene: &Scene,
    windows: &[Window],
    gloss: &[f64],
    options: &Options,
) -> Result<Vec<Taken>, Box<dyn Error>> {
    let lamps = lamps(site, scene, windows)?;
    let probes: Vec<Eye> = site
        .probes
        .iter()
        .map(|p| Eye::Panorama { pose: p.pose, width: options.probe_width, height: options.probe_width / 2 })
        .collect();
    let views: Vec<Eye> = site.views.iter().map(|v| Eye::Camera(v.camera)).collect();
    let places = probes.iter().chain(&views).flat_map(|eye| seen(scene, eye, STRIDE));
    let field = Field::new(scene, &lamps, places, options.links, options.seed);
    let truth = Truth { scene, lamps: &lamps, field: &field, gloss };
    let side = (options.samples as f64).sqrt().ceil() as usize;
    for (k, eye) in probes.iter().enumerate() {
        let seed = options.seed << 8 | k as u64;
        let picture = truth.picture(eye, &Sampling { side, blur: [0.0; 2], seed });
        let name = format!("probe_{}", k + 1);
        write_probe(&folder.join(format!("probes/{name}.exr")), &picture)?;
        if options.eight_bit {
            let mut dice = Dice::new(options.seed, &name);
            let photo = Camera::plain(&picture, 0.97).photograph(&picture, &mut dice);
            std::fs::write(folder.join(format!("probes/{name}.jpg")), jpeg(&photo, 92)?)?;
        }
    }
    let mut taken = Vec::new();
    for (k, eye) in views.iter().enumerate() {
        let name = format!("view_{}", k + 1);
        let mut dice = Dice::new(options.seed, &name);
        let blur = if dice.chance(0.4) { [dice.between(-1.0, 1.0), dice.between(-0.6, 0.6)] } else { [0.0; 2] };
        let picture = truth.picture(eye, &Sampling { side, blur, seed: options.seed << 8 | 128 | k as u64 });
        let camera = Camera::automatic(&picture, &mut dice);
        let photo: RgbImage = camera.photograph(&picture, &mut dice);
        std::fs::write(folder.join(format!("photos/{name}.jpg")), jpeg(&photo, camera.quality)?)?;
        taken.push(Taken { camera, blur });
    }
    Ok(taken)
}

/// The lights of the true site.
///
/// # Errors
/// When the sky's picture cannot be read.
pub fn lamps(site: &Site, scene: &Scene, windows: &[Window]) -> Result<Lamps, Box<dyn Error>> {
    let sky = match &site.environment {
        Some(Environment::Image { path, rotation, projection }) => {
            let panorama = Panorama::new(panorama::read(path)?, *projection, *rotation);
            Sky::Image(Box::new(EnvironmentSampler::new(panorama)))
        }
        Some(Environment::Uniform(radiance)) => Sky::Uniform(*radiance),
        None => Sky::Uniform(Vec3::ZERO),
    };
    let portal = |[middle, along, up]: &Window| Portal {
        centre: scene.local(FRAME.point_in(*middle)),
        half: [along, up].map(|v| FRAME.direction_in(*v).as_vec3()),
    };
    let sun = site.sun.map(|s| (s.direction, s.irradiance));
    Ok(Lamps { sky, sun, portals: windows.iter().map(portal).collect() })
}

/// Writes a probe as 16-bit floats.
fn write_probe(file: &Path, picture: &Picture) -> Result<(), Box<dyn Error>> {
    let layer = Layer::vectors("", ["R", "G", "B"], &picture.pixels, true);
    Ok(write_exr(file, picture.width, picture.height, &[layer], None)?)
}
