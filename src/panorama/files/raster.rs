//! Reading PNG, JPEG and TIFF.

use std::fs::File;
use std::io::{BufRead, BufReader, Seek, SeekFrom};
use std::path::Path;

use glam::Vec3;
use image::metadata::Orientation::{self, Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, ImageResult, Limits};

use super::limits::{Result, allocate, check_size, picture_bytes};
use crate::memory;
use crate::panorama::radiometry::Coding;
use crate::panorama::srgb::{LINEAR, srgb_to_linear};
use crate::panorama::{PanoramaError, Picture};

/// The most bytes that a PNG file's colour profile, which nothing here uses, may inflate to.
const MOST_BESIDE_PIXELS: u64 = 16 << 20;

/// Reads a file's head: its decoder, and the bytes that decoding takes, which are the pixels as they are stored and what the
/// decoder keeps beside them.
pub(crate) fn opened<'a>(
    mut file: impl BufRead + Seek + 'a,
    format: ImageFormat,
) -> ImageResult<(impl ImageDecoder + 'a, u64)> {
    let many_scans = has_many_scans(&mut file, format)?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(if format == ImageFormat::Png { MOST_BESIDE_PIXELS } else { memory::limit() });
    let mut reader = ImageReader::with_format(file, format);
    reader.limits(limits);
    let decoder = reader.into_decoder()?;
    let stored = decoder.total_bytes();
    let bytes = match format {
        ImageFormat::Tiff => stored.saturating_mul(2), // decoded, and copied
        ImageFormat::Jpeg if many_scans => stored.saturating_mul(3), // a coefficient of two bytes for each value
        _ => stored,
    };
    Ok((decoder, bytes))
}

/// Whether a JPEG file's values come in several scans, so that all coefficients are kept until the last (ITU-T T.81, B.2).
/// Leaves the file at its start.
fn has_many_scans(file: &mut (impl BufRead + Seek), format: ImageFormat) -> std::io::Result<bool> {
    if format != ImageFormat::Jpeg {
        return Ok(false);
    }
    let mut in_frame = 0;
    file.seek(SeekFrom::Start(2))?;
    let many = loop {
        let mut head = [0; 4];
        // a file that breaks off, or is not as it should be, will say so when it is decoded: the worst is taken
        if file.read_exact(&mut head).is_err() || head[0] != 0xff {
            break true;
        }
        let length = u16::from_be_bytes([head[2], head[3]]);
        match head[1] {
            0xc0 | 0xc1 => {
                let mut frame = [0; 6]; // precision, height, width, components
                if file.read_exact(&mut frame).is_err() || length < 8 {
                    break true;
                }
                in_frame = frame[5];
                file.seek_relative(i64::from(length) - 8)?;
            }
            0xc2..=0xcf if head[1] != 0xc4 && head[1] != 0xc8 && head[1] != 0xcc => break true,
            0xda => {
                let mut scan = [0];
                break file.read_exact(&mut scan).is_err() || scan[0] < in_frame;
            }
            _ => file.seek_relative((i64::from(length) - 2).max(0))?,
        }
    };
    file.rewind()?;
    Ok(many)
}

/// The decoder of a picture that is not too large, the bytes that decoding takes, and how the camera was held, unturned where
/// the file does not say.
pub(super) fn checked(
    path: &Path,
    file: BufReader<File>,
    format: ImageFormat,
) -> Result<(impl ImageDecoder, u64, Orientation)> {
    let (mut decoder, bytes) = opened(file, format).map_err(|e| decode_error(path, e))?;
    let (width, height) = decoder.dimensions();
    check_size(path, width.into(), height.into())?;
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    Ok((decoder, bytes, orientation))
}

pub(crate) fn dimensions(path: &Path, file: BufReader<File>, format: ImageFormat) -> Result<(usize, usize)> {
    let (decoder, _, orientation) = checked(path, file, format)?;
    let (width, height) = decoder.dimensions();
    let sideways = matches!(orientation, Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH);
    let (width, height) = if sideways { (height, width) } else { (width, height) };
    Ok((width as usize, height as usize))
}

pub(crate) fn read(path: &Path, file: BufReader<File>, format: ImageFormat) -> Result<(Picture, Coding)> {
    let (decoder, decoding, orientation) = checked(path, file, format)?;
    let (width, height) = decoder.dimensions();
    let turning = if orientation == Orientation::NoTransforms { 0 } else { decoder.total_bytes() };
    let needed = decoding.saturating_add(turning).saturating_add(picture_bytes(width.into(), height.into()));
    memory::check(needed).map_err(|over| PanoramaError::memory(path, over))?;
    let mut decoded = DynamicImage::from_decoder(decoder).map_err(|e| decode_error(path, e))?;
    decoded.apply_orientation(orientation);
    let mut picture = allocate(path, decoded.width() as usize, decoded.height() as usize)?;
    let (kind, bytes) = (decoded.color(), decoded.as_bytes());
    let channels = usize::from(kind.channel_count());
    let coding = match kind {
        ColorType::Rgb32F | ColorType::Rgba32F => {
            fill(&mut picture, bytemuck::cast_slice(bytes), channels, 0.5, |v: f32| v);
            Coding::Linear
        }
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {
            let table: &[f32; 256] = &LINEAR;
            fill(&mut picture, bytes, channels, 1 << 7, |v: u8| table[usize::from(v)]);
            Coding::Srgb8
        }
        _ => {
            let table: Vec<f32> = (0..=65535u16).map(|v| srgb_to_linear(f32::from(v) / 65535.0)).collect();
            fill(&mut picture, bytemuck::cast_slice(bytes), channels, 1 << 15, |v: u16| table[usize::from(v)]);
            Coding::Srgb16
        }
    };
    Ok((picture, coding))
}

