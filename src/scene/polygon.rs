//! Cutting faces of more than three corners, strips and fans into triangles.

use glam::{DVec2, DVec3};
use spade::handles::FixedFaceHandle;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation as _};
use std::collections::BTreeMap;

/// Past this many corners cutting ears, whose time goes with their square at best, takes longer than Delaunay triangles.
const MOST_EARS: usize = 64;

/// Cuts a face, whose corners lie where `point` says, into triangles that cover it, concave or not, in the plane of Newell's
/// normal: by cutting ears, or, of many corners, into constrained Delaunay triangles. `false` where only a fan was possible:
/// corners on one line, or many corners and edges that cross.
pub(super) fn triangulate(face: &[u32], point: impl Fn(u32) -> DVec3, add: &mut impl FnMut([u32; 3])) -> bool {
    if let [a, b, c] = *face {
        add([a, b, c]);
        return true;
    }
    let points: Vec<DVec3> = face.iter().map(|&i| point(i)).collect();
    let normal = newell(&points);
    if !normal.is_finite() || normal == DVec3::ZERO {
        fan(face, add);
        return false;
    }
    let flat: Vec<DVec2> = points.iter().map(|&p| project(p, normal)).collect();
    if face.len() > MOST_EARS {
        let triangles = delaunay(&flat);
        match &triangles {
            Some(triangles) => triangles.iter().for_each(|t| add(t.map(|i| face[i]))),
            None => fan(face, add),
        }
        return triangles.is_some();
    }
    let mut left: Vec<usize> = (0..face.len()).collect();
    let mut at = 0;
    let mut refused = 0;
    while left.len() > 3 && refused < left.len() {
        let n = left.len();
        let ear = [left[(at + n - 1) % n], left[at % n], left[(at + 1) % n]];
        if is_ear(ear, &left, &flat) {
            add(ear.map(|i| face[i]));
            left.remove(at % n);
            // the next ear is sought one corner on, which keeps triangles from all meeting at one corner
            at = (at % n) % (n - 1);
            refused = 0;
        } else {
            refused += 1;
        }
        at += 1;
    }
    let rest: Vec<u32> = left.into_iter().map(|i| face[i]).collect();
    fan(&rest, add);
    rest.len() == 3
}

