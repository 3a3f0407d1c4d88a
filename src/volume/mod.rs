//! The irradiance volume (paper, section 4.2): light where no probe sees.
//!
//! The paper averages the records inside each cell and lets neighbouring cells fill the empty ones. That spreads sun
//! patches and leaks through walls. Here the empty places are filled by what actually lights them: rays cast from a
//! place on the unseen surface find surfaces that probes did see, whose radiance is known, the sky behind windows, and
//! other unseen places, with which they exchange light until it settles. Neighbours that differ by no more than their
//! noise are averaged. Values are directional and sit on the surfaces inside each cell; a point takes them from the
//! cells around it, as far as no wall stands between.
//!
//! ```
//! use clerestory::volume::{Nearby, VolumeSettings, Transport, Volume};
//! # use clerestory::glam::{Mat3, Vec3};
//! # use clerestory::panorama::{Picture, Projection, Radiometry};
//! # use clerestory::shoot::{Hits, Light, charted};
//! # use std::sync::Arc;
//! # mod given {
//! #     include!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/common/room.rs"));
//! # }
//! # use given::room;
//! # let scene = room(); // 4 × 3 × 2.5 m, grey: half of the light comes back
//! # let panorama = Picture { width: 64, height: 32, pixels: vec![Vec3::splat(0.2); 64 * 32] };
//! # let (chart, picture) = charted(panorama, Projection::LatLong);
//! # let hits = Arc::new(Hits::shoot(&scene, Vec3::new(2.0, 1.5, 1.2), Mat3::IDENTITY, chart));
//! # let light = Light::new(&scene, [(hits, &picture, Radiometry::default())], None, None);
//! // irradiance at a point of the floor, gathered from what the probe saw of the other walls
//! let point = (Vec3::new(1.0, 1.0, 0.0), Vec3::Z);
//! let settings = VolumeSettings { cells: 8, rays: 512, ..VolumeSettings::default() };
//! let transport = Transport::cast(&scene, &[point], &[&light], &settings);
//! let volume = Volume::new(&scene, &transport, &light);
//! let filled = volume.irradiance(&scene, point.0, point.1, &mut Nearby::default()).expect("was asked for");
//! assert!((filled.irradiance / (std::f32::consts::PI * 0.2) - 1.0).abs().max_element() < 0.05);
//! ```

mod cache_points;
mod exchange;
mod filled;
mod gathered;
mod grid;
mod guide;
mod nearby;
mod smooth;
#[cfg(test)]
mod tests;
mod transfer;
mod transport;

pub use cache_points::{CachePoint, CachePoints, Weighted};
pub use filled::Filled;
pub(crate) use filled::irradiance;
pub use grid::Grid;
pub use nearby::Nearby;
pub use transfer::VolumeTransfer;
pub use transport::{Transport, VolumeSettings};

use glam::{Vec3, Vec3A};
use rayon::prelude::*;
use std::f32::consts::PI;

use crate::panorama::luminance;
use crate::scene::{Ray, Scene};
use crate::shoot::Light;
use gathered::Gathered;
use guide::Guide;
use nearby::VisiblePoints;
use smooth::evened;
use transport::first_met;

/// Irradiance at cache points on unseen surfaces, without the sun that falls on them directly.
pub struct Volume<'a> {
    transport: &'a Transport,
    /// Per gathered place the vector irradiance of each channel, E(n) = n · vector.
    vectors: Vec<[Vec3; 3]>,
    /// Per gathered place the share of its hemisphere from where somebody tells what light comes.
    told: Vec<f32>,
    open: bool,
    /// How the places were evened out.
    shares: Vec<Vec<(u32, f32)>>,
}

impl<'a> Volume<'a> {
    /// Sends a lighting along the rays of a transport.
    pub fn new(scene: &Scene, transport: &'a Transport, light: &Light) -> Self {
        let Transport { cache_points, gathered, .. } = transport;
        // what arrives from seen surfaces, the sky, and unseen surfaces in direct sun
        let (first, sums): (Vec<[Vec3; 3]>, Vec<[f32; 2]>) = gathered
            .par_iter()
            .map(|g| {
                let mut vectors = [Vec3::ZERO; 3];
                let (mut squares, mut all, mut untold) = (0.0, 0.0, 0.0);
                let normal = cache_points.list[g.cache_point as usize].normal;
                let mut add = |weight: Vec3, radiance: Vec3| {
                    add(&mut vectors, weight, radiance);
                    squares += (weight.dot(normal) * luminance(radiance)).powi(2);
                    all += weight.dot(normal);
                };
                for s in &g.sky {
                    let told = light.told_sky(s.direction);
                    untold += if told.is_none() { s.weight.dot(normal) } else { 0.0 };
                    add(s.weight, told.unwrap_or_else(|| light.beyond(scene, s.direction)));
                }
                for s in &g.seen {
                    add(s.weight, s.rho * light.of_cell(scene, s.probe, s.cell));
                }
                for u in &g.unseen {
                    let in_sun = || transport.in_sun(scene, light, u);
                    let direct = || if in_sun() { light.unshadowed_sun(u.normal) } else { Vec3::ZERO };
                    let e = if u.linked { None } else { light.observe_untrusted(scene, u.position, u.normal) };
                    add(u.weight, u.rho * e.unwrap_or_else(direct));
                }
                (vectors, [squares, if all > 0.0 { 1.0 - untold / all } else { 1.0 }])
            })
            .unzip();
        let (squares, told): (Vec<f32>, Vec<f32>) = sums.into_iter().map(|[squares, told]| (squares, told)).unzip();
        let settled = bounced(transport, first);
        let shares = transport.beside.shares(cache_points, gathered, &settled, &squares);
        let vectors = evened(&settled, &shares);
        let open = told.iter().any(|t| *t < Filled::TOLD);
        Self { transport, vectors, told, open, shares }
    }

