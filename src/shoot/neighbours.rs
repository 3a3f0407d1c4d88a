//! Records around a place that no probe tells of.

use glam::Vec3;

use super::hits::clear;
use super::records::shaded;
use super::{KdTree, Records};
use crate::scene::Scene;

/// Trusted records in shade, found by where they lie.
pub(super) struct Neighbours {
    tree: KdTree<Neighbour>,
    /// The first search's radius and the last one's, metres.
    reach_m: [f32; 2],
}

#[derive(Clone, Copy)]
struct Neighbour {
    position: Vec3,
    normal: Vec3,
    light: Vec3,
}

/// About so many records are kept.
const MOST: usize = 1 << 15;

/// The first search's radius, as a share of the box around all records.
const FIRST_REACH: f32 = 1.0 / 128.0;

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
        let entries: Vec<_> = places.map(|n| (n.position, n)).collect();
        let (low, high) =
            entries.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), e| (l.min(e.0), h.max(e.0)));
        let across = if entries.is_empty() { 0.0 } else { low.distance(high) };
        Self { tree: KdTree::new(entries), reach_m: [FIRST_REACH * across, 2.0 * across] }
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

    /// The nearest records that face alike, nearest first.
    fn nearest(&self, point: Vec3, normal: Vec3) -> Vec<(f32, Neighbour)> {
        let [mut reach, last] = self.reach_m;
        loop {
            let mut found = self.around(point, normal, reach);
            // beyond the radius none is nearer than these
            let enough = found.get(ASKED - 1).is_some_and(|f| f.0 <= reach * reach);
            if enough || reach >= last {
                found.truncate(ASKED);
                return found;
            }
            reach = (2.0 * reach).max(f32::MIN_POSITIVE);
        }
    }

    /// What lies within a radius and faces alike, nearest first, with the square of how far.
    fn around(&self, point: Vec3, normal: Vec3, reach_m: f32) -> Vec<(f32, Neighbour)> {
        let mut found = Vec::new();
        self.tree.within(point, reach_m, |n, distance2| {
            if n.normal.dot(normal) <= ALIKE {
                return;
            }
            let way = n.position - point;
            let off = way.dot(normal).abs().max(way.dot(n.normal).abs()) * OFF_PLANE;
            found.push((distance2 + off * off, *n));
        });
        let order = |a: &(f32, Neighbour), b: &(f32, Neighbour)| {
            let key = |n: &Neighbour| n.position.to_array();
            a.0.total_cmp(&b.0).then_with(|| key(&a.1).partial_cmp(&key(&b.1)).unwrap_or(std::cmp::Ordering::Equal))
        };
        found.sort_by(order);
        found
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
