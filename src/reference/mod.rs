//! The reference: an unbiased path tracer, the truth against which error is stated, and the maker of rehearsal probes.
//!
//! Surfaces are Lambertian and two-sided. Light comes from a sky, a sun and emissive triangles ([`Lights`]). A picture is
//! an [`Estimate`] that grows: two independent halves, whose difference tells its [`Noise`].
//!
//! ```text
//! Site, Scene ─► Lights ─► render_camera / render_panorama ─► Estimate ─► mean, variance, halves, noise
//!                          one sample: random ─► path (vertex, sky, emitters)
//! ```

mod emitters;
mod estimate;
mod lights;
mod path;
mod random;
mod render;
mod sky;
mod sun_patches;
mod vertex;

pub use estimate::{Estimate, Noise};
pub use lights::{LightError, Lights};
pub use path::Strategy;
pub use render::{
    Eye, Progress, ReferenceSettings, Stopped, add_samples, irradiance, render_camera, render_panorama, unwatched,
};
pub use sky::Sky;
