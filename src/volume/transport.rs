//! Which surfaces light the unseen ones: rays cast from the volume's anchors. Holds no light, so that many lightings
//! share it.

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;

use super::anchors::plastic;
use super::{Anchors, Grid, Guide};
use crate::scene::{Ray, Scene};
use crate::shoot::{Hits, Light};

/// How finely to gather.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Cells along the scene's longest side.
    pub cells: u32,
    /// Rays from each wanted anchor.
    pub rays: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { cells: 64, rays: 192 }
    }
}

/// Rays from anchors to what lights them.
pub struct Transport {
    /// Where the volume's values are.
    pub anchors: Anchors,
    /// For each gathered anchor its index and its rays.
    pub(super) gathered: Vec<(u32, Vec<Carrier>)>,
}

/// One gather ray.
pub(super) struct Carrier {
    /// Direction × weight: Σ over rays of this × radiance is the vector irradiance of a channel.
    pub(super) weight: Vec3,
    /// What the ray found.
    pub(super) from: Source,
}

/// What a gather ray found.
pub(super) enum Source {
    /// The sky.
    Sky(Vec3),
    /// A surface that a probe's cell sees, with its albedo/π.
    Seen { probe: u32, cell: u32, rho: Vec3 },
    /// A surface that no probe sees, with the anchor that stands for it and its albedo/π.
    Unseen { anchor: Option<u32>, position: Vec3, normal: Vec3, rho: Vec3 },
}

impl Transport {
    /// Casts rays from the anchors around `wanted` unseen points (position, normal), then fewer from the unseen places
    /// that those rays find. `lights` only guide the rays to bright places.
    pub fn cast(scene: &Scene, wanted: &[(Vec3, Vec3)], lights: &[&Light], settings: &Settings) -> Self {
        let (low, high) = scene.mesh.bounds();
        let anchors = Anchors::over(scene, Grid::over(low, high, settings.cells));
        let mut wave = anchors.near(wanted);
        let guide = guide(scene, &anchors, &wave, lights);
        let mut known = vec![false; anchors.list.len()];
        let mut gathered: Vec<(u32, Vec<Carrier>)> = Vec::new();
        let Some(hits) = lights.first().map(|l| l.records.iter().map(|r| r.hits()).collect::<Vec<_>>()) else {
            return Self { anchors, gathered };
        };
        for rays in [settings.rays, settings.rays.div_ceil(16)] {
            let caster = Caster { scene, anchors: &anchors, hits: &hits };
            let cast: Vec<_> = wave.par_iter().map(|&a| (a, caster.cast_from(a, &guide, rays))).collect();
            for &a in &wave {
                known[a as usize] = true;
            }
            let links = cast.iter().flat_map(|c| &c.1).filter_map(|c| match c.from {
                Source::Unseen { anchor, .. } => anchor,
                _ => None,
            });
            let mut next: Vec<u32> = links.filter(|&a| !known[a as usize]).collect();
            next.sort_unstable();
            next.dedup();
            gathered.extend(cast);
            wave = next;
        }
        Self { anchors, gathered }
    }
}

struct Caster<'a> {
    scene: &'a Scene,
    anchors: &'a Anchors,
    hits: &'a [&'a Hits],
}

impl Caster<'_> {
    fn cast_from(&self, index: u32, guide: &Guide, rays: u32) -> Vec<Carrier> {
        let anchor = self.anchors.list[index as usize];
        let origin = anchor.position + anchor.normal * self.anchors.lift();
        let lobes = guide.from(origin, anchor.normal);
        let turn = plastic(u64::from(index) * 7919 + 1);
        let share = 1.0 / rays as f32;
        let mut found = Vec::new();
        (0..rays)
            .filter_map(|k| {
                let u = (plastic(u64::from(k)) + turn).fract();
                let (direction, density) = lobes.sample((k as f32 + 0.5) * share, u)?;
                let from = self.look(&Ray { origin, direction }, (share / density).sqrt(), &mut found);
                // the density is bounded below, for the vector's sake: rays along the surface tell nothing of E(n)
                Some(Carrier { weight: direction * (share / density.max(LEAST_DENSITY)), from })
            })
            .collect()
    }

    /// What a ray finds; `spread` is its width per metre.
    fn look(&self, ray: &Ray, spread: f32, found: &mut Vec<super::Weighted>) -> Source {
        let Some(hit) = self.scene.tracer.closest(ray, 1e-4) else { return Source::Sky(ray.direction) };
        let s = self.scene.surface(ray, &hit);
        let rho = self.scene.filtered_albedo(s.triangle, s.barycentric, hit.t * spread) / PI;
        let mut best: Option<(f32, u32, u32)> = None;
        for (probe, hits) in self.hits.iter().enumerate() {
            let fine = hits.fineness(s.position, s.normal);
            if fine > best.map_or(0.0, |b| b.0)
                && let Some(cell) = hits.find(self.scene, s.position, s.normal)
            {
                best = Some((fine, probe as u32, cell));
            }
        }
        if let Some((_, probe, cell)) = best {
            return Source::Seen { probe, cell, rho };
        }
        self.anchors.around(s.position, s.normal, found);
        let near = found.iter().take(4).find(|f| self.anchors.sees(self.scene, f.1, s.position, s.normal));
        Source::Unseen { anchor: near.map(|n| n.1), position: s.position, normal: s.normal, rho }
    }
}

