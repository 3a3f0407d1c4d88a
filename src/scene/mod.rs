//! The model: mesh, materials, textures and ray casting.

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
