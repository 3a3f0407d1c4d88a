//! How likely a region is a fault, by what was measured of it: logistic regression on rooms whose faults are known.
//!
//! Each cue adds to the logarithm of the odds in proportion to how far it is from where it speaks neither way. The weights
//! are fitted to the candidates of many audits (`docs/audit.md`); none is set by hand.

use crate::audit::finding::{Evidence, Finding};
use crate::audit::hypothesis::laying::retextured::EVIDENCE;
use crate::audit::verdict::Reason;
use crate::audit::view::Settings;

/// Something measured of a candidate.
pub(crate) struct Cue {
    test: &'static str,
    unit: &'static str,
    /// Values beyond these count as these: no weight is known outside what was fitted.
    limits: [f32; 2],
    /// Where it speaks neither way.
    even: f32,
    /// What a unit adds to the logarithm of the odds.
    weight: f32,
}

impl Cue {
    const fn new(test: &'static str, unit: &'static str, limits: [f32; 2], even: f32, weight: f32) -> Self {
        Self { test, unit, limits, even, weight }
    }

    /// What a value adds to the logarithm of the odds, and the same in words. What could not be measured speaks neither way.
    fn says(&self, value: f32) -> (f32, Evidence) {
        let value = if value.is_finite() { value.clamp(self.limits[0], self.limits[1]) } else { self.even };
        let says = self.weight * (value - self.even);
        (says, Evidence::new(self.test, value, self.even, self.unit, says))
    }
}

/// The cues of one way to tell a fault.
pub(crate) struct Cues<const N: usize> {
    /// Logarithm of the odds where all speak neither way.
    bias: f32,
    cues: [Cue; N],
}

impl<const N: usize> Cues<N> {
    /// Logarithm of the odds of a fault, and what each value said.
    pub(crate) fn weigh(&self, values: [f32; N]) -> (f32, Vec<Evidence>) {
        let (says, evidence): (Vec<f32>, Vec<Evidence>) = self.cues.iter().zip(values).map(|(c, v)| c.says(v)).unzip();
        (self.bias + says.iter().sum::<f32>(), evidence)
    }
}

/// Logarithm of a small region's share of a picture: .2 %.
pub(crate) const SMALL: f32 = -6.2;

/// And of a large one, beyond which size says no more: 2 %.
pub(crate) const LARGE: f32 = -4.0;

/// Difference of colour that is usual between a model's material and the real one, ΔE00.
pub(crate) const COLOURED: f32 = 3.0;

// The weights are no constants set by hand: they are fitted, as `docs/audit.md` says.

/// A region that photograph and probes do not agree on.
pub(crate) static SHAPE: Cues<6> = Cues {
    bias: -2.42,
    cues: [
        Cue::new("geometry mismatch", "× variance", [0.0, 6.0], 3.5, 0.30),
        Cue::new("the model's picture in its place", "share", [0.0, 1.0], 0.1, -5.63),
        Cue::new("thickness", "logarithm of pixels", [0.0, 5.0], 2.5, 2.32),
        Cue::new("at the model's edges", "share", [0.0, 1.0], 0.2, 1.72),
        Cue::new("another structure", "share", [0.0, 1.0], 0.0, 9.37),
        Cue::new("outline of a piece of the model", "intersection over union", [0.0, 1.0], 0.1, 4.24),
    ],
};

/// A region whose structure or colours are not the model's.
pub(crate) static PICTURE: Cues<9> = Cues {
    bias: -4.31,
    cues: [
        Cue::new("share of the usual structure", "share", [-0.5, 1.5], 0.5, -1.04),
        Cue::new("size", "logarithm of share of picture", [-8.0, LARGE], SMALL, 0.44),
        Cue::new("colour difference that light does not explain", "ΔE00", [0.0, 25.0], COLOURED, 0.14),
        Cue::new("so much of it ends at its borders", "ΔE00", [0.0, 12.0], COLOURED, 0.15),
        Cue::new("any colour difference that ends there", "ΔE00", [0.0, 12.0], COLOURED, 0.24),
        Cue::new("step at its borders, times size", "ΔE00 × logarithm", [-7.0, 20.0], 0.0, 0.13),
        Cue::new("geometry mismatch", "× variance", [0.0, 6.0], 1.0, -0.53),
        Cue::new("structure that the model lacks", "logarithm of × usual", [-3.0, 3.0], 0.0, 0.46),
        Cue::new("as far off elsewhere", "logarithm of squares a photograph", [-7.0, 3.0], 0.0, -0.14),
    ],
};

/// A region over whose borders the photograph may go on.
pub(crate) static BORDER: Cues<3> = Cues {
    bias: -5.97,
    cues: [
        Cue::new("odds of no border, times the share that tells", "logarithm", [-6.0, 8.0], 0.0, 1.50),
        Cue::new("share of the usual structure", "share", [-0.5, 1.5], 0.5, -3.66),
        Cue::new("size", "logarithm of share of picture", [-8.0, LARGE], SMALL, 1.13),
    ],
};

