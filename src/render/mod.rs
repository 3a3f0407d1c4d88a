//! Rendering (paper, section 4.3): primary rays find surfaces, records or the volume tell their irradiance E, and
//! radiance is albedo × E / π. Samples of a pixel on one surface share E and a filtered albedo (`shade`); pixels on one
//! surface share E as far as it changes little (`lattice`).

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
pub use rays::PrimaryRays;
pub use relight::{Irradiance, Lit, Relit};
pub use setup::{LeftOut, Options, Setup, SetupError, Timings, pictures, prepare, prepare_for};
pub use view::{exposure_of, render, shown_points};
