//! Witnesses: the points of a floor that must be seen, each with its weight.

use glam::{DVec2, Vec3};

use super::region::VisibilityRegion;
use crate::plan::floors::floor::Floor;
use crate::plan::free_space::open_space::OpenSpace;
use crate::scene::{Ray, Scene};
use crate::site::Plan;

/// The most points that stand for a floor's area.
const MOST: f64 = 4000.0;
/// Pieces of wall are at most so long, metres.
const PIECE_M: f64 = 0.5;
/// Wall witnesses stand so far off the outline, metres, and a real wall is within this of it.
const OFF_M: f64 = 0.02;
const WALL_M: f32 = 0.3;

/// A piece of wall at probe height, a metre of which weighs as much as a square metre of floor.
#[derive(Clone, Copy, Debug)]
pub struct WallPiece {
    /// Its two ends on the outline, local metres.
    pub ends: [DVec2; 2],
    /// Its middle, just inside.
    pub at: DVec2,
    /// Unit normal into the room.
    pub normal: DVec2,
    /// Metres.
    pub length_m: f64,
}

/// What is to be seen on a floor.
pub struct Witnesses {
    /// Points of the floor's area with the square metres they stand for.
    pub area: Vec<(DVec2, f64)>,
    /// Pieces of wall.
    pub walls: Vec<WallPiece>,
}

impl Witnesses {
    /// Spreads witnesses over a floor and along its walls.
    pub fn of(floor: &Floor, open: &OpenSpace, scene: &Scene, plan: &Plan) -> Self {
        Self { area: area(floor, open), walls: walls(floor, open, scene, plan) }
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.area.len() + self.walls.len()
    }

    /// Their weights: area first, then walls.
    pub fn weights(&self) -> Vec<f64> {
        self.area.iter().map(|(_, w)| *w).chain(self.walls.iter().map(|w| w.length_m)).collect()
    }

    /// The witnesses that a region sees, in order.
    pub fn seen(&self, region: &VisibilityRegion, plan: &Plan) -> Vec<u32> {
        let flattest = plan.incidence_deg.to_radians().cos();
        let faces = |w: &WallPiece| {
            let to = region.centre - w.at;
            to.dot(w.normal) >= flattest * to.length()
        };
        let area = self.area.iter().map(|(p, _)| region.sees(*p, 1e-6));
        let walls = self.walls.iter().map(|w| faces(w) && region.sees(w.at, 1e-6));
        (0..).zip(area.chain(walls)).filter(|(_, seen)| *seen).map(|(i, _)| i).collect()
    }
}

/// For each square of the floor, the point of it nearest to the middle of what is to be seen there.
fn area(floor: &Floor, open: &OpenSpace) -> Vec<(DVec2, f64)> {
    let grid = floor.target.grid;
    let one = |cells: Vec<usize>| {
        let mean = cells.iter().map(|c| grid.middle(*c)).sum::<DVec2>() / cells.len() as f64;
        let near = |p: &DVec2| p.distance_squared(mean);
        let inside = cells.iter().map(|c| grid.middle(*c)).filter(|p| open.contains(*p));
        let best = inside.min_by(|a, b| near(a).total_cmp(&near(b)))?;
        Some((best, cells.len() as f64 * grid.cell_area()))
    };
    let side = (floor.target.area() / MOST).sqrt().max(0.2);
    floor.target.blocks(side).into_iter().filter_map(one).collect()
}

/// The outline beside the floor in pieces, where there is a wall in the model.
fn walls(floor: &Floor, open: &OpenSpace, scene: &Scene, plan: &Plan) -> Vec<WallPiece> {
    let mut pieces = Vec::new();
    let height = floor.elevation + plan.probe_height_m as f32;
    for polygon in open.polygons() {
        for (ring, inward_left) in polygon.sided_rings() {
            for (i, &a) in ring.iter().enumerate() {
                let b = ring[(i + 1) % ring.len()];
                let count = (a.distance(b) / PIECE_M).ceil().max(1.0);
                let along = (b - a) / count;
                let normal = if inward_left { along.perp() } else { -along.perp() }.normalize_or_zero();
                for k in 0..count as usize {
                    let start = a + along * k as f64;
                    let at = start + along * 0.5 + normal * OFF_M;
                    let beside = [0.1, 0.25].iter().any(|d| floor.target.at(at + normal * *d));
                    let inside = at - normal * OFF_M + normal * 0.1;
                    let ray = Ray {
                        origin: inside.as_vec2().extend(height),
                        direction: Vec3::new(-normal.x as f32, -normal.y as f32, 0.0),
                    };
                    if beside && open.contains(at) && scene.tracer.occluded(&ray, 0.0, WALL_M) {
                        pieces.push(WallPiece { ends: [start, start + along], at, normal, length_m: along.length() });
                    }
                }
            }
        }
    }
    pieces
}
