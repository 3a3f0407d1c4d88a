//! The constrained Delaunay triangulation of clean polygons, in packed arrays. The only door to `spade`.

use super::polygon::{Polygon, PolygonError};
use glam::DVec2;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};

/// No triangle: a wall.
pub(crate) const WALL: u32 = u32::MAX;

/// Three corners, turning left, and what lies across the edge opposite each: a triangle, or [`WALL`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub(crate) corners: [u32; 3],
    pub(crate) across: [u32; 3],
}

type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// The corners and triangles of the inside: what an odd number of ring edges separates from the outside.
///
/// # Errors
///
/// When edges cross or when the inside's area is not that of the outer rings less that of the holes: rings overlap, nest or
/// lie outside each other.
pub(crate) fn triangulate(polygons: &[Polygon]) -> Result<(Vec<DVec2>, Vec<Triangle>), PolygonError> {
    let mut points = Vec::new();
    let mut edges = Vec::new();
    for ring in polygons.iter().flat_map(Polygon::rings) {
        let first = points.len();
        points.extend(ring.iter().map(|p| Point2::new(p.x, p.y)));
        edges.extend((0..ring.len()).map(|i| [first + i, first + (i + 1) % ring.len()]));
    }
    let mut conflict = None;
    let given = points.clone();
    let cdt = Cdt::try_bulk_load_cdt(points, edges, |e| conflict = conflict.or(Some(e)));
    let cdt = cdt.map_err(|_| PolygonError::NoInside)?;
    if let Some([a, _]) = conflict {
        let p = given.get(a).copied().unwrap_or(Point2::new(0.0, 0.0));
        return Err(PolygonError::Crossing { x: p.x, y: p.y });
    }
    let (corners, triangles) = pack(&cdt, &inside_of(&cdt));
    let area: f64 = triangles.iter().map(|t| t.corners.map(|c| corners[c as usize])).map(area_of).sum();
    let expected: f64 = polygons.iter().map(Polygon::area).sum();
    let fits = (area - expected).abs() <= 1e-9 * expected.abs();
    if triangles.is_empty() || !fits { Err(PolygonError::NoInside) } else { Ok((corners, triangles)) }
}

fn area_of([a, b, c]: [DVec2; 3]) -> f64 {
    (b - a).perp_dot(c - a) / 2.0
}

/// Floods from outside; each ring edge that is crossed turns inside to outside and back.
fn inside_of(cdt: &Cdt) -> Vec<bool> {
    let mut inside = vec![None; cdt.num_all_faces()];
    let outer = cdt.outer_face().fix();
    inside[outer.index()] = Some(false);
    let mut front = vec![(outer, false)];
    while let Some((face, here)) = front.pop() {
        let edges: Vec<_> = match cdt.face(face).as_inner() {
            Some(inner) => inner.adjacent_edges().to_vec(),
            None => cdt.convex_hull().collect(),
        };
        for edge in edges {
            let edge = if edge.face().fix() == face { edge } else { edge.rev() };
            let beyond = edge.rev().face().fix();
            if inside[beyond.index()].is_none() {
                let there = here ^ edge.is_constraint_edge();
                inside[beyond.index()] = Some(there);
                front.push((beyond, there));
            }
        }
    }
    inside.into_iter().map(|v| v.unwrap_or(false)).collect()
}

/// The inside faces in breadth-first order and their corners in the order of use, so that neighbours lie near each other in
/// memory.
fn pack(cdt: &Cdt, inside: &[bool]) -> (Vec<DVec2>, Vec<Triangle>) {
    let mut number = vec![WALL; cdt.num_all_faces()];
    let mut order = Vec::new();
    for seed in cdt.inner_faces().filter(|f| inside[f.fix().index()]) {
        let mut next = order.len();
        if number[seed.fix().index()] == WALL {
            number[seed.fix().index()] = order.len() as u32;
            order.push(seed);
        }
        while next < order.len() {
            for edge in order[next].adjacent_edges() {
                let Some(face) = edge.rev().face().as_inner() else { continue };
                let open = !edge.is_constraint_edge() && inside[face.fix().index()];
                if open && number[face.fix().index()] == WALL {
                    number[face.fix().index()] = order.len() as u32;
                    order.push(face);
                }
            }
            next += 1;
        }
    }
    let (mut corners, mut corner_number) = (Vec::new(), vec![u32::MAX; cdt.num_vertices()]);
    let triangles = order.iter().map(|face| {
        let edges = face.adjacent_edges();
        let own = edges.map(|edge| {
            let corner = &mut corner_number[edge.from().fix().index()];
            if *corner == u32::MAX {
                *corner = corners.len() as u32;
                corners.push(DVec2::new(edge.from().position().x, edge.from().position().y));
            }
            *corner
        });
        let beyond = |i: usize| {
            let edge = edges[(i + 1) % 3];
            if edge.is_constraint_edge() { WALL } else { number[edge.rev().face().fix().index()] }
        };
        Triangle { corners: own, across: [beyond(0), beyond(1), beyond(2)] }
    });
    let triangles = triangles.collect();
    (corners, triangles)
}
