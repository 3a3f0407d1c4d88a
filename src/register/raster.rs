//! Cells of a latitude/longitude grid in a picture's own axes: all of the sphere, or the window that a photograph fills.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// A window of a latitude/longitude grid that is `full` cells round and `full / 2` high, with the unit direction of each
/// cell's middle in the picture's axes (+x right, +y forward, +z up). Cells are square at the equator, where the window of
/// a photograph lies.
#[derive(Clone, Debug)]
pub(super) struct Raster {
    /// Cells round the whole sphere.
    pub(super) full: usize,
    /// The window's first column and row.
    pub(super) corner: [usize; 2],
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) directions: Vec<Vec3>,
    /// The sine of the angle from the zenith of each row's middle: a cell's width over its height.
    sines: Vec<f32>,
}

impl Raster {
    pub(super) fn new(full: usize, corner: [usize; 2], width: usize, height: usize) -> Self {
        let directions = (0..width * height)
            .map(|i| {
                direction(
                    full,
                    corner[0] as f32 + (i % width) as f32 + 0.5,
                    corner[1] as f32 + (i / width) as f32 + 0.5,
                )
            })
            .collect();
        let sine = |row: usize| (PI * (corner[1] as f32 + row as f32 + 0.5) / (full / 2) as f32).sin();
        Self { full, corner, width, height, directions, sines: (0..height).map(sine).collect() }
    }

    /// All of the sphere.
    pub(super) fn sphere(full: usize) -> Self {
        Self::new(full, [0, 0], full, full / 2)
    }

    /// The same window on a grid half as fine. The window's corner is even, its last odd column and row are dropped.
    pub(super) fn halved(&self) -> Self {
        Self::new(self.full / 2, self.corner.map(|c| c / 2), self.width / 2, self.height / 2)
    }

    pub(super) fn len(&self) -> usize {
        self.directions.len()
    }

    /// Whether the right end touches the left one.
    pub(super) fn wraps(&self) -> bool {
        self.width == self.full
    }

    /// Angle between the middles of neighbouring rows, radians.
    pub(super) fn cell_angle(&self) -> f32 {
        TAU / self.full as f32
    }

    /// A cell's width over its height.
    pub(super) fn sine(&self, i: usize) -> f32 {
        self.sines[i / self.width]
    }

    /// A cell's neighbours to the left, right, above and below; the cell itself at a border.
    pub(super) fn around(&self, i: usize) -> [usize; 4] {
        let (w, x) = (self.width, i % self.width);
        let seam = if self.wraps() { w - 1 } else { 0 };
        [
            if x > 0 { i - 1 } else { i + seam },
            if x + 1 < w { i + 1 } else { i - seam },
            if i >= w { i - w } else { i },
            if i + w < self.len() { i + w } else { i },
        ]
    }

    /// Whether two neighbours lie on either side of the seam, where a filter over the window ends.
    pub(super) fn seam(&self, i: usize, j: usize) -> bool {
        i / self.width == j / self.width && i.abs_diff(j) + 1 == self.width && self.wraps()
    }

    /// Vectors over the sphere, per radian, across each cell's direction, in the picture's axes, from what changes over one cell
    /// to the right and down. Nothing in the rows by the poles, where cells are slivers.
    pub(super) fn gradient(&self, i: usize, right: f32, down: f32) -> Vec3 {
        let sine = self.sine(i);
        if sine < LEAST_SINE {
            return Vec3::ZERO;
        }
        let d = self.directions[i];
        let east = Vec3::new(d.y, -d.x, 0.0) / d.truncate().length().max(1e-6);
        // d × east is where the next row lies
        (right / sine * east + down * d.cross(east)) / self.cell_angle()
    }

    /// Cell coordinates of a direction in the picture's axes, in the window; `None` outside of it.
    pub(super) fn place(&self, d: Vec3) -> Option<[f32; 2]> {
        let p = crate::panorama::latlong_pixel_fast(d, self.full as f32, (self.full / 2) as f32);
        let x = p.x - self.corner[0] as f32;
        let y = p.y - self.corner[1] as f32;
        let inside = (0.0..=self.width as f32).contains(&x) && (0.0..=self.height as f32).contains(&y);
        inside.then_some([x, y])
    }

