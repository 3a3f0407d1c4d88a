//! clerestory plans where to put 360° HDR light probes inside a heritage interior, relights a model of that interior
//! from the probes, and audits the model against photographs.
//!
//! The core is Image-Based Shooting (Happa, Bashford-Rogers, Debattista and Chalmers, *Rendering Interior Cultural
//! Heritage Scenes Using Image-based Shooting*, VAST 2010). A stage is a plain function from typed input to typed
//! output; each stage is a module:
//!
//! [`site`] → [`scene`] + [`panorama`] → [`shoot`] → [`volume`] → [`render`], and [`mod@reference`] makes the truth that
//! [`study`] measures error against.
//!
//! Inside the program everything is right-handed, in metres, z up, with +y towards the model's own north, and local to
//! [`scene::Scene::origin`]. Colour is linear Rec. 709 RGB.
//!
//! # Example
//!
//! A room relit from one panorama. `docs/library.md` does it with a site on disk.
//!
//! ```
//! use clerestory::glam::DVec3;
//! use clerestory::render::{Relit, render};
//! use clerestory::site::{Camera, Pose};
//! use clerestory::glam::{Mat3, Vec3};
//! use clerestory::panorama::{Picture, Projection, Radiometry};
//! use clerestory::shoot::{Hits, Light, charted};
//! use std::sync::Arc;
//! # mod given {
//! #     include!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/common/room.rs"));
//! # }
//! # use given::room;
//!
//! let scene = room(); // 4 × 3 × 2.5 m, grey: half of the light comes back
//! let panorama = Picture { width: 64, height: 32, pixels: vec![Vec3::splat(0.2); 64 * 32] };
//! let (chart, picture) = charted(panorama, Projection::LatLong);
//! let hits = Arc::new(Hits::shoot(&scene, Vec3::new(2.0, 1.5, 1.2), Mat3::IDENTITY, chart));
//! let light = Light::new(&scene, [(hits, &picture, Radiometry::default())], None, None);
//!
//! // what the walls send out anywhere is what the probe saw them send out
//! let relit = Relit { scene: &scene, light: &light, volume: None, volume_only: false };
//! let pose = Pose::look_at(DVec3::new(1.0, 1.0, 1.0), DVec3::new(4.0, 2.0, 1.0));
//! let frame = render(&scene, &relit, &Camera::with_fov(pose, 32, 24, 60.0), 4, &|_, _| ());
//! let middle = frame.radiance.pixels[12 * 32 + 16];
//! assert!((middle - 0.2).abs().max_element() < 1e-3);
//! ```
//!
//! # Buffers
//!
//! Pictures, frames and layers are rows from the top, `pixels[y * width + x]`, without padding; meshes are arrays with one entry a
//! vertex or triangle, or none at all where the model has no such thing. Errors and most results may grow ([`non_exhaustive`]); settings
//! have a default to start from: `VolumeSettings { rays: 64, ..VolumeSettings::default() }`. Public types of [`glam`] are its own.
//!
//! [`non_exhaustive`]: https://doc.rust-lang.org/reference/attributes/type_system.html

pub use glam;

#[cfg(doctest)]
#[doc = include_str!("../docs/library.md")]
pub mod library_guide {}

pub mod atomic_write;
pub mod audit;
pub mod bake;
pub mod check;
pub(crate) mod cholesky;
pub(crate) mod components;
pub mod csv;
pub(crate) mod edge_aware;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod init;
pub(crate) mod lists;
pub mod memory;
pub mod panorama;
pub mod paper;
pub mod photograph;
pub mod plan;
pub mod radiometry;
pub mod reference;
pub mod register;
pub mod render;
pub mod report;
pub mod scene;
pub mod shoot;
pub mod site;
pub(crate) mod sphere;
pub(crate) mod statistics;
pub mod study;
pub mod transfer;
pub mod viewer;
pub mod volume;
