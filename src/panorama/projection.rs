//! How pixels map to directions and back.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

/// How a picture's pixels map to directions in the camera's axes (+x right, +y forward, +z up).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Latitude/longitude: the centre column looks forward, moving right turns right, the top row is up.
    LatLong,
    /// Debevec's angular map: angle from forward proportional to the distance from the centre, 180° at the rim.
    Angular,
    /// A mirror ball photographed from far away.
    MirrorBall,
    /// Equidistant fisheye: the angle from forward is proportional to the distance from the centre, 90° at the rim.
    Fisheye,
    /// A vertical cube cross, 3 × 4 faces.
    CubeCross,
    /// An ordinary photograph.
    Perspective {
        /// Vertical field of view in radians.
        fov_y: f64,
    },
}

/// Direction of latitude/longitude pixel coordinates: pixel (0, 0) is the top-left pixel's corner.
pub fn latlong_direction(width: usize, height: usize, x: f64, y: f64) -> DVec3 {
    let longitude = (x / width as f64 - 0.5) * TAU;
    let (sin_theta, cos_theta) = (y / height as f64 * PI).sin_cos();
    let (sin, cos) = longitude.sin_cos();
    DVec3::new(sin_theta * sin, sin_theta * cos, cos_theta)
}

/// Latitude/longitude pixel coordinates of a direction of any length but zero.
pub fn latlong_pixel(width: usize, height: usize, d: DVec3) -> DVec2 {
    let longitude = d.x.atan2(d.y);
    let theta = d.x.hypot(d.y).atan2(d.z);
    DVec2::new((longitude / TAU + 0.5) * width as f64, theta / PI * height as f64)
}

/// Solid angle in steradians of any pixel of row `y`: 2π/width · (cos θ₀ − cos θ₁).
pub fn latlong_solid_angle(width: usize, height: usize, y: usize) -> f64 {
    let (top, bottom) = (y as f64 / height as f64 * PI, (y + 1) as f64 / height as f64 * PI);
    // cos a − cos b = 2 sin((a+b)/2) sin((b−a)/2), exact also at the poles
    TAU / width as f64 * 2.0 * (0.5 * (top + bottom)).sin() * (0.5 * (bottom - top)).sin()
}
