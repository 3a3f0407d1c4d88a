//! What the page shows, read from the files that the verbs write (their formats are fixed, their fields may grow).

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::report::Fingerprint;
use crate::site::Project;

/// All that a page shows.
#[derive(Clone, Debug, Default)]
pub struct Archive {
    /// The site's name.
    pub site: String,
    /// What the site file says of the work.
    pub project: Project,
    /// Name and version of the program.
    pub software: String,
    /// `check --json`.
    pub check: Option<Check>,
    /// `plan.json`.
    pub plan: Option<Plan>,
    /// `render --json`.
    pub render: Option<Render>,
    /// Pictures of each view that stand beside each other.
    pub views: Vec<ViewPictures>,
    /// `findings.json`.
    pub audit: Option<Audit>,
    /// Whether there is a study sheet.
    pub study: Option<Study>,
    /// The viewer's file beside the page.
    pub viewer: Option<String>,
    /// The verbs that were run, in order.
    pub runs: Vec<Run>,
    /// Whether all sheets are in `report.pdf`, too.
    pub sheets_pdf: bool,
    /// Every file that was read.
    pub inputs: Vec<Fingerprint>,
}

/// One verb as it was run for the report.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Run {
    /// The verb.
    pub verb: String,
    /// The command line that does the same.
    pub command: String,
    /// Seconds that it took; `None` where it was left out.
    pub seconds: Option<f64>,
    /// Why it was left out or came to no end; empty where it did.
    pub note: String,
}

/// The part of `check --json` that the page shows.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Check {
    /// Whether nothing is to be warned of.
    pub ok: bool,
    /// Mistakes that explain the rest.
    pub causes: Vec<Cause>,
    /// Sentences about the site file.
    pub warnings: Vec<String>,
    /// Sentences about how triangles meet.
    pub edge_warnings: Vec<String>,
    /// The model.
    pub model: Model,
    /// The probes.
    pub probes: Vec<Probe>,
    /// The stages of work.
    pub stages: Vec<Stage>,
    /// Share of what the views show that no probe sees.
    pub unseen_share: Option<f64>,
}

/// A mistake in the site file.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Cause {
    /// What is wrong and what to do.
    pub sentence: String,
}

/// The model's health.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Model {
    /// Triangles after import.
    pub triangles: usize,
    /// East, north and up extent in metres.
    pub size_m: [f64; 3],
    /// Sentences.
    pub warnings: Vec<String>,
}

/// A probe's sanity.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Probe {
    /// Its name.
    pub name: String,
    /// Height above the floor in metres.
    pub height_m: Option<f64>,
    /// Distance to the nearest surface in metres.
    pub nearest_m: Option<f64>,
    /// Sentences.
    pub warnings: Vec<String>,
}

/// A stage of work.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Stage {
    /// Its name.
    pub stage: String,
    /// Whether the site needs it.
    pub needed: bool,
    /// Why, or why not.
    pub why: String,
}

/// `plan.json`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Plan {
    /// The floors, from below.
    pub floors: Vec<Floor>,
}

/// A floor's plan.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Floor {
    /// Its name.
    pub name: String,
    /// Height in the model's units.
    pub elevation: f64,
    /// Open area in square metres.
    pub area_m2: f64,
    /// Where to put the tripod, in order of use.
    pub stations: Vec<Station>,
    /// Share of the open area that the stations see.
    pub covered_fraction: f64,
    /// The fewest stations that can do.
    pub lower_bound: f64,
    /// Area that no allowed station sees.
    pub unreachable_m2: f64,
    /// The sheet's files, without folder and ending.
    pub sheets: Vec<String>,
}

/// A planned probe.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Station {
    /// Its name.
    pub name: String,
    /// In the model's own axes and units.
    pub position: [f64; 3],
    /// Area that it sees.
    pub covers_m2: f64,
    /// Share of the floor that it adds to those before.
    pub adds_fraction: f64,
}

/// `render --json`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Render {
    /// Seconds of set-up.
    pub setup: Setup,
    /// Each view.
    pub views: Vec<Rendered>,
    /// Number of records.
    pub records: usize,
    /// Most memory that was held.
    pub peak_bytes: Option<u64>,
    /// What was left out.
    pub left_out: Vec<LeftOut>,
}

/// Seconds of set-up.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Setup {
    /// Reading.
    pub load_s: f64,
    /// The probes' rays.
    pub shoot_s: f64,
    /// Their light.
    pub index_s: f64,
    /// The volume.
    pub volume_s: f64,
}

