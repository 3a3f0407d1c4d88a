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

    /// Leaves the marked triangles out of the ray caster, and frees the pictures that only they have. The mesh keeps
    /// them, so that indices and bounds stay. Gives the number of triangles and the bytes that this saves.
    pub fn leave_out(&mut self, marked: &[bool]) -> (usize, usize) {
        let keep: Vec<bool> = marked.iter().map(|m| !m).collect();
        let before = self.tracer.bytes();
        self.tracer = Tracer::over(&self.mesh, &keep);
        let mut used = vec![false; self.textures.len()];
        for (t, _) in keep.iter().enumerate().filter(|k| *k.1) {
            if let Some(texture) = self.materials[self.mesh.materials[t] as usize].texture {
                used[texture as usize] = true;
            }
        }
        let mut freed = before.saturating_sub(self.tracer.bytes());
        for (texture, used) in self.textures.iter_mut().zip(used) {
            if !used {
                freed += std::mem::replace(texture, Texture::blank()).bytes();
            }
        }
        (marked.iter().filter(|m| **m).count(), freed)
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
        self.albedo_along(triangle, barycentric, Vec2::ZERO, 1, 0.0)
    }

    /// Albedo averaged over a footprint `width_m` metres wide on the surface, for relighting: a lamp counts as white, so
    /// that the light a probe saw it send out is kept, whatever its Kd.
    pub fn filtered_albedo(&self, triangle: u32, barycentric: Vec2, width_m: f32) -> Vec3 {
        if self.emission(triangle) != Vec3::ZERO {
            return Vec3::ONE;
        }
        self.albedo_along(triangle, barycentric, Vec2::ZERO, 1, width_m)
    }

    /// Albedo averaged over what a thin pencil of rays sees of a surface: `width_m` wide across the ray, and stretched
    /// along the surface by the angle it is seen at (up to 8 times). A lamp counts as white.
    pub fn pencil_albedo(&self, surface: &Surface, direction: Vec3, width_m: f32) -> Vec3 {
        let cos = -surface.normal.dot(direction);
        let taps = (1.0 / cos.max(0.125) - 0.25).ceil() as u32;
        if taps <= 1 || self.emission(surface.triangle) != Vec3::ZERO {
            return self.filtered_albedo(surface.triangle, surface.barycentric, width_m);
        }
        let along = (direction + surface.normal * cos).normalize_or_zero() * (width_m / cos.max(0.125));
        let [a, b, c] = self.mesh.corners(surface.triangle);
        let (e1, e2) = (b - a, c - a);
        let n = e1.cross(e2);
        let length = Vec2::new(along.cross(e2).dot(n), e1.cross(along).dot(n)) / n.length_squared();
        self.albedo_along(surface.triangle, surface.barycentric, length, taps, width_m)
    }

    /// Albedo averaged over `taps` places spread evenly over `length` (in barycentric coordinates) about a point.
    fn albedo_along(&self, triangle: u32, middle: Vec2, length: Vec2, taps: u32, width_m: f32) -> Vec3 {
        let material = &self.materials[self.mesh.materials[triangle as usize] as usize];
        let mut albedo = material.albedo;
        if let Some(colour) = self.mesh.colour(triangle, middle) {
            albedo *= colour;
        }
        let Some(texture) = material.texture else { return albedo };
        let Some(uv) = self.mesh.uv(triangle, middle) else { return albedo };
        let texture = &self.textures[texture as usize];
        let level = if width_m > 0.0 { texture.level(width_m * self.mesh.uv_per_metre(triangle)) } else { 0.0 };
        if taps <= 1 {
            return albedo * texture.sample(uv, level);
        }
        let ends = self.mesh.uv(triangle, middle + length).unwrap_or(uv) - uv;
        let share = 1.0 / taps as f32;
        let at = |k: u32| uv + ends * ((k as f32 + 0.5) * share - 0.5);
        albedo * ((0..taps).map(|k| texture.sample(at(k), level)).sum::<Vec3>() * share)
    }

    /// Radiance that a triangle sends out of itself (both sides).
    pub fn emission(&self, triangle: u32) -> Vec3 {
        self.materials[self.mesh.materials[triangle as usize] as usize].emission
    }
}
