//! Errors kept block by block, so that their uncertainty can be told.
//!
//! Neighbouring pixels err together, so pixels are no independent draws; blocks of them nearly are. A confidence interval
//! is the bootstrap's over blocks, drawn view by view (Efron and Tibshirani, *An Introduction to the Bootstrap*, 1993,
//! percentile method); the same draws serve all runs, so that ratios of two runs are paired.

use serde::{Deserialize, Serialize};

use crate::reference::random::splitmix64;

/// Sums over the pixels of one block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f32; 7]", into = "[f32; 7]")]
pub struct Block {
    /// Number of pixels with a truth.
    pub pixels: f32,
    /// Σ FLIP.
    pub flip: f32,
    /// Σ squared error over channels, the truth's noise taken off where it is known.
    pub squared: f32,
    /// Number of pixels whose relative error counts: all but the worst 0.1 % of a view.
    pub kept: f32,
    /// Σ over these of the squared relative error, a pixel's mean over channels.
    pub relative: f32,
    /// Number of windows of structural similarity whose middle lies here.
    pub windows: f32,
    /// Σ of their similarities.
    pub similarity: f32,
}

impl From<[f32; 7]> for Block {
    fn from([pixels, flip, squared, kept, relative, windows, similarity]: [f32; 7]) -> Self {
        Self { pixels, flip, squared, kept, relative, windows, similarity }
    }
}

impl From<Block> for [f32; 7] {
    fn from(b: Block) -> Self {
        [b.pixels, b.flip, b.squared, b.kept, b.relative, b.windows, b.similarity]
    }
}

impl Block {
    /// Whether all its sums are numbers.
    fn is_known(&self) -> bool {
        <[f32; 7]>::from(*self).iter().all(|sum| sum.is_finite())
    }
}

/// What error is stated in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// Root of the mean squared error, in units of radiance.
    Rmse,
    /// Relative mean squared error, see [`crate::study::relmse`].
    RelMse,
    /// Mean FLIP, see [`crate::study::flip()`].
    Flip,
    /// Structural similarity, see [`crate::study::ssim`]; the only one that is better the greater it is.
    Ssim,
}

impl Metric {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 4] = [Self::Rmse, Self::RelMse, Self::Flip, Self::Ssim];

    /// As people read it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rmse => "RMSE",
            Self::RelMse => "relMSE",
            Self::Flip => "FLIP",
            Self::Ssim => "SSIM",
        }
    }

    /// Its value over blocks that count so often each; 0 where nothing counts. A block with a sum that is no number does
    /// not count.
    pub fn over(self, blocks: &[Block], weights: &[f32]) -> f64 {
        let sum = |part: fn(&Block) -> f32| -> f64 {
            let known = blocks.iter().zip(weights).filter(|(b, _)| b.is_known());
            known.map(|(b, w)| f64::from(part(b)) * f64::from(*w)).sum()
        };
        let per = |part: f64, all: f64| if all > 0.0 { part / all } else { 0.0 };
        match self {
            Self::Rmse => per(sum(|b| b.squared), 3.0 * sum(|b| b.pixels)).max(0.0).sqrt(),
            Self::RelMse => per(sum(|b| b.relative), sum(|b| b.kept)).max(0.0),
            Self::Flip => per(sum(|b| b.flip), sum(|b| b.pixels)),
            Self::Ssim => per(sum(|b| b.similarity), sum(|b| b.windows)),
        }
    }
}

/// A value with the middle 95 % of what it might as well have been.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The value.
    pub value: f64,
    /// Its lower confidence limit.
    pub low: f64,
    /// Its upper confidence limit.
    pub high: f64,
}

/// Draws of blocks with replacement, each as how often every block was drawn.
pub struct Resamples {
    once: Vec<f32>,
    draws: Vec<Vec<f32>>,
}

impl Resamples {
    /// `count` draws for views of so many blocks each, whose blocks stand one view after the other.
    pub fn new(blocks_of_view: &[usize], count: usize) -> Self {
        let total = blocks_of_view.iter().sum();
        // Steele, Lea and Flood, *Fast splittable pseudorandom number generators*, 2014
        let mut state = 0x5EED_u64;
        let mut below = |n: usize| {
            let drawn = splitmix64(state);
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            ((u128::from(drawn) * n as u128) >> 64) as usize
        };
        let draw = |_| {
            let mut weights = vec![0.0; total];
            let mut first = 0;
            for &n in blocks_of_view {
                for _ in 0..n {
                    weights[first + below(n)] += 1.0;
                }
                first += n;
            }
            weights
        };
        Self { once: vec![1.0; total], draws: (0..count).map(draw).collect() }
    }

    /// A value and its 95 % interval; `value` is given how often each block counts. Draws without a finite value are
    /// left out; without any, the interval is the value alone.
    pub fn interval(&self, value: impl Fn(&[f32]) -> f64) -> Interval {
        let middle = value(&self.once);
        let mut all: Vec<f64> = self.draws.iter().map(|w| value(w)).filter(|v| v.is_finite()).collect();
        all.sort_unstable_by(f64::total_cmp);
        let at = |q: f64| match all.len() {
            0 => middle,
            n => all[((q * n as f64) as usize).min(n - 1)],
        };
        Interval { value: middle, low: at(0.025), high: at(0.975) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_has_the_known_interval() {
        // 400 blocks whose FLIP is 0 or 1 by turns: mean 0.5, standard error 0.5/√400 = 0.025
        let blocks: Vec<Block> =
            (0..400).map(|i| Block { pixels: 1.0, flip: (i % 2) as f32, ..Block::default() }).collect();
        let resamples = Resamples::new(&[100, 300], 2000);
        let i = resamples.interval(|w| Metric::Flip.over(&blocks, w));
        assert_eq!(i.value, 0.5);
        assert!((0.5 - i.low - 1.96 * 0.025).abs() < 0.006 && (i.high - 0.5 - 1.96 * 0.025).abs() < 0.006, "{i:?}");
        let paired = resamples.interval(|w| Metric::Flip.over(&blocks, w) / Metric::Flip.over(&blocks, w));
        assert!((paired.high - paired.low).abs() < 1e-12, "a run against itself has no uncertainty");
    }

    #[test]
    fn blocks_survive_their_file() {
        let block = Block { pixels: 256.0, flip: 12.345_67, squared: 1e-9, relative: 3e8, ..Block::default() };
        let text = serde_json::to_string(&block).unwrap();
        assert_eq!(serde_json::from_str::<Block>(&text).unwrap(), block);
    }

    #[test]
    fn metrics_of_constant_errors_have_closed_forms() {
        let block =
            Block { pixels: 4.0, flip: 1.0, squared: 12.0, kept: 4.0, relative: 2.0, windows: 2.0, similarity: 1.0 };
        let values = Metric::ALL.map(|m| m.over(&[block; 3], &[1.0, 2.0, 0.0]));
        assert_eq!(values, [1.0, 0.5, 0.25, 0.5]);
        assert_eq!(Metric::Flip.over(&[], &[]), 0.0);
    }
}
