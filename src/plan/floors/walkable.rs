//! Where a person can walk: tops of spans with headroom, joined where a step leads from one to the next.

use glam::Vec3;
use rayon::prelude::*;
use std::collections::BTreeMap;

use super::heightfield::{Heightfield, Top};
use crate::components::components;
use crate::scene::{Ray, Scene, edges};

/// The highest step a person with a tripod takes, metres.
pub(crate) const STEP_M: f32 = 0.25;
/// A person is so wide, metres.
const SHOULDERS_M: f64 = 0.4;
/// Indoors or not is told once for squares of about this side, metres.
pub(crate) const BLOCK_M: f64 = 0.4;

/// A top that can be walked on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WalkableSpan {
    pub(crate) cell: u32,
    /// Height, local metres.
    pub(crate) z: f32,
    /// Within 10° of level.
    pub(crate) level: bool,
    /// Which connected part of all places it belongs to.
    pub(crate) part: u32,
    /// Whether it is indoors at probe height.
    pub(crate) indoors: bool,
}

/// All walkable places, column by column and from below.
pub(crate) struct WalkableSpans {
    pub(crate) columns: Heightfield,
    pub(crate) list: Vec<WalkableSpan>,
    starts: Vec<u32>,
    /// Which side of triangles is seen from indoors.
    pub(crate) side: Side,
}

impl WalkableSpans {
    /// The places with `headroom_m` above them; whether they are indoors is told `height_m` above them.
    pub(crate) fn new(columns: Heightfield, scene: &Scene, headroom_m: f32, height_m: f32) -> Self {
        let mut list = Vec::new();
        let mut starts = Vec::with_capacity(columns.grid.len() + 1);
        for cell in 0..columns.grid.len() {
            starts.push(list.len() as u32);
            let spans = columns.column(cell);
            for (i, span) in spans.iter().enumerate() {
                let free = spans.get(i + 1).map_or(f32::INFINITY, |above| above.low - span.high);
                if span.top >= Top::Sloped && free >= headroom_m {
                    let (cell, level) = (cell as u32, span.top == Top::Level);
                    list.push(WalkableSpan { cell, z: span.high, level, part: 0, indoors: false });
                }
            }
        }
        starts.push(list.len() as u32);
        let mut places = Self { columns, list, starts, side: Side::Any };
        places.join();
        places.enclose(scene, height_m);
        places
    }

    /// The places of one column.
    pub(crate) fn column(&self, cell: usize) -> std::ops::Range<usize> {
        self.starts[cell] as usize..self.starts[cell + 1] as usize
    }

    /// Numbers the connected parts by their first place.
    fn join(&mut self) {
        let spans = &*self;
        let steps = |at: usize| {
            let WalkableSpan { cell, z, .. } = spans.list[at];
            let beside = spans.columns.grid.neighbours(cell as usize).flat_map(move |c| spans.column(c));
            beside.filter(move |other| (spans.list[*other].z - z).abs() <= STEP_M)
        };
        let part = components(self.list.len(), |_| true, steps);
        self.list.iter_mut().zip(part).for_each(|(place, part)| place.part = part);
    }

    /// The places that a person walks to from some, staying indoors and where there is room for shoulders.
    pub(crate) fn walked_to(&self, from: impl Iterator<Item = usize>) -> Vec<bool> {
        let grid = self.columns.grid;
        let reach = (0.5 * SHOULDERS_M / grid.cell_m).round().max(1.0) as isize;
        let near = |place: WalkableSpan, cell: usize| {
            self.column(cell).filter(move |other| (self.list[*other].z - place.z).abs() <= STEP_M)
        };
        let fits = |i: usize| {
            let place = self.list[i];
            let room = |(x, y)| grid.beside(place.cell as usize, x, y).is_some_and(|c| near(place, c).next().is_some());
            place.indoors && [(reach, 0), (-reach, 0), (0, reach), (0, -reach)].into_iter().all(room)
        };
        let mut reached = vec![false; self.list.len()];
        let mut queue: Vec<usize> = from.collect();
        queue.iter().for_each(|i| reached[*i] = true);
        while let Some(i) = queue.pop() {
            let place = self.list[i];
            for other in grid.neighbours(place.cell as usize).flat_map(|c| near(place, c)) {
                if !reached[other] && fits(other) {
                    reached[other] = true;
                    queue.push(other);
                }
            }
        }
        reached
    }