/// A region that shows little of what the model makes there.
pub(crate) static UNLIKE: Cues<7> = Cues {
    bias: -4.24,
    cues: [
        Cue::new("unlike the model, 8 pixels", "logarithm", [-3.0, 4.0], 0.81, 0.93),
        Cue::new("size", "logarithm of share of picture", [-8.0, LARGE], -5.95, 0.70),
        Cue::new("thickness", "logarithm of pixels", [0.0, 5.0], 2.82, 0.92),
        Cue::new("geometry test", "× threshold", [0.0, 1.0], 0.19, 8.12),
        Cue::new("texture test, times the share of light that it cannot mirror", "× threshold", [0.0, 3.0], 0.54, 1.54),
        Cue::new("odds of another structure, times that share", "logarithm", [-10.0, 10.0], -0.93, 0.23),
        Cue::new("step at its outline that is not the model's", "logarithm", [0.0, 20.0], 3.8, 0.21),
    ],
};

/// A part over whose contours the photograph may go on.
pub(crate) static ABSENT: Cues<2> = Cues {
    bias: -0.96,
    cues: [
        Cue::new("odds of no contour, times the share that tells", "logarithm", [-6.0, 8.0], 3.5, 0.62),
        Cue::new("size", "logarithm of share of picture", [-8.0, LARGE], SMALL, 0.69),
    ],
};

/// An opening of the model at whose rim the photograph goes on.
pub(crate) static OPENING: Cues<3> = Cues {
    bias: -2.48,
    cues: [
        Cue::new("step at its rim", "logarithm of × usual", [0.0, 4.0], 1.0, -3.65),
        Cue::new("rim in one plane", "share", [0.0, 0.55], 0.5, 10.47),
        Cue::new("size", "logarithm of share of picture", [-8.0, LARGE], SMALL, 0.66),
    ],
};

/// A smooth surface whose parts fit better off their places.
pub(crate) static DISPLACED: Cues<3> = Cues {
    bias: -2.90,
    cues: [
        Cue::new("odds of another place along its normal", "logarithm", [0.0, 40.0], 8.0, 0.39),
        Cue::new("parts that agree on it", "share", [0.0, 1.0], 0.7, 4.83),
        Cue::new("less off there", "share", [0.0, 1.0], 0.3, 4.52),
    ],
};

/// A piece of texture that the photograph shows laid otherwise.
pub(crate) static LAYING: Cues<4> = Cues {
    bias: 0.92,
    cues: [
        Cue::new(EVIDENCE, "logarithm", [0.0, 100.0], 20.0, 0.01),
        Cue::new("correlation with the model's texture", "correlation", [-0.5, 1.0], 0.5, -1.34),
        Cue::new("correlation when laid otherwise", "correlation", [0.0, 1.0], 0.6, -0.06),
        Cue::new("size", "logarithm of share of picture", [-8.0, -2.0], SMALL, 0.16),
    ],
};

/// A part whose outline is beside its place.
pub(crate) static OUTLINE: Cues<1> =
    Cues { bias: -1.54, cues: [Cue::new("odds of another place", "logarithm", [0.0, 20.0], 5.0, 0.28)] };

/// What is told of all ways to tell a fault is the likeliest, which makes too much of it: how much likelier faults were as its odds grew.
static TOLD: Cues<1> = Cues {
    bias: -0.27,
    cues: [Cue::new("odds by all cues", "logarithm", [f32::NEG_INFINITY, f32::INFINITY], 0.0, 1.11)],
};

/// The cue of a picture that is known only when all photographs are, and its number.
fn elsewhere() -> (usize, &'static Cue) {
    let last = PICTURE.cues.len() - 1;
    (last, &PICTURE.cues[last])
}

/// How many squares of all photographs are as far off as a picture takes the place of what spoke neither way.
pub(crate) fn learn(finding: &mut Finding, log_odds: &mut f32, squares: f32) {
    let (k, cue) = elsewhere();
    if finding.evidence[0].test == PICTURE.cues[0].test {
        let (says, evidence) = cue.says(squares);
        finding.evidence[k] = evidence;
        *log_odds += says;
    }
}

/// Tests whose regions may turn up all over a model; how many of right random rooms are no faults, a photograph; and what share of the
/// logarithm counts: less than all where a real scan had a part in the weights.
pub(crate) static BACKGROUND: [(&str, f64, f32); 2] =
    [(SHAPE.cues[0].test, 0.11, 1.0), (UNLIKE.cues[0].test, 0.18, 0.6)];

