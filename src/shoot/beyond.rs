//! Light from where the model has nothing and nobody tells: the open top of a scan, its holes.
//!
//! A scan seldom has the lamps and windows that light it, and photographs taken by hand seldom show them. What records
//! measure does not lie, though: at their places what arrives from all that is known, and the rest from beyond, add up to
//! their irradiance. That gives the mean radiance of what lies beyond.

use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::{PI, TAU};

use super::Light;
use super::records::shaded;
use crate::scene::{Ray, Scene};
use crate::sphere::across;
use crate::statistics::median;

/// Records asked, about, and rays from each.
const PLACES: usize = 384;
const RAYS: usize = 64;

/// A record that sees less of what lies beyond says nothing of it.
const LEAST_SHARE: f32 = 0.1;

/// So many have to say something.
const FEWEST: usize = 16;

impl Light {
    /// Radiance from where the model has nothing and nobody tells, such as the open top of a scan: what the light on
    /// records asks for.
    pub fn beyond(&self, scene: &Scene) -> Vec3 {
        *self.beyond.get_or_init(|| radiance(scene, self))
    }
}

/// What lies beyond, as radiance that is the same from all such directions: per channel the median over records of what
/// they have above what known surfaces and the known sky send them. Black where too few records see any of it: from a closed room nothing
/// tells of what is outside.
fn radiance(scene: &Scene, light: &Light) -> Vec3 {
    let mean = light.mean_radiance();
    let asked: Vec<(Vec3, Vec3, Vec3)> = shaded(&light.records, PLACES).collect();
    let told: Vec<Option<Vec3>> =
        asked.par_iter().map(|&(point, normal, e)| balance(scene, light, mean, point, normal, e)).collect();
    let told: Vec<Vec3> = told.into_iter().flatten().collect();
    if told.len() < FEWEST {
        return Vec3::ZERO;
    }
    let channel = |c: usize| median(told.iter().map(|t| t[c])).unwrap_or(0.0).clamp(0.0, f32::MAX);
    Vec3::new(channel(0), channel(1), channel(2))
}

/// What one record says of the radiance beyond.
fn balance(scene: &Scene, light: &Light, mean: Vec3, point: Vec3, normal: Vec3, e: Vec3) -> Option<Vec3> {
    let (tangent, bitangent) = across(normal);
    let origin = point + normal * (1e-3 + 1e-5 * point.abs().max_element());
    let (mut known, mut open) = (Vec3::ZERO, 0usize);
    for k in 0..RAYS {
        // a cosine's share each: a golden spiral on the disc below
        let u = (k as f32 + 0.5) / RAYS as f32;
        let (sin, cos) = (k as f32 * TAU * 0.381_966_01).sin_cos();
        let direction = (tangent * cos + bitangent * sin) * u.sqrt() + normal * (1.0 - u).sqrt();
        let ray = Ray { origin, direction };
        match scene.tracer.closest(&ray, 1e-4) {
            Some(hit) => {
                let s = scene.surface(&ray, &hit);
                let e = light.nearest(scene, s.position, s.normal);
                let sent = e.map(|e| e * scene.filtered_albedo(s.triangle, s.barycentric, 0.1 * hit.t) / PI);
                known += sent.unwrap_or(mean);
            }
            None => match light.told_sky(direction) {
                Some(radiance) => known += radiance,
                None => open += 1,
            },
        }
    }
    let share = open as f32 / RAYS as f32;
    (share > LEAST_SHARE).then(|| (e / PI - known / RAYS as f32) / share)
}
