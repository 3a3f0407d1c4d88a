//! The surface that is baked: the inner sides of a model's triangles, cut where light changes, never so that a crack opens.

use glam::Vec3;
use rayon::prelude::*;
use smallvec::SmallVec;

use crate::components::components;
use crate::lists::Lists;
use crate::scene::Scene;

/// No sample, no patch.
pub(super) const NONE: u32 = u32::MAX;

/// One side of a triangle or of a part of one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Places of the corners, counter-clockwise as seen from this side.
    pub(super) corners: [u32; 3],
    /// Their light.
    pub(super) samples: [u32; 3],
    /// Barycentric coordinates of the corners in the model's triangle: of its second and third corner.
    pub(super) at: [[f32; 2]; 3],
    /// The model's triangle.
    pub(super) triangle: u32,
    /// The smooth surface that it is part of.
    pub(super) patch: u32,
    /// The light at the edges' middles.
    pub(super) middles: [Middle; 3],
}

/// What is known of the light at the middle of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Middle {
    /// Nothing.
    Unasked,
    /// It is what the ends say.
    Even,
    /// It was looked up, as the candidate of this number, and there has been no room yet.
    Uneven(u32),
}

/// A point of a patch that light is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Where light is asked for: a hair inside the patch's rim, so that what meets it there does not hide it.
    pub(super) position: Vec3,
    /// The mean of the patch's normals around.
    pub(super) normal: Vec3,
}

/// The surface as it stands.
pub(super) struct Surface {
    /// Local metres; of corners at the same place only the first counts.
    pub(super) places: Vec<Vec3>,
    pub(super) pieces: Vec<Piece>,
    pub(super) samples: Vec<Sample>,
    /// The pieces as they were when there were last at most `coarse_samples`, or before the first cut; none if that is 0.
    pub(super) coarse: Vec<Piece>,
    coarse_samples: usize,
    /// How far inside a rim light is asked for, metres.
    pull_m: f32,
}

/// Pieces that meet at an edge on one patch: the places of its ends, and the pieces' edges.
pub(super) struct Run {
    pub(super) ends: [u32; 2],
    /// First entry in [`Edges::entries`], and one past the last.
    pub(super) range: [u32; 2],
    /// The edge: runs of one edge share it.
    pub(super) edge: u32,
}

/// All edges of a surface.
pub(super) struct Edges {
    /// 3 · piece + edge, run by run.
    entries: Vec<u32>,
    /// By their ends, then by patch.
    pub(super) runs: Vec<Run>,
    /// For each 3 · piece + edge its run.
    pub(super) run_of: Vec<u32>,
    /// Number of edges.
    pub(super) count: usize,
}

impl Edges {
    /// The pieces' edges (3 · piece + edge) of a run.
    pub(super) fn of(&self, run: &Run) -> &[u32] {
        &self.entries[run.range[0] as usize..run.range[1] as usize]
    }

    /// All pieces' edges that lie at the same edge as one of them.
    pub(super) fn around(&self, at: u32) -> impl Iterator<Item = u32> {
        let run = self.run_of[at as usize] as usize;
        let same = move |r: &&Run| r.edge == self.runs[run].edge;
        let (before, after) = self.runs.split_at(run);
        let runs = before.iter().rev().take_while(same).chain(after.iter().take_while(same));
        runs.flat_map(|run| self.of(run)).copied()
    }
}

impl Surface {
    /// The given sides of a scene's triangles. Neighbours whose normals are closer than `smooth` (a cosine) are one patch.
    pub(super) fn new(scene: &Scene, inner: &[bool], smooth: f32, pull_m: f32, coarse_samples: usize) -> Self {
        let mesh = &scene.mesh;
        let place_of = mesh.welded();
        let mut pieces: Vec<Piece> = Vec::new();
        for side in (0..inner.len()).filter(|s| inner[*s]) {
            let triangle = (side / 2) as u32;
            let mut corners = mesh.triangles[side / 2].map(|v| place_of[v as usize]);
            let mut at = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
            if side % 2 == 1 {
                corners.swap(1, 2);
                at.swap(1, 2);
            }
            pieces.push(Piece { corners, samples: [NONE; 3], at, triangle, patch: 0, middles: [Middle::Unasked; 3] });
        }
        let places = mesh.positions.clone();
        let mut surface = Self { places, pieces, samples: Vec::new(), coarse: Vec::new(), coarse_samples, pull_m };
        surface.find_patches(smooth);
        surface.sample_corners();
        surface
    }

