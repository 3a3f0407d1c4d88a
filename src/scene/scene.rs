//! A model ready to cast rays at.

use glam::{DVec3, Vec2, Vec3};

use crate::scene::mesh::{Material, Mesh};
use crate::scene::texture::Texture;
use crate::scene::tracer::{Hit, Ray, Tracer};

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
        self.face(hit.triangle).surface(ray, hit.t)
    }

    /// Diffuse albedo at a point of a triangle, per channel in 0..=1: Kd × texture × vertex colour, bilinear, at
    /// texture level 0.
    pub fn albedo(&self, triangle: u32, barycentric: Vec2) -> Vec3 {
        self.paint(&self.face(triangle), false).albedo(barycentric, 0.0)
    }

    /// Albedo averaged over a footprint `width_m` metres wide on the surface, for relighting: a lamp counts as white, so
    /// that the light a probe saw it send out is kept, whatever its Kd.
    pub fn filtered_albedo(&self, triangle: u32, barycentric: Vec2, width_m: f32) -> Vec3 {
        self.paint(&self.face(triangle), true).albedo(barycentric, width_m)
    }

    /// Radiance that a triangle sends out of itself (both sides).
    pub fn emission(&self, triangle: u32) -> Vec3 {
        self.materials[self.mesh.materials[triangle as usize] as usize].emission
    }
}
