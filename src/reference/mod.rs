//! The reference: an unbiased path tracer, the truth against which error is stated, and the maker of rehearsal probes.
//!
//! Surfaces are Lambertian and two-sided. Light comes from a sky, a sun and emissive triangles ([`Lights`]). A picture is
//! an [`Estimate`] that grows: two independent halves, whose difference tells its [`Noise`].
//!
//! ```text
//! Site, Scene ─► Lights ─► trace ─► Estimate ─► mean, variance, halves, noise
//!                          one sample: random ─► path (vertex, sky, emitters)
//! ```
//!
//! ```
//! use clerestory::glam::Vec3;
//! use clerestory::reference::{Lights, ReferenceSettings, irradiance};
//! # mod given {
//! #     include!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/common/room.rs"));
//! # }
//! # use given::room;
//!
//! // a furnace: walls that shine with 1 and reflect half end at E = π · 1 / (1 − ½)
//! let mut scene = room();
//! scene.materials[0].emission = Vec3::ONE;
//! let lights = Lights::new(&scene, None, None);
//! let settings = ReferenceSettings { samples: 1024, ..ReferenceSettings::default() };
//! let (mean, _error) = irradiance(&scene, &lights, Vec3::new(1.0, 1.0, 0.0), Vec3::Z, &settings);
//! assert!((mean / (2.0 * std::f32::consts::PI) - 1.0).abs().max_element() < 0.05);
//! ```

mod emitters;
mod estimate;
mod lights;
mod path;
pub(crate) mod random;
mod render;
mod sky;
mod sun_patches;
mod vertex;

pub use estimate::{Estimate, Noise};
pub use lights::{LightError, Lights};
pub use path::Strategy;
pub use render::{Eye, Progress, ReferenceSettings, Stopped, add_samples, irradiance, trace};
pub use sky::Sky;
