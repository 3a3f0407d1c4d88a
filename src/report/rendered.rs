//! What rendering a site's views came to, as `render --json` tells it and the report's page shows it.

use serde::Serialize;
use std::path::PathBuf;

use crate::check::Saving;
use crate::radiometry::{Fit, PhotographFit};
use crate::render::{LeftOut, Timings};
use crate::study::Comparison;

/// Rendered views and what they cost.
#[derive(Clone, Debug, Serialize)]
pub struct Rendered {
    /// Seconds of set-up.
    pub setup: Timings,
    /// The views, in the site's order.
    pub views: Vec<RenderedView>,
    /// What views were drawn from, where not from the records themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baked: Option<BakedFrames>,
    /// Number of records.
    pub records: usize,
    /// What they take.
    pub record_bytes: usize,
    /// The most memory that the process has held, where the system tells.
    pub peak_bytes: Option<u64>,
    /// Stages that were left out.
    pub left_out: Vec<NotDone>,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
    /// The probes' gains, fitted to each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gains: Option<Fit>,
}

/// A bake that views were drawn from.
#[derive(Clone, Debug, Serialize)]
pub struct BakedFrames {
    /// Number of vertices with light.
    pub vertices: usize,
    /// Seconds that baking took.
    pub seconds: f64,
    /// FLIP of some frames of a walk to the same rendered in full: of the first, the middle and the last one.
    pub flip: Vec<f64>,
    /// How numbered pictures were turned into light, where probes have such.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub video: Option<VideoTimes>,
}

/// What it took to light a bake by numbered pictures.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct VideoTimes {
    /// Seconds for finding the operator.
    pub operator_s: f64,
    /// How many frames were lit.
    pub frames: usize,
    /// Seconds for reading all pictures.
    pub decode_s: f64,
    /// Seconds for all products.
    pub product_s: f64,
}

/// A stage that was left out, and what that saved where it is known.
#[derive(Clone, Debug, Serialize)]
pub struct NotDone {
    /// The stage, and why.
    #[serde(flatten)]
    pub what: LeftOut,
    /// What that saved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saves: Option<Saving>,
}

/// One rendered view.
#[derive(Clone, Debug, Serialize)]
pub struct RenderedView {
    /// Its name.
    pub name: String,
    /// Seconds of bare primary rays.
    pub rays_s: f64,
    /// Seconds of relighting.
    pub shade_s: f64,
    /// Share of pixels that a probe sees.
    pub covered_fraction: f64,
    /// Where the linear picture was written.
    pub file: PathBuf,
    /// Errors against the photograph.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<Comparison>,
    /// The photograph's exposure, white balance and vignetting against the render, and the error that is left then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit: Option<PhotographFit>,
    /// Errors after that fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_after_fit: Option<Comparison>,
}
