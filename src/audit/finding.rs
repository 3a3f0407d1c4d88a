//! What the audit found, as values and as `findings.json` and `findings.csv`.

use serde::Serialize;
use std::collections::BTreeMap;

use crate::audit::verdict::{Reason, Verdict};
use crate::panorama::Picture;

/// What sort of fault it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The surface is right, its picture is not.
    Texture,
    /// The surface is not where it should be.
    Geometry,
}

impl Kind {
    /// The name in the machine-readable outputs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Texture => "texture",
            Self::Geometry => "geometry",
        }
    }
}

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum What {
    /// The texture is turned.
    Rotated,
    /// The texture is mirrored.
    Mirrored,
    /// The texture is shifted.
    Shifted,
    /// The texture is too large or too small.
    Scaled,
    /// The structure is right, the colour is not.
    Recoloured,
    /// The picture is another one.
    Changed,
    /// Something stands in front of the modelled surface, or a recess is behind it, that is not modelled.
    Missing,
    /// The model has something that is not there.
    Extra,
    /// The surface is some way off its place.
    Moved,
}

impl What {
    /// The name in the machine-readable outputs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rotated => "rotated",
            Self::Mirrored => "mirrored",
            Self::Shifted => "shifted",
            Self::Scaled => "scaled",
            Self::Recoloured => "recoloured",
            Self::Changed => "changed",
            Self::Missing => "missing",
            Self::Extra => "extra",
            Self::Moved => "moved",
        }
    }
}

/// How far the real surface is from the modelled one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Displacement {
    /// Metres along the modelled surface's normal, positive towards the camera's side.
    pub metres: f64,
    /// One standard deviation, metres.
    pub uncertainty_m: f64,
}

/// One figure that speaks for a finding.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evidence {
    /// What was measured, such as `geometry mismatch` or `colour difference`.
    pub test: String,
    /// The figure.
    pub value: f64,
    /// Where it speaks neither way.
    pub threshold: f64,
    /// The figure's unit, such as `× noise`, `ΔE00` or `correlation`.
    pub unit: String,
    /// What it adds to the logarithm of the odds of a fault.
    pub log_odds: f64,
}

impl Evidence {
    /// A figure, where it would speak neither way, and what it says.
    pub(crate) fn new(test: &str, value: f32, threshold: f32, unit: &str, log_odds: f32) -> Self {
        let [value, threshold, log_odds] = [value, threshold, log_odds].map(f64::from);
        Self { test: test.into(), value, threshold, unit: unit.into(), log_odds }
    }
}

/// How far a part stands beside its modelled place, across the line of sight, as the photograph sees it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shift {
    /// Metres to the right.
    pub right_m: f64,
    /// Metres down.
    pub down_m: f64,
}

impl Shift {
    /// Which way it is shifted most, and its whole length in metres.
    pub fn words(&self) -> (&'static str, f64) {
        let side = match (self.right_m.abs() >= self.down_m.abs(), self.right_m >= 0.0, self.down_m >= 0.0) {
            (true, true, _) => "to the right",
            (true, false, _) => "to the left",
            (false, _, true) => "down",
            (false, _, false) => "up",
        };
        (side, self.right_m.hypot(self.down_m))
    }
}

/// One fault of the model, as one view shows it best.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// `F1`, `F2`, … over all views, the surest first; `D1`, … for doubts.
    pub id: String,
    /// The view that shows it best.
    pub view: String,
    /// Other views that show the same; `masks` says where.
    pub also_in: Vec<String>,
    /// Texture or geometry.
    pub kind: Kind,
    /// What is wrong.
    pub what: What,
    /// Confidence, 0..=1.
    pub score: f64,
    /// Pixels of the photograph: left, top, and one past right and bottom.
    pub bbox: [u32; 4],
    /// Pixels of the photograph.
    pub area_px: u64,
    /// File name of the 8-bit mask (255 inside), of the photograph's size, beside `findings.json`.
    pub mask: String,
    /// Per view that shows it, the file name of its mask there.
    pub masks: BTreeMap<String, String>,
    /// Expected number of regions as strange as this in a photograph of a right model.
    pub false_alarms: Option<f64>,
    /// Centre of the region on the modelled surface, in the model's own axes and units.
    pub position: [f64; 3],
    /// The region's greatest extent on the modelled surface, metres.
    pub size_m: f64,
    /// Area of the modelled surface in the region, cm².
    pub area_cm2: f64,
    /// The model's material that most of the region is made of.
    pub material: String,
    /// How far the surface is off, where that could be measured.
    pub displacement: Option<Displacement>,
    /// How far a part stands beside its place, where its outline told.
    pub shift: Option<Shift>,
    /// Why it cannot be told for sure; [`Reason::None`] for all but doubts.
    pub reason: Reason,
    /// The figures behind it.
    pub evidence: Vec<Evidence>,
    /// A sentence for people.
    pub note: String,
}

