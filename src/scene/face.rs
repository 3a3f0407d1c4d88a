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
        Face { triangle, corner: a, normal: n.normalize_or_zero(), doubled_m2: n.length(), gradient }
    }

    /// What a face is painted with. Lamps count as white where that is asked for.
    pub fn paint(&self, face: &Face, white_lamps: bool) -> Paint<'_> {
        let material = &self.materials[self.mesh.materials[face.triangle as usize] as usize];
        let mut paint = Paint { plain: material.albedo, colours: None, texture: None };
        if white_lamps && material.is_lamp() {
            paint.plain = Vec3::ONE;
            return paint;
        }
        match self.mesh.span(face.triangle, &self.mesh.colours) {
            // of one colour: painted as by a material of that colour
            Some([a, Vec3::ZERO, Vec3::ZERO]) => paint.plain *= a,
            colours => paint.colours = colours,
        }
        if let Some(texture) = material.texture
            && let Some(uv) = self.mesh.span(face.triangle, &self.mesh.uvs)
        {
            let texture = &self.textures[texture as usize];
            let (width, height) = texture.size();
            let units2_per_m2 = uv[1].perp_dot(uv[2]).abs() / face.doubled_m2.max(f32::MIN_POSITIVE);
            let scale = (width as f32 * height as f32 * units2_per_m2).sqrt();
            paint.texture = Some(Cloth { texture, uv, scale });
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
    /// Twice the area.
    doubled_m2: f32,
    /// How the second and the third corner's barycentric coordinates change per metre.
    gradient: [Vec3; 2],
}

impl Face {
    /// Whether a surface's normal points to the triangle's back, whose corners run clockwise.
    #[inline]
    pub fn is_back(&self, normal: Vec3) -> bool {
        self.normal.dot(normal) < 0.0
    }

    /// Where a ray meets this triangle, `t` metres along.
    #[inline]
    pub fn surface(&self, ray: &Ray, t: f32) -> Surface {
        let position = ray.origin + ray.direction * t;
        let normal = if self.normal.dot(ray.direction) > 0.0 { -self.normal } else { self.normal };
        Surface { position, normal, triangle: self.triangle, barycentric: self.barycentric(position) }
    }

    /// How far along a ray the triangle's plane lies, metres; not finite where they are parallel.
    #[inline]
    pub fn meet(&self, ray: &Ray) -> f32 {
        self.normal.dot(self.corner - ray.origin) / self.normal.dot(ray.direction)
    }

    /// What a pencil of rays covers of the triangle's plane at a distance: its sides, given in metres a metre, stretched
    /// along the plane by the angle it is seen at (up to 8 times).
    pub fn covered(&self, direction: Vec3, sides: [Vec3; 2], distance: f32) -> [Vec3; 2] {
        let along = self.normal.dot(direction);
        let along = along.abs().max(0.125).copysign(along);
        let on_plane = |side: Vec3| (side - direction * (self.normal.dot(side) / along)) * distance;
        [on_plane(sides[0]), on_plane(sides[1])]
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

impl Cloth<'_> {
    /// Texture coordinates.
    #[inline]
    fn at(&self, barycentric: Vec2) -> Vec2 {
        let [a, b, c] = self.uv;
        a + b * barycentric.x + c * barycentric.y
    }
}

impl Paint<'_> {
    /// Diffuse albedo at a point, per channel in 0..=1: Kd × texture × vertex colour, averaged over a footprint of this
    /// width in metres on the surface.
    #[inline]
    pub fn albedo(&self, barycentric: Vec2, width_m: f32) -> Vec3 {
        self.shade(barycentric, |cloth, uv| cloth.texture.sample(uv, Texture::level_of(width_m * cloth.scale)))
    }

    /// [`Paint::albedo`] without the blend between two levels of the texture: for the many rays whose mean counts.
    #[inline]
    pub fn rough_albedo(&self, barycentric: Vec2, width_m: f32) -> Vec3 {
        self.shade(barycentric, |cloth, uv| cloth.texture.near(uv, width_m * cloth.scale))
    }

