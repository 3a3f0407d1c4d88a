//! How much each test suspects each pixel.

use crate::audit::decide::odds::probability;
use crate::audit::likelihood::appearance::Texture;
use crate::audit::picture::by_luminance::{BINS, Bins};
use crate::audit::view::Observations;
use crate::statistics::quantile;

/// Above these a pixel is marked. Each is some way above the greatest value that faultless models give but for a few
/// pixels at edges, which are too thin to become regions.
pub(crate) const ODDS: f32 = 3.0;
pub(crate) const COLOUR: f32 = 6.5;
pub(crate) const MISMATCH: f32 = 3.0;
pub(crate) const PIXELS_OFF: f32 = 0.7;
pub(crate) const GAIN: f32 = 250.0;
/// How many times better than what is left a displacement must explain a difference.
pub(crate) const RATIO: f32 = 1.0;
/// What is this many times as strong as half of the picture at its brightness is a fault, if it is above the threshold.
const NOISE: f32 = 5.0;
/// A pixel counts as marked from this share of the threshold on.
pub(crate) const LOW: f32 = 0.75;

/// Scores per pixel; 1 is the threshold.
pub(crate) struct Scores {
    pub(crate) texture: Vec<f32>,
    pub(crate) geometry: Vec<f32>,
}

impl Scores {
    pub(crate) fn of(observed: &Observations) -> Self {
        let (t, g) = (&observed.texture, &observed.geometry);
        let n = t.tested.len();
        // what most of the picture has at a brightness is the picture's noise there, and not the model's fault
        let bins = Bins::new(&observed.log_photo);
        let level = |values: &[f32], counts: &dyn Fn(usize) -> bool| bins.quantile(values, 0.5, counts);
        let tested = |i: usize| t.tested[i];
        let over = |values: &[f32], least: f32, times: f32, usual: [f32; BINS]| -> Vec<f32> {
            let of = |i: usize| values[i] / least.max(times * usual[bins.of[i]]);
            (0..n).map(|i| if t.tested[i] { of(i) } else { 0.0 }).collect()
        };
        let colour = over(&t.colour, COLOUR, NOISE, level(&t.colour, &tested));
        let structure = |i: usize| if t.tested[i] { t.structure.odds[i] / ODDS } else { 0.0 };
        let texture: Vec<f32> = (0..n).map(|i| colour[i].max(structure(i))).collect();
        let geometry = (0..n)
            .map(|i| {
                if g.able[i] == 0 {
                    return 0.0;
                }
                let wrong = g.mismatch[i] / MISMATCH;
                let off = g.best_m[i].abs() * g.parallax[i] / PIXELS_OFF;
                let moved = (g.ratio[i] / RATIO).min(g.gain[i] / GAIN).min(off);
                wrong.max(moved)
            })
            .collect();
        Self { texture, geometry }
    }

    /// How much each pixel is suspected by itself: by both scores, and by the logarithm of how much more photograph and model differ around
    /// it than they have in common. Less than `most`: no region bears it out.
    pub(crate) fn suspicion(&self, unlike: &[f32], most: f64) -> Vec<f32> {
        let tests = self.texture.iter().zip(&self.geometry);
        let odds = tests.zip(unlike).map(|((t, g), unlike)| t.ln_1p() + g.ln_1p() + unlike);
        odds.map(|odds| (most * probability(odds)) as f32).collect()
    }
}

/// What three quarters of some pixels have more of than [`crate::audit::likelihood::structure::Structure::lacking`].
pub(crate) fn lacking(t: &Texture, pixels: &[usize]) -> f32 {
    let mut all: Vec<f32> = pixels.iter().filter(|i| t.tested[**i]).map(|i| t.structure.lacking[*i]).collect();
    quantile(&mut all, 0.25).unwrap_or(f32::NEG_INFINITY)
}
