//! How a probe's records are laid out: rows of cells of nearly equal solid angle.
//!
//! A latitude/longitude picture has as many pixels in its polar rows as at its equator, in far less solid angle. Its
//! chart is therefore a reduced grid: each row holds only as many cells as its solid angle deserves, which saves a
//! share of 1 − 2/π = 36 % of the rays and evens out the records' sizes. A perspective photograph keeps its pixels.

use glam::{DVec2, Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use std::ops::Range;

use crate::panorama::{CameraModel, latlong_pixel_fast};

/// The cells of a probe and the directions they look along, in the probe's axes (+x right, +y forward, +z up).
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    lens: Lens,
    /// Index of each row's first cell, and one past the last.
    starts: Vec<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Lens {
    LatLong,
    /// A rectangle in the plane at distance 1 ahead.
    Plane(Plane),
}

/// A rectangle of tangents, x right and y down.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plane {
    /// The top left corner.
    corner: Vec2,
    /// Width and height.
    size: Vec2,
}

impl Plane {
    /// The unit direction of a share of the width from the left and of the height from the top.
    fn direction(self, u: f32, v: f32) -> Vec3 {
        let p = self.corner + Vec2::new(u, v) * self.size;
        Vec3::new(p.x, 1.0, -p.y).normalize()
    }
}

impl Chart {
    /// The reduced grid of a latitude/longitude picture.
    pub fn latlong(width: usize, height: usize) -> Self {
        let mut starts = vec![0];
        let mut total = 0;
        for row in 0..height {
            let sine = (PI * (row as f32 + 0.5) / height as f32).sin();
            total += ((width as f32 * sine).ceil() as u32).clamp(4.min(width as u32), width as u32);
            starts.push(total);
        }
        Self { lens: Lens::LatLong, starts }
    }

    /// The pixels of a perspective picture with square pixels, its axis in the middle and the given vertical field of view
    /// in radians.
    pub fn perspective(width: usize, height: usize, fov_y: f64) -> Self {
        Self::pinhole(width, height, &CameraModel::with_fov([width as u32, height as u32], fov_y.to_degrees()))
    }

    /// The pixels of a picture by a pinhole camera; its distortion and skew are not heeded.
    pub fn pinhole(width: usize, height: usize, camera: &CameraModel) -> Self {
        let size = DVec2::new(f64::from(camera.size[0]), f64::from(camera.size[1])) / camera.focal;
        let plane = Plane { corner: (-camera.centre / camera.focal).as_vec2(), size: size.as_vec2() };
        Self { lens: Lens::Plane(plane), starts: (0..=height).map(|row| (row * width) as u32).collect() }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.starts[self.rows()] as usize
    }

    /// Whether there is no cell.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// The cells of a row, from left to right.
    pub fn row(&self, row: usize) -> Range<usize> {
        self.starts[row] as usize..self.starts[row + 1] as usize
    }

    /// The direction of the middle of a cell, by its index.
    pub fn middle_of(&self, cell: usize) -> Vec3 {
        let (row, x) = self.row_of(cell);
        self.middle(row, x)
    }

    /// The row of a cell, and its place in that.
    pub fn row_of(&self, cell: usize) -> (usize, usize) {
        let row = self.starts.partition_point(|&start| start as usize <= cell) - 1;
        (row, cell - self.row(row).start)
    }

    /// Whether the left end of a row touches its right end.
    pub fn wraps(&self) -> bool {
        matches!(self.lens, Lens::LatLong)
    }

    /// The unit direction of a place in a row: `x` in cells from the row's left end, `y` in rows from the top.
    pub fn direction(&self, row: usize, x: f32, y: f32) -> Vec3 {
        self.directions(row, y)(x)
    }

    /// The unit directions of the middles of a row's cells, from left to right.
    pub fn middles(&self, row: usize) -> impl Fn(usize) -> Vec3 + use<> {
        let direction = self.directions(row, row as f32 + 0.5);
        move |x| direction(x as f32 + 0.5)
    }

    /// [`Chart::direction`] at one height.
    #[inline]
    fn directions(&self, row: usize, y: f32) -> impl Fn(f32) -> Vec3 + use<> {
        let n = self.row(row).len() as f32;
        let v = y / self.rows() as f32;
        let (sin_theta, cos_theta) = if self.wraps() { (v * PI).sin_cos() } else { (0.0, 0.0) };
        let lens = self.lens;
        move |x| {
            let u = x / n;
            match lens {
                Lens::LatLong => {
                    let (sin_phi, cos_phi) = ((u - 0.5) * TAU).sin_cos();
                    Vec3::new(sin_theta * sin_phi, sin_theta * cos_phi, cos_theta)
                }
                Lens::Plane(plane) => plane.direction(u, v),
            }
        }
    }