    /// Width in metres of the finest detail that this can show on a face: a texel, or the spacing of vertices that differ in colour; 0 for
    /// one plain colour.
    pub fn finest_detail(&self, face: &Face) -> f32 {
        self.texture.map_or(0.0, |cloth| 1.0 / cloth.scale).max(self.vertex_spacing(face))
    }

    /// Metres between the vertices of a face that have colours of their own, as a scan's do; 0 where they have none.
    pub fn vertex_spacing(&self, face: &Face) -> f32 {
        self.colours.map_or(0.0, |_| face.doubled_m2.sqrt())
    }

    /// Albedo averaged over a parallelogram on the surface about a point, its sides given in metres: bilinear in the
    /// texture's level whose texels are about half its shorter side wide, over places so many texels apart.
    pub fn patch(&self, face: &Face, barycentric: Vec2, sides: [Vec3; 2], apart: f32) -> Vec3 {
        self.shade(barycentric, |Cloth { texture, uv: [_, b, c], .. }, uv| {
            let on_texture = |side: Vec3| {
                let change = face.change(side);
                *b * change.x + *c * change.y
            };
            texture.patch(uv, on_texture(sides[0]), on_texture(sides[1]), apart)
        })
    }

    /// Whether another face carries this one on at a point of it: in the same plane, and painted as this one would be
    /// if it went on that far.
    pub fn carried_on(&self, face: &Face, (other, paint): (&Face, &Paint), point: Vec3) -> bool {
        /// Metres off the plane, and texels off each other, that count as none.
        const LEVEL: f32 = 1e-4;
        const TEXELS: f32 = 0.05;
        let plane = face.normal.dot(other.normal).abs() > 1.0 - 1e-6
            && face.normal.dot(point - face.corner).abs() < LEVEL
            && self.plain == paint.plain
            && self.colours.is_none()
            && paint.colours.is_none();
        plane
            && match (&self.texture, &paint.texture) {
                (None, None) => true,
                (Some(mine), Some(theirs)) if std::ptr::eq(mine.texture, theirs.texture) => {
                    let off = mine.at(face.barycentric(point)) - theirs.at(other.barycentric(point));
                    mine.texture.texels(off - off.round()) < TEXELS
                }
                _ => false,
            }
    }

    /// Kd × vertex colour × what a texture gives at its coordinates there.
    #[inline]
    fn shade(&self, at: Vec2, texel: impl FnOnce(&Cloth, Vec2) -> Vec3) -> Vec3 {
        let plain = match self.colours {
            Some([a, b, c]) => self.plain * (a + b * at.x + c * at.y),
            None => self.plain,
        };
        self.texture.as_ref().map_or(plain, |cloth| plain * texel(cloth, cloth.at(at)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::{grey, parallelograms};

    #[test]
    fn detail_is_as_fine_as_texels_or_vertices_that_differ() {
        let square = || parallelograms(&[(Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y)]);
        let finest = |scene: &Scene| scene.paint(&scene.face(0), false).finest_detail(&scene.face(0));
        assert_eq!(finest(&grey(square(), 0.5)), 0.0);
        let coloured = |colours: [f32; 4]| {
            let mut mesh = square();
            mesh.colours = colours.map(Vec3::splat).to_vec();
            grey(mesh, 1.0)
        };
        assert_eq!(finest(&coloured([0.3; 4])), 0.0);
        assert_eq!(finest(&coloured([0.3, 0.3, 0.4, 0.4])), 2.0);
        let mut textured = grey(square(), 1.0);
        textured.mesh.uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].to_vec();
        textured.materials[0].texture = Some(0);
        textured.textures = vec![Texture::new("squares".into(), 100, 50, vec![[9, 9, 9, 255]; 5000])];
        // texels of 2 by 4 cm
        assert!((finest(&textured) - (0.02f32 * 0.04).sqrt()).abs() < 1e-6);
    }
}
