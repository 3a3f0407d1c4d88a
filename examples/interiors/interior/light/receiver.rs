//! A spot that gathers: what comes straight from windows, lamps and sunlit places, and where its links end.

use clerestory::scene::{Ray, Scene};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

use super::Place;
use super::lamps::{Emitters, Lamps, Sunlit};
use crate::interior::dice::Dice;

/// What the sun sends on over less than this is left to the links, metres.
const NEAR: f32 = 0.6;
/// How far rays start off their surface, metres.
const OFF: f32 = 3e-4;

/// What a spot may be lit by, and how often that is asked.
pub(super) struct Sources<'a> {
    pub(super) scene: &'a Scene,
    pub(super) lamps: &'a Lamps,
    pub(super) emitters: Emitters,
    pub(super) sunlit: Vec<Sunlit>,
    /// Rays that link a spot to others.
    pub(super) links: usize,
    /// Samples of windows, of lamps and of sunlit places.
    pub(super) samples: usize,
    pub(super) seed: u64,
}

impl Sources<'_> {
    /// Gathers at the spot with this number.
    pub(super) fn gather(&self, number: usize, (position, normal): Place) -> Gathered {
        let mut dice = Dice::new(self.seed ^ ((number as u64) << 20), "spot");
        let spot = Receiver::new(self.scene, position, normal);
        let mut direct = spot.sky_light(self, &mut dice) + spot.lamp_light(self, &mut dice);
        direct += spot.sunlit_light(self, &mut dice);
        let ends = spot.ends(self, &mut dice, &mut direct);
        Gathered { direct, ends }
    }
}

/// What arrives at a spot straight from lights, and the ends of its links.
pub(super) struct Gathered {
    pub(super) direct: Vec3,
    pub(super) ends: Vec<End>,
}

/// Where a link ends.
pub(super) struct End {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    pub(super) albedo: Vec3,
}

/// A spot that gathers.
struct Receiver<'a> {
    scene: &'a Scene,
    start: Vec3,
    normal: Vec3,
}

impl<'a> Receiver<'a> {
    fn new(scene: &'a Scene, position: Vec3, normal: Vec3) -> Self {
        Self { scene, start: position + normal * OFF, normal }
    }

    fn clear(&self, direction: Vec3, distance: f32) -> bool {
        !self.scene.tracer.occluded(&Ray { origin: self.start, direction }, 0.0, distance)
    }

    fn sky_light(&self, &Sources { lamps, samples, .. }: &Sources, dice: &mut Dice) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for portal in &lamps.portals {
            let area = portal.area_vector();
            let n = (samples * 2 / lamps.portals.len()).max(6);
            for k in 0..n {
                let to = portal.at(stratified(k, n, dice)) - self.start;
                let direction = to.normalize_or_zero();
                let cosine = self.normal.dot(direction);
                if cosine > 0.0 && self.clear(direction, f32::INFINITY) {
                    let solid = area.dot(direction).abs() / to.length_squared().max(0.01);
                    sum += lamps.sky.radiance(direction) * (cosine * solid / n as f32);
                }
            }
        }
        sum
    }

    fn lamp_light(&self, &Sources { ref emitters, samples, .. }: &Sources, dice: &mut Dice) -> Vec3 {
        if emitters.triangles.is_empty() {
            return Vec3::ZERO;
        }
        let mut sum = Vec3::ZERO;
        for _ in 0..samples {
            let (point, normal, radiance, density) = emitters.sample(self.scene, dice);
            let to = point - self.start;
            let (distance, direction) = (to.length(), to.normalize_or_zero());
            let cosine = self.normal.dot(direction);
            if cosine > 0.0 && self.clear(direction, distance - 2e-3) {
                let solid = normal.dot(direction).abs() / (density * distance.max(0.03).powi(2));
                sum += radiance * (cosine * solid / samples as f32);
            }
        }
        sum
    }

    /// Sunlight that places farther than [`NEAR`] send on.
    fn sunlit_light(&self, &Sources { ref sunlit, samples, .. }: &Sources, dice: &mut Dice) -> Vec3 {
        let mut sum = Vec3::ZERO;
        if sunlit.is_empty() {
            return sum;
        }
        for k in 0..samples {
            let part = (k as f64 + dice.unit()) / samples as f64 * sunlit.len() as f64;
            let s = &sunlit[(part as usize).min(sunlit.len() - 1)];
            let to = s.position + s.normal * OFF - self.start;
            let (distance, direction) = (to.length(), to.normalize_or_zero());
            let cosines = self.normal.dot(direction).max(0.0) * s.normal.dot(-direction).max(0.0);
            if distance > NEAR && cosines > 0.0 && self.clear(direction, distance - OFF) {
                sum += s.power * (FRAC_1_PI * cosines / distance.powi(2));
            }
        }
        sum * (sunlit.len() as f32 / samples as f32)
    }

    /// Follows the links; adds the sunlight of near ends to `direct`.
    fn ends(&self, sources: &Sources, dice: &mut Dice, direct: &mut Vec3) -> Vec<End> {
        let &Sources { lamps, ref emitters, links, .. } = sources;
        let (t, b) = self.normal.any_orthonormal_pair();
        let mut ends = Vec::with_capacity(links);
        for k in 0..links {
            let u = stratified(k, links, dice);
            let (r, (sin, cos)) = (u.x.sqrt(), (TAU * u.y).sin_cos());
            let direction = (t * (r * cos) + b * (r * sin) + self.normal * (1.0 - u.x).max(0.0).sqrt()).normalize();
            let ray = Ray { origin: self.start, direction };
            let Some(hit) = self.scene.tracer.closest(&ray, 0.0) else { continue };
            if emitters.emits(hit.triangle) {
                continue;
            }
            let s = self.scene.surface(&ray, &hit);
            let albedo = self.scene.albedo(s.triangle, s.barycentric);
            if hit.t <= NEAR {
                let at = Receiver::new(self.scene, s.position, s.normal);
                *direct += albedo * at.sun(lamps, Vec3::ZERO) / links as f32;
            }
            ends.push(End { position: s.position, normal: s.normal, albedo });
        }
        ends
    }

    /// Irradiance straight from the sun, its direction moved by `aside`.
    fn sun(&self, lamps: &Lamps, aside: Vec3) -> Vec3 {
        let Some((towards, irradiance)) = lamps.sun else { return Vec3::ZERO };
        let cosine = self.normal.dot(towards);
        if cosine > 0.0 && self.clear((towards + aside).normalize(), f32::INFINITY) {
            irradiance * cosine
        } else {
            Vec3::ZERO
        }
    }
}

/// Irradiance straight from the sun on a place; `aside` moves the sun's direction within its disc.
pub fn sunlight(scene: &Scene, lamps: &Lamps, (position, normal): Place, aside: Vec3) -> Vec3 {
    Receiver::new(scene, position, normal).sun(lamps, aside)
}

/// A point of the unit square in the k-th of n strata: even along x, and along y by the radical inverse, moved at random.
pub(super) fn stratified(k: usize, n: usize, dice: &mut Dice) -> Vec2 {
    let inverse = f64::from((k as u32).reverse_bits()) / f64::from(u32::MAX);
    let y = (inverse + dice.unit() / n as f64).fract();
    Vec2::new(((k as f64 + dice.unit()) / n as f64) as f32, y as f32)
}
