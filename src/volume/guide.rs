//! Where bright things are, so that rays find them.
//!
//! An interior is lit by a few small and very bright things: windows and sun patches. Rays cast blindly find them
//! seldom. A guide is a list of spheres around them; part of the rays go towards the spheres, and each ray is weighted by
//! the probability of its direction under the whole mixture (Veach and Guibas, *Optimally Combining Sampling Techniques*,
//! 1995), so a poor guide costs noise and never a wrong mean.

use glam::{Vec2, Vec3, Vec4};
use std::collections::BTreeMap;
use std::f32::consts::{PI, TAU};

use super::Grid;
use crate::scene::{Ray, Scene};
use crate::sphere::across;

/// A bright thing.
#[derive(Clone, Copy, Debug)]
struct Sphere {
    centre: Vec3,
    radius: f32,
    /// Radiance × area, summed over channels.
    power: f32,
}

/// Bright things in a scene.
#[derive(Clone, Debug, Default)]
pub(super) struct Guide {
    spheres: Vec<Sphere>,
}

/// A guide as seen from one point.
pub(super) struct Lobes {
    normal: Vec3,
    lobes: Vec<Lobe>,
    fours: Vec<Four>,
    /// Running sum of the lobes' shares, ends at 1.
    running: Vec<f32>,
}

/// Directions within an angle of an axis, given by its cosine.
struct Lobe {
    axis: Vec3,
    cos: f32,
}

/// Four lobes beside each other: axes, the cosines down to which a direction lies inside, and the share of the guided rays ÷
/// solid angle.
struct Four {
    axis: [Vec4; 3],
    cos: Vec4,
    density: Vec4,
}

/// Share of rays that follow the guide.
const GUIDED: f32 = 0.5;

impl Guide {
    /// From bright pieces (position, radiance × area), one sphere per grid cell.
    pub(super) fn new(grid: &Grid, pieces: impl Iterator<Item = (Vec3, f32)>) -> Self {
        #[derive(Default)]
        struct Sum {
            power: f64,
            first: glam::DVec3,
            second: f64,
        }
        let mut cells: BTreeMap<usize, Sum> = BTreeMap::new();
        for (position, power) in pieces {
            let Some(index) = grid.index(grid.cell(position)) else { continue };
            let (p, w) = (position.as_dvec3(), f64::from(power));
            let sum = cells.entry(index).or_default();
            sum.power += w;
            sum.first += p * w;
            sum.second += p.length_squared() * w;
        }
        let spheres = cells
            .into_values()
            .filter(|s| s.power > 0.0)
            .map(|s| {
                let centre = s.first / s.power;
                let variance = (s.second / s.power - centre.length_squared()).max(0.0);
                let radius = (1.5 * variance.sqrt() as f32).max(0.1 * grid.cell_m);
                Sphere { centre: centre.as_vec3(), radius, power: s.power as f32 }
            })
            .collect();
        Self { spheres }
    }

    /// The spheres that matter most to the surfaces around a point, each with how much it counts: those that nothing
    /// hides from the point count fully.
    pub(super) fn clear(&self, scene: &Scene, point: Vec3, normal: Vec3, most: usize) -> Vec<(u32, f32)> {
        /// What is hidden from one point may yet be seen from another beside it.
        const HIDDEN: f32 = 0.1;
        let best = self.best(point, normal, most, (0..self.spheres.len() as u32).map(|i| (i, 1.0)));
        let clear = |i: u32| {
            let s = &self.spheres[i as usize];
            let d = s.centre - point;
            let length = d.length();
            let ray = Ray { origin: point, direction: d / length };
            d.dot(normal) <= 0.0 || !scene.tracer.occluded(&ray, 1e-4, length - s.radius)
        };
        best.into_iter().map(|(_, i)| (i, if clear(i) { 1.0 } else { HIDDEN })).collect()
    }

