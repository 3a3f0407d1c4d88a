//! How large a picture may be, checked before memory is asked for.

use std::path::Path;

use crate::memory;
use crate::panorama::{PanoramaError, Picture};

/// The most pixels a picture may have: 2²⁸, twice a 16384 × 8192 panorama.
pub const MAX_PIXELS: u64 = 1 << 28;

pub(super) type Result<T> = std::result::Result<T, PanoramaError>;

/// Refuses sizes that no honest picture has, before anything is allocated.
pub(crate) fn check_size(path: &Path, width: u64, height: u64) -> Result<(usize, usize)> {
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
pub(crate) fn picture_bytes(width: u64, height: u64) -> u64 {
    width * height * size_of::<glam::Vec3>() as u64
}

/// A black picture, or an error where memory does not suffice.
pub(crate) fn allocate(path: &Path, width: usize, height: usize) -> Result<Picture> {
    let mut pixels = Vec::new();
    let needed = picture_bytes(width as u64, height as u64);
    let refused = |_| PanoramaError::memory(path, memory::OverLimit::Left { needed, left: 0 });
    pixels.try_reserve_exact(width * height).map_err(refused)?;
    pixels.resize(width * height, glam::Vec3::ZERO);
    Ok(Picture { width, height, pixels })
}
