//! Shooting (paper, section 4.1): every probe pixel's light is placed on the surface that the pixel sees.
//!
//! Casting the rays ([`Hits`]) does not depend on the lighting, so it is done once per probe; giving the hits the
//! light of a picture ([`Records`]) is cheap and is done once per lighting.

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