    /// The unit normal of a piece.
    pub(super) fn normal(&self, piece: &Piece) -> Vec3 {
        let [a, b, c] = piece.corners.map(|p| self.places[p as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// The length of an edge, metres.
    pub(super) fn length(&self, ends: [u32; 2]) -> f32 {
        self.places[ends[0] as usize].distance(self.places[ends[1] as usize])
    }

    /// Unites neighbours that lie smoothly beside each other.
    fn find_patches(&mut self, smooth: f32) {
        let normals: Vec<Vec3> = self.pieces.par_iter().map(|p| self.normal(p)).collect();
        let edges = self.edges();
        let neighbours = |piece: usize| {
            let mut found = SmallVec::<[usize; 8]>::new();
            for one in (3 * piece as u32..).take(3) {
                let [from, to] = self.ends(one);
                // all are of one patch yet: a run is an edge
                let run = &edges.runs[edges.run_of[one as usize] as usize];
                // wound alike, they run along their edge in opposite ways
                let opposite = edges.of(run).iter().filter(|&&other| self.ends(other) == [to, from]);
                let smoothly = |other: &usize| normals[piece].dot(normals[*other]) > smooth;
                found.extend(opposite.map(|other| *other as usize / 3).filter(smoothly));
            }
            found
        };
        let patches = components(self.pieces.len(), |_| true, neighbours);
        for (piece, patch) in self.pieces.iter_mut().zip(patches) {
            piece.patch = patch;
        }
    }

    /// Makes the samples of the model's own corners: one for each patch that meets a place.
    fn sample_corners(&mut self) {
        let mut corners: Vec<(u32, u32, u32)> = (self.pieces.iter().enumerate())
            .flat_map(|(i, p)| (0..3).map(move |c| (p.corners[c as usize], p.patch, 3 * i as u32 + c)))
            .collect();
        corners.par_sort_unstable();
        for run in corners.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let number = self.samples.len() as u32;
            let sample = self.sample(self.places[run[0].0 as usize], run.iter().map(|r| r.2 / 3));
            self.samples.push(sample);
            for &(_, _, at) in run {
                self.pieces[at as usize / 3].samples[at as usize % 3] = number;
            }
        }
    }

    /// A sample at a place that these pieces of a patch share.
    pub(super) fn sample(&self, place: Vec3, pieces: impl Iterator<Item = u32>) -> Sample {
        let (mut normal, mut inwards, mut count) = (Vec3::ZERO, Vec3::ZERO, 0.0);
        for piece in pieces.map(|i| &self.pieces[i as usize]) {
            let [a, b, c] = piece.corners.map(|p| self.places[p as usize]);
            let doubled = (b - a).cross(c - a);
            // by angle or area hardly matters on a smooth patch; slivers must not decide
            normal += doubled.normalize_or_zero() * doubled.length().sqrt();
            inwards += (a + b + c) / 3.0 - place;
            count += 1.0;
        }
        let normal = normal.normalize_or_zero();
        let inwards = inwards / f32::max(count, 1.0);
        let inwards = inwards - normal * inwards.dot(normal);
        Sample { position: place + inwards.clamp_length_max(self.pull_m.min(0.5 * inwards.length())), normal }
    }

    /// The places of the ends of an edge (3 · piece + edge), as its piece runs.
    pub(super) fn ends(&self, edge: u32) -> [u32; 2] {
        let corners = self.pieces[edge as usize / 3].corners;
        [corners[edge as usize % 3], corners[(edge as usize + 1) % 3]]
    }

    /// All edges.
    pub(super) fn edges(&self) -> Edges {
        /// So many places are handled together.
        const LOT: usize = 4096;
        let first = |at: u32| self.ends(at).into_iter().fold(NONE, u32::min);
        let firsts: Vec<u32> = (0..3 * self.pieces.len() as u32).into_par_iter().map(first).collect();
        // per place the edges that start there
        let starting = Lists::of(self.places.len(), || firsts.iter().copied().zip(0..));
        drop(firsts);
        let of_lot = |lot: usize| {
            let mut edges = Edges { entries: Vec::new(), runs: Vec::new(), run_of: Vec::new(), count: 0 };
            let mut here: Vec<(u32, u32, u32)> = Vec::new();
            for place in lot * LOT..self.places.len().min((lot + 1) * LOT) {
                let other = |at: u32| self.ends(at).into_iter().fold(0, u32::max);
                here.clear();
                here.extend(starting.get(place).iter().map(|&at| (other(at), self.pieces[at as usize / 3].patch, at)));
                here.sort_unstable();
                for edge in here.chunk_by(|a, b| a.0 == b.0) {
                    for run in edge.chunk_by(|a, b| a.1 == b.1) {
                        let from = edges.entries.len() as u32;
                        edges.entries.extend(run.iter().map(|e| e.2));
                        let range = [from, edges.entries.len() as u32];
                        edges.runs.push(Run { ends: [place as u32, edge[0].0], range, edge: edges.count as u32 });
                    }
                    edges.count += 1;
                }
            }
            edges
        };
        let lots: Vec<Edges> = (0..self.places.len().div_ceil(LOT)).into_par_iter().map(of_lot).collect();
        let of_all = |count: fn(&Edges) -> usize| lots.iter().map(count).sum();
        let mut all = Edges {
            entries: Vec::with_capacity(of_all(|lot| lot.entries.len())),
            runs: Vec::with_capacity(of_all(|lot| lot.runs.len())),
            run_of: vec![0; 3 * self.pieces.len()],
            count: 0,
        };
        for lot in lots {
            let (entries, edges) = (all.entries.len() as u32, all.count as u32);
            for run in &lot.runs {
                lot.of(run).iter().for_each(|at| all.run_of[*at as usize] = all.runs.len() as u32);
                let range = run.range.map(|i| i + entries);
                all.runs.push(Run { ends: run.ends, range, edge: run.edge + edges });
            }
            all.entries.extend(lot.entries);
            all.count += lot.count;
        }
        all
    }

    /// Keeps the pieces as they are now, if they are coarse enough or none are kept yet.
    pub(super) fn keep_coarse(&mut self) {
        if self.coarse_samples > 0 && (self.coarse.is_empty() || self.samples.len() <= self.coarse_samples) {
            self.coarse.clone_from(&self.pieces);
        }
    }

    /// Cuts pieces at marked edges; `middle` gives for an edge (3 · piece + edge) its middle's place and sample. The longest
    /// marked edge is halved first, towards the opposite corner (Rivara, *Algorithms for refining triangular grids*, 1984),
    /// so that both sides of an edge are cut at the same place and angles stay bounded.
    pub(super) fn cut(&mut self, middle: impl Fn(u32) -> Option<(u32, u32)> + Sync) {
        let middles = |i: u32| [0, 1, 2].map(|e| middle(3 * i + e));
        // a piece has one part more than marked edges; 4 · piece + part
        let parts = |i: u32| (0..=middles(i).iter().flatten().count() as u32).map(move |k| 4 * i + k);
        let order: Vec<u32> = (0..self.pieces.len() as u32).into_par_iter().flat_map_iter(parts).collect();
        let one = |&k: &u32| part(&self.places, self.pieces[k as usize / 4], middles(k / 4), k % 4);
        self.pieces = order.par_iter().map(one).collect();
    }
}

/// Halves a piece at the longest of its marked edges, and the halves again: gives the part of this number.
fn part(places: &[Vec3], mut piece: Piece, mut middles: [Option<(u32, u32)>; 3], mut number: u32) -> Piece {
    while let Some(longest) = longest(places, &piece.corners, |e| middles[e].is_some()) {
        let Some((place, sample)) = middles[longest] else { break };
        let (a, b, c) = (longest, (longest + 1) % 3, (longest + 2) % 3);
        let at = [0, 1].map(|k| 0.5 * (piece.at[a][k] + piece.at[b][k]));
        let half = |corners: [(u32, u32, [f32; 2]); 3], middles: [Middle; 3]| Piece {
            corners: corners.map(|c| c.0),
            samples: corners.map(|c| c.1),
            at: corners.map(|c| c.2),
            middles,
            ..piece
        };
        let corner = |k: usize| (piece.corners[k], piece.samples[k], piece.at[k]);
        let (m, new) = ((place, sample, at), Middle::Unasked);
        let first = 1 + u32::from(middles[c].is_some());
        // (a, m, c) or (m, b, c): of their edges the one to the opposite corner is new
        (piece, middles) = if number < first {
            (half([corner(a), m, corner(c)], [new, new, piece.middles[c]]), [None, None, middles[c]])
        } else {
            number -= first;
            (half([m, corner(b), corner(c)], [new, piece.middles[b], new]), [None, middles[b], None])
        };
    }
    piece
}

/// The longest of those edges of a piece that are wanted; of equals the one whose ends come first.
pub(super) fn longest(places: &[Vec3], corners: &[u32; 3], wanted: impl Fn(usize) -> bool) -> Option<usize> {
    let key = |e: usize| {
        let (a, b) = (corners[e], corners[(e + 1) % 3]);
        (places[a as usize].distance_squared(places[b as usize]), std::cmp::Reverse((a.min(b), a.max(b))))
    };
    (0..3).filter(|e| wanted(*e)).max_by(|p, q| {
        let (p, q) = (key(*p), key(*q));
        p.0.total_cmp(&q.0).then(p.1.cmp(&q.1))
    })
}

/// Which of 1024³ cells of a cube around a box (least and greatest corner) a point lies in, cells close together mostly having
/// numbers close together (Morton's order), so that triangles that follow each other share corners.
pub(super) fn morton(p: Vec3, (low, high): (Vec3, Vec3)) -> u32 {
    let p = (p - low) / (high - low).max_element().max(f32::MIN_POSITIVE);
    let cell = (p * 1024.0).as_ivec3().clamp(glam::IVec3::ZERO, glam::IVec3::splat(1023)).as_uvec3();
    (0..10).map(|bit| (cell.x >> bit & 1 | (cell.y >> bit & 1) << 1 | (cell.z >> bit & 1) << 2) << (3 * bit)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_of_two_patches_are_cut_at_the_edge_that_they_share() {
        let places = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.5), Vec3::new(0.5, 0.5, 0.0)];
        let piece = |corners, patch| {
            let (samples, at) = (corners, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
            Piece { corners, samples, at, triangle: patch, patch, middles: [Middle::Unasked; 3] }
        };
        let pieces = vec![piece([0, 1, 2], 0), piece([3, 2, 1], 1)];
        let (samples, coarse) = (Vec::new(), Vec::new());
        let mut surface = Surface { places, pieces, samples, coarse, coarse_samples: 0, pull_m: 0.0 };
        let edges = surface.edges();
        let runs: Vec<_> = edges.runs.iter().map(|r| (r.ends, edges.of(r).to_vec(), r.edge)).collect();
        let known = [([0, 1], 0, 0), ([0, 2], 2, 1), ([1, 2], 1, 2), ([1, 2], 4, 2), ([1, 3], 5, 3), ([2, 3], 3, 4)];
        assert_eq!(runs, known.map(|(ends, at, edge)| (ends, vec![at], edge)));
        assert!(known.iter().enumerate().all(|(run, k)| edges.run_of[k.1 as usize] == run as u32));
        let mut around: Vec<u32> = edges.around(4).collect();
        around.sort_unstable();
        assert_eq!((around, edges.count), (vec![1, 4], 5));
        surface.cut(|at| [1, 4].contains(&at).then_some((4, at)));
        let corners: Vec<_> = surface.pieces.iter().map(|p| (p.corners, p.triangle)).collect();
        assert_eq!(corners, [([1, 4, 0], 0), ([4, 2, 0], 0), ([2, 4, 3], 1), ([4, 1, 3], 1)]);
    }
}
