//! Exposure, white balance, vignetting and response of pictures, fitted to each other by what several of them see.
//!
//! A diffuse surface sends the same radiance everywhere, so that two pictures of one point have to agree on it:
//! gᵢ·f(xᵢ) = gⱼ·f(xⱼ). `shot` is a picture that knows where it was taken, `overlap` finds points that several of them
//! see by the model, `solve` fits all pictures together, robust to gloss, to things that the model lacks and to clipped
//! pixels, which only say “at least”. `of_render` fits one photograph to its render.
//!
//! One factor a channel is free: the geometric mean of the fitted gains ÷ the first guesses is 1.

mod fit;
mod of_render;
mod overlap;
mod shot;
mod solve;
#[cfg(test)]
mod tests;

pub use fit::{Fit, FitSettings, Fitted};

pub use of_render::{PhotographFit, fit_to_render};
pub use shot::{Eye, Shot};

use crate::panorama::{self, Exif, PanoramaError, Radiometry};
use crate::photograph::{self, PhotographError};
use crate::scene::Scene;
use crate::site::Site;

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
/// [`FitSettings::photographs`] says so (which come last). First guesses are what the site file says.
///
/// # Errors
///
/// Pictures that cannot be read.
pub fn fit(site: &Site, scene: &Scene, lighting: &str, settings: &FitSettings) -> Result<Fit, RadiometryError> {
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
        let (Some(path), Some((picture, coding))) = (&view.photo, photograph::read_masked(view)?) else { continue };
        let guess = Radiometry { clipped: coding.clipped(), ..Radiometry::default() };
        let eye = Eye::Camera(view.camera);
        shots.push(Shot { name: view.name.clone(), eye, picture, coding, guess, camera: camera(path) });
    }
    Ok(fit_shots(scene, &shots, settings))
}

/// Fits the radiometry of pictures of a scene to each other. Fewer than two that see the same leave all first guesses as
/// they are.
pub fn fit_shots(scene: &Scene, shots: &[Shot], settings: &FitSettings) -> Fit {
    let overlap = overlap::find(scene, shots, settings.samples);
    solve::fit(shots, &overlap, settings)
}
