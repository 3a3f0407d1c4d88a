//! A bake as what views are rendered with: light at a point of the model is what the corners of the piece around it have.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::baked::{Baked, Origin};
use crate::render::{Irradiance, Lit, Relit, ShadingPoint};
use crate::scene::Scene;
use crate::volume::Nearby;

/// A baked lighting, for [`crate::render::render`]: no record is looked up, and no ray cast but towards a sun that is kept apart.
#[derive(Clone, Copy)]
pub struct BakedLight<'a> {
    baked: &'a Baked,
    /// What was baked: tells of sides that were not, of the sky and how far the sun reaches.
    relit: &'a Relit<'a>,
    /// Irradiance at the vertices.
    irradiance: &'a [Vec3],
    /// What the sun adds there where it reaches; empty where it is part of the irradiance.
    sunlight: &'a [Vec3],
    /// How many times as bright all else is.
    brightness: f32,
    pieces: &'a Pieces,
}

impl<'a> BakedLight<'a> {
    /// A lighting of a bake by its number, and what it was baked from.
    pub fn new(baked: &'a Baked, lighting: usize, relit: &'a Relit<'a>, pieces: &'a Pieces) -> Self {
        let (irradiance, sunlight) = (&baked.irradiance[lighting][..], &baked.sunlight[lighting][..]);
        Self { baked, relit, irradiance, sunlight, brightness: 1.0, pieces }
    }

    /// The same bake with other irradiance at its vertices, that of the sun included, and all else so many times as bright.
    pub fn relit(self, irradiance: &'a [Vec3], brightness: f32) -> Self {
        Self { irradiance, sunlight: &[], brightness, ..self }
    }
}

impl Irradiance for BakedLight<'_> {
    fn at(&self, spot: &ShadingPoint, near: &mut Nearby) -> Lit {
        let face = self.relit.scene.face(spot.triangle);
        let place = face.barycentric(spot.position);
        let side = 2 * spot.triangle as usize + usize::from(face.is_back(spot.normal));
        let Some(piece) = self.pieces.find(side, place) else {
            let lit = self.relit.at(spot, near);
            return Lit { shade: lit.shade * self.brightness, sun: lit.sun * self.brightness, ..lit };
        };
        let weights = self.baked.origins[piece as usize].weights(place);
        let corners = self.baked.triangles[piece as usize].map(|v| v as usize);
        let mean = |of: &[Vec3]| (0..3).map(|c| of[corners[c]] * weights[c]).sum::<Vec3>();
        let nearest =
            &self.baked.vertices[corners[(0..3).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0)]];
        let lit = Lit::known(mean(self.irradiance), nearest.source, nearest.agreement);
        let sun = if self.sunlight.is_empty() { Vec3::ZERO } else { mean(self.sunlight) };
        Lit { sun: lit.shade + sun, needs_shadow_ray: sun != Vec3::ZERO, ..lit }
    }

    fn in_sun(&self, point: Vec3, normal: Vec3) -> bool {
        self.relit.in_sun(point, normal)
    }

    fn sky(&self, direction: Vec3) -> Vec3 {
        self.relit.sky(direction) * self.brightness
    }
}

/// Finds the baked triangle at a place of the model: a tree of halvings a side, as Rivara's cuts are.
pub struct Pieces {
    /// Per side of the model's triangles its first branch.
    roots: Vec<Branch>,
    cuts: Vec<Cut>,
}

/// A line from an edge's middle to the opposite corner, and what lies to its right and left.
#[derive(Clone, Copy)]
struct Cut {
    from: Vec2,
    along: Vec2,
    sides: [Branch; 2],
}

#[derive(Clone, Copy)]
enum Branch {
    Nothing,
    Piece(u32),
    Cut(u32),
}

impl Pieces {
    /// The tree for a bake of a scene.
    pub fn new(scene: &Scene, baked: &Baked) -> Self {
        let origins = &baked.origins;
        let mut order: Vec<u32> = (0..origins.len() as u32).collect();
        order.par_sort_unstable_by_key(|&i| (origins[i as usize].side, i));
        let mut roots = vec![Branch::Nothing; 2 * scene.mesh.triangles.len()];
        let mut cuts = Vec::new();
        for pieces in order.chunk_by_mut(|a, b| origins[*a as usize].side == origins[*b as usize].side) {
            let corners = [Vec2::ZERO, Vec2::X, Vec2::Y];
            roots[origins[pieces[0] as usize].side as usize] = branch(origins, corners, pieces, &mut cuts);
        }
        Self { roots, cuts }
    }