/// The share of a fault's surfaces that other photographs may find right.
const WRONGLY_RIGHT: f32 = 0.05;

/// Adds that other photographs find a share of its surfaces right: it is no fault where they do, but for what they may be wrong in.
pub(crate) fn found_right(finding: &mut Finding, log_odds: &mut f32, share: f32) {
    let says = (1.0 - share).max(WRONGLY_RIGHT).ln();
    finding.evidence.push(Evidence::new("found right in other photographs", share, 0.0, "share", says));
    *log_odds += says;
}

/// The most that the odds of a region may turn out as, whatever the other photographs show.
fn at_most(log_odds: f32) -> f32 {
    let (_, cue) = elsewhere();
    let most = cue.limits.map(|l| cue.says(l).0).into_iter().fold(0.0, f32::max);
    log_odds + most
}

/// Whether a region may turn out at least as likely a fault as this.
pub(crate) fn may_reach(log_odds: f32, least: f64) -> bool {
    probability(at_most(log_odds)) >= least
}

/// Whether it may turn out a finding, where so many false alarms are allowed.
pub(crate) fn may_be_found(log_odds: f32, allowed: f64) -> bool {
    reason(at_most(log_odds), allowed) == Reason::None
}

/// Regions of even odds or more that a right model gives in a photograph: counted on rooms (`docs/audit.md`).
const ALARMS: f64 = 0.06;

/// Regions of at least these odds that a right model gives in a photograph: in inverse proportion to the odds.
pub(crate) fn false_alarms(log_odds: f32) -> f64 {
    ALARMS * (-f64::from(log_odds)).exp()
}

impl Settings {
    /// Those by which all is told that right models give no more often than this in a photograph, however unlikely it is a fault.
    pub fn allowing(false_alarms: f64) -> Self {
        let usual = Self::default();
        // the probability from which on `false_alarms` are no more than these
        let least_probability = usual.least_probability.min(told((ALARMS / false_alarms).ln() as f32));
        Self { false_alarms, least_probability, ..usual }
    }
}

/// The probability of a fault of these odds.
pub(crate) fn probability(log_odds: f32) -> f64 {
    1.0 / (1.0 + (-f64::from(log_odds)).exp())
}

/// The probability of a fault that is told with these odds, as often as such are right (Platt, *Probabilistic outputs for support vector
/// machines*, 1999).
pub(crate) fn told(log_odds: f32) -> f64 {
    probability(TOLD.weigh([log_odds]).0)
}

/// Why a region of these odds is a doubt, if right models give such more often than allowed.
pub(crate) fn reason(log_odds: f32, allowed: f64) -> Reason {
    if false_alarms(log_odds) > allowed { Reason::Usual } else { Reason::None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_weight_is_in_the_table() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let table = std::fs::read_to_string(root.join("docs/audit.md")).unwrap();
        let all = [
            &SHAPE.cues[..],
            &PICTURE.cues,
            &UNLIKE.cues,
            &BORDER.cues,
            &ABSENT.cues,
            &OPENING.cues,
            &DISPLACED.cues,
            &LAYING.cues,
            &OUTLINE.cues,
            &TOLD.cues,
        ];
        for cue in all.into_iter().flatten() {
            let row = format!("| {} | {} | {:.2} | {:+.2} |", cue.test, cue.unit, cue.even, cue.weight);
            assert!(table.contains(&row), "docs/audit.md lacks the row {row}");
        }
    }

    #[test]
    fn what_could_not_be_measured_speaks_neither_way() {
        let (all, evidence) = SHAPE.weigh([f32::NAN; 6]);
        assert!(all == SHAPE.bias && evidence.iter().all(|e| e.log_odds == 0.0 && e.value == e.threshold));
        let mut values = [f32::NAN; 6];
        values[0] = 5.0;
        assert!(SHAPE.weigh(values).0 > all);
    }

    #[test]
    fn higher_odds_are_likelier_and_rarer() {
        assert!(probability(2.0) > probability(1.0) && false_alarms(2.0) < false_alarms(1.0));
        assert!(told(2.0) > told(1.0) && told(-1.0) < probability(-1.0));
        assert_eq!(probability(0.0), 0.5);
        assert_eq!((reason(-9.0, 0.1), reason(9.0, 0.1)), (Reason::Usual, Reason::None));
    }

    #[test]
    fn what_may_be_found_is_likely_enough_to_be_told() {
        for allowed in [0.01, 0.1, 1.0, 10.0] {
            let settings = Settings::allowing(allowed);
            let least = (-8..8).map(|k| 0.5 * k as f32).find(|z| reason(*z, allowed) == Reason::None).unwrap();
            assert!(told(least) >= settings.least_probability, "{allowed}: {least}");
            assert!(settings.least_probability <= Settings::default().least_probability);
        }
    }
}