    /// The spheres that shed most light on a surface, with their share of it.
    fn best(
        &self,
        point: Vec3,
        normal: Vec3,
        most: usize,
        spheres: impl Iterator<Item = (u32, f32)>,
    ) -> Vec<(f32, u32)> {
        let mut seen: Vec<(f32, u32)> = Vec::with_capacity(self.spheres.len());
        for (i, factor) in spheres {
            let s = &self.spheres[i as usize];
            let d = s.centre - point;
            let (d2, along) = (d.length_squared(), d.dot(normal));
            // inside a sphere, or all of it below the horizon: blind rays do
            if s.radius * s.radius > 0.8 * d2 || along < -s.radius {
                continue;
            }
            seen.push((factor * s.power / d2 * ((along + s.radius) / d2.sqrt()).clamp(0.02, 1.0), i));
        }
        if seen.len() > most {
            seen.select_nth_unstable_by(most, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            seen.truncate(most);
            // selection leaves them in an order that a last digit may turn over
            seen.sort_unstable_by_key(|s| s.1);
        }
        seen
    }

    /// The guide from a point on a surface, of these spheres only.
    pub(super) fn of(&self, point: Vec3, normal: Vec3, spheres: &[(u32, f32)]) -> Lobes {
        let seen = self.best(point, normal, spheres.len(), spheres.iter().copied());
        let total: f32 = seen.iter().map(|s| s.0).sum();
        let inv = if total > 0.0 { 1.0 / total } else { 0.0 };
        let mut sum = 0.0;
        let mut all = Lobes { normal, lobes: Vec::with_capacity(seen.len()), running: Vec::new(), fours: Vec::new() };
        for (i, &(share, sphere)) in seen.iter().enumerate() {
            let s = &self.spheres[sphere as usize];
            let d = s.centre - point;
            let d2 = d.length_squared();
            let lobe = Lobe { axis: d / d2.sqrt(), cos: (1.0 - s.radius * s.radius / d2).sqrt() };
            sum += share * inv;
            all.running.push(sum);
            if i % 4 == 0 {
                all.fours.push(Four::NONE);
            }
            if let Some(four) = all.fours.last_mut() {
                four.put(i % 4, &lobe, share * inv / (TAU * (1.0 - lobe.cos)));
            }
            all.lobes.push(lobe);
        }
        all
    }
}

impl Four {
    /// No direction lies inside.
    const NONE: Self = Self { axis: [Vec4::ZERO; 3], cos: Vec4::INFINITY, density: Vec4::ZERO };

    fn put(&mut self, lane: usize, lobe: &Lobe, density: f32) {
        for (axis, value) in self.axis.iter_mut().zip(lobe.axis.to_array()) {
            axis[lane] = value;
        }
        // a direction sampled on the rim lies inside, whatever rounding says
        self.cos[lane] = lobe.cos * (1.0 - 1e-6);
        self.density[lane] = density;
    }

    /// What the lobes around a direction add to its density.
    fn density(&self, direction: Vec3) -> Vec4 {
        let [x, y, z] = self.axis;
        let along = x * direction.x + y * direction.y + z * direction.z;
        Vec4::select(along.cmpge(self.cos), self.density, Vec4::ZERO)
    }
}

impl Lobes {
    /// A direction and the probability density of it per steradian; `None` where it falls below the horizon. `pick`
    /// chooses the kind of ray, `at` the direction, both evenly spread over 0..1.
    pub(super) fn sample(&self, pick: f32, at: Vec2) -> Option<(Vec3, f32)> {
        let guided = if self.lobes.is_empty() { 0.0 } else { GUIDED };
        let direction = if pick < guided {
            let k = self.running.partition_point(|&r| r < pick / guided).min(self.lobes.len() - 1);
            let lobe = &self.lobes[k];
            about(lobe.axis, 1.0 - at.x * (1.0 - lobe.cos), at.y)
        } else {
            about(self.normal, (1.0 - at.x).sqrt(), at.y)
        };
        let cos = direction.dot(self.normal);
        if cos <= 0.0 {
            return None;
        }
        let density = self.fours.iter().fold(Vec4::ZERO, |sum, four| sum + four.density(direction)).element_sum();
        Some((direction, guided * density + (1.0 - guided) * cos / PI))
    }
}

/// The unit vector at an angle (given by its cosine) from an axis, and a fraction of a turn about it.
fn about(axis: Vec3, cos: f32, turn: f32) -> Vec3 {
    let (t, b) = across(axis);
    let (s, c) = (turn * TAU).sin_cos();
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    t * (sin * c) + b * (sin * s) + axis * cos
}