/// A stage that was left out.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct LeftOut {
    /// The stage.
    pub stage: String,
    /// Why.
    pub why: String,
}

/// One rendered view.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Rendered {
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
    pub error: Option<Error>,
}

/// Errors of a view.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Error {
    /// Over all pixels.
    pub all: Errors,
}

/// Errors over some pixels.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Errors {
    /// Mean FLIP.
    pub flip: f64,
    /// Relative mean squared error.
    pub relmse: f64,
    /// Median relative error.
    pub median: f64,
}

/// The pictures of a view, by file name in the report's folder, all of the same size and exposure.
#[derive(Clone, Debug, Default)]
pub struct ViewPictures {
    /// The view's name.
    pub name: String,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// The photograph.
    pub photo: Option<String>,
    /// The relit view.
    pub render: String,
    /// The photograph with what the audit found marked on it.
    pub findings: Option<String>,
    /// Stem of the audit's sheet.
    pub sheet: Option<String>,
}

/// `findings.json`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Audit {
    /// What is wrong.
    pub findings: Vec<Finding>,
    /// What disagrees without telling how.
    pub doubts: Vec<Finding>,
    /// How each view was judged.
    pub views: Vec<AuditedView>,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
}

/// How one photograph was judged.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct AuditedView {
    /// The view.
    pub view: String,
    /// Shares of its pixels.
    pub shares: Shares,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
}

/// Shares of a view's pixels.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Shares {
    /// Nothing speaks against the model.
    pub ok: f64,
    /// The picture on the surface is wrong.
    pub texture: f64,
    /// The surface is wrong.
    pub geometry: f64,
    /// Something disagrees without telling how.
    pub ambiguous: f64,
    /// Nothing can be said.
    pub untestable: f64,
}

/// One thing that is wrong.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Finding {
    /// Unique.
    pub id: String,
    /// The view that shows it.
    pub view: String,
    /// `texture` or `geometry`.
    pub kind: String,
    /// `rotated`, `missing` and so on.
    pub what: String,
    /// 0 to 1.
    pub score: f64,
    /// Pixels: left, top, right, bottom.
    pub bbox: [f64; 4],
    /// Its mask's file.
    pub mask: String,
    /// In the model's own axes and units.
    pub position: [f64; 3],
    /// Metres.
    pub size_m: f64,
    /// Square centimetres.
    pub area_cm2: f64,
    /// The model's material.
    pub material: String,
    /// How far the surface is off.
    pub displacement: Option<Displacement>,
    /// A sentence.
    pub note: String,
}

/// How far a surface is off its place.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Displacement {
    /// Metres along its normal, positive towards the camera's side.
    pub metres: f64,
    /// One standard deviation.
    pub uncertainty_m: f64,
}

/// What the page shows of the study.
#[derive(Clone, Debug, Default)]
pub struct Study {
    /// Header and rows of `study.csv`.
    pub table: Vec<Vec<String>>,
    /// `study --json`.
    pub summary: StudySummary,
}

/// `study --json`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct StudySummary {
    /// How much longer other ways take for the same error.
    pub speed_ups: Vec<SpeedUp>,
    /// Where image-based shooting loses, a sentence each.
    pub losses: Vec<String>,
    /// What to render with.
    pub recommended: Option<Recommended>,
}

/// How much longer another way takes for the same error.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct SpeedUp {
    /// The other way.
    pub against: String,
    /// The error's measure.
    pub metric: String,
    /// The error.
    pub error: f64,
    /// `extrapolated` where the other way's curve ends before.
    pub how: String,
    /// Times as long for a frame.
    pub frame: Interval,
    /// Times as long with all set-up.
    pub with_setup: Interval,
}

/// A figure and its 95 % interval; NaN where it is not finite.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Interval {
    /// The figure.
    #[serde(deserialize_with = "null_is_nan")]
    pub value: f64,
    /// Lower end.
    #[serde(deserialize_with = "null_is_nan")]
    pub low: f64,
    /// Upper end.
    #[serde(deserialize_with = "null_is_nan")]
    pub high: f64,
}

/// JSON has no infinity: null stands for it.
fn null_is_nan<'de, D: serde::Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

/// What to render with.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Recommended {
    /// Why.
    pub why: String,
    /// The command to paste.
    pub snippet: String,
}
