//! The volume as a linear function of records.

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use super::smooth::evened;
use super::{Nearby, Transport, Volume, add, bounced};
use crate::lists::Lists;
use crate::scene::Scene;
use crate::shoot::Light;

/// A volume's places as functions of records and the sun, with what one lighting's light chose held fixed: which records
/// tell of a place, and how far places are evened out. What nobody measured, such as the light from [beyond](Light::beyond),
/// is taken to go with a factor that the caller gives.
pub struct VolumeTransfer<'a> {
    transport: &'a Transport,
    /// Per gathered place what records add to its vector irradiance.
    terms: Lists<Term>,
    /// Per gathered place what comes from the sky as the site gives it, and what goes with the factor.
    fixed: Vec<[[Vec3; 3]; 2]>,
    /// Per gathered place and channel: times the sun's irradiance this is vector irradiance.
    sun: Vec<[Vec3; 3]>,
    shares: &'a [Vec<(u32, f32)>],
}

/// A record's part in a place's vector irradiance.
#[derive(Clone, Copy, Default)]
struct Term {
    record: u32,
    weight: Vec3,
    rho: Vec3,
}

/// A place's terms while they are found.
#[derive(Default)]
struct PlaceTransfer {
    /// Probe and cell of a record, and its part.
    terms: Vec<(u32, u32, Vec3, Vec3)>,
    fixed: [[Vec3; 3]; 2],
    sun: [Vec3; 3],
}

impl<'a> VolumeTransfer<'a> {
    /// The places of a volume; `number` gives a record (probe, cell) its place among all that are needed.
    pub fn new(scene: &Scene, light: &Light, volume: &'a Volume, mut number: impl FnMut(u32, u32) -> u32) -> Self {
        let transport = volume.transport;
        let found: Vec<PlaceTransfer> = transport
            .gathered
            .par_iter()
            .map(|g| {
                let mut place = PlaceTransfer::default();
                for s in &g.sky {
                    match light.sky_cells(s.direction) {
                        Some((probe, cells)) => {
                            place.terms.extend(cells.iter().map(|&(cell, w)| (probe, cell, s.weight * w, Vec3::ONE)));
                        }
                        None => match light.told_sky(s.direction) {
                            Some(radiance) => add(&mut place.fixed[0], s.weight, radiance),
                            None => add(&mut place.fixed[1], s.weight, light.beyond(scene, s.direction)),
                        },
                    }
                }
                place.terms.extend(g.seen.iter().map(|s| (s.probe, s.cell, s.weight, s.rho)));
                for u in &g.unseen {
                    let mut of_records = Vec::new();
                    if !u.linked {
                        light.weigh(scene, (u.position, u.normal), true, |probe, cell, _, w| {
                            of_records.push((probe, cell, w));
                        });
                    }
                    let total: f32 = of_records.iter().map(|r| r.2).sum();
                    place.terms.extend(of_records.iter().map(|&(p, c, w)| (p, c, u.weight * (w / total), u.rho)));
                    let in_sun = of_records.is_empty() && transport.in_sun(scene, light, u);
                    let cosine = if in_sun { light.sun_cosine(u.normal) } else { 0.0 };
                    add(&mut place.sun, u.weight * cosine, u.rho);
                }
                place
            })
            .collect();
        let (mut terms, mut fixed, mut sun) = (Lists::default(), Vec::new(), Vec::new());
        for place in found {
            let own = place.terms.into_iter();
            let own = own.map(|(probe, cell, weight, rho)| Term { record: number(probe, cell), weight, rho });
            terms.push(&own.collect::<Vec<_>>());
            fixed.push(place.fixed);
            sun.push(place.sun);
        }
        Self { transport, terms, fixed, sun, shares: &volume.shares }
    }

    /// Gives record `i` the number `order[i]`.
    pub(crate) fn renumber(&mut self, order: &[u32]) {
        self.terms.items_mut().iter_mut().for_each(|t| t.record = order[t.record as usize]);
    }

    /// The vector irradiance of all gathered places, from the records' light, the sun's irradiance, and the factors of the
    /// sky as the site gives it and of what nobody measured.
    pub fn vectors(&self, records: &[Vec3A], sun: Vec3, sky: Vec3, factor: f32) -> Vec<[Vec3; 3]> {
        let first = |i: usize| {
            let [mut vectors, guessed] = self.fixed[i];
            for c in 0..3 {
                vectors[c] = vectors[c] * sky[c] + guessed[c] * factor + self.sun[i][c] * sun[c];
            }
            for t in self.terms.get(i) {
                add(&mut vectors, t.weight, t.rho * Vec3::from(records[t.record as usize]));
            }
            vectors
        };
        let first = (0..self.terms.len()).into_par_iter().map(first).collect();
        evened(&bounced(self.transport, first), self.shares)
    }
}

impl Volume<'_> {
    /// The gathered places that a point takes its value from, with shares that add up to 1; nothing where it has none.
    pub(crate) fn places(&self, scene: &Scene, point: Vec3, normal: Vec3, near: &mut Nearby) -> Vec<(u32, f32)> {
        let mut places = Vec::new();
        self.take(scene, point, normal, near, |place, weight| places.push((place as u32, weight)));
        let total: f32 = places.iter().map(|p| p.1).sum();
        places.iter_mut().for_each(|p| p.1 /= total);
        if total > 0.0 { places } else { Vec::new() }
    }
}