    /// Smooths with the kernel 1 2 1 along rows and columns; cells without weight take no part and stay as they are.
    pub(super) fn soften(&self, values: &[f32], weight: &[f32]) -> Vec<f32> {
        if values.is_empty() {
            return Vec::new();
        }
        let (w, h) = (self.width, self.height);
        let (before, after) = if self.wraps() { (w - 1, 0) } else { (0, w - 1) };
        let mut rows = vec![0.0; values.len()];
        for ((out, v), k) in rows.chunks_exact_mut(w).zip(values.chunks_exact(w)).zip(weight.chunks_exact(w)) {
            for (x, out) in out.iter_mut().enumerate() {
                let left = if x > 0 { x - 1 } else { before };
                let right = if x + 1 < w { x + 1 } else { after };
                *out = soft([v[x], v[left], v[right]], [k[x], k[left], k[right]]);
            }
        }
        let mut all = vec![0.0; values.len()];
        for (y, out) in all.chunks_exact_mut(w).enumerate() {
            let of = |y: usize| (&rows[y * w..(y + 1) * w], &weight[y * w..(y + 1) * w]);
            let (above, here, below) = (of(y.saturating_sub(1)), of(y), of((y + 1).min(h - 1)));
            for (x, out) in out.iter_mut().enumerate() {
                *out = soft([here.0[x], above.0[x], below.0[x]], [here.1[x], above.1[x], below.1[x]]);
            }
        }
        all
    }
}

/// The mean of a value, twice as heavy, and of those on either side, of what has weight; the value itself if it has none.
#[inline]
fn soft([v, a, b]: [f32; 3], [weight, of_a, of_b]: [f32; 3]) -> f32 {
    let part = |v: f32, k: f32| if k > 0.0 { (v * 0.25, 0.25) } else { (0.0, 0.0) };
    let (a, b) = (part(a, of_a), part(b, of_b));
    let mean = (v * 0.5 + a.0 + b.0) / (0.5 + a.1 + b.1);
    if weight == 0.0 { v } else { mean }
}

/// Rows nearer to a pole than this sine are not looked at.
pub(super) const LEAST_SINE: f32 = 0.15;

/// The unit direction of grid coordinates, in the picture's axes.
pub(super) fn direction(full: usize, x: f32, y: f32) -> Vec3 {
    let (sin_longitude, cos_longitude) = ((x / full as f32 - 0.5) * TAU).sin_cos();
    let (sin_theta, cos_theta) = (y / (full / 2) as f32 * PI).sin_cos();
    Vec3::new(sin_theta * sin_longitude, sin_theta * cos_longitude, cos_theta)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gradient_of_a_linear_function_is_its_slope_along_the_sphere() {
        let slope = Vec3::new(0.3, -0.8, 0.5);
        for raster in [Raster::sphere(256), Raster::new(512, [190, 100], 120, 80)] {
            let values: Vec<f32> = raster.directions.iter().map(|d| d.dot(slope)).collect();
            let mut asked = 0;
            for i in 0..raster.len() {
                let step = |a: usize, b: usize| (a != i && b != i).then(|| 0.5 * (values[b] - values[a]));
                let [left, right, up, down] = raster.around(i);
                let (Some(right), Some(down)) = (step(left, right), step(up, down)) else { continue };
                if raster.sine(i) < LEAST_SINE {
                    continue;
                }
                let d = raster.directions[i];
                let expected = slope - d * slope.dot(d);
                asked += 1;
                assert!(raster.gradient(i, right, down).distance(expected) < 0.01, "cell {i}");
            }
            assert!(asked > 5_000);
        }
    }

    #[test]
    fn a_cell_s_direction_lies_in_the_cell() {
        for raster in [Raster::sphere(64), Raster::new(256, [96, 40], 64, 48)] {
            for (i, d) in raster.directions.iter().enumerate() {
                let [x, y] = raster.place(*d).unwrap();
                assert_eq!((x as usize, y as usize), (i % raster.width, i / raster.width));
            }
        }
    }
}
