//! HDR pictures and how their pixels map to directions.

mod error;
mod picture;
mod projection;
mod read;
mod read_exr;
mod read_hdr;
mod read_raster;
mod write;

pub use error::PanoramaError;
pub use picture::Picture;
pub use projection::{Projection, latlong_direction, latlong_pixel, latlong_solid_angle};
pub use read::{MAX_PIXELS, dimensions, read};
pub use read_raster::{linear_to_srgb, srgb_to_linear};
pub use write::{Channel, Layer, write_exr};
