//! Records around a place that no probe tells of.

use glam::Vec3;

use super::hits::clear;
use super::records::shaded;
use super::{KdTree, Records};
use crate::scene::Scene;

/// Trusted records in shade, found by where they lie.
pub(super) struct Neighbours {
    tree: KdTree<Neighbour>,
}

#[derive(Clone, Copy)]
struct Neighbour {
    position: Vec3,
    normal: Vec3,
    light: Vec3,
}

/// About so many records are kept.
const MOST: usize = 1 << 15;

/// So many are asked whether they are seen, the nearest first, and so many that are make a mean.
const ASKED: usize = 24;
const ENOUGH: usize = 4;

/// A way off either surface's plane counts so many times: on the same surface light changes less.
const OFF_PLANE: f32 = 3.0;

/// Cosine between normals from which on surfaces face alike; and from which on they may be one.
const ALIKE: f32 = 0.5;
const ONE: f32 = 0.9;

impl Neighbours {
    pub(super) fn new(probes: &[Records]) -> Self {
        let places = shaded(probes, MOST).map(|(position, normal, light)| Neighbour { position, normal, light });
        Self { tree: KdTree::new(places.map(|n| (n.position, n)).collect()) }
    }

    /// Irradiance at a point by the nearest records that face alike and that it sees; else by the nearest that lies on the
    /// same surface, or that faces alike.
    pub(super) fn light(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<Vec3> {
        let found = self.nearest(point, normal);
        let one = |n: &Neighbour| {
            let way = n.position - point;
            n.normal.dot(normal) > ONE && way.dot(normal).abs() < 0.1 * way.length()
        };
        let on_surface = || found.iter().find(|f| one(&f.1)).map(|f| f.1.light);
        let nearest = || found.first().map(|f| f.1.light);
        seen(scene, point, normal, &found).or_else(on_surface).or_else(nearest)
    }

    /// Irradiance at a point by the nearest records that face alike and that it sees.
    pub(super) fn seen(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<Vec3> {
        seen(scene, point, normal, &self.nearest(point, normal))
    }

    /// The nearest records that face alike, nearest first, with the square of how far.
    fn nearest(&self, point: Vec3, normal: Vec3) -> Vec<(f32, Neighbour)> {
        self.tree.nearest(point, ASKED, |n, distance2| {
            if n.normal.dot(normal) <= ALIKE {
                return f32::INFINITY;
            }
            let way = n.position - point;
            let off = way.dot(normal).abs().max(way.dot(n.normal).abs()) * OFF_PLANE;
            distance2 + off * off
        })
    }
}

/// The mean light of the first few that a point sees, the nearest counting most.
fn seen(scene: &Scene, point: Vec3, normal: Vec3, found: &[(f32, Neighbour)]) -> Option<Vec3> {
    let seen: Vec<_> = found.iter().filter(|f| sees(scene, point, normal, &f.1)).take(ENOUGH).collect();
    let weight = |off: f32| 1.0 / (off + 1e-6);
    let total: f32 = seen.iter().map(|f| weight(f.0)).sum();
    // shares first: a mean of the greatest numbers is a number
    let mean = || seen.iter().map(|f| f.1.light * (weight(f.0) / total)).sum::<Vec3>().min(Vec3::splat(f32::MAX));
    (!seen.is_empty()).then(mean)
}

/// Whether nothing stands between a point and a record, seen from just above both surfaces.
fn sees(scene: &Scene, point: Vec3, normal: Vec3, n: &Neighbour) -> bool {
    /// Share of the way between them.
    const LIFT: f32 = 0.05;
    let lift = LIFT * point.distance(n.position) + 1e-4;
    clear(scene, point + normal * lift, n.position + n.normal * lift, lift)
}
