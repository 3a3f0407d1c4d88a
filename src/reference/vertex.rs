//! Points where a path meets the model, and rays that leave them without hitting what they start on.

use glam::Vec3;

use crate::scene::{Ray, Scene};

/// Walls that touch a corner begin where a ray from it does. Rays start this far back, in metres, and count hits only from
/// their true origin on.
const RUN_UP: f32 = 2e-4;

/// A point on a surface, seen from one side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    pub(super) position: Vec3,
    /// Unit geometric normal on the side the path came from.
    pub(super) normal: Vec3,
    pub(super) albedo: Vec3,
    pub(super) triangle: u32,
    /// Distance along the ray, metres.
    pub(super) distance: f32,
}

/// The nearest surface along a ray.
pub(super) fn trace(scene: &Scene, ray: &Ray) -> Option<Vertex> {
    let early = Ray { origin: ray.origin - ray.direction * RUN_UP, direction: ray.direction };
    let hit = scene.tracer.closest(&early, RUN_UP)?;
    let surface = scene.surface(&early, &hit);
    // Interpolated from the corners, a point lies on the triangle to the last bits, however far it was seen from
    // (Wächter and Binder 2019, section 6.1)
    let [a, b, c] = scene.mesh.corners(hit.triangle);
    let position = a + (b - a) * surface.barycentric.x + (c - a) * surface.barycentric.y;
    Some(Vertex {
        position,
        normal: surface.normal,
        albedo: scene.albedo(hit.triangle, surface.barycentric).clamp(Vec3::ZERO, Vec3::ONE),
        triangle: hit.triangle,
        distance: hit.t - RUN_UP,
    })
}

/// Whether nothing stands on a ray before `distance` metres, which may be infinite.
pub(super) fn clear(scene: &Scene, origin: Vec3, direction: Vec3, distance: f32) -> bool {
    let early = Ray { origin: origin - direction * RUN_UP, direction };
    !scene.tracer.occluded(&early, RUN_UP, distance + RUN_UP)
}

/// A point moved off its surface, to the side of `normal`, by some 250 units in the last place of each coordinate:
/// enough at every scale, and invisible at all (Wächter and Binder, *A Fast and Robust Method for Avoiding
/// Self-Intersection*, Ray Tracing Gems, 2019, chapter 6).
pub(super) fn off_surface(point: Vec3, normal: Vec3) -> Vec3 {
    const NEAR_ZERO: f32 = 1.0 / 32.0;
    let moved = |p: f32, n: f32| {
        if p.abs() < NEAR_ZERO {
            return p + n / 65536.0;
        }
        let ulps = (256.0 * n) as i32;
        f32::from_bits((p.to_bits() as i32 + if p < 0.0 { -ulps } else { ulps }) as u32)
    };
    Vec3::new(moved(point.x, normal.x), moved(point.y, normal.y), moved(point.z, normal.z))
}

/// A cosine-distributed direction around `normal`: density cos/π.
pub(super) fn cosine_direction(normal: Vec3, u: glam::Vec2) -> Vec3 {
    // Malley: a uniform point of the disk, lifted; the disk by Shirley and Chiu's concentric map, which keeps
    // stratification
    let p = u * 2.0 - 1.0;
    let (r, phi) = if p.x.abs() > p.y.abs() {
        (p.x, std::f32::consts::FRAC_PI_4 * (p.y / p.x))
    } else if p.y == 0.0 {
        (0.0, 0.0)
    } else {
        (p.y, std::f32::consts::FRAC_PI_2 - std::f32::consts::FRAC_PI_4 * (p.x / p.y))
    };
    let (sin, cos) = phi.sin_cos();
    let (x, y) = (r * cos, r * sin);
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    (tangent * x + bitangent * y + normal * z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn points_move_to_the_side_of_the_normal_and_not_far() {
        for p in [Vec3::ZERO, Vec3::new(1.0, -2.0, 3.0), Vec3::new(-500.0, 1e-3, 90.0), Vec3::splat(-1e-5)] {
            for n in [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Z, Vec3::new(0.6, -0.8, 0.0)] {
                let step = off_surface(p, n) - p;
                assert!(step.dot(n) > 0.0, "{p} {n}");
                assert!(step.length() < 6e-5 * p.length().max(1.0), "{p} {n} {step}");
            }
        }
    }

    #[test]
    fn cosine_directions_have_the_cosine_moments() {
        // E[cos] = 2/3, E[cos²] = 1/2, E[tangent] = 0
        let n = Vec3::new(0.3, -0.5, 0.8).normalize();
        let (mut m1, mut m2, mut mean) = (0.0, 0.0, Vec3::ZERO);
        let k = 64;
        for i in 0..k * k {
            let u = Vec2::new(((i % k) as f32 + 0.5) / k as f32, ((i / k) as f32 + 0.5) / k as f32);
            let d = cosine_direction(n, u);
            assert!((d.length() - 1.0).abs() < 1e-5);
            m1 += d.dot(n);
            m2 += d.dot(n).powi(2);
            mean += d;
        }
        let count = (k * k) as f32;
        let (m1, m2) = (m1 / count, m2 / count);
        assert!((m1 - 2.0 / 3.0).abs() < 2e-3 && (m2 - 0.5).abs() < 1e-3, "{m1} {m2}");
        assert!((mean / count - n * (2.0 / 3.0)).length() < 2e-3);
    }
}
