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

/// How far every pixel of a view's picture is off.
pub(crate) struct Field {
    width: usize,
    height: usize,
    /// NaN where nothing can be said.
    values: Vec<f32>,
    /// Sums over all pixels above and left: of values, and of how many there are.
    sums: Vec<[f64; 2]>,
}

impl Field {
    /// Takes a view's values per pixel, NaN where nothing can be said.
    pub(crate) fn new(width: usize, values: Vec<f32>) -> Self {
        let height = values.len() / width.max(1);
        let mut sums = vec![[0.0f64; 2]; (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = [0.0f64; 2];
            for x in 0..width {
                let value = values[y * width + x];
                if value.is_finite() {
                    row = [row[0] + f64::from(value), row[1] + 1.0];
                }
                let above = sums[y * (width + 1) + x + 1];
                sums[(y + 1) * (width + 1) + x + 1] = [above[0] + row[0], above[1] + row[1]];
            }
        }
        Self { width, height, values, sums }
    }

    /// How far a pixel is off, if anything can be said of it.
    pub(crate) fn value(&self, pixel: usize) -> Option<f32> {
        Some(self.values[pixel]).filter(|v| v.is_finite())
    }

    /// Mean over those of a set of pixels that something can be said of, and how many they are.
    fn mean(&self, pixels: &[usize]) -> (f64, usize) {
        let told = pixels.iter().filter_map(|i| self.value(*i));
        let (sum, n) = told.fold((0.0, 0), |(s, n), v| (s + f64::from(v), n + 1));
        (sum / n.max(1) as f64, n)
    }

    /// Mean over a square; `None` where nothing can be said of half of it.
    fn square(&self, x: usize, y: usize, side: usize) -> Option<f64> {
        let at = |x: usize, y: usize| self.sums[y * (self.width + 1) + x];
        let (a, b, c, d) = (at(x, y), at(x + side, y), at(x, y + side), at(x + side, y + side));
        let [sum, n] = [0, 1].map(|k| d[k] - b[k] - c[k] + a[k]);
        (2.0 * n >= (side * side) as f64).then_some(sum / n)
    }
}

/// Squares that hold more than this share of the region's own place are no comparison.
const OWN: f64 = 0.25;

/// The share of the squares that tells how the greatest are spread.
const TAIL: f64 = 0.1;

/// The expected number of false alarms of a region of one of the views: of squares of its size in a photograph, where the model is
/// right, that are as far off; `views` are their fields and each pixel's modelled place. `None` where nothing is left to compare with.
pub(crate) fn expected_squares(views: &[(&Field, &[Vec3])], view: usize, pixels: &[usize]) -> Option<f64> {
    let (own, position) = views[view];
    let (mean, told) = own.mean(pixels);
    if told == 0 {
        return None;
    }
    // the region's own place, in other views, too
    let (low, high) = pixels
        .iter()
        .map(|i| position[*i])
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let cell = (high - low).max_element().max(0.05) / 8.0;
    let key = |p: Vec3| (p / cell).floor().as_ivec3().to_array();
    let place: BTreeSet<[i32; 3]> = pixels.iter().map(|i| key(position[*i])).collect();
    let largest = (own.width * own.height) as f64 / 16.0;
    let side = (told as f64).min(largest).sqrt().round().max(4.0) as usize;
    let step = side.div_ceil(2);
    let mut means = Vec::new();
    for (field, position) in views {
        if field.width < side || field.height < side {
            continue;
        }
        for y in (0..=field.height - side).step_by(step) {
            for x in (0..=field.width - side).step_by(step) {
                let Some(m) = field.square(x, y, side) else { continue };
                // a grid of places in the square is enough to know whose it is
                let places = (0..36)
                    .map(|k| (y + (2 * (k / 6) + 1) * side / 12) * field.width + x + (2 * (k % 6) + 1) * side / 12);
                let own = places.filter(|i| place.contains(&key(position[*i]))).count();
                if own as f64 <= OWN * 36.0 {
                    means.push(m as f32);
                }
            }
        }
    }
    if means.len() < 8 {
        return None;
    }
    let tail = tail(&mut means, mean as f32);
    let in_picture = (own.width * own.height) as f64 / (side * side) as f64;
    Some(in_picture * tail)
}

/// Probability that one of these values would be as great as this: a power of it beyond the value that a share of [`TAIL`] exceeds,
/// as far as those above that are spread (Hill, *A simple general approach to inference about the tail of a distribution*, 1975).
fn tail(values: &mut [f32], value: f32) -> f64 {
    let from = quantile(values, 1.0 - TAIL).unwrap_or(f32::INFINITY).max(1e-6);
    if value <= from {
        return 1.0;
    }
    let above = values.iter().filter(|v| **v > from).map(|v| f64::from(v / from).ln());
    let (sum, n) = above.fold((0.0, 0u32), |(s, n), l| (s + l, n + 1));
    // the few that there are could be spread further by their error
    let spread = sum / f64::from(n.max(1)) * (1.0 + 1.0 / f64::from(n.max(1)).sqrt());
    TAIL * (f64::from(value / from)).powf(-1.0 / spread.max(1e-3))
}
