//! Which parts of a model no ray from its probes and views can ever reach.
//!
//! A closed surface, every edge of which belongs to an even number of triangles, parts space in two. If all probes and
//! views are on one side of it, no ray of theirs, however often reflected, comes to the other side: what lies there
//! wholly can be left out of the ray caster, and no picture changes.

use glam::{DVec3, Vec3};

use crate::components::members;
use crate::scene::{Mesh, Ray, Tracer};
use crate::site::Site;

/// Where rays start: all probes, and the views, or those named; metres from `origin`.
pub fn eyes(site: &Site, origin: DVec3, views: Option<&[&str]>) -> Vec<Vec3> {
    let wanted = |name: &str| views.is_none_or(|v| v.contains(&name));
    let cameras = site.views.iter().filter(|v| wanted(&v.name)).map(|v| v.camera.pose);
    site.probes.iter().map(|p| p.pose).chain(cameras).map(|pose| (pose.position - origin).as_vec3()).collect()
}

/// Triangles that no ray from `eyes` (local metres) can reach, as a mark for each; `None` where all can be reached, or
/// where that cannot be ruled out.
pub fn unreachable(mesh: &Mesh, eyes: &[Vec3]) -> Option<Vec<bool>> {
    let parts = parts(mesh);
    if parts.len() < 2 || eyes.is_empty() {
        return None;
    }
    let mut marked = vec![false; mesh.triangles.len()];
    let boxes: Vec<Bounds> = parts.iter().map(|p| p.bounds(mesh)).collect();
    for (w, wall) in parts.iter().enumerate().filter(|(_, p)| p.closed) {
        // most closed things hold nothing and have no eye in them: no ray is needed to know that they part nothing
        let eye_within = eyes.iter().any(|eye| boxes[w].holds([*eye; 2]));
        let parted = |p: &usize| *p != w && (eye_within || boxes[w].holds(boxes[*p].0));
        let others: Vec<usize> = (0..parts.len()).filter(parted).collect();
        if others.is_empty() {
            continue;
        }
        let keep = wall.marks(mesh.triangles.len());
        let tracer = Tracer::over(mesh, &keep);
        let sides: Option<Vec<bool>> = eyes.iter().map(|eye| inside(&tracer, *eye)).collect();
        let Some(sides) = sides else { continue };
        if sides.iter().any(|s| *s != sides[0]) {
            continue;
        }
        for part in others.into_iter().map(|p| &parts[p]) {
            let done = part.triangles.iter().all(|&t| marked[t as usize]);
            if !done && apart(mesh, &tracer, wall, part, sides[0]) {
                part.triangles.iter().for_each(|&t| marked[t as usize] = true);
            }
        }
    }
    marked.contains(&true).then_some(marked)
}

/// Least and greatest corner.
struct Bounds([Vec3; 2]);

impl Bounds {
    fn holds(&self, [low, high]: [Vec3; 2]) -> bool {
        low.cmpge(self.0[0]).all() && high.cmple(self.0[1]).all()
    }
}

/// Triangles that hang together by corners in the same place.
struct MeshComponent {
    triangles: Vec<u32>,
    /// Every edge belongs to an even number of triangles.
    closed: bool,
}

impl MeshComponent {
    fn marks(&self, count: usize) -> Vec<bool> {
        let mut marks = vec![false; count];
        self.triangles.iter().for_each(|&t| marks[t as usize] = true);
        marks
    }

    fn bounds(&self, mesh: &Mesh) -> Bounds {
        let corners = self.triangles.iter().flat_map(|&t| mesh.corners(t));
        let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        Bounds(corners.fold(none, |[low, high], p| [low.min(p), high.max(p)]))
    }

    fn edges<'a>(&'a self, mesh: &'a Mesh) -> impl Iterator<Item = [Vec3; 2]> + 'a {
        self.triangles.iter().flat_map(|&t| {
            let [a, b, c] = mesh.corners(t);
            [[a, b], [b, c], [c, a]]
        })
    }
}

fn parts(mesh: &Mesh) -> Vec<MeshComponent> {
    let welded = mesh.welded();
    let one = |triangles: Vec<usize>| {
        let sorted = |a: u32, b: u32| (a.min(b), a.max(b));
        let corners = triangles.iter().map(|t| mesh.triangles[*t].map(|i| welded[i as usize]));
        let mut edges: Vec<_> = corners.flat_map(|[a, b, c]| [sorted(a, b), sorted(b, c), sorted(c, a)]).collect();
        edges.sort_unstable();
        let closed = edges.chunk_by(|a, b| a == b).all(|same| same.len() % 2 == 0);
        MeshComponent { closed, triangles: triangles.into_iter().map(|t| t as u32).collect() }
    };
    members(&mesh.components()).into_iter().map(one).collect()
}

