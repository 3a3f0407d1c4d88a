//! A region that was judged.

use crate::audit::finding::{Displacement, Evidence, Kind, Shift, What};
use crate::audit::picture::regions::Region;
use crate::audit::verdict::Reason;

/// What says that a region is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum By {
    /// A figure whose logarithm of odds is this.
    Figure(f32),
    /// That its structure is not the albedo's, as it is nowhere else.
    Structure,
    /// That something else fits, so surely that no right model gives it.
    Fit,
}

/// A region that both tests have had their say on.
pub struct Judged {
    pub(crate) region: Region,
    /// Texture or geometry.
    pub kind: Kind,
    /// What is wrong.
    pub what: What,
    /// Confidence, 0..=1.
    pub score: f64,
    /// How far the surface is off, where that could be measured.
    pub displacement: Option<Displacement>,
    /// How far a part stands beside its place.
    pub shift: Option<Shift>,
    /// Why it is a doubt; [`Reason::None`] for a finding.
    pub reason: Reason,
    /// The figures behind it.
    pub evidence: Vec<Evidence>,
    /// What says that it is wrong, and how often that is said of a right model.
    pub(crate) by: By,
}

impl Judged {
    /// Indices of its pixels at the audit's size.
    pub fn pixels(&self) -> &[usize] {
        &self.region.pixels
    }
}

/// Confidence from strength over threshold and from size: one half at the threshold for a small region.
pub(crate) fn confidence(strength: f64, pixels: f32) -> f64 {
    let odds = strength.max(0.1).powf(1.5) * (f64::from(pixels) / 100.0).max(0.3).powf(0.3);
    odds / (1.0 + odds)
}
