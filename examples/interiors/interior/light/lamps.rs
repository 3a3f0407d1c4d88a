//! The lights of a place: the sky behind windows, the sun and where it falls, surfaces that shine.

use clerestory::reference::Sky;
use clerestory::scene::{Ray, Scene};
use glam::{Vec2, Vec3};

use super::receiver::stratified;
use crate::interior::dice::Dice;

/// Sunlit places that are sampled from.
const SUNLIT: usize = 512;

/// A hole in the walls through which the sky shines: a parallelogram around it, local metres.
#[derive(Clone, Copy, Debug)]
pub struct Portal {
    /// Its middle.
    pub centre: Vec3,
    /// Halves of its sides.
    pub half: [Vec3; 2],
}

impl Portal {
    pub(super) fn area_vector(&self) -> Vec3 {
        4.0 * self.half[0].cross(self.half[1])
    }

    pub(super) fn at(&self, u: Vec2) -> Vec3 {
        self.centre + self.half[0] * (2.0 * u.x - 1.0) + self.half[1] * (2.0 * u.y - 1.0)
    }
}

/// The lights of a place.
pub struct Lamps {
    /// Seen through the portals.
    pub sky: Sky,
    /// Towards the sun (unit), and its irradiance on what faces it.
    pub sun: Option<(Vec3, Vec3)>,
    /// Holes to the outside.
    pub portals: Vec<Portal>,
}

/// A sunlit place that sends light on.
pub(super) struct Sunlit {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    /// Albedo × power of the sun that it stands for.
    pub(super) power: Vec3,
}

/// Where the sun falls in through the portals, by equal shares of its power.
pub(super) fn sunlit(scene: &Scene, lamps: &Lamps, seed: u64) -> Vec<Sunlit> {
    let Some((towards, irradiance)) = lamps.sun else { return Vec::new() };
    let mut dice = Dice::new(seed, "sunlit");
    let facing: Vec<f32> = lamps.portals.iter().map(|p| p.area_vector().dot(towards).abs()).collect();
    let total: f32 = facing.iter().sum();
    let mut all = Vec::new();
    for (portal, facing) in lamps.portals.iter().zip(&facing) {
        let n = (SUNLIT as f32 * facing / total.max(1e-6)).round() as usize;
        for k in 0..n {
            let origin = portal.at(stratified(k, n, &mut dice));
            let out = Ray { origin: origin + towards * 1e-3, direction: towards };
            let ray = Ray { origin: origin - towards * 1e-3, direction: -towards };
            if scene.tracer.occluded(&out, 0.0, f32::INFINITY) {
                continue;
            }
            let Some(hit) = scene.tracer.closest(&ray, 0.0) else { continue };
            let s = scene.surface(&ray, &hit);
            let albedo = scene.albedo(s.triangle, s.barycentric);
            let power = albedo * irradiance * (facing / n as f32);
            all.push(Sunlit { position: s.position, normal: s.normal, power });
        }
    }
    all
}

/// Triangles that shine, with the running sum of their shares of power.
pub(super) struct Emitters {
    pub(super) triangles: Vec<(u32, f32)>,
    power: Vec<f32>,
    emits: Vec<bool>,
}

impl Emitters {
    pub(super) fn new(scene: &Scene) -> Self {
        let count = scene.mesh.triangles.len() as u32;
        let emits: Vec<bool> = (0..count).map(|t| scene.emission(t).max_element() > 0.0).collect();
        let shining = || (0..count).filter(|&t| emits[t as usize]);
        let power: Vec<f32> = shining().map(|t| scene.emission(t).element_sum() * scene.mesh.area(t)).collect();
        let total: f32 = power.iter().sum();
        let mut run = 0.0;
        let triangles = shining()
            .zip(&power)
            .map(|(t, p)| {
                run += p / total;
                (t, run)
            })
            .collect();
        Self { triangles, power: power.iter().map(|p| p / total).collect(), emits }
    }

    pub(super) fn emits(&self, triangle: u32) -> bool {
        self.emits[triangle as usize]
    }

    /// A point, its normal, its radiance and its density per square metre.
    pub(super) fn sample(&self, scene: &Scene, dice: &mut Dice) -> (Vec3, Vec3, Vec3, f32) {
        let u = dice.unit() as f32;
        let i = self.triangles.partition_point(|t| t.1 <= u).min(self.triangles.len() - 1);
        let triangle = self.triangles[i].0;
        let [a, b, c] = scene.mesh.corners(triangle);
        let (r, v) = ((dice.unit() as f32).sqrt(), dice.unit() as f32);
        let point = a * (1.0 - r) + b * (r * (1.0 - v)) + c * (r * v);
        let density = self.power[i] / scene.mesh.area(triangle);
        (point, scene.mesh.normal(triangle), scene.emission(triangle), density)
    }
}
