//! A region that was judged.

use crate::audit::decide::odds;
use crate::audit::finding::{Displacement, Evidence, Kind, Shift, What};
use crate::audit::picture::regions::Region;
use crate::audit::verdict::Reason;

/// A region that both tests have had their say on.
pub struct Judged {
    pub(crate) region: Region,
    /// Texture or geometry.
    pub kind: Kind,
    /// What is wrong.
    pub what: What,
    /// Logarithm of the odds of a fault.
    pub(crate) log_odds: f32,
    /// How far the surface is off, where that could be measured.
    pub displacement: Option<Displacement>,
    /// How far a part stands beside its place.
    pub shift: Option<Shift>,
    /// A pixel beside an opening of the model, whose surface goes on over it.
    pub(crate) rim: Option<usize>,
    /// The part of the model whose outline told it, and the logarithm of the odds against its place.
    pub(crate) part: Option<(u32, f32)>,
    /// The figures behind it.
    pub evidence: Vec<Evidence>,
}

impl Judged {
    pub(crate) fn new(kind: Kind, what: What, log_odds: f32, evidence: Vec<Evidence>, region: Region) -> Self {
        Self { region, kind, what, log_odds, displacement: None, shift: None, rim: None, part: None, evidence }
    }

    /// Probability of a fault, 0..=1, as far as its view tells.
    pub fn score(&self) -> f64 {
        odds::probability(self.log_odds)
    }

    /// Whether a fault is likelier than none.
    pub(crate) fn is_likely(&self) -> bool {
        self.log_odds >= 0.0
    }

    /// Why it is a doubt, as far as its view tells, if so many false alarms are allowed in a photograph; [`Reason::None`] for a finding.
    pub fn reason(&self, false_alarms: f64) -> Reason {
        odds::reason(self.log_odds, false_alarms)
    }

    /// Indices of its pixels at the audit's size.
    pub fn pixels(&self) -> &[usize] {
        &self.region.pixels
    }
}
