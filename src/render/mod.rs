//! Rendering (paper, section 4.3): primary rays find surfaces, records or the volume tell their irradiance E, and
//! radiance is albedo × E / π. Samples of a pixel on one surface share E and a filtered albedo (`shade`); pixels on one
//! surface share E as far as it changes little (`lattice`).
//!
//! ```
//! use clerestory::glam::DVec3;
//! use clerestory::render::{Relit, render};
//! use clerestory::site::{Camera, Pose};
//! # use clerestory::glam::{Mat3, Vec3};
//! # use clerestory::panorama::{Picture, Projection, Radiometry};
//! # use clerestory::shoot::{Hits, Light, charted};
//! # use std::sync::Arc;
//! # mod given {
//! #     include!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/common/room.rs"));
//! # }
//! # use given::room;
//! # let scene = room(); // 4 × 3 × 2.5 m, grey: half of the light comes back
//! # let panorama = Picture { width: 64, height: 32, pixels: vec![Vec3::splat(0.2); 64 * 32] };
//! # let (chart, picture) = charted(panorama, Projection::LatLong);
//! # let hits = Arc::new(Hits::shoot(&scene, Vec3::new(2.0, 1.5, 1.2), Mat3::IDENTITY, chart));
//! # let light = Light::new(&scene, [(hits, &picture, Radiometry::default())], None, None);
//! // a scene, and the light that a probe brought into it
//! let relit = Relit { scene: &scene, light: &light, volume: None, volume_only: false };
//! let pose = Pose::look_at(DVec3::new(1.0, 1.0, 1.0), DVec3::new(4.0, 2.0, 1.0));
//! let frame = render(&scene, &relit, &Camera::with_fov(pose, 32, 24, 60.0), 1, &|_, _| ());
//! assert_eq!(frame.radiance.pixels.len(), 32 * 24);
//! assert!(frame.radiance.pixels.iter().all(|p| (p - 0.2).abs().max_element() < 1e-3));
//! ```

mod frame;
mod lattice;
mod rays;
mod relight;
mod setup;
mod shade;
#[cfg(test)]
mod tests;
mod view;

pub use frame::{Frame, Source};
pub(crate) use rays::Cast;
pub use rays::PrimaryRays;
pub use relight::{Irradiance, Lit, Relit, ShadingPoint};
pub use setup::{LeftOut, Options, Setup, SetupError, Timings, pictures, prepare, prepare_for, shoot_probes};
pub(crate) use view::first_hits;
pub use view::{render, shown_points};
