//! Where pictures were taken: the pose of every probe and photograph, found and refined against the model and against each
//! other. The paper (section 8) names placing probes by comparing their pictures with the model as its future work.
//!
//! 1. `picture`: a picture becomes log-luminance by direction, from fine to coarse.
//! 2. `search`: edges of shape and texture that the model shows from many places are correlated with the picture's at all
//!    headings at once, by Fourier transforms along rows; around the place given, or on all of the floors (`anywhere`).
//! 3. `refine`: the best candidates are moved by Gauss–Newton, coarse to fine. What the picture should be (`model`) is
//!    the model's albedo under light that the picture itself shows, even over each smooth surface: it stands the difference between albedo and
//!    radiance, needs no lamp or sun, and is blind to exposure.
//! 4. `together`: what the other pictures saw of the same surfaces, shadows and all, then speaks as well.
//! 5. `verdict`: the fit, its uncertainty, and the second-best place.
//!
//! ```
//! use clerestory::glam::{DMat3, DVec3};
//! use clerestory::register::turn_deg;
//! use clerestory::site::Pose;
//!
//! let north = Pose { position: DVec3::ZERO, rotation: DMat3::IDENTITY };
//! let east = Pose { rotation: DMat3::from_rotation_z((-90f64).to_radians()), ..north };
//! assert!((turn_deg(&north, &east) - 90.0).abs() < 1e-9);
//! ```

mod anywhere;
mod error;
mod eye;
mod misfit;
mod model;
mod picture;
mod preview;
mod raster;
mod refine;
mod run;
mod search;
mod together;
mod verdict;

pub use error::RegisterError;
pub use eye::{Subject, Verdict};
pub use misfit::{Misfit, misfits};
pub use preview::{Preview, picture, preview};
pub use run::register;

use crate::site::{Pose, Site};

/// How far to look, and how finely.
#[derive(Clone, Debug)]
pub struct RegisterSettings {
    /// How far a picture may have been taken from where the site file says, metres.
    pub within_m: f32,
    /// How far it may be tilted from what the site file says, degrees.
    pub tilt_deg: f32,
    /// Cells round the sphere of the finest level; pictures are not looked at more finely.
    pub finest: usize,
    /// Look on all of the site's floors, not only around where the site file says. Where it says nothing this is so anyway.
    pub anywhere: bool,
    /// Let pictures speak for each other's poses.
    pub together: bool,
    /// Whose pictures of the probes; the site's first where empty.
    pub lighting: Option<String>,
    /// Only these probes and views, by name; all where empty. Others keep their poses and still speak for these.
    pub only: Vec<String>,
}

/// People set tripods up level within this, degrees.
pub const TRIPOD_TILT_DEG: f32 = 3.0;

impl Default for RegisterSettings {
    fn default() -> Self {
        Self {
            within_m: 1.0,
            tilt_deg: 10.0,
            finest: 1024,
            anywhere: false,
            together: true,
            lighting: None,
            only: Vec::new(),
        }
    }
}

/// A picture's pose as found.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Registered {
    /// Whose.
    pub subject: Subject,
    /// The pose before; `None` where the site file has no place.
    pub given: Option<Pose>,
    /// The pose as found. Where nothing was found, the one given, or what fits least badly.
    pub pose: Pose,
    /// What is known of it.
    pub verdict: Verdict,
    /// Correlation of the picture's edges with the model's at the pose found, −1..=1.
    pub fit: f64,
    /// The same at the pose given.
    pub fit_given: Option<f64>,
    /// Covariance of shift (right, forward, up; metres) and turn about the same axes (radians), in the picture's axes.
    pub covariance: [[f64; 6]; 6],
    /// The second-best place.
    pub rival: Option<Rival>,
}

/// Another place that fits a picture.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Rival {
    /// Where.
    pub pose: Pose,
    /// Its fit, as [`Registered::fit`] but at a coarser level; compare with `best`.
    pub fit: f64,
    /// The fit of the pose found at that level.
    pub best: f64,
    /// By how many standard errors it fits worse, block by block of the picture.
    pub worse: f64,
}

impl Registered {
    /// Standard deviation of the place, metres: the root of the sum over three axes.
    pub fn position_m(&self) -> f64 {
        (0..3).map(|k| self.covariance[k][k]).sum::<f64>().sqrt()
    }

    /// Standard deviation of the direction, degrees: the root of the sum over three axes.
    pub fn direction_deg(&self) -> f64 {
        (3..6).map(|k| self.covariance[k][k]).sum::<f64>().sqrt().to_degrees()
    }

    /// How far the place moved, metres, and the direction turned, degrees; `None` where the site file has no place.
    pub fn moved(&self) -> Option<(f64, f64)> {
        self.given.map(|given| (self.pose.position.distance(given.position), turn_deg(&given, &self.pose)))
    }
}

/// The angle between two poses' directions, degrees.
pub fn turn_deg(a: &Pose, b: &Pose) -> f64 {
    let q = glam::DQuat::from_mat3(&(a.rotation.transpose() * b.rotation));
    (2.0 * q.xyz().length().atan2(q.w.abs())).to_degrees()
}

/// The site with the poses found in place of those given.
pub fn with_poses(site: &Site, found: &[Registered]) -> Site {
    let mut site = site.clone();
    for f in found {
        match f.subject {
            Subject::Probe(i) => (site.probes[i].pose, site.probes[i].placed) = (f.pose, true),
            Subject::View(i) => site.views[i].camera.pose = f.pose,
        }
    }
    site
}
