//! The model: mesh, materials, textures and ray casting.

mod health;
mod load;
mod mesh;
mod mtl;
mod obj;
mod texture;
mod tracer;

pub use health::{Edges, Health, MaterialArea, edges};
pub use load::{SceneError, load};
pub use mesh::{Material, Mesh};
pub use texture::Texture;
pub use tracer::{Hit, Ray, Tracer};

use glam::{DVec3, Vec2, Vec3};

/// A model ready to cast rays at. Immutable once made.
pub struct Scene {
    /// Triangles, local to [`Scene::origin`].
    pub mesh: Mesh,
    /// What the triangles are made of.
    pub materials: Vec<Material>,
    /// Pictures that materials name.
    pub textures: Vec<Texture>,
    /// The local origin: metres in the program's axes.
    pub origin: DVec3,
    /// Finds what a ray hits.
    pub tracer: Tracer,
}

/// A point on the model as a ray found it.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Local metres.
    pub position: Vec3,
    /// Unit geometric normal, on the side the ray came from.
    pub normal: Vec3,
    /// The triangle.
    pub triangle: u32,
    /// Barycentric coordinates of the second and third corner.
    pub barycentric: Vec2,
}

impl Scene {
    /// Builds the ray caster over a mesh that has passed import (finite, no zero-area, no duplicate triangles).
    pub fn new(mesh: Mesh, materials: Vec<Material>, textures: Vec<Texture>, origin: DVec3) -> Self {
        let tracer = Tracer::new(&mesh);
        Self { mesh, materials, textures, origin, tracer }
    }

    /// A position in metres in the program's axes, local to this scene.
    pub fn local(&self, position: DVec3) -> Vec3 {
        (position - self.origin).as_vec3()
    }

    /// What a ray found at a hit.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let [a, b, c] = self.mesh.corners(hit.triangle);
        let (e1, e2) = (b - a, c - a);
        let n = e1.cross(e2);
        let position = ray.origin + ray.direction * hit.t;
        let p = position - a;
        let inv = 1.0 / n.length_squared();
        let barycentric = Vec2::new(p.cross(e2).dot(n) * inv, e1.cross(p).dot(n) * inv);
        let n = n.normalize_or_zero();
        let normal = if n.dot(ray.direction) > 0.0 { -n } else { n };
        Surface { position, normal, triangle: hit.triangle, barycentric }
    }

    /// Diffuse albedo at a point of a triangle, per channel in 0..=1: Kd × texture × vertex colour, bilinear, at
    /// texture level 0.
    pub fn albedo(&self, triangle: u32, barycentric: Vec2) -> Vec3 {
        self.filtered_albedo(triangle, barycentric, 0.0)
    }

    /// Albedo averaged over a footprint `width_m` metres wide on the surface.
    pub fn filtered_albedo(&self, triangle: u32, barycentric: Vec2, width_m: f32) -> Vec3 {
        let material = &self.materials[self.mesh.materials[triangle as usize] as usize];
        let mut albedo = material.albedo;
        if let Some(colour) = self.mesh.colour(triangle, barycentric) {
            albedo *= colour;
        }
        if let Some(texture) = material.texture
            && let Some(uv) = self.mesh.uv(triangle, barycentric)
        {
            let texture = &self.textures[texture as usize];
            let level = if width_m > 0.0 { texture.level(width_m * self.mesh.uv_per_metre(triangle)) } else { 0.0 };
            albedo *= texture.sample(uv, level);
        }
        albedo
    }

    /// Albedo averaged over what a thin pencil of rays sees of a surface: `width_m` wide across the ray, and stretched
    /// along the surface by the angle it is seen at (up to 8 times).
    pub fn pencil_albedo(&self, surface: &Surface, direction: Vec3, width_m: f32) -> Vec3 {
        let material = &self.materials[self.mesh.materials[surface.triangle as usize] as usize];
        if material.texture.is_none() {
            return self.filtered_albedo(surface.triangle, surface.barycentric, width_m);
        }
        let cos = -surface.normal.dot(direction);
        let taps = (1.0 / cos.max(0.125) - 0.25).ceil();
        if taps <= 1.0 {
            return self.filtered_albedo(surface.triangle, surface.barycentric, width_m);
        }
        let along = (direction + surface.normal * cos).normalize_or_zero() * (width_m / cos.max(0.125));
        let [a, b, c] = self.mesh.corners(surface.triangle);
        let (e1, e2) = (b - a, c - a);
        let n = e1.cross(e2);
        let step = Vec2::new(along.cross(e2).dot(n), e1.cross(along).dot(n)) / n.length_squared();
        let mut sum = Vec3::ZERO;
        for k in 0..taps as u32 {
            let at = surface.barycentric + step * ((k as f32 + 0.5) / taps - 0.5);
            sum += self.filtered_albedo(surface.triangle, at, width_m);
        }
        sum / taps
    }

    /// Radiance that a triangle sends out of itself (both sides).
    pub fn emission(&self, triangle: u32) -> Vec3 {
        self.materials[self.mesh.materials[triangle as usize] as usize].emission
    }
}
