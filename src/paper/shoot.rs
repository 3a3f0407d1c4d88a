//! Section 4.1: each panorama pixel becomes an irradiance record on the surface that it sees.

use glam::{Mat3, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;

use crate::panorama::{Picture, Projection};
use crate::scene::{Ray, Scene};

/// Surfaces nearer than this to a probe are taken for its tripod, metres.
const NEAREST_M: f32 = 1e-3;

/// A probe's place, axes and picture.
#[derive(Clone, Copy, Debug)]
pub struct ProbeLight<'a> {
    /// Local metres.
    pub origin: Vec3,
    /// From the probe's axes (+x right, +y forward, +z up) to the program's.
    pub to_world: Mat3,
    /// Radiance.
    pub picture: &'a Picture,
    /// How its pixels map to directions; the paper's is latitude/longitude.
    pub projection: Projection,
}

/// What a k-d tree node stores beside its position X. The radius R is one for all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Unit normal N of the surface, on the probe's side.
    pub normal: Vec3,
    /// Irradiance; NaN in a channel that the surface does not reflect, where radiance tells nothing.
    pub irradiance: Vec3,
}

/// A record at its position, and how far it may be from its neighbour: the distance of neighbouring rays, metres.
pub(super) struct Shot {
    pub(super) position: Vec3,
    pub(super) record: Record,
    pub(super) spacing_m: f32,
}

/// Shoots all pixels of a probe, in the picture's order.
pub(super) fn shoot(scene: &Scene, probe: &ProbeLight, least_albedo: f32) -> Vec<Shot> {
    let picture = probe.picture;
    (0..picture.height)
        .into_par_iter()
        .flat_map_iter(|y| (0..picture.width).filter_map(move |x| shoot_pixel(scene, probe, (x, y), least_albedo)))
        .collect()
}

/// The record of one pixel; none where the pixel is no light (not finite, negative), sees no surface, or sees one that
/// reflects nothing.
fn shoot_pixel(scene: &Scene, probe: &ProbeLight, (x, y): (usize, usize), least_albedo: f32) -> Option<Shot> {
    let ProbeLight { picture: &Picture { width, height, ref pixels }, projection, .. } = *probe;
    let radiance = pixels[y * width + x];
    if !Picture::valid(radiance) {
        return None;
    }
    let direction = projection.direction(width, height, x as f64 + 0.5, y as f64 + 0.5)?.as_vec3();
    let ray = Ray { origin: probe.origin, direction: probe.to_world * direction };
    let hit = scene.tracer.closest(&ray, NEAREST_M)?;
    let surface = scene.surface(&ray, &hit);
    let albedo = scene.albedo(surface.triangle, surface.barycentric);
    let irradiance = irradiance(radiance, albedo, least_albedo)?;
    let record = Record { normal: surface.normal, irradiance };
    let solid_angle = projection.solid_angle(width, height, x, y) as f32;
    Some(Shot { position: surface.position, record, spacing_m: hit.t * solid_angle.sqrt() })
}

/// I_s = I_e/ρ_d, with the π that turns a Lambertian surface's radiance into irradiance: E = πL/ρ. NaN in channels where
/// ρ is zero (or so small that E is no number); `None` where that leaves no channel.
fn irradiance(radiance: Vec3, albedo: Vec3, least_albedo: f32) -> Option<Vec3> {
    let e = PI * radiance / albedo.max(Vec3::splat(least_albedo));
    let known = e.is_finite_mask() & albedo.cmpgt(Vec3::ZERO);
    known.any().then(|| Vec3::select(known, e, Vec3::NAN))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_that_is_not_reflected_tells_nothing() {
        let e = irradiance(Vec3::new(2.0, 2.0, 0.0), Vec3::new(0.5, 0.0, 0.0), 0.05).unwrap();
        assert!((e.x - 4.0 * PI).abs() < 1e-5 && e.y.is_nan() && e.z.is_nan());
        assert!(irradiance(Vec3::ONE, Vec3::ZERO, 0.05).is_none());
        assert!(irradiance(Vec3::ZERO, Vec3::ZERO, 0.0).is_none());
    }

    #[test]
    fn dark_texels_are_lifted_as_far_as_asked() {
        let of = |least| irradiance(Vec3::ONE, Vec3::splat(1e-3), least).map(|e| (e.x / PI).round());
        assert_eq!([of(0.0), of(0.05)], [Some(1000.0), Some(20.0)]);
    }

    #[test]
    fn black_is_light_of_no_strength() {
        assert_eq!(irradiance(Vec3::ZERO, Vec3::ONE, 0.05), Some(Vec3::ZERO));
    }
}
