//! The latitude/longitude projection, exact and fast.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::panorama::Picture;

pub(crate) fn direction(width: usize, height: usize, x: f64, y: f64) -> DVec3 {
    at(longitude(width, x), zenith_angle(height, y))
}

/// Sine and cosine of a column's longitude.
pub(crate) fn longitude(width: usize, x: f64) -> (f64, f64) {
    ((x / width as f64 - 0.5) * TAU).sin_cos()
}

/// Sine and cosine of a row's angle from the zenith.
pub(crate) fn zenith_angle(height: usize, y: f64) -> (f64, f64) {
    (y / height as f64 * PI).sin_cos()
}

/// The direction of a longitude and an angle from the zenith.
pub(crate) fn at((sin_longitude, cos_longitude): (f64, f64), (sin_theta, cos_theta): (f64, f64)) -> DVec3 {
    DVec3::new(sin_theta * sin_longitude, sin_theta * cos_longitude, cos_theta)
}

pub(crate) fn pixel(width: usize, height: usize, d: DVec3) -> DVec2 {
    let longitude = d.x.atan2(d.y);
    let theta = d.x.hypot(d.y).atan2(d.z);
    DVec2::new((longitude / TAU + 0.5) * width as f64, theta / PI * height as f64)
}

/// Ω = 2π/width · (cos θ₀ − cos θ₁), as 2 sin((θ₀+θ₁)/2) sin((θ₁−θ₀)/2), which loses nothing near the poles.
pub(crate) fn solid_angle(width: usize, height: usize, y: usize) -> f64 {
    let middle = (y as f64 + 0.5) / height as f64 * PI;
    let half = 0.5 * PI / height as f64;
    TAU / width as f64 * 2.0 * middle.sin() * half.sin()
}

/// Latitude/longitude pixel coordinates of a direction (camera's axes, any length but zero) in a `w × h` picture, for
/// the inner loops: x in 0..=w, y in 0..=h.
///
/// No branches and no library calls. Off by at most 0.002 pixels at 4096 × 2048, the error of its arctangent and of
/// f32 pixel coordinates together; x and y are as good at the poles as elsewhere.
#[inline]
pub fn latlong_pixel_fast(direction: Vec3, w: f32, h: f32) -> Vec2 {
    use std::f32::consts::{FRAC_1_PI, TAU};
    let d = direction;
    let horizontal = (d.x * d.x + d.y * d.y).sqrt();
    let longitude = arctangent(d.x, d.y);
    let theta = arctangent(horizontal, d.z);
    Vec2::new((longitude * (1.0 / TAU) + 0.5) * w, theta * FRAC_1_PI * h)
}

/// atan2(y, x) to 2·10⁻⁶ radians: an odd polynomial of degree 11 on 0..=1 (least maximal error, by Lawson's reweighted
/// least squares), unfolded over the octants by selection.
#[inline]
fn arctangent(y: f32, x: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, PI};
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ay > ax;
    let t = ax.min(ay) / ax.max(ay).max(f32::MIN_POSITIVE);
    let s = t * t;
    let p = 0.052_647_34 - s * 0.011_719_131;
    let p = -0.116_426_47 + s * p;
    let p = 0.193_540_37 + s * p;
    let p = -0.332_622_83 + s * p;
    let p = t * (0.999_977_2 + s * p);
    let p = if steep { FRAC_PI_2 - p } else { p };
    let p = if x < 0.0 { PI - p } else { p };
    p.copysign(y)
}

/// The pixel at a place that may lie up to a picture's width beyond its sides, and a row beyond its poles: columns go on
/// all around, and beyond a pole lies the other side of its row.
#[inline]
pub(crate) fn pixel_across(width: usize, height: usize, x: i64, y: i64) -> [usize; 2] {
    let (w, h) = (width as i64, height as i64);
    let (x, y) = match y {
        ..0 => (x + w / 2, -1 - y),
        y if y >= h => (x + w / 2, 2 * h - 1 - y),
        y => (x, y),
    };
    // both ends once round at most: no division
    let x = match x {
        ..0 => x + w,
        x if x >= w => x - w,
        x => x,
    };
    [x as usize, y as usize]
}

/// The four pixels around pixel coordinates, by row and column, and where between them the coordinates lie.
#[inline]
pub(crate) fn neighbours(width: usize, height: usize, p: Vec2) -> ([[[usize; 2]; 2]; 2], Vec2) {
    let q = p - 0.5;
    let floor = q.floor();
    let x = (floor.x as i64).clamp(-1, width as i64 - 1);
    let y = (floor.y as i64).clamp(-1, height as i64 - 1);
    let row = |y| [pixel_across(width, height, x, y), pixel_across(width, height, x + 1, y)];
    ([row(y), row(y + 1)], q - floor)
}

/// The picture's value at pixel coordinates, bilinear, also across its sides and poles.
pub(crate) fn bilinear(picture: &Picture, p: Vec2) -> Vec3 {
    let (pixels, fraction) = neighbours(picture.width, picture.height, p);
    let [top, bottom] = pixels.map(|row| {
        let [left, right] = row.map(|[x, y]| picture.pixels[y * picture.width + x]);
        left.lerp(right, fraction.x)
    });
    top.lerp(bottom, fraction.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions spread evenly over the sphere, plus what is next to poles, seam and octant edges.
    fn directions() -> Vec<DVec3> {
        let golden = PI * (3.0 - 5f64.sqrt());
        let spiral = (0..200_000).map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 200_000.0;
            let (sin, cos) = (golden * f64::from(i)).sin_cos();
            DVec3::new((1.0 - z * z).sqrt() * sin, (1.0 - z * z).sqrt() * cos, z)
        });
        let small = [0.0, 1e-30, 1e-9, 1e-5, 1e-3];
        let mut all: Vec<_> = spiral.collect();
        for axis in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 0.0, 1.0)] {
            for a in small {
                for b in small {
                    for sign in [DVec3::ONE, DVec3::new(-1.0, 1.0, -1.0), DVec3::new(1.0, -1.0, -1.0)] {
                        all.push((axis + DVec3::new(a, b, a)) * sign);
                    }
                }
            }
        }
        all
    }

    #[test]
    fn the_fast_pixel_is_the_exact_one() {
        let (w, h) = (4096, 2048);
        let mut worst = 0.0f64;
        for d in directions() {
            // judge the lookup, not the rounding of its input
            let d = d.as_vec3();
            let fast = latlong_pixel_fast(d, w as f32, h as f32).as_dvec2();
            let exact = pixel(w, h, d.as_dvec3());
            let off = fast - exact;
            let x = off.x.abs().min((off.x.abs() - w as f64).abs());
            // right at a pole every column is right
            let x = if d.truncate() == Vec2::ZERO { 0.0 } else { x };
            worst = worst.max(x).max(off.y.abs());
        }
        assert!(worst < 0.002, "{worst} pixels");
    }
}
