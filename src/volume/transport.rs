//! Which surfaces light the unseen ones: rays cast from the volume's anchors. Holds no light, so that many lightings
//! share it.

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f32::consts::PI;

use super::anchors::plastic;
use super::smooth::Beside;
use super::{Anchor, Anchors, Grid, Guide};
use crate::scene::{Ray, Scene, Surface};
use crate::shoot::{Light, sunlight};

/// How finely to gather.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Cells along the scene's longest side.
    pub cells: u32,
    /// Rays from each wanted anchor, on average: those that light more of what is shown get more.
    pub rays: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { cells: 64, rays: 96 }
    }
}

/// Rays from anchors to what lights them.
pub struct Transport {
    /// Where the volume's values are.
    pub anchors: Anchors,
    /// The direction towards the sun that [`Unseen::sunlit`] was found for.
    pub(super) sun: Option<Vec3>,
    /// What each gathered anchor sees.
    pub(super) gathered: Vec<Gathered>,
    /// For each anchor the index of the gathered place that stands for it, or [`NONE`].
    pub(super) places: Vec<u32>,
    /// Which gathered places lie beside each other.
    pub(super) beside: Beside,
}

/// What the rays from one anchor found. A ray's weight is its direction × its share of the hemisphere: Σ over rays of
/// weight × radiance is the vector irradiance of a channel.
pub(super) struct Gathered {
    pub(super) anchor: u32,
    /// Number of rays cast.
    pub(super) rays: u32,
    pub(super) sky: Vec<Sky>,
    pub(super) seen: Vec<Seen>,
    pub(super) unseen: Vec<Unseen>,
    /// The unseen surfaces for which another gathered place stands, added up by place, in order.
    pub(super) links: Vec<Link>,
}

/// A ray into the sky.
pub(super) struct Sky {
    pub(super) weight: Vec3,
    pub(super) direction: Vec3,
}

/// A ray to a surface that a probe's cell sees, with its albedo/π.
pub(super) struct Seen {
    pub(super) weight: Vec3,
    pub(super) rho: Vec3,
    pub(super) probe: u32,
    pub(super) cell: u32,
}

/// A ray to a surface that no probe sees, with its albedo/π.
pub(super) struct Unseen {
    pub(super) weight: Vec3,
    pub(super) rho: Vec3,
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    /// Whether the sun reaches it.
    pub(super) sunlit: bool,
    /// The anchor that speaks for it, and whether that is linked: then it holds all but direct sun.
    anchor: Option<u32>,
    pub(super) linked: bool,
}

/// Light from another gathered place.
pub(super) struct Link {
    /// Index of the other among the gathered.
    pub(super) other: u32,
    /// Per channel Σ weight × albedo/π: times the other's irradiance this is vector irradiance.
    pub(super) weights: [Vec3; 3],
}

/// A ray follows one of at most so many of the guide's spheres.
const MOST_SPHERES: usize = 64;

/// No gathered place.
const NONE: u32 = u32::MAX;

/// Unseen surfaces that are only found by rays get so many times fewer rays of their own.
const FEWER: u32 = 6;

impl Transport {
    /// Casts rays from the anchors around `wanted` unseen points (position, normal), then fewer from the unseen places
    /// that those rays find. `lights` guide the rays to bright places, and the first tells where the sun stands.
    pub fn cast(scene: &Scene, wanted: &[(Vec3, Vec3)], lights: &[&Light], settings: &Settings) -> Self {
        let (low, high) = scene.mesh.bounds();
        let mut anchors = Anchors::over(scene, Grid::over(low, high, settings.cells));
        anchors.complete(scene, wanted);
        let sun = lights.iter().find_map(|l| l.sun).map(|s| s.direction);
        let Some(&light) = lights.first() else {
            let places = vec![NONE; anchors.list.len()];
            return Self { anchors, sun, gathered: Vec::new(), places, beside: Beside::default() };
        };
        let near = anchors.near(scene, wanted);
        let first: Vec<u32> = near.iter().map(|n| n.0).collect();
        let rays = shared_out(settings.rays, &near);
        let guide = guide(scene, &anchors, &first, lights);
        let caster = Caster { scene, anchors: &anchors, light, guide: &guide, sun };
        let mut gathered = caster.wave(&first, &rays);
        let mut places = vec![NONE; anchors.list.len()];
        for (i, &a) in first.iter().enumerate() {
            places[a as usize] = i as u32;
        }
        let second = caster.second(&gathered, &mut places);
        let few = vec![settings.rays.div_ceil(FEWER); second.len()];
        gathered.extend(caster.wave(&second, &few));
        caster.link(&mut gathered, &mut places);
        let beside = Beside::find(scene, &anchors, &gathered, &places);
        Self { anchors, sun, gathered, places, beside }
    }
}

