//! Evens out the noise of the volume's values: places that see each other and face alike are mostly lit alike.
//!
//! Each place averages its own light with that of the places beside it, a neighbour counting less the farther its light
//! is from the place's own, measured by the noise of both (as in non-local means: Rousselle, Knaus and Zwicker,
//! *Adaptive rendering with non-local means filtering*, 2012). Real differences of light stay; noise goes.

use glam::Vec3;
use rayon::prelude::*;

use super::cache_points::CachePoints;
use super::filled::irradiance;
use super::gathered::Gathered;
use crate::panorama::luminance;
use crate::scene::Scene;

/// Per gathered place the others beside it: index among the gathered, and how much each counts if lit alike.
#[derive(Default)]
pub(super) struct Neighbours(Vec<Vec<(u32, f32)>>);

impl Neighbours {
    /// Finds for each gathered place the gathered places beside it that it sees; `places` holds for each cache point the index
    /// of the gathered place that stands for it.
    pub(super) fn find(scene: &Scene, cache_points: &CachePoints, gathered: &[Gathered], places: &[u32]) -> Self {
        /// So many neighbours are enough.
        const ENOUGH: usize = 12;
        /// Cosine between normals from which on a place's vector irradiance, gathered over its own hemisphere, may speak
        /// for another.
        const FACING: f32 = 0.9;
        // a cache point that is gathered stands for itself
        let is_gathered = |cache_point: u32| {
            gathered.get(places[cache_point as usize] as usize).is_some_and(|g| g.cache_point == cache_point)
        };
        let beside = |found: &mut Vec<_>, g: &Gathered| -> Vec<(u32, f32)> {
            let here = cache_points.list[g.cache_point as usize];
            cache_points.around(here.position, here.normal, found);
            let alike = |other: u32| cache_points.list[other as usize].normal.dot(here.normal) > FACING;
            let others = found.iter().filter(|f| f.1 != g.cache_point && is_gathered(f.1) && alike(f.1));
            let seen = others.filter(|f| cache_points.sees(scene, f.1, here.position, here.normal)).take(ENOUGH);
            seen.map(|f| (places[f.1 as usize], (f.0 / CachePoints::FULL_WEIGHT).sqrt())).collect()
        };
        Self(gathered.par_iter().with_max_len(64).map_init(Vec::new, beside).collect())
    }

    /// What each place's evened vector irradiance is made of: places with their shares, which add up to 1, itself first.
    /// `squares` is for each place the sum of the squares of what its rays add to its irradiance (luminance).
    pub(super) fn shares(
        &self,
        cache_points: &CachePoints,
        gathered: &[Gathered],
        vectors: &[[Vec3; 3]],
        squares: &[f32],
    ) -> Vec<Vec<(u32, f32)>> {
        /// A difference whose square is so many times the noise of both counts as noise.
        const SURE: f32 = 2.0;
        let variance = |place: usize| {
            let (g, vectors) = (&gathered[place], &vectors[place]);
            let e = luminance(irradiance(vectors, cache_points.list[g.cache_point as usize].normal));
            (squares[place] - e * e / g.rays as f32).max(0.0)
        };
        let variance: Vec<f32> = (0..gathered.len()).map(variance).collect();
        let mean = |(i, others): (usize, &Vec<(u32, f32)>)| {
            let normal = cache_points.list[gathered[i].cache_point as usize].normal;
            let bright = |place: usize| luminance(irradiance(&vectors[place], normal));
            let here = bright(i);
            let weight = |&(other, share): &(u32, f32)| {
                let noise = variance[i] + variance[other as usize];
                let off = (bright(other as usize) - here).powi(2);
                (other, share * (-(off - SURE * noise).max(0.0) / noise.max(f32::MIN_POSITIVE)).exp())
            };
            let mut shares: Vec<(u32, f32)> =
                std::iter::once((i as u32, 1.0)).chain(others.iter().map(weight)).collect();
            let total: f32 = shares.iter().map(|s| s.1).sum();
            shares.iter_mut().for_each(|s| s.1 /= total);
            shares
        };
        self.0.par_iter().enumerate().map(mean).collect()
    }
}

/// The vector irradiances evened out by [shares](Neighbours::shares).
pub(super) fn evened(vectors: &[[Vec3; 3]], shares: &[Vec<(u32, f32)>]) -> Vec<[Vec3; 3]> {
    let mean = |shares: &Vec<(u32, f32)>| {
        shares.iter().fold([Vec3::ZERO; 3], |mut sum, &(place, share)| {
            for (sum, v) in sum.iter_mut().zip(vectors[place as usize]) {
                *sum += v * share;
            }
            sum
        })
    };
    shares.par_iter().map(mean).collect()
}