    /// How a direction in a row changes over one cell to the right and one row down, to first order.
    pub fn steps(&self, row: usize, d: Vec3) -> (Vec3, Vec3) {
        let (n, rows) = (self.row(row).len() as f32, self.rows() as f32);
        match self.lens {
            Lens::LatLong => {
                let sin_theta = d.x.hypot(d.y).max(1e-6);
                let right = Vec3::new(d.y, -d.x, 0.0) * (TAU / n);
                let down = Vec3::new(d.z * d.x / sin_theta, d.z * d.y / sin_theta, -sin_theta) * (PI / rows);
                (right, down)
            }
            Lens::Plane(Plane { size, .. }) => {
                let right = Vec3::X * (size.x / n * d.y);
                let down = Vec3::NEG_Z * (size.y / rows * d.y);
                (right - d * right.dot(d), down - d * down.dot(d))
            }
        }
    }

    /// The place of a direction (need not be a unit vector): fraction of a row from its left end, and rows from the
    /// top; `None` where the picture does not reach.
    pub fn place(&self, d: Vec3) -> Option<Vec2> {
        match self.lens {
            Lens::LatLong => Some(latlong_pixel_fast(d, 1.0, self.rows() as f32)),
            Lens::Plane(Plane { corner, size }) => {
                let p = (Vec2::new(d.x, -d.z) / d.y - corner) / size;
                (d.y > 0.0 && p.min_element() >= 0.0 && p.max_element() <= 1.0)
                    .then(|| Vec2::new(p.x, p.y * self.rows() as f32))
            }
        }
    }

    /// The direction of the middle of a cell.
    pub fn middle(&self, row: usize, x: usize) -> Vec3 {
        self.direction(row, x as f32 + 0.5, row as f32 + 0.5)
    }

    /// The four cells around a place, with bilinear weights that sum to 1.
    #[inline]
    pub fn around(&self, place: Vec2) -> [(usize, f32); 4] {
        let y = place.y - 0.5;
        let y0 = y.floor();
        let fy = y - y0;
        let last = self.rows() as i32 - 1;
        let top = self.beside(place.x, (y0 as i32).clamp(0, last) as usize);
        let bottom = self.beside(place.x, (y0 as i32 + 1).clamp(0, last) as usize);
        let [(a, wa), (b, wb)] = top;
        let [(c, wc), (d, wd)] = bottom;
        [(a, wa * (1.0 - fy)), (b, wb * (1.0 - fy)), (c, wc * fy), (d, wd * fy)]
    }

    /// The two cells of a row to the left and right of a fraction of it, with linear weights.
    #[inline]
    fn beside(&self, u: f32, row: usize) -> [(usize, f32); 2] {
        let range = self.row(row);
        let n = range.len() as i32;
        let x = u * n as f32 - 0.5;
        let x0 = x.floor();
        let f = x - x0;
        let (left, right) = (x0 as i32, x0 as i32 + 1);
        let (left, right) = if self.wraps() {
            (if left < 0 { left + n } else { left }, if right >= n { right - n } else { right })
        } else {
            (left.max(0), right.min(n - 1))
        };
        [(range.start + left as usize, 1.0 - f), (range.start + right as usize, f)]
    }

    /// The cells of the 3 × 3 neighbourhood of a cell (fewer at a border), with the weights of a tent kernel two cells
    /// in radius.
    pub fn patch(&self, row: usize, x: usize) -> impl Iterator<Item = (usize, f32)> {
        let u = (x as f32 + 0.5) / self.row(row).len() as f32;
        (row.saturating_sub(1)..=(row + 1).min(self.rows() - 1)).flat_map(move |r| {
            let range = self.row(r);
            let n = range.len() as i32;
            let at = u * n as f32 - 0.5;
            // not below −½: rounds to the nearest
            let middle = (at + 0.5) as i32;
            let wy = if r == row { 1.0 } else { 0.5 };
            (middle - 1..=middle + 1).filter_map(move |column| {
                let weight = wy * (1.0 - 0.5 * (column as f32 - at).abs());
                let column = match column {
                    ..0 if self.wraps() => column + n,
                    _ if column >= n && self.wraps() => column - n,
                    _ => column,
                };
                (0..n).contains(&column).then(|| (range.start + column as usize, weight))
            })
        })
    }

    /// Four places near a cell's corners, in cells from its left and top edge. In a reduced row a cell takes pixels that
    /// stick out of it on either side, so its whole width counts.
    pub fn corners(&self) -> [(f32, f32); 4] {
        let (left, right) = match self.lens {
            Lens::LatLong => (0.0, 1.0),
            Lens::Plane(_) => (0.05, 0.95),
        };
        [(left, 0.05), (right, 0.05), (left, 0.95), (right, 0.95)]
    }

    /// Angle between neighbouring rows in radians: the side of a cell.
    pub fn cell_angle(&self) -> f32 {
        match self.lens {
            Lens::LatLong => PI / self.rows() as f32,
            Lens::Plane(Plane { size, .. }) => size.y / self.rows() as f32,
        }
    }
}
