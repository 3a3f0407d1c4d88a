//! Triangles made ready for many look-ups: neighbouring rays mostly meet the same one.

use glam::{Vec2, Vec3};

use super::{Ray, Scene, Surface, Texture};

impl Scene {
    /// A triangle, ready for many look-ups.
    pub fn face(&self, triangle: u32) -> Face {
        let [a, b, c] = self.mesh.corners(triangle);
        let (e1, e2) = (b - a, c - a);
        let n = e1.cross(e2);
        let inv = 1.0 / n.length_squared();
        let gradient = [e2.cross(n) * inv, n.cross(e1) * inv];
        Face { triangle, corner: a, normal: n.normalize_or_zero(), gradient }
    }

    /// What a face is painted with. Lamps count as white where that is asked for.
    pub fn paint(&self, face: &Face, white_lamps: bool) -> Paint<'_> {
        let material = &self.materials[self.mesh.materials[face.triangle as usize] as usize];
        let mut paint = Paint { plain: material.albedo, colours: None, texture: None };
        if white_lamps && material.emission != Vec3::ZERO {
            paint.plain = Vec3::ONE;
            return paint;
        }
        let corners = self.mesh.triangles[face.triangle as usize];
        if !self.mesh.colours.is_empty() {
            let [a, b, c] = corners.map(|i| self.mesh.colours[i as usize]);
            paint.colours = Some([a, b - a, c - a]);
        }
        if let Some(texture) = material.texture
            && !self.mesh.uvs.is_empty()
        {
            let [a, b, c] = corners.map(|i| self.mesh.uvs[i as usize]);
            let texture = &self.textures[texture as usize];
            let scale = texture.texels_per_unit() * self.mesh.uv_per_metre(face.triangle);
            paint.texture = Some(Cloth { texture, uv: [a, b - a, c - a], scale });
        }
        paint
    }
}

/// A triangle, ready for many look-ups.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// The triangle.
    pub triangle: u32,
    corner: Vec3,
    normal: Vec3,
    /// How the second and the third corner's barycentric coordinates change per metre.
    gradient: [Vec3; 2],
}

impl Face {
    /// Where a ray meets this triangle, `t` metres along.
    #[inline]
    pub fn surface(&self, ray: &Ray, t: f32) -> Surface {
        let position = ray.origin + ray.direction * t;
        let normal = if self.normal.dot(ray.direction) > 0.0 { -self.normal } else { self.normal };
        Surface { position, normal, triangle: self.triangle, barycentric: self.barycentric(position) }
    }

    /// Barycentric coordinates of a point on the triangle's plane; may be outside the triangle.
    #[inline]
    pub fn barycentric(&self, point: Vec3) -> Vec2 {
        self.change(point - self.corner)
    }

    /// How barycentric coordinates change over a way along the triangle, in metres.
    #[inline]
    pub fn change(&self, way: Vec3) -> Vec2 {
        Vec2::new(self.gradient[0].dot(way), self.gradient[1].dot(way))
    }
}

/// What a triangle is painted with, ready for many look-ups.
#[derive(Clone, Copy)]
pub struct Paint<'a> {
    plain: Vec3,
    /// Vertex colours: of the first corner, and what the second's and the third's add to it.
    colours: Option<[Vec3; 3]>,
    texture: Option<Cloth<'a>>,
}

#[derive(Clone, Copy)]
struct Cloth<'a> {
    texture: &'a Texture,
    /// Texture coordinates of the first corner, and what the second's and the third's add to them.
    uv: [Vec2; 3],
    /// Texels a metre.
    scale: f32,
}

impl Paint<'_> {
    /// Diffuse albedo at a point, per channel in 0..=1: Kd × texture × vertex colour, averaged over a footprint of this
    /// width in metres on the surface.
    #[inline]
    pub fn albedo(&self, barycentric: Vec2, width_m: f32) -> Vec3 {
        self.albedo_along(barycentric, Vec2::ZERO, 1, width_m)
    }

    /// Albedo averaged over what a thin pencil of rays sees of a surface: `width_m` wide across the ray, and stretched
    /// along the surface by the angle it is seen at (up to 8 times).
    pub fn pencil(&self, face: &Face, surface: &Surface, direction: Vec3, width_m: f32) -> Vec3 {
        let cos = -surface.normal.dot(direction);
        let taps = (1.0 / cos.max(0.125) + 0.75) as u32;
        if taps <= 1 || self.texture.is_none() {
            return self.albedo(surface.barycentric, width_m);
        }
        let along = (direction + surface.normal * cos).normalize_or_zero() * (width_m / cos.max(0.125));
        self.albedo_along(surface.barycentric, face.change(along), taps, width_m)
    }

    /// Albedo averaged over `taps` places spread evenly over `length` (in barycentric coordinates) about a point.
    #[inline]
    fn albedo_along(&self, middle: Vec2, length: Vec2, taps: u32, width_m: f32) -> Vec3 {
        let mut albedo = self.plain;
        if let Some([a, b, c]) = self.colours {
            albedo *= a + b * middle.x + c * middle.y;
        }
        let Some(Cloth { texture, uv: [a, b, c], scale }) = &self.texture else { return albedo };
        let uv = *a + *b * middle.x + *c * middle.y;
        let level = Texture::level_of(width_m * scale);
        if taps <= 1 {
            return albedo * texture.sample(uv, level);
        }
        let ends = *b * length.x + *c * length.y;
        let share = 1.0 / taps as f32;
        let at = |k: u32| uv + ends * ((k as f32 + 0.5) * share - 0.5);
        albedo * ((0..taps).map(|k| texture.sample(at(k), level)).sum::<Vec3>() * share)
    }
}
