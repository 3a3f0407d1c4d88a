//! Which surfaces light the unseen ones: rays cast from the volume's cache points. Holds no light, so that many lightings
//! share it.

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f32::consts::PI;

use super::cache_points::plastic;
use super::exchange::Exchange;
use super::gathered::{Gathered, Link, SeenRay, SkyRay, UnseenRay};
use super::smooth::Neighbours;
use super::{CachePoint, CachePoints, Grid, Guide};
use crate::scene::{Hit, Ray, Scene, Surface};
use crate::shoot::{Light, sunlight};
use crate::sphere::across;

/// How finely to gather.
#[derive(Clone, Copy, Debug)]
pub struct VolumeSettings {
    /// Cells along the scene's longest side.
    pub cells: u32,
    /// Rays from each wanted cache point, on average: those that light more of what is shown get more.
    pub rays: u32,
    /// A wanted point farther than this from all cache points that face as it does gets one of its own, in cells.
    pub spacing: f32,
}

impl Default for VolumeSettings {
    fn default() -> Self {
        Self { cells: 64, rays: 96, spacing: 0.4 }
    }
}

impl VolumeSettings {
    /// For light that is set anew often: places stand twice as far apart, since each of a large model is in every product.
    #[must_use]
    pub fn for_products(self) -> Self {
        Self { spacing: 0.8, ..self }
    }
}

/// Rays from cache points to what lights them.
pub struct Transport {
    /// Where the volume's values are.
    pub cache_points: CachePoints,
    /// The direction towards the sun that [`UnseenRay::sunlit`] was found for.
    sun: Option<Vec3>,
    /// What each gathered cache point sees.
    pub(super) gathered: Vec<Gathered>,
    /// For each cache point the index of the gathered place that stands for it, or [`NONE`].
    pub(super) places: Vec<u32>,
    /// How gathered places light each other.
    pub(super) exchange: Exchange,
    /// Which gathered places lie beside each other.
    pub(super) beside: Neighbours,
}

/// A ray follows one of at most so many of the guide's spheres.
const MOST_SPHERES: usize = 64;

/// No gathered place.
const NONE: u32 = u32::MAX;

/// Unseen surfaces that are only found by rays get so many times fewer rays of their own.
const FEWER: u32 = 4;

impl Transport {
    /// Casts rays from the cache points around `wanted` unseen points (position, normal), then fewer from the unseen places
    /// that those rays find. `lights` guide the rays to bright places, and the first tells where the sun stands.
    pub fn cast(scene: &Scene, wanted: &[(Vec3, Vec3)], lights: &[&Light], settings: &VolumeSettings) -> Self {
        let (low, high) = scene.mesh.bounds();
        let mut cache_points = CachePoints::over(scene, Grid::over(low, high, settings.cells));
        cache_points.complete(scene, wanted, settings.spacing);
        let sun = lights.iter().find_map(|l| l.sun).map(|s| s.direction);
        let Some(&light) = lights.first() else {
            let places = vec![NONE; cache_points.list.len()];
            let (exchange, beside) = (Exchange::default(), Neighbours::default());
            return Self { cache_points, sun, gathered: Vec::new(), places, exchange, beside };
        };
        let near = cache_points.near(scene, wanted);
        let first: Vec<u32> = near.iter().map(|n| n.0).collect();
        let rays = shared_out(settings.rays, &near);
        let guide = guide(scene, &cache_points, &first, lights);
        let caster = Caster { scene, cache_points: &cache_points, light, guide: &guide, sun };
        let mut gathered = caster.wave(&first, &rays);
        let mut places = vec![NONE; cache_points.list.len()];
        for (i, &a) in first.iter().enumerate() {
            places[a as usize] = i as u32;
        }
        let (second, own) = caster.second(&gathered, &mut places);
        let few = vec![settings.rays.div_ceil(FEWER); second.len()];
        gathered.extend(caster.wave(&second, &few));
        caster.link(&mut gathered, &mut places, &own);
        let exchange = Exchange::new(&cache_points, &gathered);
        let beside = Neighbours::find(scene, &cache_points, &gathered, &places);
        Self { cache_points, sun, gathered, places, exchange, beside }
    }