/// What was found out about a probe on the way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProbeGain {
    /// The probe's name.
    pub probe: String,
    /// Its exposure against the mean of all probes, in stops.
    pub gain_ev: f64,
    /// Share of the view's surface pixels that it sees well enough to test.
    pub sees: f64,
    /// Median relative difference between its light and the photograph's where it sees; `None` where it sees too little.
    pub difference: Option<f64>,
    /// A sentence if it disagrees with the others.
    pub warning: Option<String>,
}

/// How the camera was moved to fit the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PoseCorrection {
    /// Whether the pose was refined; if not, the site's pose was kept.
    pub refined: bool,
    /// Mean shift of the picture, pixels of the photograph.
    pub mean_px: f64,
    /// Greatest shift of the picture, pixels of the photograph.
    pub max_px: f64,
    /// What the fit leaves open, pixels of the photograph (one standard deviation, as far as the fit can tell).
    pub residual_px: f64,
    /// Angle that the camera was turned by, degrees.
    pub rotation_deg: f64,
    /// Distance that the camera was moved by, metres.
    pub translation_m: f64,
}

/// Shares of a view's pixels under each verdict; they sum to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Shares {
    /// See [`Verdict::Ok`].
    pub ok: f64,
    /// See [`Verdict::Texture`].
    pub texture: f64,
    /// See [`Verdict::Geometry`].
    pub geometry: f64,
    /// See [`Verdict::Ambiguous`].
    pub ambiguous: f64,
    /// See [`Verdict::Untestable`].
    pub untestable: f64,
}

/// How one view was audited.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ViewSummary {
    /// The view's name.
    pub view: String,
    /// The photograph's file.
    pub photo: String,
    /// The photograph's width and height in pixels.
    pub size: [u32; 2],
    /// Pixels of the photograph, along a side, that were averaged to one for the audit.
    pub reduced_by: u32,
    /// The probes' exposure over the photograph's, in stops.
    pub exposure_ev: f64,
    /// What the photograph's channels were multiplied by on top of the exposure; their product is 1.
    pub white_balance: [f64; 3],
    /// Loss of light in the picture's corners, in stops.
    pub vignetting_ev: f64,
    /// The photograph's noise, relative to its light: robust standard deviation in its smooth parts.
    pub noise: f64,
    /// How the camera was moved.
    pub pose: PoseCorrection,
    /// What was found out about the probes.
    pub probes: Vec<ProbeGain>,
    /// Shares of the pixels.
    pub shares: Shares,
    /// Shares of all pixels that are ambiguous or untestable, by reason.
    pub reasons: BTreeMap<String, f64>,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
}

/// Everything the audit says of one view. All but the photograph has the audit's size: a pixel is `summary.reduced_by` squared of the
/// photograph's.
pub struct AuditedView {
    /// Figures, for the machine-readable output.
    pub summary: ViewSummary,
    /// The photograph with exposure and white balance of the probes, of its own size.
    pub photograph: Picture,
    /// The model in the probes' light, radiance.
    pub render: Picture,
    /// The model's albedo under even light, 0..1: relit from what the probes saw, wrong colours hardly show.
    pub neutral: Picture,
    /// What is said of each pixel.
    pub verdicts: Vec<Verdict>,
    /// Why no more is said of it.
    pub reasons: Vec<Reason>,
    /// How much each pixel is suspected, 0..=1: by the likeliest finding or doubt that it is in, and by itself; in none, by itself alone and less than any doubt is
    /// told with, or a little by one near it.
    pub suspicion: Vec<f32>,
    /// For each finding or doubt that this view shows: its id and the pixels it covers.
    pub masks: Vec<(String, Vec<bool>)>,
}

/// The thresholds that regions were judged by.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Method {
    /// The program's version.
    pub version: String,
    /// The lighting whose probes were used; empty where the site has only one.
    pub lighting: String,
    /// Names of thresholds and their values.
    pub thresholds: BTreeMap<String, f64>,
}

/// Everything the audit says of a site.
pub struct Audit {
    /// Faults, the surest first.
    pub findings: Vec<Finding>,
    /// Where something disagrees but what it is cannot be told, the surest first.
    pub doubts: Vec<Finding>,
    /// The views, in the site's order.
    pub views: Vec<AuditedView>,
    /// How it was judged.
    pub method: Method,
    /// What is odd about the site, a sentence each.
    pub warnings: Vec<String>,
}

impl Finding {
    /// Whether it is a finding, and not a doubt.
    pub fn is_sure(&self) -> bool {
        self.reason == Reason::None
    }
}

impl Shares {
    /// Counts a view's verdicts.
    pub fn of(verdicts: &[Verdict]) -> Self {
        let share = |v: Verdict| verdicts.iter().filter(|w| **w == v).count() as f64 / verdicts.len().max(1) as f64;
        Self {
            ok: share(Verdict::Ok),
            texture: share(Verdict::Texture),
            geometry: share(Verdict::Geometry),
            ambiguous: share(Verdict::Ambiguous),
            untestable: share(Verdict::Untestable),
        }
    }
}
