//! Exposure, white balance, vignetting and response of pictures, fitted to each other by what several of them see.
//!
//! A diffuse surface sends the same radiance everywhere, so that two pictures of one point have to agree on it:
//! gᵢ·f(xᵢ) = gⱼ·f(xⱼ). `shot` is a picture that knows where it was taken, `overlap` finds points that several of them
//! see by the model, `solve` fits all pictures together, robust to gloss, to things that the model lacks and to clipped
//! pixels, which only say “at least”. `of_render` fits one photograph to its render.
//!
//! One factor a channel is free: the geometric mean of the fitted gains ÷ the first guesses is 1.

mod of_render;
mod overlap;
mod shot;
mod solve;
#[cfg(test)]
mod tests;

pub use of_render::{PhotographFit, fit_to_render};
pub use shot::{Eye, Shot};

use glam::Vec3;
use serde::Serialize;

use crate::panorama::{self, Exif, PanoramaError, Radiometry};
use crate::photograph::{self, PhotographError};
use crate::scene::Scene;
use crate::site::Site;

/// What to fit, and from how much.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Directions that each picture looks along for points that others see, too.
    pub samples: usize,
    /// Fit vignetting of perspective pictures, one for all of a camera and size, where that makes them agree better.
    pub vignetting: bool,
    /// Fit a response of 8 and 16-bit pictures, one for all of a camera, where that makes them agree better.
    pub response: bool,
    /// [`fit`] takes the views' photographs in.
    pub photographs: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { samples: 4000, vignetting: true, response: false, photographs: false }
    }
}

/// The radiometry of several pictures.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Fit {
    /// One for each picture, in order.
    pub pictures: Vec<Fitted>,
    /// Comparisons of one point in two pictures, times channels.
    pub comparisons: usize,
    /// How far two pictures of a point are apart with the first guesses: robust standard deviation of the logarithm.
    pub spread_before: f64,
    /// The same after the fit.
    pub spread: f64,
}

/// One picture's radiometry.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Fitted {
    /// The probe's or view's name.
    pub name: String,
    /// Whether it was fitted: enough of what it sees is seen by others, and through them by most of all. If not, it keeps
    /// its first guess.
    pub tied: bool,
    /// Comparisons that it takes part in, times channels.
    pub comparisons: usize,
    /// Robust standard deviation of the logarithm of what is left between it and others.
    pub spread: f64,
    /// Radiance per stored value: red, green, blue.
    pub gain: [f32; 3],
    /// See [`Radiometry`].
    pub vignetting: [f32; 2],
    /// See [`Radiometry`].
    pub response: [f32; 2],
}

impl Fit {
    /// The pictures that are not tied to the others.
    pub fn untied(&self) -> impl Iterator<Item = &Fitted> {
        self.pictures.iter().filter(|p| !p.tied)
    }

    /// Gives the site's probes what was found for them, by name.
    pub fn apply(&self, site: &mut Site) {
        for probe in &mut site.probes {
            if let Some(found) = self.pictures.iter().find(|p| p.tied && p.name == probe.name) {
                probe.gain = Vec3::from(found.gain);
                probe.vignetting = found.vignetting.into();
                probe.response = found.response.into();
            }
        }
    }
}

/// Why a site's pictures could not be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RadiometryError {
    /// A probe's picture cannot be read.
    #[error(transparent)]
    Picture(#[from] PanoramaError),
    /// A view's photograph cannot be used.
    #[error(transparent)]
    Photograph(#[from] PhotographError),
}

/// Fits the radiometry of a site's probes that have a picture of a lighting, and of its views' photographs if
/// [`Settings::photographs`] says so (which come last). First guesses are what the site file says.
///
/// # Errors
///
/// Pictures that cannot be read.
pub fn fit(site: &Site, scene: &Scene, lighting: &str, settings: &Settings) -> Result<Fit, RadiometryError> {
    let mut cameras: Vec<Option<String>> = Vec::new();
    // of files that do not name their camera all are one camera's
    let mut camera = |path| {
        let name = Exif::read(path).camera;
        cameras.iter().position(|c| *c == name).unwrap_or_else(|| {
            cameras.push(name);
            cameras.len() - 1
        })
    };
    let mut shots = Vec::new();
    for probe in &site.probes {
        let Some(lit) = probe.pictures.iter().find(|p| p.lighting == lighting) else { continue };
        let (picture, coding) = panorama::read_coded(&lit.path)?;
        let eye = Eye::Probe { pose: probe.pose, projection: probe.projection };
        let (guess, camera) = (probe.radiometry(coding), camera(&lit.path));
        shots.push(Shot { name: probe.name.clone(), eye, picture, coding, guess, camera });
    }
    for view in site.views.iter().filter(|_| settings.photographs) {
        let (Some(path), Some((mut picture, coding))) = (&view.photo, photograph::read(view)?) else { continue };
        for (pixel, out) in picture.pixels.iter_mut().zip(photograph::left_out(view)?.unwrap_or_default()) {
            if out {
                *pixel = Vec3::NAN;
            }
        }
        let guess = Radiometry { clipped: coding.clipped(), ..Radiometry::default() };
        let eye = Eye::Camera(view.camera);
        shots.push(Shot { name: view.name.clone(), eye, picture, coding, guess, camera: camera(path) });
    }
    Ok(fit_shots(scene, &shots, settings))
}

/// Fits the radiometry of pictures of a scene to each other. Fewer than two that see the same leave all first guesses as
/// they are.
pub fn fit_shots(scene: &Scene, shots: &[Shot], settings: &Settings) -> Fit {
    let overlap = overlap::find(scene, shots, settings.samples);
    solve::fit(shots, &overlap, settings)
}
