//! Path-traces the chapel's probes and photographs.

use clerestory::panorama::{Layer, Picture, write_exr};
use clerestory::reference::{self, Eye, Lights, ReferenceSettings};
use clerestory::scene::{self, Health, Scene};
use clerestory::site::{Pictures, Site};
use glam::Vec3;
use std::error::Error;
use std::path::Path;

use crate::chapel::site::LIGHTINGS;
use crate::denoise::denoise;

/// Size of a probe in pixels.
const PROBE: (usize, usize) = (512, 256);
const SEED: u64 = 1;

/// Makes every probe in every lighting, and every photograph in the first.
pub fn all(folder: &Path, samples: u32) -> Result<(), Box<dyn Error>> {
    for sub in ["probes", "photos"] {
        std::fs::create_dir_all(folder.join(sub))?;
    }
    let site = Site::load_with(folder, Pictures::MayBeMissing)?;
    let scene = scene::load(&site, &mut Health::default())?;
    for (i, lighting) in LIGHTINGS.iter().enumerate() {
        let site = Site { sun: site.sun_under(lighting.name), ..site.clone() };
        let lights = [
            Lights::load(&site, &scene)?,
            Lights::load(&Site { sun: None, ..site.clone() }, &scene)?,
            Lights::load(&Site { environment: None, ..site.clone() }, &scene)?,
        ];
        for probe in &site.probes {
            let eye = Eye::Panorama { pose: probe.pose, width: PROBE.0, height: PROBE.1 };
            trace(&scene, &lights, &eye, samples, &probe.pictures[i].path)?;
        }
        for view in site.views.iter().filter(|_| i == 0) {
            if let Some(photo) = &view.photo {
                trace(&scene, &lights, &Eye::Camera(view.camera), samples, photo)?;
            }
        }
    }
    Ok(())
}

/// Path-traces a picture, takes its noise out and writes it.
fn trace(scene: &Scene, lamps: &[Lights; 3], eye: &Eye, samples: u32, file: &Path) -> Result<(), Box<dyn Error>> {
    let start = std::time::Instant::now();
    let estimate = |lights: &Lights, max_bounces: u32| {
        let settings = ReferenceSettings { samples, seed: SEED, max_bounces, ..ReferenceSettings::default() };
        reference::trace(scene, lights, eye, &settings)
    };
    // the same seed sends the same rays from the eye, so that the difference holds no noise of theirs
    let [all, sky, sun] = lamps;
    let (full, seen, sunlit) =
        (estimate(all, ReferenceSettings::default().max_bounces), estimate(sky, 0), estimate(sun, 1));
    let direct = combine(&seen.mean(), &sunlit.mean(), |a, b| a + b);
    let [a, b] = [0, 1].map(|k| {
        let direct = combine(&seen.half(k), &sunlit.half(k), |a, b| a + b);
        combine(&full.half(k), &direct, |a, b| a - b)
    });
    let [a, b] = denoise(scene, eye, [&a, &b]);
    let slow = combine(&a, &b, |a, b| 0.5 * (a + b));
    let error = combine(&a, &b, |a, b| 0.5 * (a - b));
    let picture = combine(&direct, &slow, |a, b| a + b);
    write(file, &picture)?;
    println!(
        "{}: traced {:.1} % noise, smoothed {:.2} % (median over blocks); {:.0} s",
        file.display(),
        100.0 * full.noise().median,
        100.0 * noise(&picture, &error),
        start.elapsed().as_secs_f64()
    );
    Ok(())
}

fn combine(a: &Picture, b: &Picture, f: impl Fn(Vec3, Vec3) -> Vec3) -> Picture {
    let pixels = a.pixels.iter().zip(&b.pixels).map(|(&a, &b)| f(a, b)).collect();
    Picture { width: a.width, height: a.height, pixels }
}

/// Relative error of luminance, median over pixels: root of the mean square error over blocks of 8 × 8, over their mean.
fn noise(picture: &Picture, error: &Picture) -> f64 {
    let luminance = Vec3::new(0.2126, 0.7152, 0.0722);
    let mut relative = Vec::new();
    for y0 in (0..picture.height).step_by(8) {
        for x0 in (0..picture.width).step_by(8) {
            let block = (0..64).map(|k| (y0 + k / 8) * picture.width + x0 + k % 8);
            let (square, light) = block.fold((0.0, 0.0), |(s, l), i| {
                let e = f64::from(error.pixels[i].dot(luminance));
                (s + e * e, l + f64::from(picture.pixels[i].dot(luminance)))
            });
            relative.push((square * 64.0_f64).sqrt() / light.max(1e-9));
        }
    }
    relative.sort_by(f64::total_cmp);
    relative[relative.len() / 2]
}

/// Writes a picture as 16-bit floats whose last three bits are cleared by rounding: exact to 0.4 %, below the noise,
/// and half the file.
fn write(file: &Path, picture: &Picture) -> Result<(), Box<dyn Error>> {
    let round = |v: f32| f32::from_bits((v.max(0.0).to_bits() + 0x8000) & 0xffff_0000);
    let pixels: Vec<Vec3> = picture.pixels.iter().map(|p| p.map(round)).collect();
    let layer = Layer::vectors("", ["R", "G", "B"], &pixels, true);
    Ok(write_exr(file, picture.width, picture.height, &[layer], None)?)
}
