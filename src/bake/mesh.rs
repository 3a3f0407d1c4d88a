//! The surface that is baked: the inner sides of a model's triangles, cut where light changes, never so that a crack opens.

use glam::Vec3;
use rayon::prelude::*;
use std::collections::HashMap;

use crate::scene::{Mesh, Scene};

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
    /// Local metres; corners at the same place count as one.
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
    /// (ends, patch, 3 · piece + edge), sorted.
    pub(super) entries: Vec<(u64, u32, u32)>,
    pub(super) runs: Vec<Run>,
    /// For each 3 · piece + edge its run.
    pub(super) run_of: Vec<u32>,
    /// Number of edges.
    pub(super) count: usize,
}

impl Surface {
    /// The given sides of a scene's triangles. Neighbours whose normals are closer than `smooth` (a cosine) are one patch.
    pub(super) fn new(scene: &Scene, inner: &[bool], smooth: f32, pull_m: f32, coarse_samples: usize) -> Self {
        let mesh = &scene.mesh;
        let (places, place_of) = welded(mesh);
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
        let mut parent: Vec<u32> = (0..self.pieces.len() as u32).collect();
        fn root(parent: &mut [u32], mut i: u32) -> u32 {
            while parent[i as usize] != i {
                parent[i as usize] = parent[parent[i as usize] as usize];
                i = parent[i as usize];
            }
            i
        }
        for run in edges.entries.chunk_by(|a, b| a.0 == b.0) {
            for (i, &(_, _, one)) in run.iter().enumerate() {
                for &(_, _, other) in &run[..i] {
                    let (p, q) = (one / 3, other / 3);
                    let (mine, theirs) = (self.ends(one), self.ends(other));
                    // wound alike, they run along their edge in opposite ways
                    let opposite = mine[0] == theirs[1] && mine[1] == theirs[0];
                    if opposite && normals[p as usize].dot(normals[q as usize]) > smooth {
                        let (p, q) = (root(&mut parent, p), root(&mut parent, q));
                        parent[p.max(q) as usize] = p.min(q);
                    }
                }
            }
        }
        for i in 0..self.pieces.len() as u32 {
            self.pieces[i as usize].patch = root(&mut parent, i);
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
        let entry = |(i, piece): (usize, &Piece)| {
            (0..3u32)
                .map(move |e| {
                    let [a, b] = [piece.corners[e as usize], piece.corners[(e as usize + 1) % 3]];
                    (u64::from(a.min(b)) << 32 | u64::from(a.max(b)), piece.patch, 3 * i as u32 + e)
                })
                .collect::<smallvec::SmallVec<[_; 3]>>()
        };
        let mut entries: Vec<(u64, u32, u32)> = self.pieces.par_iter().enumerate().flat_map_iter(entry).collect();
        entries.par_sort_unstable();
        let mut runs: Vec<Run> = Vec::new();
        let mut run_of = vec![0; entries.len()];
        let (mut count, mut last) = (0, None);
        for (i, &(ends, patch, at)) in entries.iter().enumerate() {
            if last != Some((ends, patch)) {
                count += usize::from(last.is_none_or(|l| l.0 != ends));
                last = Some((ends, patch));
                let range = [i as u32; 2];
                runs.push(Run { ends: [(ends >> 32) as u32, ends as u32], range, edge: count as u32 - 1 });
            }
            if let Some(run) = runs.last_mut() {
                run.range[1] = i as u32 + 1;
            }
            run_of[at as usize] = runs.len() as u32 - 1;
        }
        Edges { entries, runs, run_of, count }
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
        let (places, pieces) = (&self.places, &self.pieces);
        let one = |(i, piece): (usize, &Piece)| {
            let middles = [0, 1, 2].map(|e| middle(3 * i as u32 + e));
            let mut parts = smallvec::SmallVec::<[Piece; 4]>::new();
            halve(places, *piece, middles, &mut parts);
            parts
        };
        self.pieces = pieces.par_iter().enumerate().flat_map_iter(one).collect();
    }
}

/// Halves a piece at the longest of its marked edges, and the halves again.
fn halve(places: &[Vec3], piece: Piece, middles: [Option<(u32, u32)>; 3], parts: &mut smallvec::SmallVec<[Piece; 4]>) {
    let Some(longest) = longest(places, &piece.corners, |e| middles[e].is_some()) else {
        parts.push(piece);
        return;
    };
    let Some((place, sample)) = middles[longest] else { return };
    let (a, b, c) = (longest, (longest + 1) % 3, (longest + 2) % 3);
    let at = [0, 1].map(|k| 0.5 * (piece.at[a][k] + piece.at[b][k]));
    // (a, m, c) and (m, b, c): of their edges the one to the opposite corner is new
    let part = |corners: [(u32, u32, [f32; 2]); 3], middles: [Middle; 3]| Piece {
        corners: corners.map(|c| c.0),
        samples: corners.map(|c| c.1),
        at: corners.map(|c| c.2),
        middles,
        ..piece
    };
    let corner = |k: usize| (piece.corners[k], piece.samples[k], piece.at[k]);
    let m = (place, sample, at);
    let new = Middle::Unasked;
    halve(places, part([corner(a), m, corner(c)], [new, new, piece.middles[c]]), [None, None, middles[c]], parts);
    halve(places, part([m, corner(b), corner(c)], [new, piece.middles[b], new]), [None, middles[b], None], parts);
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

/// A mesh's places, each once, and for each vertex its place.
fn welded(mesh: &Mesh) -> (Vec<Vec3>, Vec<u32>) {
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    let mut places = Vec::new();
    let place_of = mesh.positions.iter().map(|p| {
        // no two zeros
        let key = (*p + 0.0).to_array().map(f32::to_bits);
        *known.entry(key).or_insert_with(|| {
            places.push(*p);
            places.len() as u32 - 1
        })
    });
    let place_of = place_of.collect();
    (places, place_of)
}

/// Which of 1024³ cells of a cube around a box (least and greatest corner) a point lies in, cells close together mostly having
/// numbers close together (Morton's order), so that triangles that follow each other share corners.
pub(super) fn morton(p: Vec3, (low, high): (Vec3, Vec3)) -> u32 {
    let p = (p - low) / (high - low).max_element().max(f32::MIN_POSITIVE);
    let cell = (p * 1024.0).as_ivec3().clamp(glam::IVec3::ZERO, glam::IVec3::splat(1023)).as_uvec3();
    (0..10).map(|bit| (cell.x >> bit & 1 | (cell.y >> bit & 1) << 1 | (cell.z >> bit & 1) << 2) << (3 * bit)).sum()
}
