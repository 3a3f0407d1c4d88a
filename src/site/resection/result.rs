//! A pose from picked points, with its doubts.

use glam::{DVec2, DVec3};

use crate::site::camera::Camera;

/// A pose found from matches.
#[derive(Clone, Debug)]
pub struct Resection {
    /// The camera, posed.
    pub camera: Camera,
    /// Distance in pixels between each pair's pixel and where the camera shows its point, in the pairs' order.
    pub residuals_px: Vec<f64>,
    /// Root of the mean square of them.
    pub rms_px: f64,
    /// One standard deviation of the position along its worst axis, metres.
    pub position_sd_m: f64,
    /// One standard deviation of the direction about its worst axis, degrees.
    pub direction_sd_deg: f64,
    /// One standard deviation of the focal length in pixels, where it was solved for.
    pub focal_sd_px: Option<f64>,
    /// The pair, from 0, without which the others would agree far better.
    pub suspect: Option<usize>,
}

/// Why no pose follows from the matches.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ResectionError {
    /// Too few.
    #[error("{found} pairs of pixel and point, but {needed} are needed{}", if *focal { " where the focal length is to be found too" } else { "" })]
    TooFew {
        /// How many there are.
        found: usize,
        /// How many there have to be.
        needed: usize,
        /// Whether the focal length is wanted.
        focal: bool,
    },
    /// Two pairs at one place.
    #[error("pairs {first} and {second} are at the same place of the model or of the picture")]
    Coincident {
        /// The one, from 1.
        first: usize,
        /// The other, from 1.
        second: usize,
    },
    /// All on a line: the camera may turn about it.
    #[error("all points lie on a line (none is farther than {off_m:.3} m from it)")]
    Collinear {
        /// The largest distance from the line, metres.
        off_m: f64,
    },
    /// A pixel that the lens cannot show.
    #[error("pair {pair} is at a pixel where the lens, with its distortion, shows nothing")]
    Unshown {
        /// The pair, from 1.
        pair: usize,
    },
    /// Nothing fits.
    #[error(
        "no camera shows the points there: the best misses by {rms_px:.1} pixels (worst: pair {worst}, by {worst_px:.1})"
    )]
    NoFit {
        /// Root of the mean squared miss, pixels.
        rms_px: f64,
        /// The pair that is farthest off, from 1.
        worst: usize,
        /// By how many pixels.
        worst_px: f64,
    },
    /// Two poses fit alike.
    #[error(
        "two poses fit, {apart_m:.2} m apart (missing by {rms_px:.2} and {other_px:.2} pixels): the points lie nearly in one plane \
         or are too few"
    )]
    Ambiguous {
        /// Distance between the two, metres.
        apart_m: f64,
        /// Root of the mean squared miss of the better one, pixels.
        rms_px: f64,
        /// The same of the other.
        other_px: f64,
    },
    /// The pose is loose.
    #[error("the pairs do not fix {what}: it is uncertain by {uncertainty}")]
    Loose {
        /// What is loose.
        what: &'static str,
        /// By how much, with its unit.
        uncertainty: String,
    },
}

/// A point of the model and where a photograph shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Pixels from the top-left corner.
    pub pixel: DVec2,
    /// Metres in the program's axes.
    pub point: DVec3,
}