/// Rays for each anchor, about `mean` on average. An error is seen as often as the anchor counts, and falls with the root of
/// the number of rays: the sum of its squares is least for rays as the root of what an anchor counts (Neyman, *On the
/// two different aspects of the representative method*, 1934, with the same spread everywhere).
fn shared_out(mean: u32, near: &[(u32, f32)]) -> Vec<u32> {
    /// Least and most rays, of the mean.
    const LEAST: f32 = 0.2;
    const MOST: f32 = 3.0;
    /// Rays come in such lots, so that a point more or less seldom turns an anchor's rays another way.
    const LOT: f32 = 12.0;
    let mean = mean as f32;
    let per_root = mean * near.len() as f32 / near.iter().map(|n| n.1.sqrt()).sum::<f32>();
    let rays = |counts: f32| (counts.sqrt() * per_root).clamp(LEAST * mean, MOST * mean);
    near.iter().map(|n| ((rays(n.1) / LOT).ceil() * LOT) as u32).collect()
}

struct Caster<'a> {
    scene: &'a Scene,
    anchors: &'a Anchors,
    light: &'a Light,
    guide: &'a Guide,
    sun: Option<Vec3>,
}

impl Caster<'_> {
    /// Gathers for anchors with so many rays for each. Anchors close together share what they know of the guide's spheres:
    /// which of them they see.
    fn wave(&self, wave: &[u32], rays: &[u32]) -> Vec<Gathered> {
        let mut groups: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
        for (i, &anchor) in wave.iter().enumerate() {
            groups.entry(self.anchors.neighbourhood(anchor)).or_default().push(i as u32);
        }
        let groups: Vec<Vec<u32>> = groups.into_values().collect();
        let mut cast: Vec<(u32, Gathered)> = groups
            .par_iter()
            .flat_map_iter(|group| {
                let first = self.anchors.list[wave[group[0] as usize] as usize];
                let origin = first.position + first.normal * self.anchors.lift();
                let most = MOST_SPHERES.min(rays[group[0] as usize] as usize / 2);
                let spheres = self.guide.clear(self.scene, origin, first.normal, most);
                group.iter().map(move |&i| (i, self.cast_from(wave[i as usize], &spheres, rays[i as usize])))
            })
            .collect();
        cast.sort_unstable_by_key(|c| c.0);
        cast.into_iter().map(|c| c.1).collect()
    }

    fn cast_from(&self, index: u32, spheres: &[(u32, f32)], rays: u32) -> Gathered {
        let anchor = self.anchors.list[index as usize];
        let origin = anchor.position + anchor.normal * self.anchors.lift();
        let lobes = self.guide.of(origin, anchor.normal, spheres);
        let turn = plastic(self.anchors.seed(index) * 7919 + 1);
        let share = 1.0 / rays as f32;
        let mut all = Gathered { anchor: index, rays, sky: vec![], seen: vec![], unseen: vec![], links: vec![] };
        for k in 0..rays {
            let u = (plastic(u64::from(k)) + turn).fract();
            let Some((direction, density)) = lobes.sample((k as f32 + 0.5) * share, u) else { continue };
            // the density is bounded below, for the vector's sake: rays along the surface tell nothing of E(n)
            let weight = direction * (share / density.max(LEAST_DENSITY));
            self.look(&Ray { origin, direction }, (share / density).sqrt(), weight, &mut all);
        }
        all
    }

    /// Adds what a ray finds; `spread` is its width per metre.
    fn look(&self, ray: &Ray, spread: f32, weight: Vec3, all: &mut Gathered) {
        let Some(hit) = self.scene.tracer.closest(ray, 1e-4) else {
            all.sky.push(Sky { weight, direction: ray.direction });
            return;
        };
        let face = self.scene.face(hit.triangle);
        let s = face.surface(ray, hit.t);
        let rho = self.scene.paint(&face, true).rough_albedo(s.barycentric, hit.t * spread) / PI;
        if let Some((probe, cell)) = self.light.finest(self.scene, s.position, s.normal) {
            all.seen.push(Seen { weight, rho, probe, cell });
            return;
        }
        let Surface { position, normal, .. } = s;
        let sunlit = self.sun.is_some_and(|sun| sunlight::reaches(self.scene, position, normal, sun));
        let anchor = self.anchors.speaker(self.scene, position, normal);
        all.unseen.push(Unseen { weight, rho, position, normal, sunlit, anchor, linked: false });
    }

    /// Which anchors to gather for besides: of those that the rays found, most often first, the ones that no gathered
    /// place stands in for. `places` holds for each anchor the index of the gathered place that stands for it.
    fn second(&self, gathered: &[Gathered], places: &mut [u32]) -> Vec<u32> {
        let mut calls = vec![0u32; places.len()];
        for anchor in gathered.iter().flat_map(|g| &g.unseen).filter_map(|u| u.anchor) {
            calls[anchor as usize] += 1;
        }
        let mut called: Vec<u32> =
            (0..places.len() as u32).filter(|&a| calls[a as usize] > 0 && places[a as usize] == NONE).collect();
        called.sort_by_key(|&a| std::cmp::Reverse(calls[a as usize]));
        let mut second = Vec::new();
        let mut found = Vec::new();
        for anchor in called {
            places[anchor as usize] = self.stand_in(anchor, places, &mut found).unwrap_or_else(|| {
                second.push(anchor);
                (gathered.len() + second.len() - 1) as u32
            });
        }
        second
    }

    /// The gathered place that stands in for an anchor that was not gathered.
    fn stand_in(&self, anchor: u32, places: &[u32], found: &mut Vec<super::Weighted>) -> Option<u32> {
        const ASKED: usize = 2;
        /// Of the weight at no distance.
        const LEAST_WEIGHT: f32 = 3.0;
        let Anchor { position, normal } = self.anchors.list[anchor as usize];
        self.anchors.around(position, normal, found);
        let near = found.iter().filter(|f| f.0 > LEAST_WEIGHT && places[f.1 as usize] != NONE && f.1 != anchor);
        let seen = near.take(ASKED).find(|f| self.anchors.sees(self.scene, f.1, position, normal));
        seen.map(|f| places[f.1 as usize])
    }

    /// Links the gathered places by the rays that found unseen surfaces.
    fn link(&self, gathered: &mut [Gathered], places: &mut [u32]) {
        let mut open: Vec<u32> = gathered.iter().flat_map(|g| &g.unseen).filter_map(|u| u.anchor).collect();
        open.sort_unstable();
        open.dedup();
        open.retain(|&a| places[a as usize] == NONE);
        let stand_ins: Vec<_> =
            open.par_iter().map_init(Vec::new, |found, &a| self.stand_in(a, places, found)).collect();
        for (&anchor, place) in open.iter().zip(&stand_ins) {
            places[anchor as usize] = place.unwrap_or(NONE);
        }
        let places = &*places;
        gathered.par_iter_mut().for_each(|g| {
            let mut links: BTreeMap<u32, [Vec3; 3]> = BTreeMap::new();
            for u in &mut g.unseen {
                let Some(other) = u.anchor.map(|a| places[a as usize]).filter(|&p| p != NONE) else { continue };
                u.linked = true;
                let weights = links.entry(other).or_default();
                for (sum, rho) in weights.iter_mut().zip(u.rho.to_array()) {
                    *sum += u.weight * rho;
                }
            }
            g.links = links.into_iter().map(|(other, weights)| Link { other, weights }).collect();
        });
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

/// What a few blind rays from about every fourth anchor find bright: places and their radiance × area.
fn scout(scene: &Scene, anchors: &Anchors, wanted: &[u32], light: &Light, threshold: f32) -> Vec<(Vec3, f32)> {
    const RAYS: u32 = 32;
    const EVERY: u64 = 4;
    // chosen by their places, so that one anchor more or less does not change all others
    let chosen = |a: &u32| (anchors.seed(*a).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32).is_multiple_of(EVERY);
    let wanted: Vec<u32> = wanted.iter().copied().filter(chosen).collect();
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
        let turn = plastic(anchors.seed(index) * 104_729 + 1);
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
