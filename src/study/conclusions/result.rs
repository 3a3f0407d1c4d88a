//! What a study concludes, as its files have it.

use serde::Serialize;

use crate::study::clock::Seconds;
use crate::study::curve::How;
use crate::study::measure::Run;
use crate::study::metrics::blocks::{Block, Interval, Metric};
use crate::study::order::Ranked;
use crate::study::sweep::{Method, Parameter, Setting};

/// All that is made of a study's runs. Times that are compared are of the processor, all threads together.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// A row a run, methods together, each method as it comes first.
    pub rows: Vec<Row>,
    /// Image-based shooting as it comes against others, at its own error.
    pub speed_ups: Vec<SpeedUp>,
    /// The others' error in its time.
    pub equal_time: Vec<EqualTime>,
    /// How error falls with each parameter.
    pub convergence: Vec<Convergence>,
    /// What to render with.
    pub recommended: Option<Recommended>,
    /// The probes in the order in which settings with fewer take them.
    pub probe_order: Vec<Ranked>,
    /// Where image-based shooting loses or stops, a sentence each.
    pub losses: Vec<String>,
}

/// One run.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The setting.
    #[serde(flatten)]
    pub setting: Setting,
    /// It in words.
    pub label: String,
    /// Set-up.
    pub setup: Seconds,
    /// A frame, mean over views.
    pub frame: Seconds,
    /// Root mean squared error.
    pub rmse: Interval,
    /// Relative mean squared error.
    pub relmse: Interval,
    /// FLIP.
    pub flip: Interval,
    /// Structural similarity.
    pub ssim: Interval,
    /// Whether no other run is both quicker in a frame and nearer by FLIP.
    pub pareto: bool,
}

/// How much longer another way takes to err as little.
#[derive(Clone, Debug, Serialize)]
pub struct SpeedUp {
    /// The other way.
    pub against: String,
    /// The error's measure; of SSIM, 1 − SSIM.
    pub metric: Metric,
    /// Image-based shooting's error.
    pub error: f64,
    /// What the other way needs for it, processor seconds a frame.
    pub needed_cpu_s: f64,
    /// How that was found.
    pub how: How,
    /// Times as long for a frame, all set-up done.
    pub frame: Interval,
    /// The same by the clock on the wall.
    pub frame_wall: Option<f64>,
    /// Times as long for one frame and all set-up, with every view's set-up charged to that frame.
    pub with_setup: Interval,
}

impl SpeedUp {
    /// It in words.
    pub fn sentence(&self) -> String {
        let metric = if self.metric == Metric::Ssim { "1 − SSIM" } else { self.metric.name() };
        let (least, how) = (self.how.bound(), if self.how == How::Extrapolated { ", extrapolated" } else { "" });
        format!(
            "For the same error ({metric} {:.4}), {} takes {least}{} × as long for a frame (95 %: {}; wall {}{how}), and {least}{} × \
             with all set-up ({}).",
            self.error,
            self.against,
            rounded(self.frame.value),
            self.frame.range(),
            self.frame_wall.map_or_else(|| "?".to_owned(), rounded),
            rounded(self.with_setup.value),
            self.with_setup.range()
        )
    }
}

/// How much more another way errs in the same time.
#[derive(Clone, Debug, Serialize)]
pub struct EqualTime {
    /// The other way.
    pub against: String,
    /// The error's measure.
    pub metric: Metric,
    /// Whether set-up counts.
    pub with_setup: bool,
    /// The time, processor seconds.
    pub cpu_s: f64,
    /// The other way's error.
    pub error: f64,
    /// How that was found; `first` means that it cannot even take one sample a pixel in that time.
    pub how: How,
    /// Its error ÷ image-based shooting's.
    pub ratio: Interval,
}

impl EqualTime {
    /// It in words.
    pub fn sentence(&self) -> String {
        format!(
            "In the {} s of {}, {} errs {}{} × as much by {} (95 %: {}).",
            rounded(self.cpu_s),
            if self.with_setup { "one frame with all set-up" } else { "a frame" },
            self.against,
            if self.how == How::First { "at least " } else { "" },
            rounded(self.ratio.value),
            self.metric.name(),
            self.ratio.range()
        )
    }
}

impl Interval {
    /// Its ends in words.
    pub fn range(&self) -> String {
        format!("{} to {}", rounded(self.low), rounded(self.high))
    }
}

/// How error falls with a parameter.
#[derive(Clone, Debug, Serialize)]
pub struct Convergence {
    /// The method.
    pub method: Method,
    /// The parameter.
    pub parameter: Parameter,
    /// The error's measure.
    pub metric: Metric,
    /// The exponent p of error ∝ parameterᵖ, fitted over all points.
    pub order: Interval,
    /// The exponent of what is still to be gained, from the last three points if they are evenly spaced in logarithm and
    /// gain less each time: error − limit ∝ parameterᵖ.
    pub tail: Option<f64>,
    /// Number of points.
    pub points: usize,
}

/// What to render with.
#[derive(Clone, Debug, Serialize)]
pub struct Recommended {
    /// The setting.
    pub setting: Setting,
    /// Why.
    pub why: String,
    /// The command to paste.
    pub snippet: String,
}

/// A run with all its views and its blocks in one list.
pub(crate) struct Whole<'a> {
    pub(crate) run: &'a Run,
    pub(crate) blocks: Vec<Block>,
}

/// A figure with two digits that count.
pub fn rounded(x: f64) -> String {
    if !x.is_finite() {
        return "?".to_owned();
    }
    let digits = if x > 0.0 { x.log10().floor() as i32 } else { 0 };
    if digits >= 1 {
        let step = 10f64.powi(digits - 1);
        let whole = ((x / step).round() * step) as u64;
        let text = whole.to_string();
        let mut out = String::new();
        for (i, c) in text.chars().enumerate() {
            if i > 0 && (text.len() - i).is_multiple_of(3) {
                out.push('\u{202f}');
            }
            out.push(c);
        }
        out
    } else {
        format!("{x:.*}", (1 - digits).clamp(1, 9) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_rounded_to_what_counts() {
        let shown = [0.123, 1.26, 9.7, 14.7, 163.0, 6543.0, 1_234_567.0, f64::NAN].map(rounded);
        assert_eq!(shown, ["0.12", "1.3", "9.7", "15", "160", "6\u{202f}500", "1\u{202f}200\u{202f}000", "?"]);
    }
}
