//! A picture to register, and its pose as far as it is known.

use glam::{Mat3, Vec3};

use super::model::LocalPose;
use super::picture::Level;
use crate::panorama::Projection;
use crate::site::{Pose, Site};

/// A probe or a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// By its index in [`Site::probes`].
    Probe(usize),
    /// By its index in [`Site::views`].
    View(usize),
}

impl Subject {
    /// Its name.
    pub fn name(self, site: &Site) -> &str {
        match self {
            Self::Probe(i) => &site.probes[i].name,
            Self::View(i) => &site.views[i].name,
        }
    }

    /// `probe` or `view`.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Probe(_) => "probe",
            Self::View(_) => "view",
        }
    }

    /// The key of its table in the site file, such as `probe.nave`.
    pub fn key(self, site: &Site) -> String {
        format!("{}.{}", self.kind(), self.name(site))
    }

    /// Its pose as the site has it.
    pub fn pose(self, site: &Site) -> Pose {
        match self {
            Self::Probe(i) => site.probes[i].pose,
            Self::View(i) => site.views[i].camera.pose,
        }
    }

    /// How its picture's pixels map to directions in its own axes.
    pub(super) fn projection(self, site: &Site) -> Projection {
        match self {
            Self::Probe(i) => site.probes[i].projection,
            Self::View(i) => Projection::Camera(site.views[i].camera.model()),
        }
    }
}

/// A picture to register.
pub(super) struct Eye {
    pub(super) subject: Subject,
    pub(super) levels: Vec<Level>,
    /// As the site file has it; the place says nothing where it is `anywhere`.
    pub(super) given: LocalPose,
    /// Whether it may have been taken anywhere on the site's floors.
    pub(super) anywhere: bool,
    /// Whether its pose is to be found, or only speaks for others.
    pub(super) wanted: bool,
}

impl Eye {
    /// Whether the site file says where it was taken.
    pub(super) fn placed(&self, site: &Site) -> bool {
        match self.subject {
            Subject::Probe(i) => site.probes[i].placed,
            Subject::View(_) => true,
        }
    }
}

/// An eye's pose as far as it is known.
pub(super) struct Placed {
    pub(super) pose: LocalPose,
    /// Agreement at the level of [`JUDGED`] cells, block by block.
    pub(super) fit: Vec<f64>,
    pub(super) rival: Option<(LocalPose, Vec<f64>)>,
    pub(super) verdict: Verdict,
}

impl Placed {
    /// Correlation of the picture's edges with the model's, −1..=1.
    pub(super) fn correlation(&self) -> f64 {
        self.fit.iter().sum()
    }
}

/// The level that is so many times finer by two than the coarsest, or the finest there is.
pub(super) fn level(levels: &[Level], finer: usize) -> &Level {
    &levels[(levels.len() - 1).saturating_sub(finer)]
}

/// The level, counted from the coarsest, where places and headings are searched.
pub(super) const SEARCHED: usize = 0;

/// The level where fits are judged and rivals compared.
pub(super) const JUDGED: usize = 1;

/// How far apart tilts are tried, degrees.
const STEP_DEG: f32 = 5.0;

/// Rotations from the picture's axes to level ones, about the one given but for its heading.
pub(super) fn tilts(given: &Mat3, most_deg: f32) -> Vec<Mat3> {
    let forward = *given * Vec3::Y;
    let level = Mat3::from_rotation_z(forward.x.atan2(forward.y)) * *given;
    let n = (most_deg / STEP_DEG).ceil() as i32;
    let turn = |k: i32| (k as f32 * STEP_DEG).to_radians();
    let steps = (-n..=n).flat_map(|a| (-n..=n).map(move |b| (a, b))).filter(|(a, b)| a * a + b * b <= n * n);
    steps.map(|(a, b)| Mat3::from_rotation_x(turn(a)) * Mat3::from_rotation_y(turn(b)) * level).collect()
}

/// What is known of a picture's pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// One place fits, and clearly better than any other.
    Found,
    /// Another place fits about as well: the model repeats itself, or the picture shows too little.
    Ambiguous,
    /// No place within reach fits: the picture may show another room, be mirrored, or have been taken farther away.
    NotFound,
}
