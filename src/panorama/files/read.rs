//! Reading pictures: the format is told by the file's first bytes, never by its name.

use image::ImageFormat;
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::limits::Result;
use super::{exr, hdr, raster};
use crate::panorama::radiometry::Coding;
use crate::panorama::{PanoramaError, Picture};

/// Reads a picture as linear Rec. 709 RGB, rows from the top.
///
/// | format | values |
/// |---|---|
/// | OpenEXR | as stored; the first R, G, B found (else Y), in the display window; alpha is passed over |
/// | Radiance `.hdr` | as stored, over the header's EXPOSURE and COLORCORR |
/// | PNG, JPEG, TIFF | decoded from sRGB to 0..=1; float TIFF as stored; NaN where alpha is below one half, as where a stitching program had no photograph |
///
/// Values are otherwise kept as stored, also NaN, infinite and negative ones: see [`Picture::health`].
///
/// # Errors
/// [`PanoramaError`] when the file is missing, damaged, of another format, larger than [`MAX_PIXELS`](crate::panorama::MAX_PIXELS), or more than
/// [`memory`](crate::memory) allows, which is estimated before anything is decoded.
pub fn read(path: &Path) -> Result<Picture> {
    Ok(read_coded(path)?.0)
}

/// The same, with how the file stores its values.
///
/// # Errors
/// As [`read`].
pub fn read_coded(path: &Path) -> Result<(Picture, Coding)> {
    let (format, file) = open(path)?;
    guarded(path, || match format {
        ImageFormat::OpenExr => Ok((exr::read(path, file)?, Coding::Linear)),
        ImageFormat::Hdr => Ok((hdr::read(path, file)?, Coding::Linear)),
        _ => raster::read(path, file, format),
    })
}

/// How the camera was held: the number of quarter turns clockwise that set the stored pixels upright, 0 to 3, and
/// whether they are then mirrored left to right. [`read`] and [`dimensions`] have done so already.
///
/// # Errors
/// As [`dimensions`].
pub fn quarter_turns(path: &Path) -> Result<(u32, bool)> {
    use image::metadata::Orientation as O;
    let (format, file) = open(path)?;
    if matches!(format, ImageFormat::OpenExr | ImageFormat::Hdr) {
        return Ok((0, false));
    }
    Ok(match guarded(path, || Ok(raster::checked(path, file, format)?.2))? {
        O::NoTransforms => (0, false),
        O::Rotate90 => (1, false),
        O::Rotate180 => (2, false),
        O::Rotate270 => (3, false),
        O::FlipHorizontal => (0, true),
        O::Rotate90FlipH => (1, true),
        O::FlipVertical => (2, true),
        O::Rotate270FlipH => (3, true),
    })
}

/// Width and height in pixels, from the header alone.
///
/// # Errors
/// As [`read`], as far as the header tells.
pub fn dimensions(path: &Path) -> Result<(usize, usize)> {
    let (format, file) = open(path)?;
    guarded(path, || match format {
        ImageFormat::OpenExr => exr::dimensions(path, file),
        ImageFormat::Hdr => hdr::dimensions(path, file),
        _ => raster::dimensions(path, file, format),
    })
}

/// A file that is read here, and its format.
fn open(path: &Path) -> Result<(ImageFormat, BufReader<File>)> {
    let mut file = BufReader::new(File::open(path).map_err(|e| PanoramaError::io(path, e))?);
    let mut head = Vec::new();
    file.by_ref().take(16).read_to_end(&mut head).map_err(|e| PanoramaError::io(path, e))?;
    file.rewind().map_err(|e| PanoramaError::io(path, e))?;
    // programs write their own names behind the mark of Radiance's pictures
    let format = if head.starts_with(b"#?") { Ok(ImageFormat::Hdr) } else { image::guess_format(&head) };
    match format {
        Ok(
            known
            @ (ImageFormat::OpenExr | ImageFormat::Hdr | ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Tiff),
        ) => Ok((known, file)),
        _ => Err(PanoramaError::UnknownFormat { path: path.into() }),
    }
}

/// Decoders may panic on damaged bytes (exr's B44 does, on an exponent out of range): that is damage, not our end.
fn guarded<T>(path: &Path, decode: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(decode))
        .unwrap_or_else(|_| Err(PanoramaError::damaged(path, "its decoder broke off")))
}
