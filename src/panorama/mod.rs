//! HDR pictures and how their pixels map to directions.
//!
//! ```
//! use clerestory::glam::DVec3;
//! use clerestory::panorama::Projection;
//!
//! // a latitude/longitude picture's middle looks forward, a quarter of its width further is to the right
//! let (width, height) = (64, 32);
//! let right = Projection::LatLong.direction(width, height, 48.0, 16.0).expect("shows all directions");
//! assert!((right - DVec3::X).length() < 1e-12);
//! let sphere: f64 = (0..width * height).map(|i| Projection::LatLong.solid_angle(width, height, i % width, i / width)).sum();
//! assert!((sphere - 4.0 * std::f64::consts::PI).abs() < 1e-9);
//! ```

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
mod radiometry;
mod read;
mod read_exr;
mod read_hdr;
mod read_raster;
mod undistort;
mod view;
mod write;

pub use camera_model::CameraModel;
pub use convert::{convert, latlong};
pub use environment::{EnvironmentSample, EnvironmentSampler};
pub use error::PanoramaError;
pub use exif::Exif;
pub use exposure::{Exposure, luminance};
pub use latlong::latlong_pixel_fast;
pub use lens::{Distortion, Lens};
pub use picture::{Picture, PictureHealth};
pub use projection::Projection;
pub use radiometry::{Radiometry, radius2, response_rises};
pub use read::{Coding, MAX_PIXELS, dimensions, quarter_turns, read, read_coded};
pub(crate) use read_raster::{decoding_bytes, has_many_scans, opened};
pub use read_raster::{linear_to_srgb, srgb_to_linear};
pub use undistort::{pinhole_of, undistorted};
pub use view::Panorama;
pub use write::{Channel, Layer, write_exr, write_png};