/// Least probability density that a ray's weight is taken from, per steradian: loses 1 % of a uniform light.
const LEAST_DENSITY: f32 = 0.02;

/// A thing is bright if its radiance is so many times the mean.
const BRIGHT: f32 = 3.0;

/// Where rays should go: to what probes saw bright, and what a few blind rays from the anchors find bright.
fn guide(scene: &Scene, anchors: &Anchors, wanted: &[u32], lights: &[&Light]) -> Guide {
    let mut places = Vec::new();
    for light in lights {
        let threshold = BRIGHT * light.mean_radiance().max_element();
        for records in &light.records {
            places.extend(records.bright_places(threshold));
        }
        places.extend(scout(scene, anchors, wanted, light, threshold));
    }
    Guide::new(&anchors.grid, places.into_iter())
}

/// What a few blind rays from each anchor find bright: places and their radiance × area.
fn scout(scene: &Scene, anchors: &Anchors, wanted: &[u32], light: &Light, threshold: f32) -> Vec<(Vec3, f32)> {
    const RAYS: u32 = 32;
    // an anchor sees a small part of the scene: a thing found by few is as bright as one that a probe saw
    let scale = 8.0 / wanted.len().max(1) as f32;
    struct Seen {
        direction: Vec3,
        solid_angle: f32,
        distance: Option<f32>,
        radiance: Vec3,
    }
    let look = |index: u32| -> Vec<(Vec3, f32)> {
        let anchor = anchors.list[index as usize];
        let origin = anchor.position + anchor.normal * anchors.lift();
        let lobes = Guide::default().from(origin, anchor.normal);
        let turn = plastic(u64::from(index) * 104_729 + 1);
        let seen: Vec<Seen> = (0..RAYS)
            .filter_map(|k| {
                let u: Vec2 = (plastic(u64::from(k)) + turn).fract();
                let (direction, density) = lobes.sample(0.5, u)?;
                let ray = Ray { origin, direction };
                let hit = scene.tracer.closest(&ray, 1e-4);
                let radiance = match hit {
                    None => light.sky(direction),
                    Some(hit) => {
                        let s = scene.surface(&ray, &hit);
                        let e = light.observe(scene, s.position, s.normal).map(|o| o.value());
                        let e = e.unwrap_or_else(|| light.direct_sun(scene, s.position, s.normal));
                        e * scene.filtered_albedo(s.triangle, s.barycentric, 0.1 * hit.t) / PI
                    }
                };
                let solid_angle = 1.0 / (density * RAYS as f32);
                Some(Seen { direction, solid_angle, distance: hit.map(|h| h.t), radiance })
            })
            .collect();
        seen.iter()
            .filter(|s| s.radiance.max_element() > threshold)
            .filter_map(|s| {
                // the sky stands as far as the surface found beside it: its window's frame
                let beside = || {
                    let near = seen.iter().filter_map(|o| o.distance.map(|t| (o.direction.dot(s.direction), t)));
                    near.max_by(|a, b| a.0.total_cmp(&b.0)).map(|n| n.1)
                };
                let t = s.distance.or_else(beside)?;
                Some((origin + s.direction * t, s.radiance.element_sum() * s.solid_angle * t * t * scale))
            })
            .collect()
    };
    wanted.par_iter().map(|&index| look(index)).collect::<Vec<_>>().concat()
}
