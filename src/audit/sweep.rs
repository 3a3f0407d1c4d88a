//! Where a region's surface fits best, over all pixels that some probe can tell the place of.

use super::geometry::{HERE, SWEEP_M};
use super::regions::{Region, dilated};
use super::view::Maps;

/// A region's cost over the sweep.
pub(super) struct Swept {
    /// Mean cost per probe and pixel at the model's own place.
    pub(super) here: f32,
    /// And at the best one.
    pub(super) least: f32,
    pub(super) best_m: f64,
    pub(super) uncertainty_m: f64,
    /// Pixels of parallax that this is.
    pub(super) pixels: f32,
    /// Share of the region that some probe can tell the place of.
    pub(super) able: f32,
    /// Another place does nearly as well.
    pub(super) twin: Option<f32>,
}

/// Moves a region along its normals and asks which place explains the photograph best.
pub(super) fn sweep(maps: &Maps, region: &Region) -> Swept {
    let (w, h) = maps.size();
    let g = &maps.geometry;
    let mut mask = vec![false; w * h];
    for &i in &region.pixels {
        mask[i] = true;
    }
    let wide = dilated(&mask, w, h, 2);
    let pixels: Vec<usize> = (0..w * h).filter(|i| wide[*i] && g.able[*i] > 0).collect();
    let able = region.pixels.iter().filter(|i| g.able[**i] > 0).count() as f32 / region.pixels.len() as f32;
    let mut weights = 0.0f64;
    let mut sums = vec![0.0f64; SWEEP_M.len()];
    let mut parallax = 0.0f64;
    for &i in &pixels {
        weights += f64::from(g.able[i]);
        parallax += f64::from(g.parallax[i]);
        for (s, sum) in sums.iter_mut().enumerate() {
            *sum += f64::from(g.costs[s][i]);
        }
    }
    let mean: Vec<f64> = sums.iter().map(|s| s / weights.max(1.0)).collect();
    let parallax = parallax / pixels.len().max(1) as f64;
    let at = (0..mean.len()).fold(HERE, |best, k| if mean[k] < mean[best] { k } else { best });
    let (mut best_m, mut curvature) = (f64::from(SWEEP_M[at]), 0.0);
    if at > 0 && at + 1 < mean.len() {
        let x = [at - 1, at, at + 1].map(|k| f64::from(SWEEP_M[k]));
        let y = [at - 1, at, at + 1].map(|k| mean[k]);
        // the parabola through three places
        let a = ((y[2] - y[1]) / (x[2] - x[1]) - (y[1] - y[0]) / (x[1] - x[0])) / (x[2] - x[0]);
        let b = (y[1] - y[0]) / (x[1] - x[0]) - a * (x[0] + x[1]);
        if a > 0.0 {
            best_m = (-b / (2.0 * a)).clamp(x[0], x[2]);
            curvature = 2.0 * a;
        }
    }
    // differences are alike over about 25 pixels; the fit's own error is at least a tenth of a pixel of parallax
    let samples = (pixels.len() as f64 / 25.0).max(1.0);
    let statistical = if curvature > 0.0 { (2.0 * mean[at].max(0.3) / (curvature * samples)).sqrt() } else { 0.25 };
    // and neighbours share it: a small region has more
    let registration = 0.12f64.hypot(0.7 / (pixels.len() as f64 / 100.0).max(1.0).sqrt());
    let uncertainty_m = statistical.hypot(registration / parallax.max(1e-3)).min(0.5);
    let twin = (0..mean.len())
        .filter(|k| k.abs_diff(at) > 3 && *k > 0 && *k + 1 < mean.len())
        .filter(|&k| mean[k] < mean[k - 1] && mean[k] < mean[k + 1])
        .filter(|&k| k != HERE && mean[k] < mean[at] + 0.15 * (mean[HERE] - mean[at]))
        .map(|k| SWEEP_M[k])
        .next();
    Swept {
        here: mean[HERE] as f32,
        least: mean[at] as f32,
        best_m,
        uncertainty_m,
        pixels: (best_m.abs() * parallax) as f32,
        able,
        twin,
    }
}