/// Fills a picture from stored values, one or three channels a pixel, with alpha or without. What alpha below `half` hides was
/// never photographed, and is NaN.
fn fill<T: Copy + PartialOrd>(
    picture: &mut Picture,
    stored: &[T],
    channels: usize,
    half: T,
    linear: impl Fn(T) -> f32,
) {
    let opaque = |v: &[T]| v.last().is_some_and(|alpha| *alpha >= half);
    // some programs write an alpha of nought all over, which would hide all there is
    let has_alpha = channels.is_multiple_of(2) && stored.chunks_exact(channels).any(opaque);
    for (pixel, v) in picture.pixels.iter_mut().zip(stored.chunks_exact(channels)) {
        *pixel = match *v {
            _ if has_alpha && !opaque(v) => Vec3::NAN,
            [r, g, b, ..] => Vec3::new(linear(r), linear(g), linear(b)),
            [grey, ..] => Vec3::splat(linear(grey)),
            [] => Vec3::ZERO,
        };
    }
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
    use crate::panorama::linear_to_srgb;
    use image::{ImageBuffer, Luma, LumaA, Rgb, Rgba};

    #[test]
    fn integers_are_decoded_from_srgb_and_floats_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        ImageBuffer::from_fn(3, 2, |x, _| Rgb([x as u8 * 100, 255, 0])).save(path("8.png")).unwrap();
        ImageBuffer::from_fn(3, 2, |x, _| Rgba([x as u16 * 30_000, 65535, 0, 65535])).save(path("16.png")).unwrap();
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
    fn what_alpha_hides_is_no_light() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        ImageBuffer::from_fn(4, 1, |x, _| Rgba([0u8, 90, 255, [0, 127, 128, 255][x as usize]]))
            .save(path("8.png"))
            .unwrap();
        ImageBuffer::from_fn(4, 1, |x, _| Rgba([9u16, 9, 9, [0, 32_767, 32_768, 65_535][x as usize]]))
            .save(path("16.png"))
            .unwrap();
        ImageBuffer::from_fn(4, 1, |x, _| LumaA([200u8, [0, 127, 128, 255][x as usize]]))
            .save(path("grey.png"))
            .unwrap();
        ImageBuffer::from_fn(4, 1, |x, _| Rgba([0.2f32, 3.0, 0.0, [0.0, 0.49, 0.5, 1.0][x as usize]]))
            .save(path("float.tif"))
            .unwrap();
        for name in ["8.png", "16.png", "grey.png", "float.tif"] {
            let shown = crate::panorama::read(&path(name)).unwrap().pixels.into_iter().map(Picture::valid);
            assert_eq!(shown.collect::<Vec<_>>(), [false, false, true, true], "{name}");
        }
        ImageBuffer::from_fn(4, 1, |_, _| Rgba([200u8, 90, 255, 0])).save(path("all.png")).unwrap();
        let all = crate::panorama::read(&path("all.png")).unwrap();
        assert!(all.pixels.into_iter().all(Picture::valid), "an alpha that is nought all over says nothing");
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
    fn a_jpeg_file_in_several_scans_is_known_by_its_head() {
        let scans = |frame: u8, in_frame: u8, in_scan: u8| {
            // start, a comment, tables, the frame, a scan
            let mut file = vec![0xff, 0xd8, 0xff, 0xfe, 0, 4, b'h', b'i', 0xff, 0xc4, 0, 3, 0];
            file.extend([0xff, frame, 0, 11, 8, 0, 1, 0, 1, in_frame, 1, 0x11, 0]);
            file.extend([0xff, 0xda, 0, 8, in_scan, 1, 0, 0, 63, 0]);
            has_many_scans(&mut std::io::Cursor::new(file), ImageFormat::Jpeg).unwrap()
        };
        assert!(!scans(0xc0, 3, 3) && !scans(0xc1, 1, 1));
        assert!(scans(0xc2, 3, 3) && scans(0xc0, 3, 1));
        assert!(has_many_scans(&mut std::io::Cursor::new([0xff, 0xd8]), ImageFormat::Jpeg).unwrap());
    }

    #[test]
    fn srgb_encoding_is_undone() {
        for i in 0..=100 {
            let v = i as f32 / 100.0;
            assert!((srgb_to_linear(linear_to_srgb(v)) - v).abs() < 1e-5);
        }
    }
}
