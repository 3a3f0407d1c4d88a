//! Reading PNG, JPEG and TIFF.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use glam::Vec3;
use image::metadata::Orientation::{self, Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::limits::{MAX_PIXELS, Result, allocate, check_size};
use crate::panorama::radiometry::Coding;
use crate::panorama::srgb::srgb_to_linear;
use crate::panorama::{PanoramaError, Picture};

pub(crate) fn dimensions(path: &Path, file: BufReader<File>, format: ImageFormat) -> Result<(usize, usize)> {
    let mut decoder = ImageReader::with_format(file, format).into_decoder().map_err(|e| decode_error(path, e))?;
    let (width, height) = decoder.dimensions();
    let (width, height) = check_size(path, width.into(), height.into())?;
    let sideways = matches!(turned(&mut decoder), Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH);
    Ok(if sideways { (height, width) } else { (width, height) })
}

/// How the camera was held.
pub(crate) fn orientation(path: &Path, file: BufReader<File>, format: ImageFormat) -> Result<Orientation> {
    let mut decoder = ImageReader::with_format(file, format).into_decoder().map_err(|e| decode_error(path, e))?;
    Ok(turned(&mut decoder))
}

/// How the camera was held, as the file says; unturned where it does not say.
fn turned(decoder: &mut impl ImageDecoder) -> Orientation {
    decoder.orientation().unwrap_or(Orientation::NoTransforms)
}

pub(crate) fn read(path: &Path, file: BufReader<File>, format: ImageFormat) -> Result<(Picture, Coding)> {
    let mut reader = ImageReader::with_format(file, format);
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_PIXELS * 16);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(|e| decode_error(path, e))?;
    let (width, height) = decoder.dimensions();
    check_size(path, width.into(), height.into())?;
    let orientation = turned(&mut decoder);
    let mut decoded = DynamicImage::from_decoder(decoder).map_err(|e| decode_error(path, e))?;
    decoded.apply_orientation(orientation);
    let mut picture = allocate(path, decoded.width() as usize, decoded.height() as usize)?;
    let coding = match decoded {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            for (pixel, v) in picture.pixels.iter_mut().zip(decoded.into_rgb32f().pixels()) {
                *pixel = Vec3::from(v.0);
            }
            Coding::Linear
        }
        DynamicImage::ImageLuma8(_)
        | DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageRgb8(_)
        | DynamicImage::ImageRgba8(_) => {
            let table: Vec<f32> = (0..=255u8).map(|v| srgb_to_linear(f32::from(v) / 255.0)).collect();
            for (pixel, v) in picture.pixels.iter_mut().zip(decoded.into_rgb8().pixels()) {
                *pixel = Vec3::from(v.0.map(|c| table[usize::from(c)]));
            }
            Coding::Srgb8
        }
        _ => {
            let table: Vec<f32> = (0..=65535u16).map(|v| srgb_to_linear(f32::from(v) / 65535.0)).collect();
            for (pixel, v) in picture.pixels.iter_mut().zip(decoded.into_rgb16().pixels()) {
                *pixel = Vec3::from(v.0.map(|c| table[usize::from(c)]));
            }
            Coding::Srgb16
        }
    };
    Ok((picture, coding))
}

pub(crate) fn decode_error(path: &Path, error: image::ImageError) -> PanoramaError {
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

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageBuffer, Luma, Rgb, Rgba};

    #[test]
    fn integers_are_decoded_from_srgb_and_floats_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        ImageBuffer::from_fn(3, 2, |x, _| Rgb([x as u8 * 100, 255, 0])).save(path("8.png")).unwrap();
        ImageBuffer::from_fn(3, 2, |x, _| Rgba([x as u16 * 30_000, 65535, 0, 9])).save(path("16.png")).unwrap();
        ImageBuffer::from_fn(3, 2, |x, _| Luma([x as u16 * 30_000])).save(path("grey.tif")).unwrap();
        ImageBuffer::from_fn(3, 2, |x, _| Rgb([x as f32 * 1e5, -1.0, 0.5])).save(path("float.tif")).unwrap();
        let at = |name: &str| crate::panorama::read(&path(name)).unwrap().pixels[2];
        let near = |a: Vec3, b: Vec3| assert!(a.distance(b) < 1e-5, "{a} {b}");
        near(at("8.png"), Vec3::new(srgb_to_linear(200.0 / 255.0), 1.0, 0.0));
        near(at("16.png"), Vec3::new(srgb_to_linear(60_000.0 / 65535.0), 1.0, 0.0));
        near(at("grey.tif"), Vec3::splat(srgb_to_linear(60_000.0 / 65535.0)));
        near(at("float.tif"), Vec3::new(2e5, -1.0, 0.5));
        assert_eq!(crate::panorama::dimensions(&path("16.png")).unwrap(), (3, 2));
    }

    #[test]
    fn a_camera_held_sideways_is_set_upright() {
        use image::ImageEncoder;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sideways.jpg");
        let mut encoder = image::codecs::jpeg::JpegEncoder::new(std::fs::File::create(&path).unwrap());
        // one TIFF entry: tag 0x112 (orientation), short, count 1, value 6: turn 90° clockwise to show
        let exif = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0".to_vec();
        encoder.set_exif_metadata(exif).unwrap();
        let stored = ImageBuffer::from_fn(64, 32, |x, _| Rgb([if x < 32 { 255u8 } else { 0 }; 3]));
        encoder.write_image(stored.as_raw(), 64, 32, image::ExtendedColorType::Rgb8).unwrap();
        assert_eq!(crate::panorama::dimensions(&path).unwrap(), (32, 64));
        let picture = crate::panorama::read(&path).unwrap();
        assert_eq!((picture.width, picture.height), (32, 64));
        // what was left is on top now
        assert!(picture.pixels[5 * 32 + 5].x > 0.9 && picture.pixels[60 * 32 + 5].x < 0.1);
    }

    #[test]
    fn the_name_does_not_decide_and_strangers_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("really-a-png.jpg");
        ImageBuffer::from_pixel(2, 2, Rgb([255u8; 3])).save_with_format(&path, ImageFormat::Png).unwrap();
        assert_eq!(crate::panorama::read(&path).unwrap().pixels[0], Vec3::ONE);
        std::fs::write(&path, "hello").unwrap();
        assert!(matches!(crate::panorama::read(&path), Err(PanoramaError::UnknownFormat { .. })));
        assert!(matches!(crate::panorama::read(folder.path()), Err(PanoramaError::Io { .. })));
        assert!(matches!(crate::panorama::read(&folder.path().join("none.exr")), Err(PanoramaError::Io { .. })));
    }

    #[test]
    fn srgb_encoding_is_undone() {
        for i in 0..=100 {
            let v = i as f32 / 100.0;
            assert!((srgb_to_linear(linear_to_srgb(v)) - v).abs() < 1e-5);
        }
    }
}
