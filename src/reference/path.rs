//! One path: from the eye over Lambertian surfaces to the lights.
//!
//! Kajiya, *The Rendering Equation*, 1986. At every vertex the sky, the sun and the emitters are each sampled once
//! (next-event estimation), and the path goes on in a cosine-distributed direction. Sky and emitters can also be met by
//! chance; both ways count, weighted by the power heuristic (Veach, *Robust Monte Carlo Methods for Light Transport
//! Simulation*, 1997, section 9.2.4). What the sun lights is sampled likewise (see `sun_patches`).

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI};

use super::emitters::EmitterPoint;
use super::lights::Lights;
use super::random::Sampler;
use super::vertex::{Vertex, clear, cosine_direction, off_surface, trace};
use crate::scene::{Ray, Scene};

/// Throughput under which roulette may end a path: on Šibenik, error² × rays is least between 0.2 and 0.5. A path
/// through albedo 0.99 makes 138 bounces before.
const ROULETTE_BELOW: f32 = 0.25;

/// Pairs of dimensions that a path uses before its first vertex: one for the pixel, or four for the irradiated spot.
const PAIRS_AT_EYE: u32 = 4;

/// The irradiated spot's pair for sun patches.
const PAIR_OF_PATCHES: u32 = 3;

/// Pairs of dimensions that a vertex may use: the way on, the sky, the emitters, the sun patches.
const PAIRS_PER_VERTEX: u32 = 4;

/// Which of the two ways to find sky and emitters counts. All three give the same picture in expectation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// Both, weighted: the least noise.
    #[default]
    Both,
    /// Lights are sampled, never met by chance.
    Lights,
    /// Lights are only met by chance. The sun cannot be met and is sampled all the same.
    Chance,
}

/// What paths run through.
pub(super) struct Paths<'a> {
    pub(super) scene: &'a Scene,
    pub(super) lights: &'a Lights,
    pub(super) max_bounces: u32,
    pub(super) strategy: Strategy,
}

/// How a ray was chosen.
#[derive(Clone, Copy)]
enum Origin {
    /// By a camera: lights could not have been sampled instead.
    Eye,
    /// By a surface with this normal, with this probability per steradian.
    Surface { normal: Vec3, density: f32 },
}

