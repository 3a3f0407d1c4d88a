//! How much each test suspects each pixel.

use super::geometry::SWEEP_M;
use super::view::Maps;

/// Above these a pixel is marked. Each is some way above the greatest value that faultless models give but for a few
/// pixels at edges, which are too thin to become regions.
pub(super) const LACKING: f32 = 0.6;
pub(super) const SURETY: f32 = 2.2;
pub(super) const COLOUR: f32 = 9.0;
pub(super) const FOREIGN: f32 = 0.16;
pub(super) const MISMATCH: f32 = 5.0;
pub(super) const PIXELS_OFF: f32 = 0.7;
pub(super) const GAIN: f32 = 250.0;
/// How many times better than what is left a displacement must explain a difference.
pub(super) const RATIO: f32 = 1.5;
/// What is this many times as strong as half of the picture at its brightness is a fault, if it is above the threshold.
const NOISE: f32 = 5.0;
/// Logarithm of brightness over the smooth prediction that is no error of the prediction.
const BRIGHTNESS: f32 = 0.4;
/// Brightness that the albedo does not have, from which on it may be a shadow.
pub(super) const SHADING: f32 = 0.25;

/// Scores per pixel; 1 is the threshold.
pub(super) struct Scores {
    pub(super) texture: Vec<f32>,
    pub(super) geometry: Vec<f32>,
    /// The part of the texture's score that is colour, and not structure.
    pub(super) colour: Vec<f32>,
}

impl Scores {
    pub(super) fn of(maps: &Maps) -> Self {
        let (t, g) = (&maps.texture, &maps.geometry);
        let n = t.tested.len();
        // what most of the picture has at a brightness is the picture's noise there, and not the model's fault
        let bins = bins(maps);
        let level = |values: &[f32], counts: &dyn Fn(usize) -> bool| usual(values, &bins, counts);
        let tested = |i: usize| t.tested[i];
        let able = |i: usize| g.able[i] > 0;
        let (colour, foreign) = (level(&t.colour, &tested), level(&t.foreign, &tested));
        let shading = level(&t.shading, &tested);
        let lacking = level(&t.lacking, &|i| t.tested[i] && t.structured[i]);
        let mismatch = level(&g.mismatch, &able);
        let colour: Vec<f32> = (0..n)
            .map(|i| {
                if !t.tested[i] {
                    return 0.0;
                }
                let colour = t.colour[i] / COLOUR.max(NOISE * colour[bins[i]]);
                colour.max(t.foreign[i] / FOREIGN.max(NOISE * foreign[bins[i]]))
            })
            .collect();
        let structure = |i: usize| (t.lacking[i] / LACKING.max(lacking[bins[i]] + 0.45)).min(t.surety[i] / SURETY);
        let texture: Vec<f32> = (0..n).map(|i| if t.tested[i] { colour[i].max(structure(i)) } else { 0.0 }).collect();
        let geometry = (0..n)
            .map(|i| {
                let bridged = maps.bridged[i];
                if g.able[i] == 0 {
                    return bridged;
                }
                let wrong = g.mismatch[i] / MISMATCH.max(NOISE * mismatch[bins[i]]);
                // a probe that differs where the photograph is as the model predicts has another fault
                let shaded =
                    (t.shading[i] / (0.8 * SHADING).max(NOISE * shading[bins[i]])).max(t.brightness[i] / BRIGHTNESS);
                let borne_out = if t.tested[i] { texture[i].max(shaded) } else { 1.0 };
                let off = SWEEP_M[g.best[i] as usize].abs() * g.parallax[i] / PIXELS_OFF;
                let moved = (g.ratio[i] / RATIO).min(g.gain[i] / GAIN).min(off);
                wrong.min(borne_out).max(moved).max(bridged)
            })
            .collect();
        Self { texture, geometry, colour }
    }

    /// The greater of both, to rank pixels by.
    pub(super) fn both(&self) -> Vec<f32> {
        self.texture.iter().zip(&self.geometry).map(|(a, b)| a.max(*b)).collect()
    }
}

/// Bins of brightness.
const BINS: usize = 8;

/// Which eighth of the picture, by brightness, each pixel is in.
fn bins(maps: &Maps) -> Vec<usize> {
    let bright: Vec<f32> = maps.log_photo.iter().map(|p| p.element_sum()).collect();
    let mut sorted: Vec<f32> = bright.iter().copied().filter(|b| b.is_finite()).collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let limits: Vec<f32> = (1..BINS).filter_map(|k| sorted.get(k * sorted.len() / BINS).copied()).collect();
    bright.iter().map(|b| limits.partition_point(|l| l < b)).collect()
}

/// The median of values per bin.
fn usual(values: &[f32], bins: &[usize], counts: &dyn Fn(usize) -> bool) -> [f32; BINS] {
    std::array::from_fn(|bin| {
        let mut all: Vec<f32> = (0..values.len()).filter(|&i| bins[i] == bin && counts(i)).map(|i| values[i]).collect();
        super::median(&mut all)
    })
}
