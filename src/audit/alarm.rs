//! How often something as strange as a region would turn up in pictures of a right model: its expected number of false alarms.
//!
//! Most of a site's pictures show what is right, and show as well how far a right model is off here: light that is known
//! coarsely, gloss, a scan's own roughness. A region is compared with squares of its size all over the pictures of the
//! site. Its false alarms are the number of such squares times the probability that one of them is as far off (Desolneux,
//! Moisan and Morel, *From Gestalt Theory to Image Analysis*, 2008; Robin, Moisan and Le Hégarat-Mascle, *An a-contrario
//! approach for subpixel change detection in satellite imagery*, PAMI 2010).

use glam::Vec3;
use std::collections::BTreeSet;

use crate::statistics::quantile;

/// What tells that a region is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Statistic {
    /// What the probes saw of a surface against the photograph.
    Place,
    /// The model's albedo under smooth light against the photograph.
    Picture,
    /// Brightness beyond all that is predicted.
    Brightness,
}

/// How far every pixel of a view is off by each statistic.
pub(super) struct Fields {
    width: usize,
    height: usize,
    /// Of each pixel the modelled place.
    position: Vec<Vec3>,
    /// Per statistic; NaN where it says nothing.
    values: [Vec<f32>; 3],
    /// Per statistic, sums over all pixels above and left: of values, and of how many there are.
    sums: [Vec<[f64; 2]>; 3],
}

impl Fields {
    /// Takes a view's values per pixel in the order of [`Statistic`], NaN where a statistic says nothing, and the modelled places.
    pub(super) fn new(width: usize, position: Vec<Vec3>, values: [Vec<f32>; 3]) -> Self {
        let height = position.len() / width.max(1);
        let sums = [0, 1, 2].map(|k| {
            let mut sums = vec![[0.0f64; 2]; (width + 1) * (height + 1)];
            for y in 0..height {
                let mut row = [0.0f64; 2];
                for x in 0..width {
                    let value = values[k][y * width + x];
                    if value.is_finite() {
                        row = [row[0] + f64::from(value), row[1] + 1.0];
                    }
                    let above = sums[y * (width + 1) + x + 1];
                    sums[(y + 1) * (width + 1) + x + 1] = [above[0] + row[0], above[1] + row[1]];
                }
            }
            sums
        });
        Self { width, height, position, values, sums }
    }

    /// Mean over a set of pixels of those that a statistic tells of, and how many they are.
    fn mean(&self, statistic: Statistic, pixels: &[usize]) -> (f64, usize) {
        let values = &self.values[statistic as usize];
        let told = pixels.iter().map(|i| values[*i]).filter(|v| v.is_finite());
        let (sum, n) = told.fold((0.0, 0), |(s, n), v| (s + f64::from(v), n + 1));
        (sum / n.max(1) as f64, n)
    }

    /// Mean over a square; `None` where less than half of it is told of.
    fn square(&self, statistic: Statistic, x: usize, y: usize, side: usize) -> Option<f64> {
        let at = |x: usize, y: usize| self.sums[statistic as usize][y * (self.width + 1) + x];
        let (a, b, c, d) = (at(x, y), at(x + side, y), at(x, y + side), at(x + side, y + side));
        let [sum, n] = [0, 1].map(|k| d[k] - b[k] - c[k] + a[k]);
        (2.0 * n >= (side * side) as f64).then_some(sum / n)
    }
}

/// Squares that hold more than this share of the region's own place are no comparison.
const OWN: f64 = 0.25;

/// The two quantiles of the squares' means that tell how they spread: the tail above the second is as long as it is between both. What
/// fills less than what is above the second does not pull at it.
const SPREAD: [f64; 2] = [0.5, 0.9];

/// The expected number of false alarms of a region of one of the views: of squares of its size in a photograph, where the model is
/// right, that are as far off. `None` where nothing is left to compare it with.
pub(super) fn false_alarms(views: &[&Fields], view: usize, statistic: Statistic, pixels: &[usize]) -> Option<f64> {
    let own = views[view];
    let (mean, told) = own.mean(statistic, pixels);
    if told == 0 {
        return None;
    }
    // the region's own place, in other views, too
    let (low, high) = pixels
        .iter()
        .map(|i| own.position[*i])
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let cell = (high - low).max_element().max(0.05) / 8.0;
    let key = |p: Vec3| (p / cell).floor().as_ivec3().to_array();
    let place: BTreeSet<[i32; 3]> = pixels.iter().map(|i| key(own.position[*i])).collect();
    let largest = (own.width * own.height) as f64 / 16.0;
    let side = (told as f64).min(largest).sqrt().round().max(4.0) as usize;
    let step = side.div_ceil(2);
    let mut means = Vec::new();
    for fields in views {
        if fields.width < side || fields.height < side {
            continue;
        }
        for y in (0..=fields.height - side).step_by(step) {
            for x in (0..=fields.width - side).step_by(step) {
                let Some(m) = fields.square(statistic, x, y, side) else { continue };
                // a grid of places in the square is enough to know whose it is
                let places = (0..36)
                    .map(|k| (y + (2 * (k / 6) + 1) * side / 12) * fields.width + x + (2 * (k % 6) + 1) * side / 12);
                let own = places.filter(|i| place.contains(&key(fields.position[*i]))).count();
                if own as f64 <= OWN * 36.0 {
                    means.push(m as f32);
                }
            }
        }
    }
    if means.len() < 8 {
        return None;
    }
    let usual = SPREAD.map(|q| quantile(&mut means, q).map_or(f64::NAN, f64::from));
    let apart = ((1.0 - SPREAD[0]) / (1.0 - SPREAD[1])).ln();
    let spread = (usual[1] - usual[0]) / apart;
    if spread.is_nan() || spread <= 0.0 {
        return None;
    }
    let tail = (1.0 - SPREAD[1]) * (-(mean - usual[1]) / spread).exp();
    let in_picture = (own.width * own.height) as f64 / (side * side) as f64;
    Some(in_picture * tail.min(1.0))
}
