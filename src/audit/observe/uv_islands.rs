//! Where a texture's mapping is cut: what is mapped in one piece goes right or wrong as one piece.

use glam::{Vec2, Vec3};

use crate::audit::picture::FEWEST;
use crate::audit::picture::regions::Segments;
use crate::edge_aware::EdgeAware;
use crate::scene::Mesh;

/// A step in texture coordinates may be off by this share of what it should be.
const LENGTH: f32 = 0.35;

/// And by this much of a period.
const SLACK: f32 = 2e-3;

/// How texture coordinates change along a triangle, per metre.
#[derive(Clone, Copy)]
pub(crate) struct Gradient {
    u: Vec3,
    v: Vec3,
}

impl Gradient {
    /// `None` without texture coordinates or area.
    pub(crate) fn of(mesh: &Mesh, triangle: u32) -> Option<Self> {
        let [a, b, c] = mesh.corners(triangle);
        let [i, j, k] = mesh.triangles[triangle as usize].map(|i| i as usize);
        let (&ua, &ub, &uc) = (mesh.uvs.get(i)?, mesh.uvs.get(j)?, mesh.uvs.get(k)?);
        let (p, q) = (b - a, c - a);
        let (pp, pq, qq) = (p.length_squared(), p.dot(q), q.length_squared());
        let area2 = pp * qq - pq * pq;
        if area2 <= 1e-7 * pp * qq {
            return None;
        }
        // the dual basis of the sides
        let (along_p, along_q) = ((p * qq - q * pq) / area2, (q * pp - p * pq) / area2);
        let (s, t) = (ub - ua, uc - ua);
        Some(Self { u: along_p * s.x + along_q * t.x, v: along_p * s.y + along_q * t.y })
    }

    /// Coordinates that change so per metre.
    pub(crate) fn along(u: Vec3, v: Vec3) -> Self {
        Self { u, v }
    }

    /// The ways along which one coordinate alone changes by 1, if they change at right angles to each other.
    pub(crate) fn directions(&self) -> [Vec3; 2] {
        [self.u, self.v].map(|g| g / g.length_squared())
    }

    /// How far texture coordinates change along a way on the triangle, in metres.
    pub(crate) fn step(&self, along: Vec3) -> Vec2 {
        Vec2::new(self.u.dot(along), self.v.dot(along))
    }
}

/// A pixel's place in the model and in its texture.
#[derive(Clone, Copy)]
pub(crate) struct Mapped {
    pub(crate) triangle: u32,
    pub(crate) position: Vec3,
    pub(crate) uv: Option<Vec2>,
}

/// Whether a texture runs on from one pixel to its neighbour, but for whole periods.
pub(crate) fn runs_on(mesh: &Mesh, a: Mapped, b: Mapped) -> bool {
    let (Some(from), Some(to)) = (a.uv, b.uv) else { return true };
    if a.triangle == b.triangle {
        return true;
    }
    let (Some(g), Some(h)) = (Gradient::of(mesh, a.triangle), Gradient::of(mesh, b.triangle)) else { return true };
    let alike = |p: Vec3, q: Vec3| p.distance(q) <= LENGTH * p.length().max(q.length());
    if !alike(g.u, h.u) || !alike(g.v, h.v) {
        return false;
    }
    let along = b.position - a.position;
    let expected = (g.step(along) + h.step(along)) * 0.5;
    let off = to - from - expected;
    let off = off - off.round();
    let slack = LENGTH * along.length();
    off.x.abs() <= slack * g.u.length() + SLACK && off.y.abs() <= slack * g.v.length() + SLACK
}

/// Cuts `joins` where `runs_on` says no between two pieces that are not too small to be tested alone.
pub(crate) fn cut(filter: &EdgeAware, runs_on: impl Fn(usize, usize) -> bool) -> EdgeAware {
    let whole = EdgeAware::new(filter.width, filter.height, |i, j| filter.joined(i, j) && runs_on(i, j));
    let segments = Segments::new(&whole);
    let large = |i: usize| segments.pixels[segments.of[i] as usize].len() >= FEWEST;
    EdgeAware::new(filter.width, filter.height, |i, j| {
        filter.joined(i, j) && (whole.joined(i, j) || !large(i) || !large(j))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles side by side in a plane, the second one's mapping shifted or turned.
    fn mesh(shift: f32, turned: bool) -> Mesh {
        let p = [[0., 0.], [1., 0.], [0., 1.], [1., 0.], [1., 1.], [0., 1.]];
        let uv = |i: usize, [x, y]: [f32; 2]| match i {
            0..3 => Vec2::new(x, y),
            _ if turned => Vec2::new(-y, x),
            _ => Vec2::new(x + shift, y),
        };
        Mesh {
            positions: p.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec(),
            uvs: p.iter().enumerate().map(|(i, q)| uv(i, *q)).collect(),
            colours: vec![],
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            materials: vec![0, 0],
        }
    }

    #[test]
    fn a_texture_runs_on_but_for_whole_periods() {
        let at = |m: &Mesh, t: u32, b: [f32; 2]| {
            let [p, q, r] = m.corners(t);
            let uv = m.uv(t, Vec2::from(b));
            Mapped { triangle: t, position: p + (q - p) * b[0] + (r - p) * b[1], uv }
        };
        let joined = |m: &Mesh| runs_on(m, at(m, 0, [0.49, 0.49]), at(m, 1, [0.02, 0.49]));
        assert!(joined(&mesh(0.0, false)) && joined(&mesh(2.0, false)));
        assert!(!joined(&mesh(0.3, false)) && !joined(&mesh(0.0, true)));
    }

    #[test]
    fn only_large_pieces_are_cut_apart() {
        let open = EdgeAware::open(40, 30);
        let halves = cut(&open, |i, j| (i % 40 < 20) == (j % 40 < 20));
        assert!(!halves.joined(19, 20) && halves.joined(18, 19) && halves.joined(20, 60));
        let in_strip = |i: usize| i % 40 < 2 && i / 40 < FEWEST / 2 - 1;
        let strip = cut(&open, |i, j| in_strip(i) == in_strip(j));
        assert!(strip.joined(1, 2));
    }
}
