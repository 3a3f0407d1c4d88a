//! Rendering (paper, section 4.3): primary rays find surfaces, records or the volume tell their irradiance E, and
//! radiance is albedo × E / π.

mod frame;
mod rays;
mod relight;
mod setup;

pub use frame::{Frame, Source};
pub use rays::PrimaryRays;
pub use relight::{Irradiance, Relit, render, shown_points};
pub use setup::{LeftOut, Options, Setup, SetupError, Timings, prepare};
