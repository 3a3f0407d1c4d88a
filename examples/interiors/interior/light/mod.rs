//! Light on the surfaces of a place, once for all of its pictures.
//!
//! The sun is kept apart, since its edges are sharp. Everything else, the light of windows and lamps and what surfaces
//! send on, changes slowly: it is gathered at spots some centimetres apart and averaged between them. Windows, lamps and
//! sunlit places are sampled as lights, the rest by a fixed set of rays from each spot whose ends are looked up until the
//! spots agree (radiosity by point-to-point links; the split of the sun's light by distance follows Kollig and Keller,
//! *Illumination in the Presence of Weak Singularities*, 2004). All pictures of a place show the same light.

mod lamps;
mod receiver;

pub use lamps::{Lamps, Portal};
pub use receiver::sunlight;

use clerestory::scene::Scene;
use glam::{IVec3, Vec3};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::f32::consts::PI;
use std::hash::{BuildHasherDefault, Hasher};

use lamps::{Emitters, sunlit};
use receiver::{Gathered, Sources};

/// Distance between spots that face about the same way, metres.
const SPACING: f32 = 0.1;
/// Side of the cells by which spots are found, metres.
const CELL: f32 = 0.2;
/// Standard deviation of the weights between spots, metres: in pictures, and before that among the spots themselves.
/// Neighbours are looked for one cell and two cells away, where next to nothing of the weight is left.
const SIGMA: f32 = 0.075;
const SIGMA_OF_SPOTS: f32 = 0.16;
/// Times that light is passed on.
const ROUNDS: usize = 24;

/// Where light is known.
struct Spot {
    position: Vec3,
    normal: Vec3,
    irradiance: Vec3,
}

/// Irradiance but the sun's, everywhere on the surfaces that were asked for.
pub struct Field {
    spots: Vec<Spot>,
    cells: HashMap<IVec3, Vec<u32>, Quick>,
    mean: Vec3,
}

/// A point on a surface, and its normal on the side that is seen.
pub type Place = (Vec3, Vec3);

impl Field {
    /// Gathers the light at all `places` (and where their light comes from), with so many `links` from each.
    pub fn new(scene: &Scene, lamps: &Lamps, places: impl Iterator<Item = Place>, links: usize, seed: u64) -> Self {
        let mut field = Self { spots: Vec::new(), cells: HashMap::default(), mean: Vec3::ZERO };
        for (position, normal) in places {
            field.add(position, normal);
        }
        let sunlit = sunlit(scene, lamps, seed);
        let sources =
            Sources { scene, lamps, emitters: Emitters::new(scene), sunlit, links, samples: links.div_ceil(3), seed };
        let mut seen = field.gather(&sources, 0);
        // what lights the seen places but is not seen itself gets spots too, farther apart
        let first = field.spots.len();
        let mut cells = HashSet::new();
        for end in seen.iter().flat_map(|g| &g.ends) {
            let key = (cell(end.position / 1.5), end.normal.round().as_ivec3());
            if field.nearest(end.position, end.normal).is_none() && cells.insert(key) {
                field.insert(end.position, end.normal);
            }
        }
        seen.extend(field.gather(&sources, first));
        field.settle(&seen, links as f32);
        field.smooth();
        field
    }

    /// Adds a spot unless there is one near with about its normal.
    fn add(&mut self, position: Vec3, normal: Vec3) {
        let near = |s: &Spot| s.normal.dot(normal) > 0.85 && s.position.distance_squared(position) < SPACING * SPACING;
        if !self.around(position, 1).any(|i| near(&self.spots[i as usize])) {
            self.insert(position, normal);
        }
    }

    fn insert(&mut self, position: Vec3, normal: Vec3) {
        self.cells.entry(cell(position)).or_default().push(self.spots.len() as u32);
        self.spots.push(Spot { position, normal, irradiance: Vec3::ZERO });
    }

    /// The spots in the cells around a point, `reach` cells far.
    fn around(&self, position: Vec3, reach: i32) -> impl Iterator<Item = u32> {
        let cell = cell(position);
        let line = move || -reach..=reach;
        let near = line().flat_map(move |x| line().flat_map(move |y| line().map(move |z| IVec3::new(x, y, z))));
        near.filter_map(move |d| self.cells.get(&(cell + d))).flatten().copied()
    }

