//! Light that a surface may mirror: floors are waxed, stone is polished, paintings are varnished, and no model says so.
//!
//! Everything else here takes surfaces as matt. A smooth dielectric adds to that, towards each eye, what comes from the mirrored
//! direction times its Fresnel reflectance; how much of it a surface shows is not known, but it is no more than that. What photograph and
//! probes differ by within these bounds is no fault of the model.

use glam::Vec3;
use rayon::prelude::*;
use smallvec::SmallVec;
use std::f32::consts::FRAC_1_SQRT_2;

use crate::audit::observe::geometry_buffer::{GeometryBuffer, NONE};
use crate::audit::observe::probe_view::ProbeView;
use crate::panorama::{Picture, luminance};
use crate::render::{Irradiance, Relit};
use crate::scene::Ray;
use crate::volume::Nearby;

/// Reflectance of varnish, wax and polished stone seen straight on: refractive index 1.5.
const STRAIGHT: f32 = 0.04;

/// How wide such surfaces spread what they mirror, radians: rings of directions around the mirrored one.
const LOBE: [f32; 2] = [0.1, 0.25];

/// Sides of the squares of pixels that mirrored light is looked up once for: a streak on a column is not much wider.
const STRIDE: usize = 3;

/// What a view's surfaces may mirror.
pub(crate) struct Gloss<'a> {
    relit: &'a Relit<'a>,
    probes: &'a [ProbeView],
    /// Light through openings.
    beyond: Vec3,
    /// The most that they may mirror towards the camera, per pixel, radiance.
    pub(crate) to_camera: Vec<Vec3>,
}

impl<'a> Gloss<'a> {
    /// Of what the probes saw; what none of them did is relit.
    pub(crate) fn new(relit: &'a Relit<'a>, surfaces: &GeometryBuffer, probes: &'a [ProbeView]) -> Self {
        // through an opening may come, from where no probe stands, the sun itself: as much as the brightest that any saw
        let beyond = probes.iter().map(ProbeView::brightest).fold(Vec3::ZERO, Vec3::max);
        let mut this = Self { relit, probes, beyond, to_camera: Vec::new() };
        this.to_camera = this.towards(surfaces, surfaces.origin, &|_| true);
        this
    }

    /// The most that surfaces may mirror towards an eye, per pixel, radiance; zero where it is not wanted.
    pub(crate) fn towards(
        &self,
        surfaces: &GeometryBuffer,
        eye: Vec3,
        wanted: &(dyn Fn(usize) -> bool + Sync),
    ) -> Vec<Vec3> {
        let (w, h) = (surfaces.width, surfaces.height);
        let wide = w.div_ceil(STRIDE);
        let mut cells = vec![Vec3::ZERO; wide * h.div_ceil(STRIDE)];
        cells.par_chunks_mut(wide).enumerate().for_each(|(row, cells)| {
            let mut scratch = Nearby::default();
            for (column, cell) in cells.iter_mut().enumerate() {
                // one pixel stands for all of a square: its middle, if that is wanted
                let corner = row * STRIDE * w + column * STRIDE;
                let inside = |k: &usize| column * STRIDE + k % STRIDE < w && row * STRIDE + k / STRIDE < h;
                let middle_first = (0..STRIDE * STRIDE).map(|k| (k + STRIDE * STRIDE / 2) % (STRIDE * STRIDE));
                let mut all = middle_first.filter(inside).map(|k| corner + k / STRIDE * w + k % STRIDE);
                if let Some(i) = all.find(|i| surfaces.triangle[*i] != NONE && wanted(*i)) {
                    let (point, normal) = (surfaces.position[i], surfaces.normal[i]);
                    *cell = self.mirrored(point, normal, (point - eye).normalize_or_zero(), &mut scratch);
                }
            }
        });
        (0..w * h).map(|i| cells[i / w / STRIDE * wide + i % w / STRIDE]).collect()
    }

