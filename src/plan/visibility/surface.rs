//! The check in space: rays from the stations to the model's real surface, which shows what a plan at probe height
//! cannot, such as vaults, the tops of cornices and what stands behind benches.

use glam::Vec3;
use rayon::prelude::*;

use super::patches::Patches;
use crate::plan::floors::raster::Map;
use crate::scene::{Ray, Scene};
use crate::site::Plan;
use crate::sphere::sphere;

/// Rays from one candidate, to learn what can be seen at all.
const RAYS: usize = 2048;

/// Where patches lie and how they face, computed once.
pub struct Surface<'a> {
    /// The model.
    pub scene: &'a Scene,
    /// The model's surface in pieces.
    pub patches: Patches,
    /// Middles of the patches, local metres.
    pub middles: Vec<Vec3>,
    /// Square metres.
    pub areas: Vec<f64>,
    range_m: f32,
    /// Least cosine between the ray and the surface's normal.
    facing: f32,
    /// Sines of the lowest and highest direction.
    field: [f32; 2],
}

impl<'a> Surface<'a> {
    /// Cuts a scene's surface into at most about `most` patches.
    pub fn new(scene: &'a Scene, plan: &Plan, most: usize) -> Self {
        let patches = Patches::new(&scene.mesh, 0.3, most);
        let middles = (0..patches.len())
            .into_par_iter()
            .map(|p| patches.corners(&scene.mesh, p).iter().sum::<Vec3>() / 3.0)
            .collect();
        let areas = (0..patches.len()).into_par_iter().map(|p| patches.area(&scene.mesh, p)).collect();
        Self {
            scene,
            patches,
            middles,
            areas,
            range_m: if plan.range_m > 0.0 { plan.range_m as f32 } else { f32::INFINITY },
            facing: plan.incidence_deg.to_radians().cos() as f32,
            field: plan.vertical_field_deg.map(|d| d.to_radians().sin() as f32),
        }
    }

    /// Whether a surface at this distance and angle counts as seen; `direction` leads away from the station.
    fn counts(&self, distance: f32, direction: Vec3, normal: Vec3) -> bool {
        let [low, high] = self.field;
        distance <= self.range_m
            && (low - 1e-6..=high + 1e-6).contains(&direction.z)
            && normal.dot(direction).abs() >= self.facing - 1e-6
    }

    /// The patches over `house` that some of many points see, found by rays to all sides from each. `free` leaves the
    /// limits out.
    pub fn reached(&self, from: &[Vec3], house: &Map, free: bool) -> Vec<bool> {
        let hits: Vec<Vec<u32>> = from.par_iter().map(|p| self.hit_from(*p, free)).collect();
        let mut reached = vec![false; self.patches.len()];
        hits.iter().flatten().for_each(|p| reached[*p as usize] = true);
        reached.iter_mut().zip(&self.middles).for_each(|(r, m)| *r &= house.at(m.truncate().as_dvec2()));
        reached
    }

    fn hit_from(&self, origin: Vec3, free: bool) -> Vec<u32> {
        let mut hits: Vec<u32> = sphere(RAYS)
            .filter_map(|direction| {
                let ray = Ray { origin, direction };
                let hit = self.scene.tracer.closest(&ray, 1e-3)?;
                let surface = self.scene.surface(&ray, &hit);
                let seen = free || self.counts(hit.t, direction, surface.normal);
                let [u, v] = surface.barycentric.to_array();
                seen.then(|| self.patches.at(hit.triangle, u, v) as u32)
            })
            .collect();
        hits.sort_unstable();
        hits.dedup();
        hits
    }

    /// Whether a patch's middle is seen from a station, and if so the cosine it is seen at.
    pub fn sees(&self, station: Vec3, patch: usize) -> Option<f32> {
        let to = self.middles[patch] - station;
        let distance = to.length();
        let direction = to / distance;
        let normal = self.scene.mesh.normal(self.patches.triangle(patch));
        if !self.counts(distance, direction, normal) {
            return None;
        }
        // short of the surface by what single precision needs
        let lift = 1e-4 * (1.0 + self.middles[patch].abs().max_element().max(station.abs().max_element()));
        let cos = normal.dot(direction).abs();
        let short = lift / cos.max(0.05);
        let blocked = self.scene.tracer.occluded(&Ray { origin: station, direction }, 1e-3, distance - short);
        (!blocked).then_some(cos)
    }
}

/// How well each patch of the surface is seen.
#[derive(Clone, Debug, Default)]
pub struct PatchVisibility {
    /// How many stations see each patch.
    pub stations: Vec<u8>,
    /// The best cosine of incidence; 0 where none sees it.
    pub cosine: Vec<f32>,
    /// The number of the first station that sees it; `u32::MAX` where none does.
    pub first: Vec<u32>,
}

impl PatchVisibility {
    /// From stations, for the patches in `of`.
    pub fn from(surface: &Surface<'_>, stations: &[Vec3], of: &[bool]) -> Self {
        let one = |patch: usize| {
            let stations = (0u32..).zip(stations).filter(|_| of[patch]);
            let seen = stations.filter_map(|(i, s)| Some((i, surface.sees(*s, patch)?)));
            seen.fold((0u8, (0f32, u32::MAX)), |(n, (best, first)), (i, cos)| {
                (n.saturating_add(1), (best.max(cos), first.min(i)))
            })
        };
        let (stations, (cosine, first)) = (0..surface.patches.len()).into_par_iter().map(one).unzip();
        Self { stations, cosine, first }
    }
}
