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
pub use shot::Shot;

use crate::panorama::{self, Exif, PanoramaError};
use crate::scene::Scene;
use crate::site::Site;

/// Fits the radiometry of a site's probes that have a picture of a lighting. First guesses are what the site file says.
///
/// # Errors
///
/// Pictures that cannot be read.
pub fn fit(site: &Site, scene: &Scene, lighting: &str, settings: &FitSettings) -> Result<Fit, PanoramaError> {
    let mut shots = Vec::new();
    for probe in &site.probes {
        let Some(lit) = probe.picture(lighting) else { continue };
        let (picture, coding) = panorama::read_coded(&lit.path)?;
        shots.push(Shot {
            name: probe.name.clone(),
            pose: probe.pose,
            projection: probe.projection,
            picture,
            coding,
            guess: probe.radiometry(coding),
            camera: Exif::read(&lit.path).camera,
        });
    }
    Ok(fit_shots(scene, &shots, settings))
}

/// Fits the radiometry of pictures of a scene to each other. Fewer than two that see the same leave all first guesses as
/// they are.
pub fn fit_shots(scene: &Scene, shots: &[Shot], settings: &FitSettings) -> Fit {
    let overlap = overlap::find(scene, shots, settings.samples);
    solve::fit(shots, &overlap, settings)
}