impl Paths<'_> {
    /// Radiance arriving against a camera's `ray`, one unbiased sample of it. Counts the rays it casts.
    pub(super) fn radiance(&self, ray: Ray, sampler: &Sampler, rays: &mut u64) -> Vec3 {
        self.follow(ray, Origin::Eye, sampler, rays)
    }

    /// Irradiance on the side of a surface that `normal` points to, one unbiased sample of it.
    pub(super) fn irradiance(&self, point: Vec3, normal: Vec3, sampler: &Sampler, rays: &mut u64) -> Vec3 {
        let spot = LitPoint { point, normal, start: off_surface(point, normal) };
        let mut direct = self.sun(&spot, rays) + self.direct(&spot, sampler, 1, rays);
        if self.max_bounces > 0 {
            direct += self.sun_patches(&spot, sampler.pair(PAIR_OF_PATCHES), rays);
        }
        match spot.scatter(sampler.pair(0)) {
            Some((ray, origin)) => direct + PI * self.follow(ray, origin, sampler, rays),
            None => direct,
        }
    }

    /// Follows a path from its first ray.
    fn follow(&self, mut ray: Ray, mut origin: Origin, sampler: &Sampler, rays: &mut u64) -> Vec3 {
        let mut radiance = Vec3::ZERO;
        let mut throughput = Vec3::ONE;
        for bounce in 0..=self.max_bounces {
            *rays += 1;
            let Some(vertex) = trace(self.scene, &ray) else {
                return radiance + throughput * self.sky(ray.direction, origin);
            };
            radiance += throughput * self.emission(&vertex, ray.direction, origin);
            if bounce == self.max_bounces || vertex.albedo == Vec3::ZERO {
                break;
            }
            throughput *= vertex.albedo;
            let spot = LitPoint::new(&vertex);
            let pair = PAIRS_AT_EYE + bounce * PAIRS_PER_VERTEX;
            // ρE/π, the albedo being in the throughput already
            let mut irradiance = self.direct(&spot, sampler, pair + 1, rays);
            let weight = self.sun_weight(&vertex, ray.direction, origin);
            if weight > 0.0 {
                irradiance += weight * self.sun(&spot, rays);
            }
            if bounce + 1 < self.max_bounces {
                irradiance += self.sun_patches(&spot, sampler.pair(pair + 3), rays);
            }
            radiance += throughput * FRAC_1_PI * irradiance;
            let Some(scattered) = spot.scatter(sampler.pair(pair)) else { break };
            (ray, origin) = scattered;
            // Survivors carry the weight of those that end, so the mean is kept; at albedo 1 none ends
            let survival = throughput.max_element() / ROULETTE_BELOW;
            if survival < 1.0 {
                if sampler.single(bounce) >= survival {
                    break;
                }
                throughput /= survival;
            }
        }
        radiance
    }

    /// What a ray that left the scene sees.
    fn sky(&self, direction: Vec3, origin: Origin) -> Vec3 {
        let Some(sky) = &self.lights.sky else { return Vec3::ZERO };
        let weight = self.chance_weight(origin, |normal| sky.density(normal, direction));
        if weight > 0.0 { weight * sky.radiance(direction) } else { Vec3::ZERO }
    }

    /// What the surface that a ray has met sends out of itself.
    fn emission(&self, vertex: &Vertex, direction: Vec3, origin: Origin) -> Vec3 {
        let Some(emitters) = &self.lights.emitters else { return Vec3::ZERO };
        let density = emitters.density(vertex.triangle);
        if density == 0.0 {
            return Vec3::ZERO;
        }
        let cosine = vertex.normal.dot(direction).abs();
        let per_steradian = |_| density * vertex.distance.powi(2) / cosine.max(f32::MIN_POSITIVE);
        self.chance_weight(origin, per_steradian) * self.scene.emission(vertex.triangle)
    }

    /// Irradiance straight from the sun.
    fn sun(&self, spot: &LitPoint, rays: &mut u64) -> Vec3 {
        let Some(sun) = &self.lights.sun else { return Vec3::ZERO };
        let cosine = spot.normal.dot(sun.direction);
        let lit = cosine > 0.0 && self.sees(spot, sun.direction, f32::INFINITY, rays);
        if lit { cosine * sun.irradiance } else { Vec3::ZERO }
    }

    /// The share of the sun's light at a vertex that counts: the rest was found from the vertex before, by
    /// [`Self::sun_patches`].
    fn sun_weight(&self, vertex: &Vertex, direction: Vec3, origin: Origin) -> f32 {
        match (&self.lights.patches, origin, self.strategy) {
            (Some(patches), Origin::Surface { density, .. }, Strategy::Both) => {
                let cosine = vertex.normal.dot(direction).abs().max(f32::MIN_POSITIVE);
                power_heuristic(density, patches.density(vertex) * vertex.distance.powi(2) / cosine)
            }
            _ => 1.0,
        }
    }

    /// Irradiance from a sampled sunlit point.
    fn sun_patches(&self, spot: &LitPoint, u: Vec2, rays: &mut u64) -> Vec3 {
        let (Some(patches), Some(sun), Strategy::Both) = (&self.lights.patches, &self.lights.sun, self.strategy) else {
            return Vec3::ZERO;
        };
        *rays += 1;
        let Some((patch, density)) = patches.sample(self.scene, u) else { return Vec3::ZERO };
        let radiance = patch.albedo * sun.irradiance * (patch.normal.dot(sun.direction) * FRAC_1_PI);
        let point = EmitterPoint { position: patch.position, normal: patch.normal, radiance, density };
        // lit on the side of its normal only
        if patch.normal.dot(spot.point - patch.position) > 0.0 {
            self.emitter_light(spot, &point, rays)
        } else {
            Vec3::ZERO
        }
    }

    /// Irradiance straight from the sky and the emitters, as far as sampling them is meant to find it.
    fn direct(&self, spot: &LitPoint, sampler: &Sampler, pair: u32, rays: &mut u64) -> Vec3 {
        let mut irradiance = Vec3::ZERO;
        if self.strategy == Strategy::Chance {
            return irradiance;
        }
        if let Some(sky) = &self.lights.sky {
            let s = sky.sample(spot.normal, sampler.pair(pair));
            let cosine = spot.normal.dot(s.direction);
            if cosine > 0.0
                && s.pdf > 0.0
                && s.radiance != Vec3::ZERO
                && self.sees(spot, s.direction, f32::INFINITY, rays)
            {
                irradiance += self.sampled_weight(s.pdf, cosine) * cosine / s.pdf * s.radiance;
            }
        }
        if let Some(emitters) = &self.lights.emitters {
            let e = emitters.sample(self.scene, sampler.pair(pair + 1));
            irradiance += self.emitter_light(spot, &e, rays);
        }
        irradiance
    }

    /// Irradiance from a sampled point of an emitter.
    fn emitter_light(&self, spot: &LitPoint, e: &EmitterPoint, rays: &mut u64) -> Vec3 {
        let to = e.position - spot.point;
        let distance2 = to.length_squared();
        let direction = to.normalize_or_zero();
        let cosine = spot.normal.dot(direction);
        let facing = e.normal.dot(direction);
        if cosine <= 0.0 || facing == 0.0 {
            return Vec3::ZERO;
        }
        let end = off_surface(e.position, if facing > 0.0 { -e.normal } else { e.normal });
        let (towards, distance) = ((end - spot.start).normalize_or_zero(), spot.start.distance(end));
        if towards.dot(direction) <= 0.0 || !self.sees(spot, towards, distance, rays) {
            return Vec3::ZERO;
        }
        let density = e.density * distance2 / facing.abs();
        self.sampled_weight(density, cosine) * cosine / density * e.radiance
    }

    fn sees(&self, spot: &LitPoint, direction: Vec3, distance: f32, rays: &mut u64) -> bool {
        *rays += 1;
        clear(self.scene, spot.start, direction, distance)
    }

    /// The share of light met by chance that counts, given the density with which sampling would have found it.
    fn chance_weight(&self, origin: Origin, density_of_sampling: impl Fn(Vec3) -> f32) -> f32 {
        match (origin, self.strategy) {
            (Origin::Eye, _) | (_, Strategy::Chance) => 1.0,
            (_, Strategy::Lights) => 0.0,
            (Origin::Surface { normal, density }, Strategy::Both) => {
                power_heuristic(density, density_of_sampling(normal))
            }
        }
    }

    /// The share of sampled light that counts: the rest is met by chance.
    fn sampled_weight(&self, density: f32, cosine: f32) -> f32 {
        if self.strategy == Strategy::Lights { 1.0 } else { power_heuristic(density, cosine * FRAC_1_PI) }
    }
}

/// The weight of a way of sampling with density `this`, beside one with density `other` (Veach 1997, β = 2).
fn power_heuristic(this: f32, other: f32) -> f32 {
    // by their ratio, so that no square overflows
    let ratio = other / this;
    1.0 / (1.0 + ratio * ratio)
}

/// A place on a surface that light arrives at.
struct LitPoint {
    point: Vec3,
    normal: Vec3,
    /// Where rays start.
    start: Vec3,
}

impl LitPoint {
    fn new(vertex: &Vertex) -> Self {
        let (point, normal) = (vertex.position, vertex.normal);
        Self { point, normal, start: off_surface(point, normal) }
    }

    /// The next ray of a path, cosine-distributed.
    fn scatter(&self, u: Vec2) -> Option<(Ray, Origin)> {
        let direction = cosine_direction(self.normal, u);
        let density = self.normal.dot(direction) * FRAC_1_PI;
        let ray = Ray { origin: self.start, direction };
        (density > 0.0).then_some((ray, Origin::Surface { normal: self.normal, density }))
    }
}
