//! What a level cut through the model shows: the walls where they stand, not by cells.

use glam::{DVec2, DVec3};
use std::collections::HashMap;

use super::contour::simplified;
use crate::plan::floors::floor::Floor;
use crate::plan::floors::raster::Map;
use crate::scene::Mesh;

/// A line of the section, from point to point, local metres; closed where its last point is its first.
pub type Line = Vec<DVec2>;

/// Ends of segments that are nearer than this are one, metres.
const SAME_M: f64 = 1e-4;

/// Corners that move a line by no more than this are left out, metres.
const STRAIGHT_M: f64 = 1e-3;

/// The model cut at height `z`, as lines; only what is within `reach_m` of `near`.
pub fn section(mesh: &Mesh, z: f64, near: &Map, reach_m: f64) -> Vec<Line> {
    let mut segments = Vec::new();
    let around = near.grown(reach_m);
    for triangle in 0..mesh.triangles.len() as u32 {
        let corners = mesh.corners(triangle).map(|c| c.as_dvec3());
        if let Some([a, b]) = cut(corners, z)
            && a.distance(b) > SAME_M
            && [a, 0.5 * (a + b), b].into_iter().any(|p| around.at(p))
        {
            segments.push([a, b]);
        }
    }
    joined(&segments)
}

/// Where a triangle crosses a height.
fn cut(corners: [DVec3; 3], z: f64) -> Option<[DVec2; 2]> {
    // a corner at the very height counts as above, so that a cut through it is not lost or found twice
    let above = corners.map(|c| c.z >= z);
    let crossing = |i: usize, j: usize| {
        let (a, b) = (corners[i], corners[j]);
        (above[i] != above[j]).then(|| a.truncate().lerp(b.truncate(), ((z - a.z) / (b.z - a.z)).clamp(0.0, 1.0)))
    };
    let mut ends = [(0, 1), (1, 2), (2, 0)].into_iter().filter_map(|(i, j)| crossing(i, j));
    Some([ends.next()?, ends.next()?])
}

/// Segments joined end to end where just two of them meet, without corners that a straight line does not need.
fn joined(segments: &[[DVec2; 2]]) -> Vec<Line> {
    let key = |p: DVec2| {
        let q = (p / SAME_M).round();
        (q.x as i64, q.y as i64)
    };
    let mut at: HashMap<(i64, i64), Vec<usize>> = HashMap::new();
    for (i, ends) in segments.iter().enumerate() {
        ends.iter().for_each(|p| at.entry(key(*p)).or_default().push(i));
    }
    let mut done = vec![false; segments.len()];
    // from an end onwards, as long as one other segment goes on
    let follow = |mut from: DVec2, done: &mut Vec<bool>| {
        let mut line = Vec::new();
        while let Some([a, b]) = at.get(&key(from)).and_then(|all| <[usize; 2]>::try_from(all.as_slice()).ok()) {
            let next = if done[a] { b } else { a };
            if done[next] {
                break;
            }
            done[next] = true;
            let [start, end] = segments[next];
            from = if key(start) == key(from) { end } else { start };
            line.push(from);
        }
        line
    };
    let mut lines = Vec::new();
    for (i, [a, b]) in segments.iter().enumerate() {
        if std::mem::replace(&mut done[i], true) {
            continue;
        }
        let mut line = follow(*a, &mut done);
        line.reverse();
        line.extend([*a, *b]);
        line.extend(follow(*b, &mut done));
        lines.push(simplified(&line, &[0, line.len() - 1], STRAIGHT_M));
    }
    lines
}

/// What stands on a floor below a lens: the model cut a little above seats and below tables, where the lens has room.
pub fn furniture(mesh: &Mesh, floor: &Floor, lens: f64) -> Vec<Line> {
    /// Heights above the floor, metres; and what so near to a wall is its skirting.
    const HEIGHTS_M: [f64; 2] = [0.4, 0.72];
    const SKIRTING_M: f64 = 0.12;
    let room = floor.open.inverted().grown(SKIRTING_M).inverted();
    let heights = HEIGHTS_M.iter().map(|h| f64::from(floor.elevation) + h).filter(|h| *h < lens - 0.1);
    heights.flat_map(|z| section(mesh, z, &room, 0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::floors::raster::Grid;
    use crate::scene::testing::parallelograms;
    use glam::Vec3;

    /// Four walls of a room of 4.9 × 5 m, each of many triangles, 3 m high, and a table that the cut misses.
    fn room() -> Mesh {
        let corners = [(0.0, 0.0), (4.9, 0.0), (4.9, 5.0), (0.0, 5.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
        let mut quads = vec![(Vec3::new(2.0, 2.0, 0.0), Vec3::X, 0.75 * Vec3::Z)];
        for (i, a) in corners.into_iter().enumerate() {
            let along = (corners[(i + 1) % 4] - a) / 7.0;
            quads.extend((0..7).map(|k| (a + k as f32 * along, along, 3.0 * Vec3::Z)));
        }
        parallelograms(&quads)
    }

    fn everywhere() -> Map {
        Map::of(Grid::covering(DVec2::ZERO, DVec2::splat(5.0), 0.1, 100_000), |_| true)
    }

    #[test]
    fn a_room_is_four_straight_lines_where_its_walls_are() {
        let lines = section(&room(), 1.6, &everywhere(), 0.0);
        let [ring] = lines.as_slice() else { panic!("{lines:?}") };
        // where the joining began is a corner of its own
        assert!((5..=6).contains(&ring.len()) && ring[0].distance(ring[ring.len() - 1]) < 1e-6, "{ring:?}");
        let low = ring.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = ring.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        assert!(low.length() < 1e-6 && high.distance(DVec2::new(4.9, 5.0)) < 1e-6);
        // lower down the table is cut, too
        assert_eq!(section(&room(), 0.5, &everywhere(), 0.0).len(), 2);
    }

    #[test]
    fn only_what_is_near_is_shown() {
        let grid = everywhere().grid;
        let corner = Map::of(grid, |c| grid.middle(c).distance(DVec2::new(4.9, 5.0)) < 1.0);
        let lines = section(&room(), 1.6, &corner, 0.1);
        let all: f64 = lines.iter().flat_map(|l| l.windows(2)).map(|w| w[0].distance(w[1])).sum();
        assert!(all > 2.0 && all < 4.5, "{all}");
    }
}
