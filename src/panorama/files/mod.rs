//! Pictures on disk: the format is told by a file's first bytes.

mod dwa;
pub(crate) mod exif;
mod exr;
mod hdr;
pub(crate) mod limits;
pub(crate) mod raster;
pub(crate) mod read;
pub(crate) mod write;
