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

mod convert;
mod environment;
mod error;
mod exposure;
mod files;
mod lens;
mod picture;
mod primaries;
mod projection;
mod radiometry;
mod srgb;
mod view;

pub use convert::{convert, latlong};
pub use environment::{EnvironmentSample, EnvironmentSampler};
pub use error::PanoramaError;
pub use exposure::{Exposure, luminance};
pub use files::exif::Exif;
pub use files::limits::MAX_PIXELS;
pub(crate) use files::raster::opened;
pub use files::read::{dimensions, quarter_turns, read, read_coded};
pub use files::write::{Layer, write_exr, write_png};
pub use lens::camera_model::CameraModel;
pub use lens::distortion::{Distortion, Lens};
pub use lens::undistort::{pinhole_of, undistorted};
pub use picture::{Picture, PictureHealth};
pub use projection::Projection;
pub use projection::latlong::latlong_pixel_fast;
pub(crate) use projection::latlong::{neighbours, pixel_across};
pub use radiometry::{Coding, Radiometry, radius2, response_rises};
pub(crate) use srgb::{LINEAR, linear_to_code};
pub use srgb::{linear_to_srgb, srgb_to_linear};
pub use view::Panorama;
