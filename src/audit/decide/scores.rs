//! How much each test suspects each pixel.

use crate::audit::decide::odds::probability;
use crate::audit::likelihood::agreement::{Unlike, near};
use crate::audit::likelihood::appearance::Texture;
use crate::audit::picture::by_luminance::{BINS, Bins};
use crate::audit::picture::{ODDS, POSE_PX};
use crate::audit::view::Observations;
use crate::statistics::quantile;

/// Above these a pixel is marked. Each is some way above the greatest value that faultless models give but for a few
/// pixels at edges, which are too thin to become regions.
pub(crate) const COLOUR: f32 = 6.5;
pub(crate) const MISMATCH: f32 = 3.0;
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
                let off = g.best_m[i].abs() * g.parallax[i] / POSE_PX;
                let moved = g.ratio[i].min(off);
                wrong.max(moved)
            })
            .collect();
        Self { texture, geometry }
    }

    /// What each pixel adds by itself to the logarithm of the odds of a fault: by both scores, and by how much more photograph and model
    /// differ around it than they have in common, in the mean of all bands.
    pub(crate) fn own(&self, unlike: &Unlike) -> Vec<f32> {
        let bands = |i: usize| unlike.iter().map(|band| band[i]).sum::<f32>() / unlike.len() as f32;
        let tests = self.texture.iter().zip(&self.geometry).enumerate();
        // half of it, since they see the same differences
        tests.map(|(i, (t, g))| 0.5 * (t.ln_1p() + g.ln_1p() + bands(i))).collect()
    }
}

/// How much each pixel is suspected, 0..=1: by the likeliest region that is told and has it, and by itself, the odds of both together; in
/// none, by itself alone and less than `least`, the least that a region is told with, or by as small a share of the odds of a region near it.
pub(crate) fn suspicion<'a>(
    own: &[f32],
    width: usize,
    told: impl Iterator<Item = (&'a [usize], f32)>,
    least: f64,
) -> Vec<f32> {
    let mut all: Vec<f32> = own.iter().map(|own| (least * probability(*own)) as f32).collect();
    let mut told: Vec<(&[usize], f32)> = told.collect();
    // the likeliest has the last word
    told.sort_by(|a, b| a.1.total_cmp(&b.1));
    let with = |log_odds: f32, i: usize| probability(log_odds + own[i]) as f32;
    for (region, log_odds) in &told {
        let near = near(region, width, own.len());
        let beside = log_odds + least.ln() as f32;
        (0..own.len()).filter(|i| near[*i]).for_each(|i| all[i] = all[i].max(with(beside, i)));
    }
    for (region, log_odds) in &told {
        region.iter().for_each(|i| all[*i] = with(*log_odds, *i));
    }
    all
}

/// What three quarters of some pixels have more of than [`crate::audit::likelihood::structure::Structure::lacking`].
pub(crate) fn lacking(t: &Texture, pixels: &[usize]) -> f32 {
    let mut all: Vec<f32> = pixels.iter().filter(|i| t.tested[**i]).map(|i| t.structure.lacking[*i]).collect();
    quantile(&mut all, 0.25).unwrap_or(f32::NEG_INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_is_suspected_first_and_in_it_what_stands_out() {
        let mut own = vec![9.0; 100];
        own[..3].copy_from_slice(&[3.0, -1.0, 0.0]);
        own[99] = -9.0;
        let (sure, doubt) = ([0], [1, 2]);
        let all = suspicion(&own, 100, [(&sure[..], 2.0), (&doubt[..], -1.0)].into_iter(), 0.1);
        // what is in none is told with the likeliest near it, by a tenth of its odds
        let expected = [5.0, -2.0, -1.0, 2.0 + 0.1f64.ln() as f32 + 9.0].map(|odds| probability(odds) as f32);
        assert_eq!(all[..4], expected);
        // near none, however much it stands out, less than the least that is told
        assert!(all[99] < all[98] && all[98] < 0.1 && all[3] > 0.9, "{all:?}");
    }
}
