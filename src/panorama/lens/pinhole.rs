//! The perspective projection of an undistorted photograph.

use glam::{DVec2, DVec3};

fn focal(fov_y: f64, height: usize) -> f64 {
    0.5 * height as f64 / (0.5 * fov_y).tan()
}

pub(crate) fn direction(fov_y: f64, width: usize, height: usize, x: f64, y: f64) -> DVec3 {
    let f = focal(fov_y, height);
    DVec3::new((x - 0.5 * width as f64) / f, 1.0, (0.5 * height as f64 - y) / f).normalize()
}

pub(crate) fn pixel(fov_y: f64, width: usize, height: usize, d: DVec3) -> Option<DVec2> {
    if d.y <= 0.0 {
        return None;
    }
    let f = focal(fov_y, height);
    let p = DVec2::new(0.5 * width as f64 + f * d.x / d.y, 0.5 * height as f64 - f * d.z / d.y);
    let inside = (0.0..=width as f64).contains(&p.x) && (0.0..=height as f64).contains(&p.y);
    inside.then_some(p)
}

pub(crate) fn solid_angle(fov_y: f64, width: usize, height: usize, x: usize, y: usize) -> f64 {
    let f = focal(fov_y, height);
    let a = |x: usize| (x as f64 - 0.5 * width as f64) / f;
    let b = |y: usize| (y as f64 - 0.5 * height as f64) / f;
    rectangle(a(x), a(x + 1), b(y), b(y + 1))
}

/// Solid angle in steradians of the rectangle [x0, x1] × [y0, y1] in the plane at distance 1: the corners' signed sum of
/// atan(xy / √(1 + x² + y²)).
pub(crate) fn rectangle(x0: f64, x1: f64, y0: f64, y1: f64) -> f64 {
    let corner = |x: f64, y: f64| (x * y).atan2((1.0 + x * x + y * y).sqrt());
    corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)
}
