//! Where bright things are, so that rays find them.
//!
//! An interior is lit by a few small and very bright things: windows and sun patches. Rays cast blindly find them
//! seldom. A guide is a list of spheres around them; part of the rays go towards the spheres, and each ray is weighted by
//! the probability of its direction under the whole mixture (Veach and Guibas, *Optimally Combining Sampling Techniques*,
//! 1995), so a poor guide costs noise and never a wrong mean.

use glam::{Vec2, Vec3};
use std::collections::BTreeMap;
use std::f32::consts::{PI, TAU};

use super::Grid;

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
pub struct Guide {
    spheres: Vec<Sphere>,
}

/// A guide as seen from one point.
pub struct Lobes {
    normal: Vec3,
    lobes: Vec<Lobe>,
    /// Running sum of the lobes' shares, ends at 1.
    running: Vec<f32>,
}

struct Lobe {
    axis: Vec3,
    cos: f32,
    /// Share of the guided rays ÷ solid angle.
    density: f32,
}

/// Share of rays that follow the guide.
const GUIDED: f32 = 0.5;

/// A point follows at most so many of the guide's spheres.
const MOST_LOBES: usize = 48;

impl Guide {
    /// From bright pieces (position, radiance × area), one sphere per grid cell.
    pub fn new(grid: &Grid, pieces: impl Iterator<Item = (Vec3, f32)>) -> Self {
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

    /// The guide from a point on a surface.
    pub fn from(&self, point: Vec3, normal: Vec3) -> Lobes {
        let mut seen: Vec<(f32, Lobe)> = Vec::with_capacity(self.spheres.len());
        for s in &self.spheres {
            let d = s.centre - point;
            let d2 = d.length_squared();
            let sin2 = s.radius * s.radius / d2;
            // inside a sphere, or all of it below the horizon: blind rays do
            if sin2 > 0.8 || d.dot(normal) < -s.radius {
                continue;
            }
            let cos = (1.0 - sin2).sqrt();
            let axis = d / d2.sqrt();
            let share = s.power / d2 * (axis.dot(normal) + sin2.sqrt()).clamp(0.02, 1.0);
            seen.push((share, Lobe { axis, cos, density: share / (TAU * (1.0 - cos)) }));
        }
        if seen.len() > MOST_LOBES {
            seen.select_nth_unstable_by(MOST_LOBES, |a, b| b.0.total_cmp(&a.0));
            seen.truncate(MOST_LOBES);
        }
        let total: f32 = seen.iter().map(|s| s.0).sum();
        let inv = if total > 0.0 { 1.0 / total } else { 0.0 };
        let mut sum = 0.0;
        let mut running = Vec::with_capacity(seen.len());
        let mut lobes = Vec::with_capacity(seen.len());
        for (share, mut lobe) in seen {
            sum += share * inv;
            lobe.density *= inv;
            running.push(sum);
            lobes.push(lobe);
        }
        Lobes { normal, lobes, running }
    }
}

impl Lobes {
    /// A direction and the probability density of it per steradian; `None` where it falls below the horizon. `pick`
    /// chooses the kind of ray, `at` the direction, both evenly spread over 0..1.
    pub fn sample(&self, pick: f32, at: Vec2) -> Option<(Vec3, f32)> {
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
        let density: f32 = self
            .lobes
            .iter()
            .map(|l| if direction.dot(l.axis) >= l.cos * (1.0 - 1e-6) { l.density } else { 0.0 })
            .sum();
        Some((direction, guided * density + (1.0 - guided) * cos / PI))
    }
}

/// The unit vector at an angle (given by its cosine) from an axis, and a fraction of a turn about it.
fn about(axis: Vec3, cos: f32, turn: f32) -> Vec3 {
    let (t, b) = axis.any_orthonormal_pair();
    let (s, c) = (turn * TAU).sin_cos();
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    t * (sin * c) + b * (sin * s) + axis * cos
}
