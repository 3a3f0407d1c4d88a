//! How large a picture may be, checked before memory is asked for.

use std::path::Path;

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
    Ok((width as usize, height as usize))
}

/// A black picture, or an error where memory does not suffice.
pub(crate) fn allocate(path: &Path, width: usize, height: usize) -> Result<Picture> {
    let mut pixels = Vec::new();
    pixels.try_reserve_exact(width * height).map_err(|_| PanoramaError::TooLarge {
        path: path.into(),
        width: width as u64,
        height: height as u64,
        limit: MAX_PIXELS,
    })?;
    pixels.resize(width * height, glam::Vec3::ZERO);
    Ok(Picture { width, height, pixels })
}
