//! What a point sees: triangular expansion (Bungiu, Hemmer, Hershberger, Huang and Kröller, *Efficient Computation of
//! Visibility Polygons*, 2014), and whether two points see each other.
//!
//! Every decision is the exact sign of an orientation of three given points (the viewpoint and corners); crossings are
//! constructed for output only. Sight may graze walls and corners: the border belongs to the open space.

use crate::plan::free_space::open_space::{Location, OpenSpace};
use crate::plan::free_space::polygon::ring_area;
use crate::plan::free_space::predicates::{crossing, orient};
use crate::plan::free_space::triangulation::WALL;
use glam::DVec2;
use smallvec::SmallVec;
use std::cmp::Ordering;

/// What is seen from a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Isovist {
    /// The viewpoint.
    pub centre: DVec2,
    /// A closed ring around what is seen, turning left, region-shaped about `centre`; the centre itself is on the ring
    /// where it lies on a wall or a corner. Slits that are seen without width are left out.
    pub ring: Vec<DVec2>,
    /// For each point of `ring` the corner it is ([`OpenSpace::corners`]), or `u32::MAX`.
    pub corners: Vec<u32>,
}

impl Isovist {
    /// The area seen, in square units.
    pub fn area(&self) -> f64 {
        ring_area(&self.ring)
    }

    fn push(&mut self, p: DVec2, corner: u32) {
        if self.ring.last() != Some(&p) {
            self.ring.push(p);
            self.corners.push(corner);
        }
    }
}

const NO_CORNER: u32 = u32::MAX;

/// A view through an edge into the triangle beyond (or onto the wall there).
#[derive(Clone, Copy, Debug)]
struct Cone {
    /// The triangle beyond the edge.
    beyond: u32,
    /// The edge's ends as seen: right and left.
    edge: [u32; 2],
    /// The corners that limit the view: right and left.
    limits: [u32; 2],
}

impl OpenSpace {
    /// What is seen from a point inside or on the border; `None` outside.
    pub fn visibility(&self, point: DVec2) -> Option<Isovist> {
        let place = self.locate(point)?;
        let openings = self.openings(point, place);
        let mut isovist = Isovist { centre: point, ..Isovist::default() };
        let n = openings.len();
        for (k, &opening) in openings.iter().enumerate() {
            let [before, after] = [openings[(k + n - 1) % n].edge[1], openings[(k + 1) % n].edge[0]];
            // beside a wall that the viewpoint is on, sight may pass the wall's end: it belongs to the ring all the same
            if before != opening.edge[0] {
                isovist.push(self.corners[opening.edge[0] as usize], opening.edge[0]);
            }
            self.expand(point, opening, &mut isovist);
            if after != opening.edge[1] {
                isovist.push(self.corners[opening.edge[1] as usize], opening.edge[1]);
                isovist.push(point, if let Location::Corner(v) = place { v } else { NO_CORNER });
            }
        }
        while isovist.ring.len() > 1 && isovist.ring.first() == isovist.ring.last() {
            isovist.ring.pop();
            isovist.corners.pop();
        }
        Some(isovist)
    }

    /// The edges around a point that it does not lie on, in left-turning order.
    fn openings(&self, point: DVec2, place: Location) -> SmallVec<[Cone; 8]> {
        let mut openings: SmallVec<[Cone; 8]> = SmallVec::new();
        for t in self.triangles_at(place) {
            let triangle = &self.triangles[t as usize];
            for i in 0..3 {
                let edge = [triangle.corners[(i + 1) % 3], triangle.corners[(i + 2) % 3]];
                let holds_point = match place {
                    Location::Inside(_) => false,
                    Location::Edge(..) => {
                        orient(self.corners[edge[0] as usize], self.corners[edge[1] as usize], point) == 0.0
                    }
                    Location::Corner(v) => edge.contains(&v),
                };
                if !holds_point {
                    openings.push(Cone { beyond: triangle.across[i], edge, limits: edge });
                }
            }
        }
        chain(point, &self.corners, &mut openings);
        openings
    }

    /// Writes the part of the ring seen through an opening.
    fn expand(&self, point: DVec2, opening: Cone, isovist: &mut Isovist) {
        let mut stack: SmallVec<[Cone; 32]> = SmallVec::new();
        stack.push(opening);
        while let Some(Cone { mut beyond, edge: [mut right, mut left], limits: [from, mut to] }) = stack.pop() {
            // the view narrows and turns; a left part is put aside while the right one is followed
            while beyond != WALL {
                let triangle = &self.triangles[beyond as usize];
                let i = if triangle.corners[0] != right && triangle.corners[0] != left {
                    0
                } else if triangle.corners[1] != right && triangle.corners[1] != left {
                    1
                } else {
                    2
                };
                let apex = triangle.corners[i];
                let p = self.corners[apex as usize];
                // the triangle turns left as apex, left, right: opposite `left` is the edge from right to apex
                let (over_right, over_left) = (triangle.across[(i + 1) % 3], triangle.across[(i + 2) % 3]);
                let after_from = orient(point, self.corners[from as usize], p);
                if after_from <= 0.0 {
                    (beyond, right) = (over_left, apex);
                    continue;
                }
                let after_to = orient(point, self.corners[to as usize], p);
                if after_to < 0.0 {
                    stack.push(Cone { beyond: over_left, edge: [apex, left], limits: [apex, to] });
                    to = apex;
                }
                (beyond, left) = (over_right, apex);
            }
            self.wall(point, [right, left], [from, to], isovist);
        }
    }

    /// Writes the seen part of a wall.
    fn wall(&self, point: DVec2, [right, left]: [u32; 2], [from, to]: [u32; 2], isovist: &mut Isovist) {
        let (a, b) = (self.corners[right as usize], self.corners[left as usize]);
        for (limit, end) in [(from, right), (to, left)] {
            let through = self.corners[limit as usize];
            let at = self.corners[end as usize];
            if limit == end || orient(point, through, at) == 0.0 {
                isovist.push(at, end);
            } else {
                isovist.push(crossing(point, through, a, b), NO_CORNER);
            }
        }
    }
}

/// Brings openings into left-turning order about the point, beginning after a gap if there is one.
fn chain(point: DVec2, corners: &[DVec2], openings: &mut [Cone]) {
    let from = |o: &Cone| corners[o.edge[0] as usize];
    openings.sort_by(|a, b| turning(point, from(a), from(b)));
    let n = openings.len();
    if let Some(first) = (0..n).find(|&k| openings[(k + n - 1) % n].edge[1] != openings[k].edge[0]) {
        openings.rotate_left(first);
    }
}

/// Orders two points by their direction from `o`, left-turning from the positive x axis: exact.
fn turning(o: DVec2, a: DVec2, b: DVec2) -> Ordering {
    let lower = |p: DVec2| p.y < o.y || (p.y == o.y && p.x < o.x);
    lower(a).cmp(&lower(b)).then_with(|| 0.0_f64.total_cmp(&(orient(o, a, b) + 0.0)))
}