    /// Whether the sun of a lighting reaches an unseen surface; casts a ray where that stands elsewhere than the
    /// transport's.
    pub(super) fn in_sun(&self, scene: &Scene, light: &Light, unseen: &UnseenRay) -> bool {
        match light.sun.map(|s| s.direction) == self.sun {
            true => unseen.sunlit,
            false => light.sun_reaches(scene, unseen.position, unseen.normal),
        }
    }

    /// The gathered place that stands for a cache point, if one does.
    #[inline]
    pub(super) fn place(&self, cache_point: u32) -> Option<usize> {
        Some(self.places[cache_point as usize] as usize).filter(|&place| place < self.gathered.len())
    }
}

/// Rays for each cache point, about `mean` on average. An error is seen as often as the cache point counts, and falls with the root of
/// the number of rays: the sum of its squares is least for rays as the root of what a cache point counts (Neyman, *On the
/// two different aspects of the representative method*, 1934, with the same spread everywhere).
fn shared_out(mean: u32, near: &[(u32, f32)]) -> Vec<u32> {
    /// Least and most rays, of the mean.
    const LEAST: f32 = 0.2;
    const MOST: f32 = 3.0;
    /// Rays come in such lots, so that a point more or less seldom turns a cache point's rays another way.
    const LOT: f32 = 12.0;
    let mean = mean as f32;
    let per_root = mean * near.len() as f32 / near.iter().map(|n| n.1.sqrt()).sum::<f32>();
    let rays = |counts: f32| (counts.sqrt() * per_root).clamp(LEAST * mean, MOST * mean);
    near.iter().map(|n| ((rays(n.1) / LOT).ceil() * LOT) as u32).collect()
}

struct Caster<'a> {
    scene: &'a Scene,
    cache_points: &'a CachePoints,
    light: &'a Light,
    guide: &'a Guide,
    sun: Option<Vec3>,
}

