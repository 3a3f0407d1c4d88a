//! Reading PNG, JPEG and TIFF.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use glam::Vec3;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::read::{MAX_PIXELS, allocate, check_size};
use super::{PanoramaError, Picture};

type Result<T> = std::result::Result<T, PanoramaError>;

pub(super) fn dimensions(path: &Path, file: BufReader<File>, format: ImageFormat) -> Result<(usize, usize)> {
    let decoder = ImageReader::with_format(file, format).into_decoder().map_err(|e| told(path, e))?;
    let (width, height) = decoder.dimensions();
    check_size(path, width.into(), height.into())
}

pub(super) fn read(path: &Path, file: BufReader<File>, format: ImageFormat) -> Result<Picture> {
    let mut reader = ImageReader::with_format(file, format);
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_PIXELS * 16);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| told(path, e))?;
    let (width, height) = decoder.dimensions();
    let (width, height) = check_size(path, width.into(), height.into())?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(|e| told(path, e))?;
    let mut picture = allocate(path, width, height)?;
    match decoded {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            for (pixel, v) in picture.pixels.iter_mut().zip(decoded.into_rgb32f().pixels()) {
                *pixel = Vec3::from(v.0);
            }
        }
        DynamicImage::ImageLuma8(_)
        | DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageRgb8(_)
        | DynamicImage::ImageRgba8(_) => {
            let table: Vec<f32> = (0..=255u8).map(|v| srgb_to_linear(f32::from(v) / 255.0)).collect();
            for (pixel, v) in picture.pixels.iter_mut().zip(decoded.into_rgb8().pixels()) {
                *pixel = Vec3::from(v.0.map(|c| table[usize::from(c)]));
            }
        }
        _ => {
            for (pixel, v) in picture.pixels.iter_mut().zip(decoded.into_rgb16().pixels()) {
                *pixel = Vec3::from(v.0.map(|c| srgb_to_linear(f32::from(c) / 65535.0)));
            }
        }
    }
    Ok(picture)
}

/// From sRGB-encoded 0..=1 to linear (IEC 61966-2-1).
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// From linear 0..=1 to sRGB-encoded (IEC 61966-2-1).
pub fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

pub(super) fn told(path: &Path, error: image::ImageError) -> PanoramaError {
    use image::ImageError;
    match error {
        ImageError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            PanoramaError::damaged(path, "it is cut short")
        }
        ImageError::IoError(e) => PanoramaError::io(path, e),
        ImageError::Unsupported(e) => PanoramaError::unsupported(path, e.to_string(), "convert it to OpenEXR"),
        ImageError::Limits(e) => PanoramaError::unsupported(path, e.to_string(), "scale it down"),
        other => PanoramaError::damaged(path, other.to_string()),
    }
}