    /// The spot that is most like a place.
    fn nearest(&self, position: Vec3, normal: Vec3) -> Option<u32> {
        let cost = |i: u32| {
            let s = &self.spots[i as usize];
            s.position.distance_squared(position) + 0.05 * (1.0 - s.normal.dot(normal))
        };
        let alike = self.around(position, 1).filter(|&i| self.spots[i as usize].normal.dot(normal) > 0.5);
        alike.min_by(|&a, &b| cost(a).total_cmp(&cost(b)))
    }

    /// Irradiance on a place: the mean of the spots around it that lie on its surface.
    pub fn irradiance(&self, position: Vec3, normal: Vec3) -> Vec3 {
        self.mean_around(position, normal, SIGMA, 1)
            .or_else(|| self.nearest(position, normal).map(|i| self.spots[i as usize].irradiance))
            .unwrap_or(self.mean)
    }

    /// The mean of the spots around a place that lie on its surface, by distance.
    fn mean_around(&self, position: Vec3, normal: Vec3, sigma: f32, reach: i32) -> Option<Vec3> {
        let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
        for i in self.around(position, reach) {
            let s = &self.spots[i as usize];
            let cosine = s.normal.dot(normal);
            if cosine < 0.3 {
                continue;
            }
            let apart = s.position - position;
            let height = apart.dot(normal).powi(2) / (0.015 + 0.1 * apart.length()).powi(2);
            let w = (-apart.length_squared() / (2.0 * sigma * sigma) - height).exp() * cosine.powi(16);
            sum += w * s.irradiance;
            weight += w;
        }
        (weight > 1e-6).then(|| sum / weight)
    }

    /// Takes what is left of the noise out of the spots.
    fn smooth(&mut self) {
        let smoothed: Vec<Vec3> = self
            .spots
            .par_iter()
            .map(|s| self.mean_around(s.position, s.normal, SIGMA_OF_SPOTS, 2).unwrap_or(s.irradiance))
            .collect();
        for (spot, light) in self.spots.iter_mut().zip(smoothed) {
            spot.irradiance = light;
        }
    }

    /// What arrives at the spots from `first` on.
    fn gather(&self, sources: &Sources, first: usize) -> Vec<Gathered> {
        let all = (first..self.spots.len()).into_par_iter();
        all.map(|i| sources.gather(i, (self.spots[i].position, self.spots[i].normal))).collect()
    }

    /// Passes light on along the links, `count` from each spot, until all of it has arrived.
    fn settle(&mut self, gathered: &[Gathered], count: f32) {
        let links: Vec<Vec<(u32, Vec3)>> = gathered
            .par_iter()
            .map(|g| g.ends.iter().filter_map(|e| Some((self.nearest(e.position, e.normal)?, e.albedo))).collect())
            .collect();
        let mut light: Vec<Vec3> = gathered.iter().map(|g| g.direct).collect();
        for _ in 0..ROUNDS {
            light = (0..light.len())
                .into_par_iter()
                .map(|i| {
                    let passed: Vec3 = links[i].iter().map(|&(j, albedo)| albedo * light[j as usize]).sum();
                    gathered[i].direct + passed / count
                })
                .collect();
        }
        self.mean = light.iter().sum::<Vec3>() / light.len().max(1) as f32;
        for (spot, light) in self.spots.iter_mut().zip(light) {
            spot.irradiance = light;
        }
    }
}

/// A hash that is quick for cells; what is looked up is never gone through in the order of hashes.
type Quick = BuildHasherDefault<CellHasher>;

/// Multiplies and turns, number by number.
#[derive(Default)]
struct CellHasher(u64);

impl Hasher for CellHasher {
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&b| self.write_i32(i32::from(b)));
    }

    fn write_i32(&mut self, number: i32) {
        self.0 = (self.0.rotate_left(23) ^ number as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }

    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }
}

fn cell(position: Vec3) -> IVec3 {
    (position / CELL).floor().as_ivec3()
}

/// Radiance that a diffuse surface sends out.
pub fn diffuse(albedo: Vec3, irradiance: Vec3) -> Vec3 {
    albedo * irradiance / PI
}