impl Caster<'_> {
    /// Gathers for cache points with so many rays for each. Cache points close together share what they know of the guide's spheres:
    /// which of them they see.
    fn wave(&self, wave: &[u32], rays: &[u32]) -> Vec<Gathered> {
        /// A thread takes no more than these at once: some take far longer than others.
        const MOST_GROUPS: usize = 8;
        let mut groups: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
        let mut order: Vec<u32> = (0..wave.len() as u32).collect();
        order.sort_unstable_by_key(|&i| wave[i as usize]);
        for i in order {
            groups.entry(self.cache_points.neighbourhood(wave[i as usize])).or_default().push(i);
        }
        let groups: Vec<Vec<u32>> = groups.into_values().collect();
        let mut cast: Vec<(u32, Gathered)> = groups
            .par_iter()
            .with_max_len(MOST_GROUPS)
            .flat_map_iter(|group| {
                let first = self.cache_points.list[wave[group[0] as usize] as usize];
                let origin = first.position + first.normal * self.cache_points.lift();
                let most = MOST_SPHERES.min(rays[group[0] as usize] as usize / 2);
                let spheres = self.guide.clear(self.scene, origin, first.normal, most);
                group.iter().map(move |&i| (i, self.cast_from(wave[i as usize], &spheres, rays[i as usize])))
            })
            .collect();
        cast.sort_unstable_by_key(|c| c.0);
        cast.into_iter().map(|c| c.1).collect()
    }

    fn cast_from(&self, index: u32, spheres: &[(u32, f32)], rays: u32) -> Gathered {
        let cache_point = self.cache_points.list[index as usize];
        let origin = cache_point.position + cache_point.normal * self.cache_points.lift();
        let lobes = self.guide.of(origin, cache_point.normal, spheres);
        let turn = plastic(self.cache_points.seed(index) * 7919 + 1);
        let share = 1.0 / rays as f32;
        let mut all = Gathered { cache_point: index, rays, sky: vec![], seen: vec![], unseen: vec![], links: vec![] };
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
        let Some((ray, hit)) = first_met(self.scene, ray, spread) else {
            all.sky.push(SkyRay { weight, direction: ray.direction });
            return;
        };
        let face = self.scene.face(hit.triangle);
        let s = face.surface(&ray, hit.t);
        let rho = self.scene.paint(&face, true).rough_albedo(s.barycentric, hit.t * spread) / PI;
        if let Some((probe, cell)) = self.light.finest_known(self.scene, s.position, s.normal) {
            all.seen.push(SeenRay { weight, rho, probe, cell });
            return;
        }
        let Surface { position, normal, .. } = s;
        let sunlit = self.sun.is_some_and(|sun| sunlight::reaches(self.scene, position, normal, sun));
        let cache_point = self.cache_points.nearest_visible(self.scene, position, normal);
        all.unseen.push(UnseenRay { weight, rho, position, normal, sunlit, cache_point, linked: false });
    }

    /// Which cache points to gather for besides: of those that the rays found, most often first, the ones that no gathered
    /// place stands in for. `places` holds for each cache point the index of the gathered place that stands for it. Tells also
    /// of each cache point whether it is then gathered itself.
    fn second(&self, gathered: &[Gathered], places: &mut [u32]) -> (Vec<u32>, Vec<bool>) {
        let mut calls = vec![0u32; places.len()];
        for cache_point in gathered.iter().flat_map(|g| &g.unseen).filter_map(|u| u.cache_point) {
            calls[cache_point as usize] += 1;
        }
        let mut called: Vec<u32> =
            (0..places.len() as u32).filter(|&a| calls[a as usize] > 0 && places[a as usize] == NONE).collect();
        // by powers of two: a call more or less seldom changes the order
        called.sort_by_key(|&a| std::cmp::Reverse(calls[a as usize].ilog2()));
        let mut second = Vec::new();
        let mut found = Vec::new();
        let mut own: Vec<bool> = places.iter().map(|p| *p != NONE).collect();
        for cache_point in called {
            let place = self.stand_in(cache_point, places, &own, &mut found);
            places[cache_point as usize] = place.unwrap_or_else(|| {
                second.push(cache_point);
                own[cache_point as usize] = true;
                (gathered.len() + second.len() - 1) as u32
            });
        }
        (second, own)
    }

    /// The gathered place that stands in for a cache point that was not gathered: that of a cache point beside it that was (`own`),
    /// not of one that another stands in for, since the noise of few rays would spread from place to place.
    fn stand_in(
        &self,
        cache_point: u32,
        places: &[u32],
        own: &[bool],
        found: &mut Vec<super::Weighted>,
    ) -> Option<u32> {
        const ASKED: usize = 2;
        /// Of the weight at no distance.
        const LEAST_WEIGHT: f32 = 3.0;
        let CachePoint { position, normal } = self.cache_points.list[cache_point as usize];
        self.cache_points.around(position, normal, found);
        let near = found.iter().filter(|f| f.0 > LEAST_WEIGHT && own[f.1 as usize] && f.1 != cache_point);
        let seen = near.take(ASKED).find(|f| self.cache_points.sees(self.scene, f.1, position, normal));
        seen.map(|f| places[f.1 as usize])
    }

    /// Links the gathered places by the rays that found unseen surfaces.
    fn link(&self, gathered: &mut [Gathered], places: &mut [u32], own: &[bool]) {
        let mut open: Vec<u32> = gathered.iter().flat_map(|g| &g.unseen).filter_map(|u| u.cache_point).collect();
        open.sort_unstable();
        open.dedup();
        open.retain(|&a| places[a as usize] == NONE);
        let stand_ins: Vec<_> =
            open.par_iter().map_init(Vec::new, |found, &a| self.stand_in(a, places, own, found)).collect();
        for (&cache_point, place) in open.iter().zip(&stand_ins) {
            places[cache_point as usize] = place.unwrap_or(NONE);
        }
        let places = &*places;
        gathered.par_iter_mut().for_each(|g| {
            let mut links: BTreeMap<u32, [Vec3; 3]> = BTreeMap::new();
            for u in &mut g.unseen {
                let Some(other) = u.cache_point.map(|a| places[a as usize]).filter(|&p| p != NONE) else { continue };
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

/// What a ray of some width per metre meets, and the ray that does; `None` if it gets out. A ray that gets out through a crack of a scan tells
/// of what is beside that: the ray stands for all that its width sees, and a sky may be thousands of times as bright as a dark room.
pub(super) fn first_met(scene: &Scene, ray: &Ray, spread: f32) -> Option<(Ray, Hit)> {
    /// A crack is no wider, either way, than so many of the distances between a scan's vertices.
    const WIDEST: f32 = 2.0;
    if let Some(hit) = scene.tracer.closest(ray, 0.0) {
        return Some((*ray, hit));
    }
    // only scans, which have their colours at their vertices, have cracks
    if scene.mesh.colours.is_empty() {
        return None;
    }
    let (u, v) = across(ray.direction);
    let beside = |width: f32| -> Option<Vec<(Ray, Hit)>> {
        let met = |aside: Vec3| {
            let ray = Ray { origin: ray.origin, direction: (ray.direction + width * aside).normalize() };
            scene.tracer.closest(&ray, 0.0).map(|hit| (ray, hit))
        };
        [u, v, -u, -v].into_iter().map(met).collect()
    };
    // the farthest is least likely the surface that the ray came from
    let (ray, hit) = beside(0.5 * spread)?.into_iter().max_by(|a, b| a.1.t.total_cmp(&b.1.t))?;
    let face = scene.face(hit.triangle);
    let crack = WIDEST * scene.paint(&face, false).vertex_spacing(&face) / hit.t;
    (crack > 0.0 && beside(crack).is_some()).then_some((ray, hit))
}

/// Least probability density that a ray's weight is taken from, per steradian: loses 1 % of a uniform light.
const LEAST_DENSITY: f32 = 0.02;

/// A thing is bright if its radiance is so many times the mean.
const BRIGHT: f32 = 3.0;

/// Where rays should go: to what probes saw bright, and what a few blind rays from the cache points find bright.
fn guide(scene: &Scene, cache_points: &CachePoints, wanted: &[u32], lights: &[&Light]) -> Guide {
    let mut places = Vec::new();
    for light in lights {
        let threshold = BRIGHT * light.mean_radiance().max_element();
        for records in &light.records {
            places.extend(records.bright_places(threshold));
        }
        places.extend(scout(scene, cache_points, wanted, light, threshold));
    }
    Guide::new(&cache_points.grid, places.into_iter())
}

/// What a few blind rays from about every fourth cache point find bright: places and their radiance × area.
fn scout(scene: &Scene, cache_points: &CachePoints, wanted: &[u32], light: &Light, threshold: f32) -> Vec<(Vec3, f32)> {
    const RAYS: u32 = 32;
    const EVERY: u64 = 4;
    /// No ray speaks for a wider thing, in cells: one that goes astray must not draw the others after it.
    const WIDEST: f32 = 0.25;
    // chosen by their places, so that one cache point more or less does not change all others
    let chosen = |a: &u32| (cache_points.seed(*a).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32).is_multiple_of(EVERY);
    let wanted: Vec<u32> = wanted.iter().copied().filter(chosen).collect();
    // a cache point sees a small part of the scene: a thing found by few is as bright as one that a probe saw
    let scale = 8.0 / wanted.len().max(1) as f32;
    struct Sighting {
        direction: Vec3,
        solid_angle: f32,
        distance: Option<f32>,
        radiance: Vec3,
    }
    let look = |index: u32| -> Vec<(Vec3, f32)> {
        let cache_point = cache_points.list[index as usize];
        let origin = cache_point.position + cache_point.normal * cache_points.lift();
        let lobes = Guide::default().of(origin, cache_point.normal, &[]);
        let turn = plastic(cache_points.seed(index) * 104_729 + 1);
        let seen: Vec<Sighting> = (0..RAYS)
            .filter_map(|k| {
                let u: Vec2 = (plastic(u64::from(k)) + turn).fract();
                let (direction, density) = lobes.sample(0.5, u)?;
                let ray = Ray { origin, direction };
                let hit = scene.tracer.closest(&ray, 0.0);
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
                Some(Sighting { direction, solid_angle, distance: hit.map(|h| h.t), radiance })
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
                let area = (s.solid_angle * t * t * scale).min((WIDEST * cache_points.grid.cell_m).powi(2));
                Some((origin + s.direction * t, s.radiance.element_sum() * area))
            })
            .collect()
    };
    wanted.par_iter().map(|&index| look(index)).collect::<Vec<_>>().concat()
}
