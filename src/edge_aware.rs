//! Averages over windows that never cross a surface's edge.

use glam::Vec3;

use crate::components::components;

/// Which neighbouring pixels lie on one surface.
///
/// Averages are recursive filters (Gastal and Oliveira, *Domain transform for edge-aware image and video processing*,
/// 2011, section 4.2.3) whose feedback is cut where two pixels are not joined: linear time for any window, and no value
/// ever crosses from one surface to another.
#[derive(Clone, Debug)]
pub(crate) struct EdgeAware {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Whether a pixel is joined to its right neighbour.
    right: Vec<bool>,
    /// Whether a pixel is joined to the one below.
    down: Vec<bool>,
}

/// Passes of the recursive filter; two leave a kernel that is close enough to a Gaussian.
const PASSES: u32 = 2;

/// Rows that are smoothed side by side: along one, each pixel waits for the one before.
const ABREAST: usize = 8;

impl EdgeAware {
    /// Asks for each pair of neighbours, by their indices, whether they are joined.
    pub(crate) fn new(width: usize, height: usize, joined: impl Fn(usize, usize) -> bool) -> Self {
        let pair = |i: usize, right: bool| {
            let (x, y) = (i % width, i / width);
            if right { x + 1 < width && joined(i, i + 1) } else { y + 1 < height && joined(i, i + width) }
        };
        let all = |right: bool| (0..width * height).map(|i| pair(i, right)).collect();
        Self { width, height, right: all(true), down: all(false) }
    }

    /// All pixels joined: plain averages.
    pub(crate) fn open(width: usize, height: usize) -> Self {
        Self::new(width, height, |_, _| true)
    }

    /// Whether two neighbours, given by their indices, are joined.
    pub(crate) fn joined(&self, i: usize, j: usize) -> bool {
        let (low, high) = (i.min(j), i.max(j));
        match high - low {
            d if d == self.width => self.down[low],
            1 => self.right[low],
            _ => false,
        }
    }

    /// A number for each pixel, the same for all that joins connect, from 0 in the order of their first pixel.
    pub(crate) fn labels(&self) -> Vec<u32> {
        let around = |i: usize| {
            let (left, up) = (i.checked_sub(1), i.checked_sub(self.width));
            [
                self.right[i].then_some(i + 1),
                self.down[i].then_some(i + self.width),
                left.filter(|j| !i.is_multiple_of(self.width) && self.right[*j]),
                up.filter(|j| self.down[*j]),
            ]
            .into_iter()
            .flatten()
        };
        components(self.width * self.height, |_| true, around)
    }

    /// Smooths in place with a kernel of standard deviation `sigma` pixels; sums over a joined region are kept about.
    pub(crate) fn smooth(&self, plane: &mut [f32], sigma: f32) {
        if sigma <= 0.0 {
            return;
        }
        let (w, h) = (self.width, self.height);
        for pass in 0..PASSES {
            let scale = 3f32.sqrt() * 2f32.powi((PASSES - pass - 1) as i32) / (4f32.powi(PASSES as i32) - 1.0).sqrt();
            let a = (-(2f32.sqrt()) / (sigma * scale)).exp();
            for (rows, joined) in plane.chunks_mut(ABREAST * w).zip(self.right.chunks(ABREAST * w)) {
                for x in 1..w {
                    for i in (x..rows.len()).step_by(w) {
                        let a = if joined[i - 1] { a } else { 0.0 };
                        rows[i] += a * (rows[i - 1] - rows[i]);
                    }
                }
                for x in (0..w - 1).rev() {
                    for i in (x..rows.len()).step_by(w) {
                        let a = if joined[i] { a } else { 0.0 };
                        rows[i] += a * (rows[i + 1] - rows[i]);
                    }
                }
            }
            for y in 1..h {
                let (above, here) = plane.split_at_mut(y * w);
                let above = &above[(y - 1) * w..];
                for ((v, u), joined) in here[..w].iter_mut().zip(above).zip(&self.down[(y - 1) * w..]) {
                    let a = if *joined { a } else { 0.0 };
                    *v += a * (u - *v);
                }
            }
            for y in (0..h - 1).rev() {
                let (here, below) = plane.split_at_mut((y + 1) * w);
                let here = &mut here[y * w..];
                for ((v, u), joined) in here.iter_mut().zip(&below[..w]).zip(&self.down[y * w..]) {
                    let a = if *joined { a } else { 0.0 };
                    *v += a * (u - *v);
                }
            }
        }
    }

    /// Sums of `a^|steps|`-weighted values along rows, then along columns, twice, within what is joined: a kernel that is the
    /// same on both sides of every edge, for fits that an uneven one would push aside. Not normalised.
    fn gather(&self, plane: &mut [f32], sigma: f32) {
        let (w, h) = (self.width, self.height);
        // two passes of a two-sided exponential of this decay have the wanted variance
        let a = (-2.0 / sigma.max(0.1)).exp();
        let mut other = vec![0.0; plane.len()];
        for _ in 0..PASSES {
            for ((row, other), joined) in
                plane.chunks_exact_mut(w).zip(other.chunks_exact_mut(w)).zip(self.right.chunks_exact(w))
            {
                for x in (0..w.saturating_sub(1)).rev() {
                    other[x] = if joined[x] { a * (other[x + 1] + row[x + 1]) } else { 0.0 };
                }
                other[w - 1] = 0.0;
                for x in 1..w {
                    row[x] += if joined[x - 1] { a * row[x - 1] } else { 0.0 };
                }
                row.iter_mut().zip(other).for_each(|(v, o)| *v += *o);
            }
            other[(h - 1) * w..].fill(0.0);
            for y in (0..h.saturating_sub(1)).rev() {
                for x in 0..w {
                    let i = y * w + x;
                    other[i] = if self.down[i] { a * (other[i + w] + plane[i + w]) } else { 0.0 };
                }
            }
            for y in 1..h {
                for x in 0..w {
                    let i = y * w + x;
                    if self.down[i - w] {
                        plane[i] += a * plane[i - w];
                    }
                }
            }
            plane.iter_mut().zip(&other).for_each(|(v, o)| *v += *o);
        }
    }

