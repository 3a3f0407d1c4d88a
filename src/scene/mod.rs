//! The model: mesh, materials, textures and ray casting.
//!
//! ```
//! use clerestory::glam::Vec3;
//! use clerestory::scene::Ray;
//! # mod given {
//! #     include!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/common/room.rs"));
//! # }
//! # use given::room;
//!
//! let scene = room(); // 4 × 3 × 2.5 m
//! let ray = Ray { origin: Vec3::new(2.0, 1.0, 1.0), direction: Vec3::X };
//! let hit = scene.tracer.closest(&ray, 1e-3).expect("the room is closed");
//! let surface = scene.surface(&ray, &hit);
//! assert!((hit.t - 2.0).abs() < 1e-5 && surface.normal == -Vec3::X);
//! assert_eq!(scene.albedo(surface.triangle, surface.barycentric), Vec3::splat(0.5));
//! ```

pub mod e57;
mod face;
mod gltf;
mod health;
mod load;
mod mesh;
mod model;
mod mtl;
mod obj;
mod pictures;
mod ply;
mod polygon;
mod texture;
mod tracer;

pub use face::{Face, Paint};
pub use health::{Edges, Health, MaterialArea, edges};
pub use load::{ModelFormat, SceneError, Spared, load, load_without, mesh_of};
pub use mesh::{Material, Mesh};
pub use texture::{Texture, Wrap};
pub use tracer::{Hit, Occluder, Ray, Tracer};

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