    /// The baked triangle at a place of a side, if that is baked.
    fn find(&self, side: usize, place: Vec2) -> Option<u32> {
        let mut branch = self.roots[side];
        loop {
            match branch {
                Branch::Nothing => return None,
                Branch::Piece(piece) => return Some(piece),
                Branch::Cut(cut) => {
                    let Cut { from, along, sides } = &self.cuts[cut as usize];
                    branch = sides[usize::from(along.perp_dot(place - *from) > 0.0)];
                }
            }
        }
    }
}

/// The tree of the pieces that fill a triangle: the halving that cuts none of them, and the trees of both halves.
fn branch(origins: &[Origin], corners: [Vec2; 3], pieces: &mut [u32], cuts: &mut Vec<Cut>) -> Branch {
    let [first, _, ..] = pieces else { return pieces.first().map_or(Branch::Nothing, |p| Branch::Piece(*p)) };
    let first = *first;
    for edge in 0..3 {
        let [a, b, c] = [edge, (edge + 1) % 3, (edge + 2) % 3].map(|k: usize| corners[k]);
        let from = 0.5 * (a + b);
        let along = c - from;
        let off = |i: u32| origins[i as usize].at.map(|p| along.perp_dot(p - from));
        let whole = |i: &u32| off(*i).iter().all(|d| *d >= 0.0) || off(*i).iter().all(|d| *d <= 0.0);
        if !pieces.iter().all(whole) {
            continue;
        }
        pieces.sort_unstable_by_key(|&i| (off(i).iter().sum::<f32>() > 0.0, i));
        let left = pieces.partition_point(|&i| off(i).iter().sum::<f32>() <= 0.0);
        let number = cuts.len();
        cuts.push(Cut { from, along, sides: [Branch::Nothing; 2] });
        let (right, left) = pieces.split_at_mut(left);
        cuts[number].sides = [branch(origins, [from, b, c], right, cuts), branch(origins, [a, from, c], left, cuts)];
        return Branch::Cut(number as u32);
    }
    // rounding alone leads here: pieces smaller than barycentric coordinates tell apart
    Branch::Piece(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle halved here and there: an edge's middle to the opposite corner, again and again.
    fn halved(depth: u32, [a, b, c]: [Vec2; 3], seed: u32, all: &mut Vec<Origin>) {
        let seed = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        if depth == 0 || seed >> 29 == 0 {
            return all.push(Origin { side: 0, at: [a, b, c] });
        }
        let [a, b, c] = [[a, b, c], [b, c, a], [c, a, b]][(seed >> 8) as usize % 3];
        let middle = 0.5 * (a + b);
        halved(depth - 1, [a, middle, c], seed ^ 1, all);
        halved(depth - 1, [middle, b, c], seed ^ 2, all);
    }

    #[test]
    fn each_piece_is_found_at_its_middle_and_weighs_its_corners() {
        for seed in 0..50 {
            let mut origins = Vec::new();
            halved(11, [Vec2::ZERO, Vec2::X, Vec2::Y], seed, &mut origins);
            let (mut pieces, mut cuts): (Vec<u32>, _) = ((0..origins.len() as u32).collect(), Vec::new());
            let root = branch(&origins, [Vec2::ZERO, Vec2::X, Vec2::Y], &mut pieces, &mut cuts);
            let tree = Pieces { roots: vec![root], cuts };
            for (i, origin) in origins.iter().enumerate() {
                let place = origin.at[0] * 0.5 + origin.at[1] * 0.3 + origin.at[2] * 0.2;
                assert_eq!(tree.find(0, place), Some(i as u32), "seed {seed}");
                let off = origin.weights(place).into_iter().zip([0.5, 0.3, 0.2]).map(|(w, known)| f32::abs(w - known));
                assert!(off.fold(0.0, f32::max) < 1e-3);
            }
        }
    }
}