    /// Weighted means of `values` around each pixel by [`gather`](Self::gather)'s kernel; 0 where no weight is near.
    pub(crate) fn even_mean(&self, values: &[f32], weights: &[f32], sigma: f32) -> Vec<f32> {
        let mut weight = weights.to_vec();
        self.gather(&mut weight, sigma);
        let mut sum = weighted(values, weights);
        self.gather(&mut sum, sigma);
        sum.iter().zip(&weight).map(|(s, w)| if *w > 1e-6 { s / w } else { 0.0 }).collect()
    }

    /// The smoothed plane.
    pub(crate) fn smoothed(&self, plane: &[f32], sigma: f32) -> Vec<f32> {
        let mut out = plane.to_vec();
        self.smooth(&mut out, sigma);
        out
    }

    /// Weighted means of `values` around each pixel; 0 where no weight is near.
    pub(crate) fn mean(&self, values: &[f32], weights: &[f32], sigma: f32) -> Vec<f32> {
        let weight = self.smoothed(weights, sigma);
        self.mean_with(values, weights, &weight, sigma)
    }

    /// The same, where the weights have been smoothed already.
    pub(crate) fn mean_with(&self, values: &[f32], weights: &[f32], smoothed: &[f32], sigma: f32) -> Vec<f32> {
        let mut sum = weighted(values, weights);
        self.smooth(&mut sum, sigma);
        for (s, w) in sum.iter_mut().zip(smoothed) {
            *s = if *w > 1e-4 { *s / w } else { 0.0 };
        }
        sum
    }

    /// The same of colours, channel by channel.
    pub(crate) fn mean_colour_with(&self, values: &[Vec3], weights: &[f32], smoothed: &[f32], sigma: f32) -> Vec<Vec3> {
        let [r, g, b] = [0, 1, 2].map(|c| {
            let channel: Vec<f32> = values.iter().map(|v| v[c]).collect();
            self.mean_with(&channel, weights, smoothed, sigma)
        });
        (0..values.len()).map(|i| Vec3::new(r[i], g[i], b[i])).collect()
    }

    /// Pixels all of whose neighbours up to `radius` steps along rows and columns are joined to them.
    pub(crate) fn inside(&self, radius: usize) -> Vec<bool> {
        let (w, h) = (self.width, self.height);
        let mut inside = vec![true; w * h];
        for _ in 0..radius {
            let goes_on = |i: usize, j: usize| self.joined(i, j) && inside[j];
            inside = (0..w * h)
                .map(|i| {
                    let (x, y) = (i % w, i / w);
                    (x == 0 || goes_on(i, i - 1))
                        && (x + 1 >= w || goes_on(i, i + 1))
                        && (y == 0 || goes_on(i, i - w))
                        && (y + 1 >= h || goes_on(i, i + w))
                })
                .collect();
        }
        inside
    }
}

/// Values times their weights; what has none may be no number.
fn weighted(values: &[f32], weights: &[f32]) -> Vec<f32> {
    values.iter().zip(weights).map(|(v, w)| if *w > 0.0 { v * w } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_crosses_an_edge() {
        let joins = EdgeAware::new(40, 30, |i, j| (i % 40 < 20) == (j % 40 < 20));
        let plane: Vec<f32> = (0..1200).map(|i| if i % 40 < 20 { 1.0 } else { 5.0 }).collect();
        let out = joins.smoothed(&plane, 8.0);
        assert!(out.iter().zip(&plane).all(|(a, b)| (a - b).abs() < 1e-4));
    }

    #[test]
    fn the_kernel_has_the_width_asked_for() {
        for sigma in [1.5f32, 4.0, 9.0] {
            let mut plane = vec![0.0; 201 * 201];
            plane[100 * 201 + 100] = 1.0;
            EdgeAware::open(201, 201).smooth(&mut plane, sigma);
            let sum: f32 = plane.iter().sum();
            let spread: f32 =
                plane.iter().enumerate().map(|(i, v)| v * ((i % 201) as f32 - 100.0).powi(2)).sum::<f32>() / sum;
            assert!((sum - 1.0).abs() < 0.02, "{sum}");
            assert!((spread.sqrt() / sigma - 1.0).abs() < 0.2, "{} for {sigma}", spread.sqrt());
        }
    }

    #[test]
    fn means_leave_out_what_has_no_weight() {
        let joins = EdgeAware::open(20, 20);
        let values: Vec<f32> = (0..400).map(|i| if i % 3 == 0 { f32::NAN } else { 2.0 }).collect();
        let weights: Vec<f32> = (0..400).map(|i| if i % 3 == 0 { 0.0 } else { 1.0 }).collect();
        assert!(joins.mean(&values, &weights, 3.0).iter().all(|v| (v - 2.0).abs() < 1e-4));
    }
}
