//! HDR pictures and how their pixels map to directions.

mod camera_model;
mod convert;
mod cube;
mod environment;
mod error;
mod exif;
mod exposure;
mod latlong;
mod lens;
mod picture;
mod pinhole;
mod primaries;
mod projection;
mod radial;
mod read;
mod read_exr;
mod read_hdr;
mod read_raster;
mod undistort;
mod view;
mod write;

pub use camera_model::CameraModel;
pub use convert::{convert, latlong_size};
pub use environment::{EnvironmentSample, EnvironmentSampler};
pub use error::PanoramaError;
pub use exif::Exif;
pub use exposure::{Exposure, luminance};
pub use latlong::latlong_pixel_fast;
pub use lens::{Distortion, Lens};
pub use picture::{Picture, PictureHealth};
pub use projection::Projection;
pub use read::{Coding, MAX_PIXELS, dimensions, quarter_turns, read, read_coded};
pub use read_raster::{linear_to_srgb, srgb_to_linear};
pub use undistort::{pinhole_of, undistorted};
pub use view::Panorama;
pub use write::{Channel, Layer, write_exr, write_png};