/// Whether a point is inside a closed surface, by the parity of crossings; `None` where directions do not agree.
fn inside(wall: &Tracer, point: Vec3) -> Option<bool> {
    const MOST: usize = 10_000;
    let odd = |direction: Vec3| -> Option<bool> {
        let (mut t, mut crossings) = (0.0, 0);
        while let Some(hit) = wall.closest(&Ray { origin: point, direction }, t) {
            (t, crossings) = (hit.t, crossings + 1);
            if crossings > MOST {
                return None;
            }
        }
        Some(crossings % 2 == 1)
    };
    let first = odd(Vec3::new(0.48, 0.6, 0.64))?;
    let others = [Vec3::new(-0.64, 0.6, -0.48), Vec3::new(0.36, -0.48, 0.8), Vec3::new(-0.6, -0.64, 0.48)];
    others.into_iter().all(|d| odd(d.normalize()) == Some(first)).then_some(first)
}

/// Whether a part lies wholly on the other side of a closed wall than the eyes, without touching it.
fn apart(mesh: &Mesh, tracer: &Tracer, wall: &MeshComponent, part: &MeshComponent, eyes_inside: bool) -> bool {
    let first = mesh.corners(part.triangles[0])[0];
    if inside(tracer, first) != Some(!eyes_inside) {
        return false;
    }
    let crossed = |tracer: &Tracer, [a, b]: [Vec3; 2]| {
        let length = a.distance(b);
        // a hair longer at both ends, so that a touch counts
        let (d, more) = ((b - a) / length, 1e-3 * length + 1e-4);
        length > 0.0 && tracer.occluded(&Ray { origin: a - d * more, direction: d }, 0.0, length + 2.0 * more)
    };
    if part.edges(mesh).any(|e| crossed(tracer, e)) {
        return false;
    }
    let own = Tracer::over(mesh, &part.marks(mesh.triangles.len()));
    !wall.edges(mesh).any(|e| crossed(&own, e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::boxes;

    /// Boxes, closed or without a lid.
    fn mesh(all: &[(Vec3, Vec3, bool)]) -> Mesh {
        let mut mesh = boxes(&all.iter().map(|&(low, high, _)| (low, high)).collect::<Vec<_>>());
        let parts = mesh.triangles.chunks(12).zip(all);
        mesh.triangles = parts.flat_map(|(part, b)| &part[..if b.2 { 12 } else { 10 }]).copied().collect();
        mesh.materials.truncate(mesh.triangles.len());
        mesh
    }

    fn marked(boxes: &[(Vec3, Vec3, bool)], eyes: &[Vec3]) -> Vec<usize> {
        let marks = unreachable(&mesh(boxes), eyes).unwrap_or_default();
        let mut first = 0;
        let mut found = Vec::new();
        for (i, b) in boxes.iter().enumerate() {
            let count = if b.2 { 12 } else { 10 };
            let here = marks.get(first..first + count).map_or(0, |m| m.iter().filter(|m| **m).count());
            assert!(here == 0 || here == count, "all of a part or nothing");
            found.extend((here > 0).then_some(i));
            first += count;
        }
        found
    }

    const V: fn(f32) -> Vec3 = Vec3::splat;

    #[test]
    fn what_a_closed_wall_parts_from_all_eyes_is_unreachable() {
        let room = (V(0.0), V(4.0), true);
        let solid = (V(1.0), V(2.0), true);
        let in_solid = (V(1.3), V(1.6), false);
        let outside = (V(6.0), V(7.0), false);
        let through = (Vec3::new(3.0, 1.0, 1.0), Vec3::new(5.0, 2.0, 2.0), true);
        let all = [room, solid, in_solid, outside];
        assert_eq!(marked(&all, &[V(3.0)]), [2, 3]);
        assert_eq!(marked(&all, &[V(3.0), V(0.5)]), [2, 3]);
        assert_eq!(marked(&all, &[V(3.0), V(9.0)]), [2], "an eye on either side of the room");
        assert_eq!(marked(&all, &[V(9.0)]), [1, 2], "seen from outside");
        assert_eq!(marked(&[room, through], &[V(0.5)]), [0usize; 0], "it sticks through the wall");
        let open = (V(0.0), V(4.0), false);
        assert_eq!(marked(&[open, outside], &[V(3.0)]), [0usize; 0], "an open wall parts nothing");
        let touching = (Vec3::new(4.0, 1.0, 1.0), Vec3::new(5.0, 2.0, 2.0), true);
        assert_eq!(marked(&[room, touching], &[V(0.5)]), [0usize; 0], "contact is no parting");
    }
}