/// A corner, and its place in the ring.
struct Corner {
    at: Point2<f64>,
    index: usize,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// The constrained Delaunay triangles inside a ring, which is wound counter-clockwise; `None` where edges cross or touch so
/// that inside and outside cannot be told. Corners at one place are one, and edges that are run through twice, such as bridges
/// to holes, are none.
fn delaunay(ring: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let mut places: BTreeMap<[u64; 2], usize> = BTreeMap::new();
    let mut corners: Vec<Corner> = Vec::new();
    let mut place = |index: usize| {
        let p = ring[index] + 0.0; // no −0
        *places.entry([p.x.to_bits(), p.y.to_bits()]).or_insert_with(|| {
            corners.push(Corner { at: Point2::new(p.x, p.y), index });
            corners.len() - 1
        })
    };
    let numbers: Vec<usize> = (0..ring.len()).map(&mut place).collect();
    let mut edges: BTreeMap<[usize; 2], bool> = BTreeMap::new();
    for (&a, &b) in numbers.iter().zip(numbers.iter().cycle().skip(1)).filter(|(a, b)| a != b) {
        *edges.entry([a.min(b), a.max(b)]).or_default() ^= true;
    }
    let edges = edges.into_iter().filter(|(_, odd)| *odd).map(|(edge, _)| edge).collect();
    let mut crossing = false;
    let cdt =
        ConstrainedDelaunayTriangulation::<Corner>::try_bulk_load_cdt(corners, edges, |_| crossing = true).ok()?;
    if crossing {
        return None;
    }
    // floods from outside; each edge of the ring turns outside to inside and back
    let mut inside: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    let mut open: Vec<_> = cdt.convex_hull().map(|edge| (edge, edge.is_constraint_edge())).collect();
    while let Some((edge, value)) = open.pop() {
        let Some(face) = edge.rev().face().as_inner() else { continue };
        let known = &mut inside[face.fix().index()];
        if known.is_none() {
            *known = Some(value);
            open.extend(face.adjacent_edges().map(|edge| (edge, value ^ edge.is_constraint_edge())));
        }
    }
    let is_inside = |face: FixedFaceHandle<_>| inside[face.index()] == Some(true);
    let faces = cdt.inner_faces().filter(|face| is_inside(face.fix()));
    let triangles: Vec<[usize; 3]> = faces.map(|face| face.vertices().map(|v| v.data().index)).collect();
    let covered: f64 = triangles.iter().map(|t| (ring[t[1]] - ring[t[0]]).perp_dot(ring[t[2]] - ring[t[0]])).sum();
    let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
    let twice: f64 = pairs.map(|(a, b)| (*a - ring[0]).perp_dot(*b - ring[0])).sum();
    ((covered - twice).abs() <= 1e-9 * twice.abs()).then_some(triangles)
}

/// The triangles of a strip, in which every other one is wound the other way.
pub(super) fn strip(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let triangle = |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
    corners.windows(3).enumerate().map(triangle)
}

/// The triangles from the first corner to each two that follow each other.
pub(super) fn fan(face: &[u32], add: &mut impl FnMut([u32; 3])) {
    for pair in face.windows(2).skip(1) {
        add([face[0], pair[0], pair[1]]);
    }
}

/// Twice the area of a polygon, as a vector along its normal (Newell's sums, about the first corner).
fn newell(points: &[DVec3]) -> DVec3 {
    points.windows(2).map(|p| (p[0] - points[0]).cross(p[1] - points[0])).sum()
}

/// Drops the axis that the normal is nearest to, keeping the winding counter-clockwise.
fn project(p: DVec3, normal: DVec3) -> DVec2 {
    let n = normal.abs();
    let (flat, sign) = if n.z >= n.x && n.z >= n.y {
        (DVec2::new(p.x, p.y), normal.z)
    } else if n.y >= n.x {
        (DVec2::new(p.z, p.x), normal.y)
    } else {
        (DVec2::new(p.y, p.z), normal.x)
    };
    if sign < 0.0 { DVec2::new(flat.y, flat.x) } else { flat }
}

/// Whether a corner turns left and no other corner lies in its triangle.
fn is_ear([a, b, c]: [usize; 3], left: &[usize], flat: &[DVec2]) -> bool {
    let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
    let (pa, pb, pc) = (flat[a], flat[b], flat[c]);
    if side(pa, pb, pc) <= 0.0 {
        return false;
    }
    let inside = |p: DVec2| side(pa, pb, p) >= 0.0 && side(pb, pc, p) >= 0.0 && side(pc, pa, p) >= 0.0;
    // a corner repeated at the same place (a bridge to a hole) is no obstacle
    left.iter().all(|&i| [a, b, c].contains(&i) || [pa, pb, pc].contains(&flat[i]) || !inside(flat[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(points: &[DVec3]) -> (Vec<[u32; 3]>, bool) {
        let face: Vec<u32> = (0..points.len() as u32).collect();
        let mut triangles = Vec::new();
        let proper = triangulate(&face, |i| points[i as usize], &mut |t| triangles.push(t));
        (triangles, proper)
    }

    fn area(triangles: &[[u32; 3]], points: &[DVec3]) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|k| move |t: &[u32; 3]| t[k] as usize);
        triangles.iter().map(|t| 0.5 * (points[b(t)] - points[a(t)]).cross(points[c(t)] - points[a(t)]).length()).sum()
    }

    /// An L, whose fan from its first corner would cover ground outside it; in all planes and both windings.
    #[test]
    fn a_concave_face_keeps_its_area() {
        let l = [(4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0), (0.0, 0.0)];
        let planes: [fn(f64, f64) -> DVec3; 3] =
            [|x, y| DVec3::new(x, y, 2.0), |x, y| DVec3::new(y, 7.0, x), |x, y| DVec3::new(1.0, x, y)];
        for plane in planes {
            let mut points: Vec<DVec3> = l.iter().map(|&(x, y)| plane(x, y)).collect();
            for _ in 0..2 {
                let (triangles, proper) = cut(&points);
                assert!(proper && triangles.len() == 4);
                assert!((area(&triangles, &points) - 6.0).abs() < 1e-12);
                points.reverse();
            }
        }
    }

    #[test]
    fn an_arrow_of_four_corners_is_cut_at_its_notch() {
        let points = [(0.0, 0.0), (4.0, 2.0), (0.0, 4.0), (1.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let (triangles, proper) = cut(&points);
        assert!(proper);
        assert!((area(&triangles, &points) - 6.0).abs() < 1e-12);
    }

    /// A band of two arms' width that winds inwards: out along one side and back along the other.
    fn spiral(corners: usize) -> Vec<DVec3> {
        let side = |width: f64| {
            let at = move |i: usize| {
                let angle = 0.1 * i as f64;
                (DVec2::from_angle(angle) * (10.0 + angle + width)).extend(0.0)
            };
            (0..corners / 2).map(at)
        };
        // arms are 2π apart: half of it is free
        side(std::f64::consts::PI).chain(side(0.0).rev()).collect()
    }

    /// A comb: narrow teeth side by side.
    fn zigzag(corners: usize) -> Vec<DVec3> {
        let tooth = |i: usize| DVec3::new(i as f64, if i.is_multiple_of(2) { 1.0 } else { 100.0 }, 0.0);
        let teeth = (0..corners - 2).map(tooth);
        let base = [DVec3::new(corners as f64, 0.0, 0.0), DVec3::ZERO];
        teeth.chain(base).collect()
    }

    fn ring_area(points: &[DVec3]) -> f64 {
        let pairs = points.iter().zip(points.iter().cycle().skip(1));
        0.5 * pairs.map(|(a, b)| a.cross(*b).z).sum::<f64>().abs()
    }

    #[test]
    fn faces_of_thousands_of_corners_are_cut_wholly() {
        for points in [spiral(4000), zigzag(12_000)] {
            let (triangles, proper) = cut(&points);
            assert!(proper && triangles.len() == points.len() - 2, "{} of {}", triangles.len(), points.len());
            assert!((area(&triangles, &points) / ring_area(&points) - 1.0).abs() < 1e-9);
        }
    }

    /// A round plate with a round hole, joined by a bridge that is run through there and back.
    #[test]
    fn a_hole_behind_a_bridge_stays_open() {
        let circle = |radius: f64, turn: f64| {
            (0..=100).map(move |i| (DVec2::from_angle(turn * f64::from(i % 100) * 0.0628) * radius).extend(1.0))
        };
        let points: Vec<DVec3> = circle(2.0, 1.0).chain(circle(1.0, -1.0)).collect();
        let (triangles, proper) = cut(&points);
        assert!(proper && triangles.len() == 200);
        assert!((area(&triangles, &points) - ring_area(&points)).abs() < 1e-9);
    }

    #[test]
    fn many_edges_that_cross_make_a_fan() {
        let points: Vec<DVec3> = (0..101).map(|i| DVec2::from_angle(f64::from(i) * 3.0).extend(0.0)).collect();
        let (triangles, proper) = cut(&points);
        assert!(!proper && triangles.len() == 99);
    }

    #[test]
    fn corners_on_a_line_make_a_fan() {
        let points: Vec<DVec3> = (0..5).map(|i| DVec3::X * f64::from(i)).collect();
        let (triangles, proper) = cut(&points);
        assert!(!proper && triangles.len() == 3);
    }
}
