//! Reading pictures: the format is told by the file's first bytes, never by its name.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::{PanoramaError, Picture, read_exr, read_hdr, read_raster};
use crate::memory;

/// The most pixels a picture may have: 2²⁸, twice a 16384 × 8192 panorama.
pub const MAX_PIXELS: u64 = 1 << 28;

type Result<T> = std::result::Result<T, PanoramaError>;

/// Reads a picture as linear Rec. 709 RGB, rows from the top.
///
/// | format | values |
/// |---|---|
/// | OpenEXR | as stored; the first R, G, B found (else Y), in the display window; alpha is left out |
/// | Radiance `.hdr` | as stored, over the header's EXPOSURE and COLORCORR |
/// | PNG, JPEG, TIFF | decoded from sRGB to 0..=1; float TIFF as stored; alpha is left out |
///
/// Values are kept as stored, also NaN, infinite and negative ones: see [`Picture::health`].
///
/// # Errors
/// [`PanoramaError`] when the file is missing, damaged, of another format, larger than [`MAX_PIXELS`], or more than
/// [`memory`] allows, which is estimated before anything is decoded.
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
        Format::Exr => Ok((read_exr::read(path, file)?, Coding::Linear)),
        Format::Hdr => Ok((read_hdr::read(path, file)?, Coding::Linear)),
        Format::Raster(kind) => read_raster::read(path, file, kind),
    })
}

/// How a file stores its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Numbers proportional to light, without an upper end of their own.
    Linear,
    /// 8 bits, encoded by sRGB's curve.
    Srgb8,
    /// 16 bits, encoded by sRGB's curve.
    Srgb16,
}

/// How the camera was held: the number of quarter turns clockwise that set the stored pixels upright, 0 to 3, and
/// whether they are then mirrored left to right. [`read`] and [`dimensions`] have done so already.
///
/// # Errors
/// As [`dimensions`].
pub fn quarter_turns(path: &Path) -> Result<(u32, bool)> {
    use image::metadata::Orientation as O;
    let (format, file) = open(path)?;
    let Format::Raster(kind) = format else { return Ok((0, false)) };
    Ok(match guarded(path, || read_raster::orientation(path, file, kind))? {
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
        Format::Exr => read_exr::dimensions(path, file),
        Format::Hdr => read_hdr::dimensions(path, file),
        Format::Raster(kind) => read_raster::dimensions(path, file, kind),
    })
}

enum Format {
    Exr,
    Hdr,
    Raster(image::ImageFormat),
}

fn open(path: &Path) -> Result<(Format, BufReader<File>)> {
    let mut file = BufReader::new(File::open(path).map_err(|e| PanoramaError::io(path, e))?);
    let mut head = Vec::new();
    file.by_ref().take(16).read_to_end(&mut head).map_err(|e| PanoramaError::io(path, e))?;
    file.rewind().map_err(|e| PanoramaError::io(path, e))?;
    let format = format_of(&head).ok_or_else(|| PanoramaError::UnknownFormat { path: path.into() })?;
    Ok((format, file))
}

fn format_of(head: &[u8]) -> Option<Format> {
    const EXR: &[u8] = &[0x76, 0x2f, 0x31, 0x01];
    if head.starts_with(EXR) {
        return Some(Format::Exr);
    }
    if head.starts_with(b"#?") {
        return Some(Format::Hdr);
    }
    match image::guess_format(head).ok()? {
        kind @ (image::ImageFormat::Png | image::ImageFormat::Jpeg | image::ImageFormat::Tiff) => {
            Some(Format::Raster(kind))
        }
        _ => None,
    }
}

/// Decoders may panic on damaged bytes (exr's B44 does, on an exponent out of range): that is damage, not our end.
fn guarded<T>(path: &Path, decode: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(decode))
        .unwrap_or_else(|_| Err(PanoramaError::damaged(path, "its decoder broke off")))
}

/// Refuses sizes that no honest picture has, before anything is allocated.
pub(super) fn check_size(path: &Path, width: u64, height: u64) -> Result<(usize, usize)> {
    let fits = width.checked_mul(height).is_some_and(|n| n <= MAX_PIXELS);
    if !fits {
        return Err(PanoramaError::TooLarge { path: path.into(), width, height, limit: MAX_PIXELS });
    }
    if width == 0 || height == 0 {
        return Err(PanoramaError::damaged(path, format!("a size of {width} × {height} pixels")));
    }
    memory::check(picture_bytes(width, height)).map_err(|over| PanoramaError::memory(path, over))?;
    Ok((width as usize, height as usize))
}

/// What a [`Picture`] of such a size takes, which [`check_size`] has passed.
pub(super) fn picture_bytes(width: u64, height: u64) -> u64 {
    width * height * size_of::<glam::Vec3>() as u64
}

/// A black picture, or an error where memory does not suffice.
pub(super) fn allocate(path: &Path, width: usize, height: usize) -> Result<Picture> {
    let mut pixels = Vec::new();
    let needed = picture_bytes(width as u64, height as u64);
    let refused = |_| PanoramaError::memory(path, memory::OverLimit::Left { needed, left: 0 });
    pixels.try_reserve_exact(width * height).map_err(refused)?;
    pixels.resize(width * height, glam::Vec3::ZERO);
    Ok(Picture { width, height, pixels })
}
