//! Lines of sight through the triangulation: whether two points see each other, and how far a ray past a corner goes.
//!
//! Both walk along one line, given by two points, and decide by exact orientations about it only. Sight may pass along
//! walls, through corners and through slits without width, since the border belongs to the open space.

use crate::plan::free_space::open_space::{Location, OpenSpace};
use crate::plan::free_space::predicates::{crossing, orient};
use crate::plan::free_space::triangulation::WALL;
use glam::DVec2;

/// Where a walk stands: on a corner, or about to enter what lies beyond an edge.
#[derive(Clone, Copy)]
enum Step {
    Corner(u32),
    /// Over this triangle's edge of that number into the next triangle; the edge's ends lie right and left of the line.
    Over(u32, usize),
    /// The line runs into a wall between these corners.
    Wall(u32, u32),
    /// The line ends on a corner.
    End,
}

impl OpenSpace {
    /// Whether two points see each other: the segment between them lies in the open space, border included. Exact and
    /// symmetric; false when either lies outside.
    pub fn sees(&self, a: DVec2, b: DVec2) -> bool {
        let (Some(at_a), Some(at_b)) = (self.locate(a), self.locate(b)) else { return false };
        let (here, goal) = (self.triangles_at(at_a), self.triangles_at(at_b));
        let arrived = |triangles: &[u32]| triangles.iter().any(|t| goal.contains(t));
        if arrived(&here) {
            return true;
        }
        let mut step = self.leave(a, b, at_a, &here);
        loop {
            match step {
                Step::Corner(v) if arrived(self.fan(v)) => return true,
                Step::Corner(v) => step = self.past_corner(a, b, v),
                Step::Over(t, i) if goal.contains(&self.triangles[t as usize].across[i]) => return true,
                Step::Over(t, i) => step = self.through(a, b, t, i),
                Step::Wall(..) | Step::End => return false,
            }
        }
    }

    /// The far end of the ray from `from` through a corner that it sees: the last point in the open space that is
    /// reached without leaving it. The corner itself when the ray goes no further. `corner` is a number of
    /// [`OpenSpace::corners`].
    pub fn ray_end(&self, from: DVec2, corner: u32) -> DVec2 {
        let through = self.corners[corner as usize];
        let mut last = through;
        let mut step = Step::Corner(corner);
        loop {
            step = match step {
                Step::Corner(v) => {
                    last = self.corners[v as usize];
                    self.past_corner(from, through, v)
                }
                Step::Over(t, i) => self.through(from, through, t, i),
                Step::Wall(right, left) => {
                    return crossing(from, through, self.corners[right as usize], self.corners[left as usize]);
                }
                Step::End => return last,
            };
        }
    }

    /// From a start on the line `a b` out of the triangles around it.
    fn leave(&self, a: DVec2, b: DVec2, at: Location, around: &[u32]) -> Step {
        if let Location::Corner(v) = at {
            return self.past_corner(a, b, v);
        }
        for &t in around {
            let corners = self.triangles[t as usize].corners;
            let sides = corners.map(|c| orient(a, b, self.corners[c as usize]));
            let ahead = |k: usize| (self.corners[corners[k] as usize] - a).dot(b - a) > 0.0;
            if let Some(k) = (0..3).find(|&k| sides[k] == 0.0 && ahead(k)) {
                return Step::Corner(corners[k]);
            }
            for i in 0..3 {
                let (right, left) = ((i + 1) % 3, (i + 2) % 3);
                let holds_start = matches!(at, Location::Edge(..))
                    && orient(self.corners[corners[right] as usize], self.corners[corners[left] as usize], a) == 0.0;
                // seen from inside, an edge runs from right to left
                if !holds_start && sides[right] < 0.0 && sides[left] > 0.0 {
                    return self.cross(t, i);
                }
            }
        }
        Step::End
    }

    /// Onwards from a corner on the line.
    fn past_corner(&self, a: DVec2, b: DVec2, v: u32) -> Step {
        let here = self.corners[v as usize];
        let mut over = None;
        for &t in self.fan(v) {
            let corners = self.triangles[t as usize].corners;
            let i = corners.iter().position(|&c| c == v).unwrap_or(0);
            let (right, left) = (corners[(i + 1) % 3], corners[(i + 2) % 3]);
            let side = |c: u32| orient(a, b, self.corners[c as usize]);
            let (side_right, side_left) = (side(right), side(left));
            for (c, s) in [(right, side_right), (left, side_left)] {
                if s == 0.0 && (self.corners[c as usize] - here).dot(b - a) > 0.0 {
                    return Step::Corner(c);
                }
            }
            if side_right < 0.0 && side_left > 0.0 {
                over = Some(self.cross(t, i));
            }
        }
        over.unwrap_or(Step::End)
    }

    /// Through the triangle beyond an edge.
    fn through(&self, a: DVec2, b: DVec2, t: u32, i: usize) -> Step {
        let triangle = self.triangles[t as usize];
        let next = triangle.across[i];
        let left = triangle.corners[(i + 2) % 3];
        let beyond = self.triangles[next as usize].corners;
        // beyond, the edge runs from left to right and the apex follows
        let j = beyond.iter().position(|&c| c == left).unwrap_or(0);
        let apex = beyond[(j + 2) % 3];
        let side = orient(a, b, self.corners[apex as usize]);
        if side == 0.0 {
            Step::Corner(apex)
        } else if side > 0.0 {
            // the apex is left: out between right and apex, opposite left
            self.cross(next, j)
        } else {
            self.cross(next, (j + 1) % 3)
        }
    }

    /// Over an edge, or into a wall there.
    fn cross(&self, t: u32, i: usize) -> Step {
        let triangle = &self.triangles[t as usize];
        let wall = triangle.across[i] == WALL;
        if wall { Step::Wall(triangle.corners[(i + 1) % 3], triangle.corners[(i + 2) % 3]) } else { Step::Over(t, i) }
    }
}