    /// Whether some of its places see much of what nobody tells of, as in an open scan.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Number of cache points that hold a value.
    pub fn len(&self) -> usize {
        (0..self.transport.places.len()).filter(|&i| self.transport.place(i as u32).is_some()).count()
    }

    /// Whether no cache point holds a value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Irradiance on a surface, without direct sun; `None` where no value is near that the point can see. `near` keeps
    /// what was found for the last point, which serves for points close by.
    pub fn irradiance(&self, scene: &Scene, point: Vec3, normal: Vec3, near: &mut Nearby) -> Option<Filled> {
        let (mut sum, mut told, mut total) = (Vec3::ZERO, 0.0, 0.0);
        self.take(scene, point, normal, near, |place, weight| {
            sum += irradiance(&self.vectors[place], normal) * weight;
            told += self.told[place] * weight;
            total += weight;
        });
        (total > 0.0).then(|| Filled { irradiance: sum / total, told: told / total })
    }

    /// Tells the gathered places that a point takes its value from, with their weights.
    #[inline]
    fn take(&self, scene: &Scene, point: Vec3, normal: Vec3, near: &mut Nearby, mut tell: impl FnMut(usize, f32)) {
        /// How far from a point, in cells, what it sees counts as seen.
        const CLOSE: f32 = 0.15;
        let cache_points = &self.transport.cache_points;
        let close = CLOSE * cache_points.grid.cell_m;
        let seen = near.seen.get(point, normal, close).unwrap_or_else(|| {
            cache_points.around(point, normal, &mut near.around);
            near.around.retain(|f| self.transport.place(f.1).is_some());
            let mut seen = VisiblePoints::default();
            cache_points.taken(scene, point, normal, &near.around, |_, index| seen.push(index));
            near.seen.put(point, normal, close, seen);
            seen
        });
        for index in seen.iter() {
            if let Some(place) = self.transport.place(index) {
                tell(place, cache_points.weight(index, point, normal));
            }
        }
    }

    /// Irradiance on a surface without direct sun, gathered on the spot by a few rays: for the odd point that has no
    /// value near.
    pub fn gather(&self, scene: &Scene, light: &Light, point: Vec3, normal: Vec3, near: &mut Nearby) -> Filled {
        const RAYS: u32 = 32;
        /// How far from a point, in cells, what was gathered for it is taken over.
        const CLOSE: f32 = 0.25;
        let cache_points = &self.transport.cache_points;
        let close = CLOSE * cache_points.grid.cell_m;
        if let Some(known) = near.gathered.get(point, normal, close) {
            return known;
        }
        let origin = point + normal * cache_points.lift();
        let lobes = Guide::default().of(origin, normal, &[]);
        let (mut sum, mut untold) = (Vec3::ZERO, 0);
        for k in 0..RAYS {
            let Some((direction, density)) = lobes.sample(0.5, cache_points::plastic(u64::from(k))) else { continue };
            let spread = (RAYS as f32 * density).recip().sqrt();
            sum += match first_met(scene, &Ray { origin, direction }, spread) {
                None => light.told_sky(direction).unwrap_or_else(|| {
                    untold += 1;
                    light.beyond(scene, direction)
                }),
                Some((ray, hit)) => {
                    let s = scene.surface(&ray, &hit);
                    let direct = || light.direct_sun(scene, s.position, s.normal);
                    let e = match light.nearest(scene, s.position, s.normal) {
                        Some(e) => e,
                        None => match self.irradiance(scene, s.position, s.normal, near) {
                            Some(filled) => filled.irradiance + direct(),
                            None => light.observe_untrusted(scene, s.position, s.normal).unwrap_or_else(direct),
                        },
                    };
                    scene.filtered_albedo(s.triangle, s.barycentric, 0.3 * hit.t) * e / PI
                }
            };
        }
        let gathered = Filled { irradiance: sum * (PI / RAYS as f32), told: 1.0 - untold as f32 / RAYS as f32 };
        near.gathered.put(point, normal, close, gathered);
        gathered
    }
}

/// What unseen places have when they have sent each other light until it settles, from what first arrives at them.
fn bounced(transport: &Transport, mut vectors: Vec<[Vec3; 3]>) -> Vec<[Vec3; 3]> {
    let Transport { cache_points, gathered, exchange, .. } = transport;
    let received = |(vectors, g): (&[Vec3; 3], &Gathered)| {
        Vec3A::from(irradiance(vectors, cache_points.list[g.cache_point as usize].normal))
    };
    let settled = exchange.settled(vectors.par_iter().zip(gathered).map(received).collect());
    vectors.par_iter_mut().zip(gathered).for_each(|(vectors, g)| {
        for link in &g.links {
            let theirs = settled[link.other as usize].to_array();
            for ((sum, weight), e) in vectors.iter_mut().zip(link.weights).zip(theirs) {
                *sum += weight * e;
            }
        }
    });
    vectors
}

fn add(vectors: &mut [Vec3; 3], weight: Vec3, radiance: Vec3) {
    for (v, l) in vectors.iter_mut().zip(radiance.to_array()) {
        *v += weight * l;
    }
}