    /// The most that a smooth dielectric mirrors along a direction of view, the brightest of what its lobe reaches.
    fn mirrored(&self, point: Vec3, normal: Vec3, along: Vec3, scratch: &mut Nearby) -> Vec3 {
        let cos = -normal.dot(along);
        if cos.is_nan() || cos <= 0.0 {
            return Vec3::ZERO;
        }
        let middle = along + normal * (2.0 * cos);
        let (a, b) = middle.any_orthonormal_pair();
        // the inner ring along two axes, the outer one between them
        let across = [a, -a, b, -b];
        let between = [a + b, a - b, b - a, -a - b].map(|d| d * FRAC_1_SQRT_2);
        let rings = across.map(|d| d * LOBE[0]).into_iter().chain(between.map(|d| d * LOBE[1]));
        let lobe = std::iter::once(Vec3::ZERO).chain(rings);
        let lights = lobe
            .map(|d| (middle + d).normalize())
            .map(|d| if d.dot(normal) > 0.0 { self.radiance(point, d, scratch) } else { Vec3::ZERO });
        let brightest = lights.fold(Vec3::ZERO, brighter);
        // Schlick, An inexpensive BRDF model for physically-based rendering, 1994
        brightest * (STRAIGHT + (1.0 - STRAIGHT) * (1.0 - cos.min(1.0)).powi(5))
    }

    /// Radiance that arrives at a point from a direction: what the nearest probe saw there, and where none did, what is relit.
    fn radiance(&self, point: Vec3, direction: Vec3, scratch: &mut Nearby) -> Vec3 {
        let (relit, scene) = (self.relit, self.relit.scene);
        let ray = Ray { origin: point, direction };
        let Some(hit) = scene.tracer.closest(&ray, 1e-3) else {
            let told = relit.light.told_sky(direction);
            return told.unwrap_or_else(|| relit.light.beyond(scene, direction)).max(self.beyond);
        };
        let at = point + direction * hit.t;
        // the nearest first, as few as need be
        let mut nearest: SmallVec<[(f32, u32); 32]> =
            self.probes.iter().enumerate().map(|(i, p)| (p.origin.distance_squared(at), i as u32)).collect();
        nearest.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if let Some(light) = nearest.iter().find_map(|(_, i)| self.probes[*i as usize].light_of(at)) {
            return light;
        }
        let s = scene.surface(&ray, &hit);
        let lit = relit.lit(s.position, s.normal, scratch);
        let e = if lit.needs_shadow_ray && relit.in_sun(s.position, s.normal) { lit.sun } else { lit.shade };
        let light = scene.filtered_albedo(s.triangle, s.barycentric, LOBE[0] * hit.t) * e / std::f32::consts::PI;
        if Picture::valid(light) { light } else { Vec3::ZERO }
    }
}

/// By how much a photograph's logarithm may be below and above that of a probe's light, where the surface may mirror so much
/// towards the camera and towards the probe; per channel.
pub(crate) fn bounds(to_camera: Vec3, to_probe: Vec3, light: Vec3) -> [Vec3; 2] {
    /// A surface shows no less than this share of its light by scattering.
    const LEAST: f32 = 0.05;
    let light = light.max(Vec3::splat(1e-30));
    [(Vec3::ONE - to_probe / light).max(Vec3::splat(LEAST)).map(f32::ln), (Vec3::ONE + to_camera / light).map(f32::ln)]
}

/// The brighter of two lights.
fn brighter(a: Vec3, b: Vec3) -> Vec3 {
    if luminance(b) > luminance(a) { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_be_mirrored_widens_what_a_right_model_shows() {
        let [below, above] = bounds(Vec3::splat(1.0), Vec3::splat(0.5), Vec3::splat(1.0));
        assert!((below.x - 0.5f32.ln()).abs() < 1e-6 && (above.x - 2.0f32.ln()).abs() < 1e-6);
        // what is mirrored may be all that is there, nearly
        assert!(bounds(Vec3::splat(1.0), Vec3::splat(0.5), Vec3::splat(0.1))[0].is_finite());
    }
}
