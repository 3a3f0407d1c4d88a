//! Rendering (paper, section 4.3): one primary ray a sample, irradiance from the records that see the point, else from
//! the volume, times albedo/π.

mod source;

pub use source::Source;

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;

use crate::panorama::Picture;
use crate::scene::{Ray, Scene, Surface};
use crate::shoot::{Observations, Records};
use crate::site::Camera;

/// A relit picture.
pub struct Frame {
    /// Radiance.
    pub radiance: Picture,
    /// Share of each pixel that records light.
    pub seen: Vec<f32>,
}

/// Combines what several probes say about a point; the probe with the finest records counts most.
pub fn combine(records: &[Records], point: Vec3, normal: Vec3, reach: i32) -> Observations {
    let mut sum = Observations::default();
    let mut finest = 0.0f32;
    for probe in records {
        let o = probe.observe(point, normal, reach);
        let fine = probe.fineness(point, normal);
        sum.add(&o, fine * fine);
        if o.shade.weight + o.sun.weight + o.mixed.weight > 0.0 { finest = finest.max(fine); }
    }
    let mut out = Observations::default();
    out.add(&sum, 1.0 / (finest * finest).max(1e-30));
    out
}

/// Irradiance from records; None where no probe sees the point.
pub fn irradiance(scene: &Scene, records: &[Records], surface: &Surface, sun: Option<Vec3>, sun_e: Vec3, reaches: &[i32]) -> Option<Vec3> {
    let min_trust: f32 = *MIN_TRUST;
    let mut lit = None;
    let mut fallback = None;
    for &reach in reaches.iter() {
        let o = combine(records, surface.position, surface.normal, reach);
        let pure = o.shade.weight + o.sun.weight;
        let total = pure + o.mixed.weight;
        if total <= 0.0 { continue; }
        let is_lit = if o.sun.weight + o.mixed.weight < 1e-3 * total { false } else if o.shade.weight + o.mixed.weight < 1e-3 * total { true } else {
            *lit.get_or_insert_with(|| sun.is_some_and(|s| crate::shoot::sunlight::reaches(scene, surface.position, surface.normal, s))) };
        let mine = if is_lit { o.sun } else { o.shade };
        if mine.weight >= 0.02 * total && mine.weight > min_trust {
            return Some(mine.irradiance());
        }
        let cos = sun.map_or(0.0, |s| surface.normal.dot(s).max(0.0));
        if is_lit && o.shade.weight > min_trust { return Some(o.shade.irradiance() + sun_e * cos); }
        if mine.weight > min_trust { fallback = Some(mine.irradiance()); }
    }
    fallback
}
static MIN_TRUST: std::sync::LazyLock<f32> = std::sync::LazyLock::new(|| std::env::var("TRUST").unwrap_or("0".into()).parse().unwrap());

/// Renders a view.
pub fn render(
    scene: &Scene,
    records: &[Records],
    camera: &Camera,
    side: u32,
    sun: Option<Vec3>,
    sun_e: Vec3,
    reaches: &[i32],
    unseen: &(dyn Fn(&Surface) -> Vec3 + Sync),
    sky: &(dyn Fn(Vec3) -> Vec3 + Sync),
) -> Frame {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let origin = scene.local(camera.pose.position);
    let pixel_angle = (1.0 / camera.focal.y) as f32;
    let pixels: Vec<(Vec3, f32)> = (0..w * h)
        .into_par_iter()
        .map(|i| {
            let (px, py) = (i % w, i / w);
            let mut sum = Vec3::ZERO;
            let mut seen = 0.0;
            for s in 0..side * side {
                let at = Vec2::new((s % side) as f32 + 0.5, (s / side) as f32 + 0.5) / side as f32;
                let direction = camera.direction(f64::from(px as f32 + at.x), f64::from(py as f32 + at.y)).as_vec3();
                let ray = Ray { origin, direction };
                let Some(hit) = scene.tracer.closest(&ray, 1e-4) else {
                    sum += sky(direction);
                    seen += 1.0;
                    continue;
                };
                let surface = scene.surface(&ray, &hit);
                let width = hit.t * pixel_angle / side as f32;
                let albedo = scene.pencil_albedo(&surface, direction, width);
                let e = match irradiance(scene, records, &surface, sun, sun_e, reaches) {
                    Some(e) => {
                        seen += 1.0;
                        e
                    }
                    None => unseen(&surface),
                };
                sum += albedo * e / PI;
            }
            let n = (side * side) as f32;
            (sum / n, seen / n)
        })
        .collect();
    let (pixels, seen) = pixels.into_iter().unzip();
    Frame { radiance: Picture { width: w, height: h, pixels }, seen }
}
