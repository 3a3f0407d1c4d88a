//! The irradiance volume (paper, section 4.2): light where no probe sees.
//!
//! The paper averages the records inside each cell and lets neighbouring cells fill the empty ones. That spreads sun
//! patches and leaks through walls. Here the empty places are filled by what actually lights them: rays cast from a
//! place on the unseen surface find surfaces that probes did see, whose radiance is known, the sky behind windows, and
//! other unseen places, with which they exchange light until it settles. Values are directional and sit on the surfaces
//! inside each cell; a point takes them from the cells around it, as far as no wall stands between.

mod anchors;
mod grid;
mod guide;
#[cfg(test)]
mod tests;
mod transport;

pub use anchors::{Anchor, Anchors, Weighted};
pub use grid::Grid;
pub use guide::{Guide, Lobes};
pub use transport::{Settings, Transport};

use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::PI;
use transport::Source;

use crate::scene::{Ray, Scene};
use crate::shoot::Light;

/// Irradiance at anchors on unseen surfaces, without the sun that falls on them directly.
pub struct Volume<'a> {
    anchors: &'a Anchors,
    /// Per anchor the vector irradiance of each channel, E(n) = n · vector; `None` where not gathered.
    vectors: Vec<Option<[Vec3; 3]>>,
}

/// Unseen places exchange light at most so often. The series converges like (albedo × share of unseen surfaces)ⁿ.
const EXCHANGES: usize = 100;

/// An exchange that changes the light by less than this share is the last.
const SETTLED: f64 = 1e-4;

impl<'a> Volume<'a> {
    /// Sends a lighting along the rays of a transport.
    pub fn new(scene: &Scene, transport: &'a Transport, light: &Light) -> Self {
        let mut gathered = vec![false; transport.anchors.list.len()];
        for (index, _) in &transport.gathered {
            gathered[*index as usize] = true;
        }
        // what arrives from seen surfaces, the sky, and unseen surfaces in direct sun
        let first: Vec<[Vec3; 3]> = transport
            .gathered
            .par_iter()
            .map(|(_, carriers)| {
                let mut vectors = [Vec3::ZERO; 3];
                for carrier in carriers {
                    let radiance = match carrier.from {
                        Source::Sky(direction) => light.sky(direction),
                        Source::Seen { probe, cell, rho } => rho * light.records[probe as usize].light(cell),
                        Source::Unseen { position, normal, rho, anchor } => {
                            let direct = || light.direct_sun(scene, position, normal);
                            let exchanged = anchor.is_some_and(|a| gathered[a as usize]);
                            let e = if exchanged { None } else { light.glimpse(scene, position, normal) };
                            rho * e.unwrap_or_else(direct)
                        }
                    };
                    add(&mut vectors, carrier.weight, radiance);
                }
                vectors
            })
            .collect();
        let mut vectors = vec![None; transport.anchors.list.len()];
        for ((index, _), first) in transport.gathered.iter().zip(&first) {
            vectors[*index as usize] = Some(*first);
        }
        // Jacobi steps of E = first + K E: each reads only the last one's values
        for _ in 0..EXCHANGES {
            let next: Vec<[Vec3; 3]> = transport
                .gathered
                .par_iter()
                .zip(&first)
                .map(|((_, carriers), first)| {
                    let mut sum = *first;
                    for carrier in carriers {
                        if let Source::Unseen { anchor: Some(other), rho, .. } = carrier.from
                            && let Some(theirs) = &vectors[other as usize]
                        {
                            let e = irradiance(theirs, transport.anchors.list[other as usize].normal);
                            add(&mut sum, carrier.weight, rho * e);
                        }
                    }
                    sum
                })
                .collect();
            let (mut change, mut all) = (0.0, 0.0);
            for ((index, _), next) in transport.gathered.iter().zip(next) {
                let last = vectors[*index as usize].replace(next).unwrap_or_default();
                for (next, last) in next.iter().zip(last) {
                    change += f64::from(next.distance(last));
                    all += f64::from(next.length());
                }
            }
            if change <= SETTLED * all {
                break;
            }
        }
        Self { anchors: &transport.anchors, vectors }
    }

    /// Number of places that hold a value.
    pub fn len(&self) -> usize {
        self.vectors.iter().flatten().count()
    }

    /// Whether no place holds a value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Irradiance on a surface, without direct sun; `None` where no value is near that the point can see. `found` is
    /// scratch space.
    pub fn irradiance(&self, scene: &Scene, point: Vec3, normal: Vec3, found: &mut Vec<Weighted>) -> Option<Vec3> {
        /// Values of less than this share of the best one's weight are left out.
        const LEAST_SHARE: f32 = 0.05;
        /// So many values are enough.
        const ENOUGH: u32 = 8;
        self.anchors.around(point, normal, found);
        found.retain(|f| self.vectors[f.1 as usize].is_some());
        let mut sum = Vec3::ZERO;
        let mut total = 0.0;
        let mut best = 0.0;
        let mut taken = 0;
        for &(weight, index) in found.iter() {
            if weight < LEAST_SHARE * best || taken == ENOUGH {
                break;
            }
            if let Some(vectors) = &self.vectors[index as usize]
                && self.anchors.sees(scene, index, point, normal)
            {
                best = f32::max(best, weight);
                taken += 1;
                sum += irradiance(vectors, normal) * weight;
                total += weight;
            }
        }
        (total > 0.0).then(|| sum / total)
    }

    /// Irradiance on a surface without direct sun, gathered on the spot by a few rays: for the odd point that has no
    /// value near.
    pub fn gather(&self, scene: &Scene, light: &Light, point: Vec3, normal: Vec3, found: &mut Vec<Weighted>) -> Vec3 {
        const RAYS: u32 = 32;
        let origin = point + normal * self.anchors.lift();
        let lobes = Guide::default().from(origin, normal);
        let mut sum = Vec3::ZERO;
        for k in 0..RAYS {
            let Some((direction, _)) = lobes.sample(0.5, anchors::plastic(u64::from(k))) else { continue };
            let ray = Ray { origin, direction };
            sum += match scene.tracer.closest(&ray, 1e-4) {
                None => light.sky(direction),
                Some(hit) => {
                    let s = scene.surface(&ray, &hit);
                    let direct = || light.direct_sun(scene, s.position, s.normal);
                    let e = match light.observe(scene, s.position, s.normal) {
                        Some(o) => o.value(),
                        None => match self.irradiance(scene, s.position, s.normal, found) {
                            Some(e) => e + direct(),
                            None => light.glimpse(scene, s.position, s.normal).unwrap_or_else(direct),
                        },
                    };
                    scene.filtered_albedo(s.triangle, s.barycentric, 0.3 * hit.t) * e / PI
                }
            };
        }
        sum * (PI / RAYS as f32)
    }
}

/// E(n) = n · vector, per channel.
fn irradiance(vectors: &[Vec3; 3], normal: Vec3) -> Vec3 {
    Vec3::new(vectors[0].dot(normal), vectors[1].dot(normal), vectors[2].dot(normal)).max(Vec3::ZERO)
}

fn add(vectors: &mut [Vec3; 3], weight: Vec3, radiance: Vec3) {
    for (v, l) in vectors.iter_mut().zip(radiance.to_array()) {
        *v += weight * l;
    }
}
