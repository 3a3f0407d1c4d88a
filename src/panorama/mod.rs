//! HDR pictures and how their pixels map to directions.

mod convert;
mod cube;
mod environment;
mod error;
mod exif;
mod exposure;
mod latlong;
mod picture;
mod pinhole;
mod primaries;
mod projection;
mod radial;
mod radiometry;
mod read;
mod read_exr;
mod read_hdr;
mod read_raster;
mod view;
mod write;

pub use convert::{convert, latlong_size};
pub use environment::{EnvironmentSample, EnvironmentSampler};
pub use error::PanoramaError;
pub use exif::Exif;
pub use exposure::{Exposure, luminance};
pub use latlong::latlong_pixel_fast;
pub use picture::{Picture, PictureHealth};
pub use projection::Projection;
pub use radiometry::{Radiometry, radius2, response_rises};
pub use read::{Coding, MAX_PIXELS, dimensions, quarter_turns, read, read_coded};
pub use read_raster::{linear_to_srgb, srgb_to_linear};
pub use view::Panorama;
pub use write::{Channel, Layer, write_exr, write_png};