    /// How many connected parts there are.
    pub(crate) fn part_count(&self) -> usize {
        self.list.iter().map(|p| p.part as usize + 1).max().unwrap_or(0)
    }

    /// Tells whether each place is indoors `height_m` above it, and which side of triangles is seen from indoors.
    fn enclose(&mut self, scene: &Scene, height_m: f32) {
        let grid = self.columns.grid;
        let block = (BLOCK_M / grid.cell_m).round().max(1.0) as usize;
        let key = |place: &WalkableSpan| {
            let (x, y) = (place.cell as usize % grid.width, place.cell as usize / grid.width);
            (place.part, y / block, x / block, (2.0 * place.z).floor() as i32)
        };
        let mut first: BTreeMap<_, usize> = BTreeMap::new();
        for (i, place) in self.list.iter().enumerate() {
            first.entry(key(place)).or_insert(i);
        }
        let asked: Vec<_> = first.into_iter().collect();
        let told: Vec<_> = asked
            .into_par_iter()
            .map(|(key, i)| {
                let place = self.list[i];
                let at = grid.middle(place.cell as usize).as_vec2();
                (key, Enclosure::at(scene, at.extend(place.z + height_m)))
            })
            .collect();
        self.side = if edges(&scene.mesh).winding_is_meaningful() {
            let closed = || told.iter().map(|(_, e)| e).filter(|e| e.closed());
            let fronts = closed().filter(|e| e.backs < 0.5).count();
            if 2 * fronts >= closed().count() { Side::Front } else { Side::Back }
        } else {
            Side::Any
        };
        let told: BTreeMap<_, bool> = told.into_iter().map(|(key, e)| (key, e.indoors(self.side))).collect();
        self.list.iter_mut().for_each(|place| place.indoors = told[&key(place)]);
    }
}

/// Which side of triangles is seen from indoors; [`Side::Any`] where the model's winding means nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Front,
    Back,
    Any,
}

/// How much of a point's surroundings is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Enclosure {
    /// Share of near-horizontal rays that hit something.
    around: f32,
    /// Share of steep upward rays that do.
    above: f32,
    /// Share of the near-horizontal hits that are on the back of a triangle.
    backs: f32,
    /// The distance in metres that half of these hits are nearer than.
    median_m: f32,
}

impl Enclosure {
    pub(crate) fn at(scene: &Scene, point: Vec3) -> Self {
        const AROUND: usize = 24;
        const ABOVE: usize = 8;
        let rays = |count: usize, pitch: fn(usize) -> f32| {
            (0..count).map(move |i| {
                let (sin, cos) = ((i as f32 + 0.37) / count as f32 * std::f32::consts::TAU).sin_cos();
                let (up, flat) = pitch(i).sin_cos();
                Ray { origin: point, direction: Vec3::new(flat * cos, flat * sin, up) }
            })
        };
        let hit = |ray: Ray| {
            let hit = scene.tracer.closest(&ray, 1e-3)?;
            Some((hit.t, scene.mesh.normal(hit.triangle).dot(ray.direction) > 0.0))
        };
        let mut hits: Vec<(f32, bool)> = rays(AROUND, |i| [0.0, 0.06, -0.06][i % 3]).filter_map(hit).collect();
        hits.sort_by(|a, b| a.0.total_cmp(&b.0));
        // half of them nearly straight up, where walls outside do not reach
        let above = rays(ABOVE, |i| [1.0, 1.5][i % 2]).filter(|r| scene.tracer.occluded(r, 1e-3, f32::MAX)).count();
        Self {
            around: hits.len() as f32 / AROUND as f32,
            above: above as f32 / ABOVE as f32,
            backs: hits.iter().filter(|h| h.1).count() as f32 / hits.len().max(1) as f32,
            median_m: hits.get(hits.len() / 2).map_or(f32::INFINITY, |h| h.0),
        }
    }

    /// Walls around suffice without a roof, so that a room whose ceiling is not modelled counts; a roof needs some
    /// walls, so that the ground under eaves does not.
    fn closed(self) -> bool {
        self.around >= 0.85 || self.above >= 0.85 && self.around >= 0.6
    }

    /// Enclosed, and not inside a wall: there, all is near and seen from the wrong side.
    pub(crate) fn indoors(self, side: Side) -> bool {
        let wrong = match side {
            Side::Front => self.backs,
            Side::Back => 1.0 - self.backs,
            Side::Any => 0.0,
        };
        self.closed() && !(wrong > 0.75 && self.median_m < 1.5)
    }
}
