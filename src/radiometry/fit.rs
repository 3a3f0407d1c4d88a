//! What a fit of pictures to each other is asked and gives.

use glam::Vec3;
use serde::Serialize;

use crate::site::Site;

/// What to fit, and from how much.
#[derive(Clone, Copy, Debug)]
pub struct FitSettings {
    /// Directions that each picture looks along for points that others see, too.
    pub samples: usize,
    /// Fit a response of 8 and 16-bit pictures, one for all of a camera, where that makes them agree better.
    pub response: bool,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self { samples: 4000, response: false }
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
    /// The probe's name.
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
    /// See [`Radiometry`](crate::panorama::Radiometry).
    pub vignetting: [f32; 2],
    /// See [`Radiometry`](crate::panorama::Radiometry).
    pub response: [f32; 2],
}

impl Fit {
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
