//! Pinhole cameras with Brown–Conrady distortion.

use glam::{DVec2, DVec3};

use super::Pose;

/// Brown–Conrady lens distortion; all zero is a perfect pinhole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// Radial terms of degree 2, 4 and 6.
    pub k: [f64; 3],
    /// Tangential terms.
    pub p: [f64; 2],
}

/// A posed pinhole camera. Pixel (0, 0) is the top-left pixel's top-left corner; its centre is (0.5, 0.5).
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Where it stands and looks.
    pub pose: Pose,
    /// Picture width in pixels.
    pub width: u32,
    /// Picture height in pixels.
    pub height: u32,
    /// Focal lengths in pixels.
    pub focal: DVec2,
    /// Principal point in pixels.
    pub centre: DVec2,
    /// Lens distortion.
    pub distortion: Distortion,
}

impl Camera {
    /// A distortion-free camera with square pixels and the given vertical field of view in degrees.
    pub fn with_fov(pose: Pose, width: u32, height: u32, fov_y_deg: f64) -> Self {
        let f = 0.5 * f64::from(height) / (0.5 * fov_y_deg.to_radians()).tan();
        Self {
            pose,
            width,
            height,
            focal: DVec2::splat(f),
            centre: DVec2::new(f64::from(width), f64::from(height)) * 0.5,
            distortion: Distortion::default(),
        }
    }

    /// The unit direction, in the program's axes, that pixel coordinates `(x, y)` look along.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let distorted = DVec2::new((x - self.centre.x) / self.focal.x, (self.centre.y - y) / self.focal.y);
        let u = self.distortion.undo(distorted);
        (self.pose.rotation * DVec3::new(u.x, 1.0, u.y)).normalize()
    }

    /// The pixel coordinates of a point (metres, program's axes, same origin as the pose), or `None` behind the camera.
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        let c = self.pose.rotation.transpose() * (point - self.pose.position);
        if c.y <= 0.0 {
            return None;
        }
        let d = self.distortion.apply(DVec2::new(c.x / c.y, c.z / c.y));
        Some(DVec2::new(self.centre.x + self.focal.x * d.x, self.centre.y - self.focal.y * d.y))
    }
}

impl Distortion {
    /// From undistorted to distorted normalised coordinates (x right, y up).
    pub fn apply(&self, u: DVec2) -> DVec2 {
        if *self == Self::default() {
            return u;
        }
        // Brown (1966), in the usual picture axes (y down)
        let (x, y) = (u.x, -u.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k[0] + r2 * (self.k[1] + r2 * self.k[2]));
        let [p1, p2] = self.p;
        DVec2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            -(y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y),
        )
    }

    /// From distorted to undistorted normalised coordinates, by fixed-point iteration.
    pub fn undo(&self, d: DVec2) -> DVec2 {
        if *self == Self::default() {
            return d;
        }
        let mut u = d;
        for _ in 0..30 {
            let step = d - self.apply(u);
            u += step;
            if step.length_squared() < 1e-24 {
                break;
            }
        }
        u
    }
}
