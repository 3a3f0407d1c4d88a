//! Where guards may stand: corners of the arrangement that the witnesses' regions make.
//!
//! A guard sees the witnesses in whose regions it stands. Regions are closed, so that a corner of a cell of their
//! arrangement lies in all regions that the cell lies in, whether the cell is a face, an edge or a point: the corners
//! are guards enough for a lower bound (Couto, de Rezende and de Souza, *An exact algorithm for minimizing vertex
//! guards on art galleries*, 2011; Tozoni, de Rezende and de Souza, *Algorithm 966*, 2016).
//!
//! Of a face, one corner is enough, and faces that a step over an edge widens (one more region, none less) need none:
//! [`super::crossings`] leaves those out.

use super::crossings::{self, Rays, place_key};
use super::witness_region::WitnessRegion;
use crate::plan::free_space::cells::Cells;
use crate::plan::free_space::open_space::OpenSpace;
use glam::DVec2;
use std::collections::HashMap;
use std::time::Instant;

/// Candidate guards, and for each the witnesses it sees.
#[derive(Default)]
pub(crate) struct Candidates {
    pub(crate) points: Vec<DVec2>,
    pub(crate) sees: Vec<Vec<u32>>,
    /// Witnesses that candidates have been asked about.
    asked: usize,
    /// The candidate at a place.
    known: HashMap<[i64; 2], u32>,
}

impl Candidates {
    /// The corners of the open space.
    pub(crate) fn new(open: &OpenSpace) -> Self {
        let points = open.corners().to_vec();
        let known = points.iter().map(|&p| place_key(p, open.extent())).zip(0..).collect();
        Self { sees: vec![Vec::new(); points.len()], points, known, ..Self::default() }
    }

    /// Asks all candidates about witnesses that were added since.
    pub(crate) fn ask(&mut self, open: &OpenSpace, regions: &[WitnessRegion]) {
        let cells = by_cell(open, regions, self.asked, self.points.len());
        for (p, sees) in self.points.iter().zip(&mut self.sees) {
            sees.extend(seen_by(&cells, regions, *p));
        }
        self.asked = regions.len();
    }

    /// Adds what the regions of all witnesses make necessary, and asks; false if time ran out.
    pub(crate) fn arrange(&mut self, open: &OpenSpace, regions: &[WitnessRegion], until: Option<Instant>) -> bool {
        self.ask(open, regions);
        let extent = open.extent();
        let rays = Rays::of(regions, extent);
        let cells = by_cell(open, regions, 0, rays.list.len() * 4);
        let rays_of = crossings::by_cell(open.bounds(), &rays);
        rays.corners(&rays_of, until, |p, of| self.add(p, of, extent, &cells, regions))
    }

    /// Adds a corner of the regions of `of`: it lies in these whatever rounding says, which is much where their borders
    /// are nearly parallel.
    fn add(&mut self, p: DVec2, of: &[u32], extent: f64, cells: &Cells, regions: &[WitnessRegion]) {
        let key = place_key(p, extent);
        if self.known.get(&key).is_some_and(|&k| of.iter().all(|w| self.sees[k as usize].contains(w))) {
            return;
        }
        let mut sees: Vec<u32> = seen_by(cells, regions, p).collect();
        for &w in of {
            if let Err(place) = sees.binary_search(&w) {
                sees.insert(place, w);
            }
        }
        self.known.insert(key, self.points.len() as u32);
        self.points.push(p);
        self.sees.push(sees);
    }
}

/// Witnesses, from one on, by the cells that their regions' boxes touch, for so many questions.
fn by_cell(open: &OpenSpace, regions: &[WitnessRegion], first: usize, questions: usize) -> Cells {
    let (low, high) = open.bounds();
    let across = (questions as f64 / 4.0).sqrt().clamp(1.0, 256.0).ceil() as usize;
    let reach = open.extent() * 1e-9;
    Cells::new(low, high - low, [across; 2], |cells, add| {
        for (w, region) in (0..).zip(regions).skip(first) {
            cells.within(region.low - reach, region.high + reach).for_each(|cell| add(cell, w));
        }
    })
}

/// The witnesses that see a point, in rising order.
fn seen_by(cells: &Cells, regions: &[WitnessRegion], p: DVec2) -> impl Iterator<Item = u32> {
    cells.get(cells.xy(p)).iter().copied().filter(move |&w| regions[w as usize].holds(p))
}
