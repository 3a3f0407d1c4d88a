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
mod error;
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
#[expect(clippy::module_inception, reason = "where a newcomer looks for Scene")]
mod scene;
#[cfg(test)]
pub(crate) mod testing;
mod text;
mod texture;
mod tracer;

pub use error::SceneError;
pub use face::{Face, Paint};
pub use health::{Edges, Health, MaterialArea, edges};
pub use load::{ModelFormat, load, load_without, mesh_of};
pub use mesh::{Material, Mesh};
pub use pictures::Spared;
pub use scene::{Scene, Surface};
pub use texture::{Texture, Wrap};
pub use tracer::{Hit, Occluder, Ray, Tracer};
