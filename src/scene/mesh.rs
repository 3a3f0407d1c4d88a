//! Triangles and what they are made of.

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::ops::Sub;

use crate::components::components;
use crate::lists::Lists;

/// An indexed triangle mesh in local metres, z up. Clean: finite, no zero-area and no duplicate triangles.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Texture coordinates, one per vertex, or empty where the model has none.
    pub uvs: Vec<Vec2>,
    /// Linear vertex colours, one per vertex, or empty where the model has none.
    pub colours: Vec<Vec3>,
    /// Corner indices into the vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Material index of each triangle.
    pub materials: Vec<u32>,
}

/// A Lambertian, two-sided surface.
#[derive(Clone, Debug)]
pub struct Material {
    /// The name in the MTL file.
    pub name: String,
    /// Linear diffuse reflectance (Kd), 0..=1.
    pub albedo: Vec3,
    /// Index of the picture that multiplies it (map_Kd).
    pub texture: Option<u32>,
    /// Radiance sent out of the surface itself (Ke), both sides.
    pub emission: Vec3,
}

impl Material {
    /// Whether it sends out light of its own.
    pub fn is_lamp(&self) -> bool {
        self.emission != Vec3::ZERO
    }

    /// Reflectance, and the texture that multiplies it, where irradiance stands for all light that comes from a surface: a lamp
    /// counts as white.
    pub fn with_white_lamps(&self) -> (Vec3, Option<u32>) {
        if self.is_lamp() { (Vec3::ONE, None) } else { (self.albedo, self.texture) }
    }
}

impl Mesh {
    /// The corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.at_corners(triangle, &self.positions)
    }

    /// What the corners of a triangle have, of what each vertex has.
    #[inline]
    fn at_corners<T: Copy>(&self, triangle: u32, each: &[T]) -> [T; 3] {
        let [a, b, c] = self.triangles[triangle as usize];
        [each[a as usize], each[b as usize], each[c as usize]]
    }

    /// What each vertex has, over a triangle: that of the first corner, and what the second's and the third's add to it. `None`
    /// where vertices have none.
    #[inline]
    pub(super) fn span<T: Copy + Sub<Output = T>>(&self, triangle: u32, each: &[T]) -> Option<[T; 3]> {
        if each.is_empty() {
            return None;
        }
        let [a, b, c] = self.at_corners(triangle, each);
        Some([a, b - a, c - a])
    }

    /// Unit normal by the winding of the corners.
    pub fn normal(&self, triangle: u32) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Area in square metres.
    pub fn area(&self, triangle: u32) -> f32 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Texture coordinates at a point of a triangle.
    pub fn uv(&self, triangle: u32, barycentric: Vec2) -> Option<Vec2> {
        self.span(triangle, &self.uvs).map(|[a, b, c]| a + b * barycentric.x + c * barycentric.y)
    }

    /// Vertex colour at a point of a triangle.
    pub fn colour(&self, triangle: u32, barycentric: Vec2) -> Option<Vec3> {
        self.span(triangle, &self.colours).map(|[a, b, c]| a + b * barycentric.x + c * barycentric.y)
    }

    /// For each vertex the first vertex at the same position, to the last bit.
    pub(crate) fn welded(&self) -> Vec<u32> {
        // −0 is 0
        let place = |i: u32| (self.positions[i as usize] + 0.0).to_array().map(f32::to_bits);
        let mut order: Vec<u32> = (0..self.positions.len() as u32).collect();
        order.par_sort_unstable_by_key(|&i| (place(i), i));
        let mut first = vec![0; order.len()];
        for same in order.chunk_by(|&a, &b| place(a) == place(b)) {
            same.iter().for_each(|i| first[*i as usize] = same[0]);
        }
        first
    }

    /// Per triangle the number of its component, from 0 in the order of their first triangles: triangles that hang
    /// together by their [welded](Self::welded) corners, such as a bench or a column.
    pub(crate) fn components(&self) -> Vec<u32> {
        let (welded, count) = (self.welded(), self.triangles.len());
        let corners = |t: usize| self.triangles[t].map(|i| welded[i as usize]);
        let around = Lists::of(welded.len(), || (0..count).flat_map(|t| corners(t).map(|corner| (corner, t as u32))));
        // corners are things too, after the triangles, so that a fan of n triangles has n links and not n²
        let linked = |thing: usize| -> SmallVec<[usize; 8]> {
            if thing < count {
                corners(thing).into_iter().map(|corner| count + corner as usize).collect()
            } else {
                around.get(thing - count).iter().map(|t| *t as usize).collect()
            }
        };
        let mut labels =
            components(count + welded.len(), |thing| thing < count || !around.get(thing - count).is_empty(), linked);
        labels.truncate(count);
        labels
    }

    /// The least and greatest corner of the box around all triangles; zeros where there is none.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let mut low = Vec3::INFINITY;
        let mut high = Vec3::NEG_INFINITY;
        for triangle in &self.triangles {
            for &i in triangle {
                low = low.min(self.positions[i as usize]);
                high = high.max(self.positions[i as usize]);
            }
        }
        if low.is_finite() { (low, high) } else { (Vec3::ZERO, Vec3::ZERO) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_hang_together_by_the_places_of_their_corners() {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let mesh = Mesh {
            positions: vec![
                at(0., 0.),
                at(1., 0.),
                at(0., 1.),
                at(5., 5.),
                at(6., 5.),
                at(5., 6.),
                at(1., 0.),
                at(0., 1.),
                at(1., 1.),
            ],
            uvs: vec![],
            colours: vec![],
            triangles: vec![[0, 1, 2], [3, 4, 5], [6, 8, 7]],
            materials: vec![0; 3],
        };
        assert_eq!(mesh.components(), [0, 1, 0]);
    }
}
