//! Makes the photograph as soft as a probe: the mean over the patch of surface that a probe's pixel sees.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::audit::observe::geometry_buffer::GeometryBuffer;
use crate::audit::observe::photo::Blurred;
use crate::audit::observe::probe_view::{ProbeView, Sight};

/// Taps along each side of a pixel's patch are so many pixels of the photograph apart, but for the fewest.
const SPACING: f32 = 18.0;
const FEWEST: usize = 4;

/// A patch that is longer than this many pixels cannot be compared: the probe sees the surface too flatly.
const LONGEST: f32 = 96.0;

/// A patch with more than this share of itself on another surface or clipped cannot be compared.
const BESIDE: f32 = 0.15;

/// The logarithm of the photograph, per pixel averaged over what a probe's pixel would see around it; NaN where the
/// probe does not see it.
pub(crate) fn soften(
    surfaces: &GeometryBuffer,
    probe: &ProbeView,
    sights: &[Option<Sight>],
    photo: &Blurred,
    usable: &[f32],
) -> Vec<Vec3> {
    (0..sights.len())
        .into_par_iter()
        .map(|i| match &sights[i] {
            Some(_) => at(surfaces, probe, photo, usable, i),
            None => Vec3::NAN,
        })
        .collect()
}

fn at(surfaces: &GeometryBuffer, probe: &ProbeView, photo: &Blurred, usable: &[f32], i: usize) -> Vec3 {
    let (w, h) = (surfaces.width as f32, surfaces.height as f32);
    let (point, normal) = (surfaces.position[i], surfaces.normal[i]);
    let d = point - probe.origin;
    let (right, up) = probe.pixel_sides(d.normalize());
    let plane = normal.dot(d);
    let angle = probe.pixel_angle() * d.length();
    // how far the patch's sides reach in the photograph
    let side = |along: Vec3| -> Option<Vec2> {
        let ray = d + along * angle;
        let across = normal.dot(ray);
        if across >= -1e-6 {
            return None;
        }
        let at = surfaces.project(probe.origin + ray * (plane / across))?;
        let from = surfaces.project(point)?;
        Some(at - from)
    };
    let (Some(u), Some(v)) = (side(right), side(up)) else { return Vec3::NAN };
    let long = u.length().max(v.length());
    if long < 0.5 {
        return photo.at(i, 0.0);
    }
    if long > LONGEST {
        return Vec3::NAN;
    }
    // the finest structure that the taps may step over: their spacing across the patch
    let blur = 0.22 * u.perp_dot(v).abs() / u.length().max(v.length()).max(1e-6);
    let middle = Vec2::new((i % surfaces.width) as f32, (i / surfaces.width) as f32);
    let tolerance = 1.5 * surfaces.distance[i] / surfaces.focal + 2e-3;
    let (mut sum, mut total, mut beside) = (Vec3::ZERO, 0.0, 0.0);
    for (a, wa) in taps(u.length()) {
        for (b, wb) in taps(v.length()) {
            let p = middle + u * a + v * b;
            if p.x < 0.0 || p.y < 0.0 || p.x > w - 1.001 || p.y > h - 1.001 {
                continue;
            }
            let j = p.y.round() as usize * surfaces.width + p.x.round() as usize;
            let apart = normal.dot(surfaces.position[j] - point).abs();
            if usable[j] == 0.0 || apart > tolerance || surfaces.normal[j].dot(normal) < 0.8 {
                beside += wa * wb;
                continue;
            }
            sum += photo.between(p, surfaces.width, blur) * (wa * wb);
            total += wa * wb;
        }
    }
    // the probe's pixel holds what is clipped or lies beside an edge, too, and from its own place more or less of it
    if beside > BESIDE {
        return Vec3::NAN;
    }
    // light is averaged, not its logarithm, but within a pixel the two differ by little
    if total > 0.5 { sum / total } else { Vec3::NAN }
}

/// Places across three pixels of a probe and their weights, which sum to about one: a bilinear look-up of box pixels is a
/// quadratic B-spline.
fn taps(length: f32) -> impl Iterator<Item = (f32, f32)> {
    let n = FEWEST.max((3.0 * length / SPACING).ceil() as usize);
    (0..n).map(move |k| {
        let t = 3.0 * ((k as f32 + 0.5) / n as f32 - 0.5);
        let weight = if t.abs() < 0.5 { 0.75 - t * t } else { 0.5 * (1.5 - t.abs()).powi(2) };
        (t, weight * 3.0 / n as f32)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taps_weigh_one_in_all_and_lie_close() {
        for length in [0.5, 10.0, 24.0, 90.0] {
            let all: Vec<(f32, f32)> = taps(length).collect();
            let sum: f32 = all.iter().map(|t| t.1).sum();
            let mean: f32 = all.iter().map(|t| t.0 * t.1).sum();
            assert!((sum - 1.0).abs() < 0.03 && mean.abs() < 1e-4, "{sum} {mean}");
            assert!(all.windows(2).all(|w| (w[1].0 - w[0].0) * length <= 0.75 * 24.0 + 1e-3));
        }
    }
}
