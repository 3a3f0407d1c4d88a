//! Pictures of a place: what each ray meets, in the light of the [`Field`], with the gloss of polished surfaces.

use clerestory::panorama::Picture;
use clerestory::reference::Eye;
use clerestory::scene::{Ray, Scene};
use glam::Vec3;
use rayon::prelude::*;

use super::dice::Dice;
use super::light::{Field, Lamps, Place, diffuse, sunlight};
use crate::common::eye::{direction, origin};

/// Sine of the sun's angular radius.
const SUN_RADIUS: f32 = 0.0047;
/// How far a polished surface scatters what it mirrors: standard deviation of the normal's tilt.
const ROUGHNESS: f64 = 0.03;
/// What is mirrored is taken to be no brighter than a sky: the few rays of a pixel find a lamp's image too seldom.
const MIRRORED: f32 = 6.0;
/// Turns between neighbours on a spiral that is even, radians.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// A place with its light.
pub struct Truth<'a> {
    /// The true model.
    pub scene: &'a Scene,
    /// What lights it.
    pub lamps: &'a Lamps,
    /// What arrives on its surfaces.
    pub field: &'a Field,
    /// Fresnel's F0 of each material.
    pub gloss: &'a [f64],
}

/// How a picture is sampled.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Rays along each side of a pixel.
    pub side: usize,
    /// Pixels that the picture moves by while the shutter is open.
    pub blur: [f64; 2],
    /// Another seed, other noise.
    pub seed: u64,
}

/// What the middles of every `stride`-th pixel of every `stride`-th row show.
pub fn seen(scene: &Scene, eye: &Eye, stride: usize) -> Vec<Place> {
    let (w, h) = (eye.size().0 / stride, eye.size().1 / stride);
    let middle = |k: usize| (k as f64 + 0.5) * stride as f64;
    let origin = origin(scene, eye);
    let cast = |i: usize| {
        let ray = Ray { origin, direction: direction(eye, middle(i % w), middle(i / w)) };
        let hit = scene.tracer.closest(&ray, 0.0)?;
        let s = scene.surface(&ray, &hit);
        Some((s.position, s.normal))
    };
    (0..w * h).into_par_iter().filter_map(cast).collect()
}

impl Truth<'_> {
    /// The picture that an eye takes.
    pub fn picture(&self, eye: &Eye, sampling: &Sampling) -> Picture {
        let (width, height) = eye.size();
        let origin = origin(self.scene, eye);
        let pixels = (0..width * height)
            .into_par_iter()
            .map(|i| {
                let mut dice = Dice::new(sampling.seed ^ ((i as u64) << 16), "pixel");
                let n = sampling.side;
                let mut known = None;
                let mut sum = Vec3::ZERO;
                for k in 0..n * n {
                    // the shutter's time runs through the pixel's rays in another order than their places do
                    let time = ((k * 5) % (n * n)) as f64 / (n * n) as f64 - 0.5;
                    let at = |cell: usize, first: usize, blur: f64, dice: &mut Dice| {
                        first as f64 + (cell as f64 + dice.unit()) / n as f64 + blur * time
                    };
                    let x = at(k % n, i % width, sampling.blur[0], &mut dice);
                    let y = at(k / n, i / width, sampling.blur[1], &mut dice).clamp(0.0, height as f64);
                    let ray = Ray { origin, direction: direction(eye, x, y) };
                    let stratum = (k as f64 + dice.unit()) / (n * n) as f64;
                    sum += self.radiance(&ray, Some((k, stratum)), &mut known, &mut dice);
                }
                sum / (n * n) as f32
            })
            .collect();
        Picture { width, height, pixels }
    }

    /// What comes along a ray. `gloss`, if there is any to be: which of the pixel's rays this is, and where it is among
    /// them (0..1). `known` is a place whose light was looked up already.
    fn radiance(
        &self,
        ray: &Ray,
        gloss: Option<(usize, f64)>,
        known: &mut Option<(Place, Vec3)>,
        dice: &mut Dice,
    ) -> Vec3 {
        let scene = self.scene;
        let Some(hit) = scene.tracer.closest(ray, 0.0) else { return self.lamps.sky.radiance(ray.direction) };
        let emission = scene.emission(hit.triangle);
        if emission.max_element() > 0.0 {
            return emission;
        }
        let s = scene.surface(ray, &hit);
        let slow = match known {
            Some(((p, n), light)) if n.dot(s.normal) > 0.98 && p.distance_squared(s.position) < 4e-4 => *light,
            _ => {
                let light = self.field.irradiance(s.position, s.normal);
                *known = Some(((s.position, s.normal), light));
                light
            }
        };
        let aside = Vec3::new(dice.unit() as f32, dice.unit() as f32, dice.unit() as f32) * 2.0 - 1.0;
        let sun = sunlight(scene, self.lamps, (s.position, s.normal), aside * SUN_RADIUS);
        let radiance = diffuse(scene.albedo(s.triangle, s.barycentric), slow + sun);
        let f0 = self.gloss[scene.mesh.materials[s.triangle as usize] as usize] as f32;
        let Some((k, stratum)) = gloss.filter(|_| f0 > 0.0) else { return radiance };
        // normal numbers in two directions, along a spiral, so that a pixel's rays are spread evenly
        let (sin, cos) = (GOLDEN_ANGLE * k as f64).sin_cos();
        let tilt = ROUGHNESS * (-2.0 * (1.0 - stratum).ln()).sqrt();
        let (t, b) = s.normal.any_orthonormal_pair();
        let normal = (s.normal + t * (tilt * cos) as f32 + b * (tilt * sin) as f32).normalize();
        let cosine = -normal.dot(ray.direction);
        let mirrored = ray.direction + 2.0 * cosine * normal;
        if cosine <= 0.0 || mirrored.dot(s.normal) <= 0.0 {
            return radiance;
        }
        // Schlick, An Inexpensive BRDF Model for Physically-based Rendering, 1994; polish is never perfect, so that
        // grazing light is not mirrored whole
        let share = f0 + (0.25 - f0) * (1.0 - cosine).powi(5);
        let away = Ray { origin: s.position + s.normal * 3e-4, direction: mirrored.normalize() };
        let mirrored = self.radiance(&away, None, &mut None, dice).min(Vec3::splat(MIRRORED));
        radiance * (1.0 - share) + share * mirrored
    }
}
