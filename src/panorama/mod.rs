//! HDR pictures and how their pixels map to directions.

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

pub use convert::{convert, latlong_size};
pub use environment::{EnvironmentSample, EnvironmentSampler};
pub use error::PanoramaError;
pub use exposure::{Exposure, luminance};
pub use files::exif::Exif;
pub use files::limits::MAX_PIXELS;
pub use files::read::{dimensions, quarter_turns, read, read_coded};
pub use files::write::{Channel, Layer, write_exr, write_png};
pub use lens::camera_model::CameraModel;
pub use lens::distortion::{Distortion, Lens};
pub use lens::undistort::{pinhole_of, undistorted};
pub use picture::{Picture, PictureHealth};
pub use projection::Projection;
pub use projection::latlong::latlong_pixel_fast;
pub(crate) use projection::latlong::pixel_across;
pub use radiometry::{Coding, Radiometry, radius2, response_rises};
pub use srgb::{linear_to_srgb, srgb_to_linear};
pub use view::Panorama;
