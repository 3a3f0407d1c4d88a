//! Where the irradiance volume keeps its values: on the surfaces inside each cell, one per side they face.

use glam::{IVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

use super::Grid;
use crate::scene::Scene;
use crate::shoot::hits::clear;

/// A place on a surface that stands for the part of it inside one cell.
#[derive(Clone, Copy, Debug)]
pub struct CachePoint {
    /// Local metres, on the surface.
    pub position: Vec3,
    /// Unit normal of the side it stands for.
    pub normal: Vec3,
}

/// All cache points of a scene, found by cell.
pub struct CachePoints {
    /// The cells.
    pub grid: Grid,
    /// Sorted by cell.
    pub list: Vec<CachePoint>,
    /// Per cell, index of its first cache point; one more at the end.
    starts: Vec<u32>,
}

/// How far a cache point speaks, in cells.
const REACH: f32 = 1.75;

/// How far off a cache point's plane, in cells, halves its weight.
const OFF_PLANE: f32 = 0.05;

/// A thread takes no more points than this at once: some take far longer than others.
const MOST_POINTS: usize = 1024;

/// How well a cache point speaks for a point, with its index.
pub type Weighted = (f32, u32);

impl CachePoints {
    /// The [weight](Self::weight) at the cache point itself.
    pub(super) const FULL_WEIGHT: f32 = 1.0 / OFF_PLANE;

    /// Puts cache points on all surfaces, both sides: per cell and main direction (26 of them) the sample nearest to the
    /// middle of the cell. Samples lie where a lattice fixed to the grid, six lines a cell, pierces the surfaces along
    /// the axis that they face most, so that cache points do not depend on how a surface is cut into triangles.
    pub fn over(scene: &Scene, grid: Grid) -> Self {
        let mesh = &scene.mesh;
        let mut best: Vec<(u64, f32, CachePoint)> = (0..mesh.triangles.len() as u32)
            .into_par_iter()
            .fold(Vec::new, |mut all, triangle| {
                let normal = mesh.normal(triangle);
                let mut found = Vec::new();
                pierced(&grid, mesh.corners(triangle), normal, |position| {
                    let cell = grid.cell(position);
                    let Some(index) = grid.index(cell) else { return };
                    let off = (position - grid.centre(cell) - UNEVEN * grid.cell_m).length_squared();
                    for normal in [normal, -normal] {
                        let key = (index as u64) * 27 + main_direction(normal);
                        found.push((key, off, CachePoint { position, normal }));
                    }
                });
                nearest(&mut found);
                all.append(&mut found);
                all
            })
            .collect::<Vec<_>>()
            .concat();
        nearest(&mut best);
        Self::sorted(grid, best.into_iter().map(|(key, _, cache_point)| ((key / 27) as usize, cache_point)).collect())
    }

    /// From cache points with their cells' indices, in order of these.
    fn sorted(grid: Grid, all: Vec<(usize, CachePoint)>) -> Self {
        let mut starts = vec![0u32; grid.len() + 1];
        for (cell, _) in &all {
            starts[cell + 1] += 1;
        }
        for i in 0..grid.len() {
            starts[i + 1] += starts[i];
        }
        Self { grid, list: all.into_iter().map(|a| a.1).collect(), starts }
    }

    /// Puts cache points on those of some points (position, normal) that see none within `spacing` cells that faces much as they do: small
    /// things hide from the cache point of their cell, and on a chamfer a neighbour's vector irradiance, of another hemisphere,
    /// says little. At most one each third of a cell along and main direction.
    pub(super) fn complete(&mut self, scene: &Scene, points: &[(Vec3, Vec3)], spacing: f32) {
        const PARTS: f32 = 3.0;
        /// Normals whose cosine is more face alike.
        const ALIKE: f32 = 0.85;
        let lonely: Vec<CachePoint> = points
            .par_iter()
            .with_max_len(MOST_POINTS)
            .map_init(Vec::new, |found, &(position, normal)| {
                self.around(position, normal, found);
                let seen = found.iter().any(|&(_, i)| {
                    let near = &self.list[i as usize];
                    near.normal.dot(normal) > ALIKE
                        && near.position.distance(position) < spacing * self.grid.cell_m
                        && self.sees(scene, i, position, normal)
                });
                (!seen).then_some(CachePoint { position, normal })
            })
            .flatten()
            .collect();
        // the nearest to the middle of each part, so that one point more or less seldom matters
        let mut new: BTreeMap<_, (f32, CachePoint)> = BTreeMap::new();
        for cache_point in lonely {
            let place = self.grid.place(cache_point.position) * PARTS;
            let part = place.floor();
            let off = (place - part - 0.5).length_squared();
            let best = new
                .entry((part.as_ivec3().to_array(), main_direction(cache_point.normal)))
                .or_insert((off, cache_point));
            if off < best.0 {
                *best = (off, cache_point);
            }
        }
        let old = self.starts.windows(2).enumerate().flat_map(|(cell, ends)| {
            self.list[ends[0] as usize..ends[1] as usize].iter().map(move |&cache_point| (cell, cache_point))
        });
        let cell = |cache_point: &CachePoint| self.grid.index(self.grid.cell(cache_point.position)).unwrap_or(0);
        let mut all: Vec<_> =
            old.chain(new.into_values().map(|(_, cache_point)| (cell(&cache_point), cache_point))).collect();
        all.sort_by_key(|a| a.0);
        *self = Self::sorted(self.grid, all);
    }

    /// The cache points around a point whose side agrees with `normal`, with weights that fall to zero 1.5 cells away, so that
    /// they hardly jump where a cell comes in or goes out:
    /// nearest, best aligned and least off the point's own plane count most.
    pub fn around(&self, point: Vec3, normal: Vec3, found: &mut Vec<Weighted>) {
        found.clear();
        let middle = self.grid.place(point).floor().as_ivec3();
        for i in 0..27 {
            let cell = middle + IVec3::new(i % 3, i / 3 % 3, i / 9) - 1;
            let Some(index) = self.grid.index(cell) else { continue };
            for j in self.starts[index]..self.starts[index + 1] {
                let weight = self.weight(j, point, normal);
                if weight > 0.0 {
                    found.push((weight, j));
                }
            }
        }
        // the greatest first, of equals the first one: bits of positive numbers are ordered as these are, and one number is
        // compared faster than two
        found.sort_unstable_by_key(|&(weight, j)| u64::from(!weight.to_bits()) << 32 | u64::from(j));
    }

    /// The cache points that points (position, normal) take values from, each once, in order, with how many points' worth of
    /// light they speak for.
    pub fn near(&self, scene: &Scene, points: &[(Vec3, Vec3)]) -> Vec<(u32, f32)> {
        let mut all: Vec<(u32, f32)> = points
            .par_iter()
            .with_max_len(MOST_POINTS)
            .fold(
                || (Vec::new(), Vec::new()),
                |(mut all, mut found), &(point, normal)| {
                    self.around(point, normal, &mut found);
                    let first = all.len();
                    self.taken(scene, point, normal, &found, |weight, index| all.push((index, weight)));
                    let total: f32 = all[first..].iter().map(|a| a.1).sum();
                    all[first..].iter_mut().for_each(|a| a.1 /= total);
                    (all, found)
                },
            )
            .flat_map_iter(|(all, _)| all)
            .collect();
        // a stable sort, so that sums do not depend on threads
        all.par_sort_by_key(|a| a.0);
        let summed = |a: &[(u32, f32)]| (a[0].0, a.iter().map(|a| a.1).sum());
        all.chunk_by(|a, b| a.0 == b.0).map(summed).collect()
    }

    /// Calls `take` with the few cache points, of those found [around](Self::around) a point, that it takes its value from:
    /// the best that it sees, with their weights.
    pub(super) fn taken(
        &self,
        scene: &Scene,
        point: Vec3,
        normal: Vec3,
        found: &[Weighted],
        mut take: impl FnMut(f32, u32),
    ) {
        /// Cache points of less than this share of the best one's weight are left out.
        const LEAST_SHARE: f32 = 0.05;
        let mut best = 0.0;
        let mut taken = 0;
        for &(weight, index) in found {
            if weight < LEAST_SHARE * best || taken == ENOUGH {
                break;
            }
            if self.sees(scene, index, point, normal) {
                best = f32::max(best, weight);
                taken += 1;
                take(weight, index);
            }
        }
    }

    /// The cache point that speaks for a point of a surface, if one near sees it.
    pub(super) fn nearest_visible(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<u32> {
        const ASKED: usize = 3;
        let mut best = [(0.0, 0); ASKED];
        // the eight cells whose middles are nearest
        let corner = (self.grid.place(point) - 0.5).floor().as_ivec3();
        for i in 0..8 {
            let cell = corner + IVec3::new(i & 1, i >> 1 & 1, i >> 2);
            let Some(index) = self.grid.index(cell) else { continue };
            for j in self.starts[index]..self.starts[index + 1] {
                let mut new = (self.weight(j, point, normal), j);
                for slot in &mut best {
                    if new.0 > slot.0 {
                        std::mem::swap(slot, &mut new);
                    }
                }
            }
        }
        best.into_iter().find(|b| b.0 > 0.0 && self.sees(scene, b.1, point, normal)).map(|b| b.1)
    }

    /// How well a cache point speaks for a point.
    pub(super) fn weight(&self, cache_point: u32, point: Vec3, normal: Vec3) -> f32 {
        let cache_point = &self.list[cache_point as usize];
        let facing = cache_point.normal.dot(normal);
        if facing < 0.3 {
            return 0.0;
        }
        let d = point - cache_point.position;
        let near = 1.0 - d.length() / (REACH * self.grid.cell_m);
        if near <= 0.0 {
            return 0.0;
        }
        let off_plane = (cache_point.normal.dot(d).abs() + normal.dot(d).abs()) / self.grid.cell_m;
        near * near * facing * facing / (OFF_PLANE + off_plane)
    }

    /// A number for what a cache point's random choices are made from. It hangs on the cache point's cell and direction alone, so
    /// that one cache point more or less elsewhere changes nothing here.
    pub(super) fn seed(&self, cache_point: u32) -> u64 {
        let CachePoint { position, normal } = self.list[cache_point as usize];
        self.key(self.grid.cell(position), normal)
    }

    /// Cache points with the same number face much the same way, within a few cells.
    pub(super) fn neighbourhood(&self, cache_point: u32) -> u64 {
        const CELLS: IVec3 = IVec3::splat(3);
        let CachePoint { position, normal } = self.list[cache_point as usize];
        self.key(self.grid.cell(position) / CELLS * CELLS, normal)
    }

    /// A number for a cell of the grid and a main direction.
    fn key(&self, cell: IVec3, normal: Vec3) -> u64 {
        self.grid.index(cell).map_or(0, |i| i as u64 * 27 + main_direction(normal))
    }

    /// How far above a surface its light is gathered, metres: past doubled walls, and small against a cell.
    pub fn lift(&self) -> f32 {
        0.02 * self.grid.cell_m
    }

    /// Whether nothing stands between a point and a cache point, seen from just above both surfaces.
    pub fn sees(&self, scene: &Scene, cache_point: u32, point: Vec3, normal: Vec3) -> bool {
        let cache_point = &self.list[cache_point as usize];
        let lift = self.lift();
        clear(scene, point + normal * lift, cache_point.position + cache_point.normal * lift, 2.0 * lift)
    }
}

/// Keeps of each key the nearest sample only.
fn nearest(samples: &mut Vec<(u64, f32, CachePoint)>) {
    samples.par_sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    samples.dedup_by_key(|s| s.0);
}

/// How far off the middle of a cell, in cells, a cache point should rather lie: so that of two samples on either side of the middle
/// one is nearer.
const UNEVEN: Vec3 = Vec3::new(0.023, 0.037, 0.043);

/// Calls `found` with the points where lattice lines along the main axis of a triangle's normal pierce it.
fn pierced(grid: &Grid, corners: [Vec3; 3], normal: Vec3, mut found: impl FnMut(Vec3)) {
    /// Lattice lines along a cell's side.
    const LINES: f32 = 6.0;
    /// Points so far beside an edge, in lattice steps, still count: better twice than never.
    const SLACK: f32 = 1e-4;
    // a little steeper towards the next axis does not count: rounding must not turn the axis
    let size = normal.abs() * Vec3::new(1.0, 0.999, 0.998);
    let axis = size.max_position();
    let (along_u, along_v) = ((axis + 1) % 3, (axis + 2) % 3);
    let flat = corners.map(|p| {
        let p = grid.place(p) * LINES;
        Vec2::new(p[along_u], p[along_v]) - 0.5
    });
    let [a, b, c] = flat;
    let first = (a.min(b).min(c) - SLACK).ceil();
    let last = (a.max(b).max(c) + SLACK).floor();
    if first.cmpgt(last).any() {
        return;
    }
    let doubled = (b - a).perp_dot(c - a);
    let inside = |p: Vec2| {
        [(a, b), (b, c), (c, a)].iter().all(|&(from, to)| {
            let edge = to - from;
            edge.perp_dot(p - from) * doubled.signum() >= -SLACK * edge.length()
        })
    };
    let step = grid.cell_m / LINES;
    let mut v = first.y;
    while v <= last.y {
        let mut u = first.x;
        while u <= last.x {
            let p = Vec2::new(u, v);
            if inside(p) {
                let off = (p - a) * step;
                let mut position = corners[0];
                position[along_u] += off.x;
                position[along_v] += off.y;
                position[axis] -= (normal[along_u] * off.x + normal[along_v] * off.y) / normal[axis];
                found(position);
            }
            u += 1.0;
        }
        v += 1.0;
    }
}

/// Which of the 26 directions from a cube's middle to its faces, edges and corners a normal is nearest to, in 0..27.
fn main_direction(n: Vec3) -> u64 {
    // tan 21.8°: a component counts where it is more than that share of the greatest. Half way would be 22.5°, as facets of
    // octagons are turned: there rounding would decide
    let limit = 0.4 * n.abs().max_element();
    let digit = |v: f32| if v > limit { 2 } else { u64::from(v >= -limit) };
    digit(n.x) * 9 + digit(n.y) * 3 + digit(n.z)
}

/// Point `i` of the two-dimensional additive recurrence on the plastic number: evenly spread over the unit square.
pub(super) fn plastic(i: u64) -> Vec2 {
    const A: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let at = |a: f64| ((i as f64 * a).fract()) as f32;
    Vec2::new(at(A[0]), at(A[1]))
}

/// The most cache points that a point takes its value from.
pub(super) const ENOUGH: usize = 8;
