//! The lens of a photograph in pixels: which pixel looks along which direction.

use glam::{DVec2, DVec3};

use super::distortion::{Distortion, Lens};

/// A calibrated lens before its picture. Directions are in the camera's axes (+x right, +y forward, +z up); pixel (0, 0)
/// is the top-left pixel's top-left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraModel {
    /// Width and height, in pixels, of the picture that the lengths below belong to. A larger or smaller picture of the
    /// same lens is the same picture stretched.
    pub size: [u32; 2],
    /// How ideal coordinates follow from directions.
    pub lens: Lens,
    /// Focal lengths in pixels; of a fisheye, pixels per radian on the axis.
    pub focal: DVec2,
    /// Principal point in pixels.
    pub centre: DVec2,
    /// Pixels to the right per ideal coordinate down: sensors whose columns lean.
    pub skew: f64,
    /// Lens distortion.
    pub distortion: Distortion,
}

impl CameraModel {
    /// Square pixels, no distortion, the axis in the middle, and the given vertical field of view in degrees.
    pub fn with_fov(size: [u32; 2], fov_y_deg: f64) -> Self {
        let f = 0.5 * f64::from(size[1]) / (0.5 * fov_y_deg.to_radians()).tan();
        Self {
            size,
            lens: Lens::Perspective,
            focal: DVec2::splat(f),
            centre: DVec2::new(f64::from(size[0]), f64::from(size[1])) * 0.5,
            skew: 0.0,
            distortion: Distortion::default(),
        }
    }

    /// The same lens before a picture of another size.
    pub fn resized(&self, width: u32, height: u32) -> Self {
        let by = self.stretch(width as usize, height as usize);
        Self {
            size: [width, height],
            focal: self.focal * by,
            centre: self.centre * by,
            skew: self.skew * by.x,
            ..*self
        }
    }

    /// Pixels across and down a picture of this size for one that the lengths belong to.
    pub(crate) fn stretch(&self, width: usize, height: usize) -> DVec2 {
        DVec2::new(width as f64, height as f64) / DVec2::new(f64::from(self.size[0]), f64::from(self.size[1]))
    }

    /// Whether it is a perfect pinhole: directions are linear in pixels before they are normalised.
    pub fn is_pinhole(&self) -> bool {
        self.lens == Lens::Perspective && self.distortion.is_none() && self.skew == 0.0
    }

    /// The unit direction that pixel coordinates `(x, y)` look along. Where the lens [shows nothing](Self::shows), the
    /// direction on the rim of what it shows.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        self.lens.direction(self.distortion.undo_or_rim(self.distorted(x, y)))
    }

    /// Whether the lens shows anything at pixel coordinates `(x, y)`: not where its distortion has folded back, nor
    /// beyond 180° of a fisheye.
    pub fn shows(&self, x: f64, y: f64) -> bool {
        self.is_pinhole()
            || (self.distortion.undo(self.distorted(x, y)))
                .is_some_and(|u| self.lens == Lens::Perspective || u.length() <= std::f64::consts::PI)
    }

    /// The pixel coordinates of a direction of any length but 0, inside the picture's frame or not; `None` where the lens
    /// does not show it: behind a perspective camera, or outside the distortion's domain.
    pub fn pixel(&self, direction: DVec3) -> Option<DVec2> {
        let ideal = self.lens.ideal(direction)?;
        if ideal.length() > self.distortion.limit() {
            return None;
        }
        let d = self.distortion.apply(ideal);
        Some(DVec2::new(self.centre.x + self.focal.x * d.x - self.skew * d.y, self.centre.y - self.focal.y * d.y))
    }

    /// The solid angle, in steradians, between pixel coordinates `low` and `high`. Exact for a pinhole; else by great
    /// circles between 3 × 3 of its points, right to the square of the angle across.
    pub fn solid_angle(&self, low: DVec2, high: DVec2) -> f64 {
        if self.is_pinhole() {
            let x = |x: f64| (x - self.centre.x) / self.focal.x;
            let y = |y: f64| (y - self.centre.y) / self.focal.y;
            return rectangle(x(low.x), x(high.x), y(low.y), y(high.y));
        }
        let at = |i: usize, j: usize| {
            let p = low + (high - low) * DVec2::new(i as f64, j as f64) * 0.5;
            self.direction(p.x, p.y)
        };
        let mut sum = 0.0;
        for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            sum += triangle(a, b, c) + triangle(a, c, d);
        }
        sum
    }

    /// Distorted ideal coordinates (x right, y up) of pixel coordinates.
    fn distorted(&self, x: f64, y: f64) -> DVec2 {
        let up = (self.centre.y - y) / self.focal.y;
        DVec2::new((x - self.centre.x + self.skew * up) / self.focal.x, up)
    }
}

/// Solid angle in steradians of the rectangle [x0, x1] × [y0, y1] in the plane at distance 1: the corners' signed sum of
/// atan(xy / √(1 + x² + y²)).
pub(crate) fn rectangle(x0: f64, x1: f64, y0: f64, y1: f64) -> f64 {
    let corner = |x: f64, y: f64| (x * y).atan2((1.0 + x * x + y * y).sqrt());
    corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)
}

/// The solid angle of a triangle of unit vectors (Van Oosterom and Strackee, *The Solid Angle of a Plane Triangle*,
/// 1983).
fn triangle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

impl Lens {
    /// The unit direction (x right, y forward, z up) of ideal coordinates; a fisheye's beyond π look backwards.
    fn direction(self, u: DVec2) -> DVec3 {
        match self {
            Self::Perspective => DVec3::new(u.x, 1.0, u.y).normalize(),
            Self::Fisheye => {
                let theta = u.length().min(std::f64::consts::PI);
                let (sin, cos) = theta.sin_cos();
                let side = u.normalize_or_zero() * sin;
                DVec3::new(side.x, cos, side.y)
            }
        }
    }

    /// The ideal coordinates of a direction of any length but 0 (x right, y forward, z up); `None` behind a perspective
    /// lens.
    fn ideal(self, c: DVec3) -> Option<DVec2> {
        match self {
            Self::Perspective if c.y > 0.0 => Some(DVec2::new(c.x / c.y, c.z / c.y)),
            Self::Perspective => None,
            Self::Fisheye => {
                let side = DVec2::new(c.x, c.z);
                let length = side.length();
                let theta = length.atan2(c.y);
                if length > 0.0 { Some(side * (theta / length)) } else { (c.y > 0.0).then_some(DVec2::ZERO) }
            }
        }
    }
}
