//! Reading Radiance `.hdr`.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use glam::Vec3;
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;

use super::read::{allocate, check_size};
use super::read_raster::told;
use super::{PanoramaError, Picture};

type Result<T> = std::result::Result<T, PanoramaError>;

pub(super) fn dimensions(path: &Path, file: BufReader<File>) -> Result<(usize, usize)> {
    let decoder = HdrDecoder::new_nonstrict(file).map_err(|e| told(path, e))?;
    let (width, height) = decoder.dimensions();
    check_size(path, width.into(), height.into())
}

pub(super) fn read(path: &Path, file: BufReader<File>) -> Result<Picture> {
    let decoder = HdrDecoder::new_nonstrict(file).map_err(|e| told(path, e))?;
    let (width, height) = decoder.dimensions();
    let (width, height) = check_size(path, width.into(), height.into())?;
    let meta = decoder.metadata();
    // the header's lines multiply up; stored values are radiance times them (Ward, *Real Pixels*, 1991)
    let correction = meta.color_correction.map_or(Vec3::ONE, |(r, g, b)| Vec3::new(r, g, b));
    let scale = (correction * meta.exposure.unwrap_or(1.0)).recip();
    if !(scale.is_finite() && scale.min_element() > 0.0) {
        return Err(PanoramaError::damaged(path, "EXPOSURE or COLORCORR that is not a positive number"));
    }
    let mut picture = allocate(path, width, height)?;
    let mut bytes = vec![0; width * height * 12];
    decoder.read_image(&mut bytes).map_err(|e| told(path, e))?;
    for (pixel, b) in picture.pixels.iter_mut().zip(bytes.chunks_exact(12)) {
        let value = |i: usize| f32::from_ne_bytes([b[i], b[i + 1], b[i + 2], b[i + 3]]);
        *pixel = Vec3::new(value(0), value(4), value(8)) * scale;
    }
    Ok(picture)
}
