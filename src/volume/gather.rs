//! Fills the volume's anchors by casting rays from them.

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;

use super::anchors::plastic;
use super::{Anchors, Guide, Volume};
use crate::scene::{Ray, Scene, Surface};

/// What a gather ray needs to know of the rest of the program.
pub struct Emitters<'a> {
    /// Radiance of a seen surface towards anywhere, `None` where no probe sees it.
    pub seen: &'a (dyn Fn(&Surface, f32) -> Option<Vec3> + Sync),
    /// Radiance of the sky.
    pub sky: &'a (dyn Fn(Vec3) -> Vec3 + Sync),
    /// Direct sun on a surface (irradiance).
    pub sun: &'a (dyn Fn(&Surface) -> Vec3 + Sync),
    /// Where windows and sun patches are.
    pub guide: &'a Guide,
}

/// The light that one anchor gathers.
struct Gathered {
    vectors: [Vec3; 3],
    /// Rays that met unseen surfaces: (anchor there, albedo/π × share as a vector irradiance weight).
    links: Vec<(u32, Vec3, Vec3)>,
}

/// Gathers at `wanted` anchors, then at the unseen anchors that those see.
pub fn gather(scene: &Scene, anchors: Anchors, wanted: &[u32], light: &Emitters, rays: u32) -> Volume {
    let n = anchors.list.len();
    let mut known = vec![false; n];
    let mut all: Vec<(u32, Gathered)> = Vec::new();
    let mut wave: Vec<u32> = wanted.to_vec();
    wave.sort_unstable();
    wave.dedup();
    for depth in 0..2 {
        let rays = if depth == 0 { rays } else { rays / 8 };
        let got: Vec<Gathered> = wave.par_iter().map(|&a| gather_one(scene, &anchors, a, light, rays.max(1))).collect();
        for &a in &wave {
            known[a as usize] = true;
        }
        let mut next: Vec<u32> = got.iter().flat_map(|g| g.links.iter().map(|l| l.0)).collect();
        next.sort_unstable();
        next.dedup();
        next.retain(|&a| !known[a as usize]);
        all.extend(wave.iter().copied().zip(got));
        wave = next;
    }
    let mut vectors = vec![[Vec3::ZERO; 3]; n];
    for (a, g) in &all {
        vectors[*a as usize] = g.vectors;
    }
    // exchange between unseen places: Jacobi steps of E = D + K E
    for _ in 0..6 {
        let old = vectors.clone();
        for (a, g) in &all {
            let mut v = g.vectors;
            for (b, rho, direction) in &g.links {
                let from = &old[*b as usize];
                let nb = anchors.list[*b as usize].normal;
                for c in 0..3 {
                    v[c] += *direction * (rho[c] * from[c].dot(nb).max(0.0));
                }
            }
            vectors[*a as usize] = v;
        }
    }
    Volume { anchors, vectors, known }
}

fn gather_one(scene: &Scene, anchors: &Anchors, index: u32, light: &Emitters, rays: u32) -> Gathered {
    let anchor = anchors.list[index as usize];
    let origin = anchor.position + anchor.normal * anchors.lift();
    let lobes = light.guide.from(origin, anchor.normal);
    let turn = plastic(u64::from(index) * 7919 + 1);
    let mut vectors = [Vec3::ZERO; 3];
    let mut links = Vec::new();
    let mut found = Vec::new();
    let share = 1.0 / rays as f32;
    for k in 0..rays {
        let u = plastic(u64::from(k));
        let u = Vec2::new((u.x + turn.x).fract(), (u.y + turn.y).fract());
        let Some((direction, density)) = lobes.sample((k as f32 + 0.5) * share, u) else { continue };
        // E(n) = mean L (n·ω)/p; the 1/cos of a blind ray is bounded, for the vector's sake
        let weight = direction * (share / density.max(0.02));
        let ray = Ray { origin, direction };
        let radiance = match scene.tracer.closest(&ray, 1e-4) {
            None => (light.sky)(direction),
            Some(hit) => {
                let surface = scene.surface(&ray, &hit);
                let width = hit.t * (share / density).sqrt();
                match (light.seen)(&surface, width) {
                    Some(l) => l,
                    None => {
                        let rho = scene.filtered_albedo(surface.triangle, surface.barycentric, width) / PI;
                        anchors.around(surface.position, surface.normal, &mut found);
                        let near =
                            found.iter().take(4).find(|f| anchors.sees(scene, f.1, surface.position, surface.normal));
                        if let Some(near) = near {
                            links.push((near.1, rho, weight));
                        }
                        rho * (light.sun)(&surface)
                    }
                }
            }
        };
        for (v, l) in vectors.iter_mut().zip(radiance.to_array()) {
            *v += weight * l;
        }
    }
    Gathered { vectors, links }
}

/// What a few blind rays from each anchor find bright: places and their radiance × area, as a guide wants them.
pub fn scout(
    scene: &Scene,
    anchors: &Anchors,
    wanted: &[u32],
    light: &Emitters,
    rays: u32,
    threshold: f32,
) -> Vec<(Vec3, f32)> {
    let scale = 8.0 / wanted.len().max(1) as f32;
    wanted
        .par_iter()
        .map(|&index| {
            let anchor = anchors.list[index as usize];
            let origin = anchor.position + anchor.normal * anchors.lift();
            let lobes = Guide::default().from(origin, anchor.normal);
            let turn = plastic(u64::from(index) * 104_729 + 1);
            let found: Vec<(Vec3, f32, Option<f32>, Vec3)> = (0..rays)
                .filter_map(|k| {
                    let u = (plastic(u64::from(k)) + turn).fract();
                    let (direction, density) = lobes.sample(0.5, u)?;
                    let ray = Ray { origin, direction };
                    let hit = scene.tracer.closest(&ray, 1e-4);
                    let radiance = match hit {
                        None => (light.sky)(direction),
                        Some(hit) => {
                            let surface = scene.surface(&ray, &hit);
                            (light.seen)(&surface, hit.t * 0.1).unwrap_or((light.sun)(&surface) * 0.1)
                        }
                    };
                    Some((direction, 1.0 / (density * rays as f32), hit.map(|h| h.t), radiance))
                })
                .collect();
            found
                .iter()
                .filter(|f| f.3.max_element() > threshold)
                .filter_map(|&(direction, solid_angle, t, radiance)| {
                    // the sky stands as far as the surface beside it: its window's frame
                    let beside = || {
                        found
                            .iter()
                            .filter_map(|f| f.2.map(|t| (f.0.dot(direction), t)))
                            .max_by(|a, b| a.0.total_cmp(&b.0))
                            .map(|b| b.1)
                    };
                    let t = t.or_else(beside)?;
                    Some((origin + direction * t, radiance.element_sum() * solid_angle * t * t * scale))
                })
                .collect::<Vec<_>>()
        })
        .collect::<Vec<_>>()
        .concat()
}
