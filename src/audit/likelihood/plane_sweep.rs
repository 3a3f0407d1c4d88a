//! Where a surface fits best, over all of its pixels that some probe can tell the place of.

use rayon::prelude::*;

use crate::audit::likelihood::photo_consistency::{Geometry, HERE, PLACES, place};
use crate::audit::observe::geometry_buffer::GeometryBuffer;
use crate::audit::observe::probe_view::ProbeView;
use crate::audit::picture::regions::at_most;

/// The place at which a surface fits best.
pub(crate) struct Swept {
    /// Metres along the normal.
    pub(crate) best_m: f64,
    pub(crate) uncertainty_m: f64,
    /// Pixels of parallax a metre.
    pub(crate) parallax: f64,
    /// What photograph and probes differ by in the model's place and in the best, per probe and pixel, in variances.
    pub(crate) here: f64,
    pub(crate) there: f64,
}

impl Swept {
    /// Pixels of parallax that it is off its place by.
    pub(crate) fn pixels(&self) -> f64 {
        self.best_m.abs() * self.parallax
    }
}

/// Moves some pixels' surface along its normals and asks which place explains the photograph best, by so many of them at most.
pub(crate) fn sweep(
    surfaces: &GeometryBuffer,
    g: &Geometry,
    probes: &[ProbeView],
    pixels: impl Iterator<Item = usize>,
    most_px: usize,
) -> Swept {
    // what shows nothing fits no place better than another, and would only hide that the rest does
    let pixels: Vec<usize> = pixels.filter(|i| g.tells(*i)).collect();
    let chosen: Vec<usize> = at_most(&pixels, most_px).collect();
    let weights: f64 = chosen.iter().map(|i| f64::from(g.able[*i])).sum();
    let parallax = chosen.iter().map(|i| f64::from(g.parallax[*i])).sum::<f64>() / chosen.len().max(1) as f64;
    // per probe and pixel
    let cost = |metres: f64| -> f64 {
        let costs = chosen.iter().map(|i| f64::from(g.cost(surfaces, probes, *i, metres as f32)));
        costs.sum::<f64>() / weights.max(1.0)
    };
    let mean: Vec<f64> = (0..PLACES).into_par_iter().map(|k| cost(place(k).into())).collect();
    let at = (0..PLACES).fold(HERE, |best, k| if mean[k] < mean[best] { k } else { best });
    let (mut best_m, mut least, mut curvature) = (f64::from(place(at)), mean[at], 0.0);
    if at > 0 && at + 1 < PLACES {
        // finer between the neighbours, and the parabola through the best three
        const FINE: usize = 16;
        let ends = [at - 1, at + 1].map(|k| f64::from(place(k)));
        let between = |k: usize| ends[0] + (ends[1] - ends[0]) * k as f64 / FINE as f64;
        let fine: Vec<f64> = (0..=FINE).into_par_iter().map(|k| cost(between(k))).collect();
        let k = (1..FINE).fold(1, |best, k| if fine[k] < fine[best] { k } else { best });
        let x = [k - 1, k, k + 1].map(between);
        let y = [k - 1, k, k + 1].map(|k| fine[k]);
        let a = ((y[2] - y[1]) / (x[2] - x[1]) - (y[1] - y[0]) / (x[1] - x[0])) / (x[2] - x[0]);
        let b = (y[1] - y[0]) / (x[1] - x[0]) - a * (x[0] + x[1]);
        if y[1] < least {
            (best_m, least) = (x[1], y[1]);
        }
        if a > 0.0 {
            best_m = (-b / (2.0 * a)).clamp(x[0], x[2]);
            curvature = 2.0 * a;
        }
    }
    // differences are alike over about 25 pixels; the fit's own error is at least a tenth of a pixel of parallax
    let samples = (pixels.len() as f64 / 25.0).max(1.0);
    let statistical = if curvature > 0.0 { (2.0 * least.max(0.3) / (curvature * samples)).sqrt() } else { 0.25 };
    // and neighbours share it: a small region has more
    let registration = 0.12f64.hypot(0.7 / (pixels.len() as f64 / 100.0).max(1.0).sqrt());
    let uncertainty_m = statistical.hypot(registration / parallax.max(1e-3)).min(0.5);
    Swept { best_m, uncertainty_m, parallax, here: mean[HERE], there: least }
}
