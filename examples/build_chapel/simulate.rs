//! Path-traces the chapel's probes and photographs.

use clerestory::panorama::{self, Layer, Panorama, Picture, Projection, write_exr};
use clerestory::reference::{Eye, Estimate, Lights, Settings, Sky, add_samples, unwatched};
use clerestory::scene::{self, Health, Scene};
use clerestory::site::{Site, Sun};
use glam::Vec3;
use std::error::Error;
use std::path::{Path, PathBuf};

use crate::chapel::site::{LIGHTINGS, Lighting};

/// Size of a probe in pixels.
const PROBE: [usize; 2] = [512, 256];
const SEED: u64 = 1;

/// Makes every probe in every lighting and every photograph in the first.
pub fn all(folder: &Path, samples: u32) -> Result<(), Box<dyn Error>> {
    let site = load(folder)?;
    let scene = scene::load(&site, &mut Health::default())?;
    for (i, lighting) in LIGHTINGS.iter().enumerate() {
        let lights = lights(folder, &site, &scene, lighting)?;
        for probe in &site.probes {
            let eye = Eye::Panorama { pose: probe.pose, width: PROBE[0], height: PROBE[1] };
            trace(&scene, &lights, &eye, samples, &probe.pictures[i].path)?;
        }
        if i == 0 {
            for view in &site.views {
                if let Some(photo) = &view.photo {
                    trace(&scene, &lights, &Eye::Camera(view.camera), samples, photo)?;
                }
            }
        }
    }
    Ok(())
}
