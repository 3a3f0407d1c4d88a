//! Shooting (paper, section 4.1): every probe pixel's light is placed on the surface that the pixel sees.
//!
//! Casting the rays ([`Hits`]) does not depend on the lighting, so it is done once per probe; giving the hits the
//! light of a picture ([`Records`]) is cheap and is done once per lighting.
//!
//! ```
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
//! // E = πL / ρ on the floor, seen from above
//! let floor = light.observe(&scene, Vec3::new(1.0, 1.0, 0.0), Vec3::Z).expect("the probe sees it");
//! assert!((floor.value() / (std::f32::consts::PI * 0.2 / 0.5) - 1.0).abs().max_element() < 1e-3);
//! ```

mod beyond;
mod chart;
pub(crate) mod hits;
mod kdtree;
mod light;
mod neighbours;
mod observation;
mod picture;
mod record_transfer;
mod records;
pub mod sunlight;
#[cfg(test)]
mod tests;

pub use chart::Chart;
pub use hits::Hits;
pub use kdtree::KdTree;
pub(crate) use light::Choice;
pub use light::{Light, Outside};
pub use observation::{Mean, Observation};
pub use picture::{charted, read_light};
pub use record_transfer::RecordTransfer;
pub use records::Records;
