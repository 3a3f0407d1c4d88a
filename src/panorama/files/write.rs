//! Writing pictures, whole or not at all.

use std::path::Path;

use exr::image::write::WritableImage;
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer as ExrLayer};
use exr::meta::attribute::{AttributeValue, IntegerBounds, Text};
use exr::meta::header::{ImageAttributes, LayerAttributes};
use exr::prelude::f16;

use super::limits::Result;
use crate::atomic_write::write_atomically;
use crate::panorama::{Exposure, PanoramaError, Picture};

/// A named group of channels. Radiance, the main layer, has the empty name, so that every viewer shows it. Those that are `half`
/// are stored as 16-bit floats: 11 bits of precision, magnitudes up to 65504 (larger ones are clamped to that).
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Names, with the layer's before them, and `width × height` values, rows from the top.
    channels: Vec<(String, Vec<f32>)>,
    half: bool,
}

impl Layer {
    /// A layer of three f32 channels R, G, B.
    pub fn rgb(name: &str, picture: &Picture) -> Self {
        Self::vectors(name, ["R", "G", "B"], &picture.pixels, false)
    }

    /// A layer of three channels with the given names.
    pub fn vectors(name: &str, channels: [&str; 3], values: &[glam::Vec3], half: bool) -> Self {
        let channel = |i: usize| (full_name(name, channels[i]), values.iter().map(|v| v[i]).collect());
        Self { channels: (0..3).map(channel).collect(), half }
    }

    /// A layer of one channel with the given name.
    pub fn scalars(name: &str, channel: &str, values: Vec<f32>, half: bool) -> Self {
        Self { channels: vec![(full_name(name, channel), values)], half }
    }
}

/// A channel's name behind its layer's.
fn full_name(layer: &str, channel: &str) -> String {
    if layer.is_empty() { channel.to_owned() } else { format!("{layer}.{channel}") }
}

/// Writes an OpenEXR file of `width × height` pixels: one part whose channels are named `layer.channel`, ZIP-compressed
/// (lossless), the same bytes for the same input. `note` becomes the file's only text attribute, `clerestory`.
///
/// The file appears whole or not at all.
///
/// # Errors
/// [`PanoramaError::Unwritable`] when a channel's length is not `width × height`, a name is taken twice or is not
/// plain text; [`PanoramaError::Io`] when the file system refuses.
pub fn write_exr(path: &Path, width: usize, height: usize, layers: &[Layer], note: Option<&str>) -> Result<()> {
    let mut channels = Vec::new();
    for layer in layers {
        for (name, values) in &layer.channels {
            channels.push(exr_channel(path, name, values, layer.half, width * height)?);
        }
    }
    channels.sort_by(|a, b| a.name.bytes().cmp(b.name.bytes()));
    if let Some(pair) = channels.windows(2).find(|p| p[0].name == p[1].name) {
        return Err(PanoramaError::unwritable(path, format!("two channels are named {}", pair[0].name)));
    }
    if channels.is_empty() || width == 0 || height == 0 {
        return Err(PanoramaError::unwritable(path, "a picture without pixels"));
    }
    let mut attributes = LayerAttributes::default();
    if let Some(note) = note {
        let text = text(path, note)?;
        attributes.other.insert(Text::from("clerestory"), AttributeValue::Text(text));
    }
    let list = AnyChannels::sort(channels.into_iter().collect());
    let layer = ExrLayer::new((width, height), attributes, Encoding::SMALL_LOSSLESS, list);
    let image =
        Image { attributes: ImageAttributes::new(IntegerBounds::from_dimensions((width, height))), layer_data: layer };
    write_atomically(
        path,
        |e| PanoramaError::io(path, e),
        |file| {
            image.write().to_buffered(file).map_err(|e| match e {
                exr::error::Error::Io(e) => PanoramaError::io(path, e),
                other => PanoramaError::unwritable(path, other.to_string()),
            })
        },
    )
}

/// Writes an 8-bit sRGB PNG for people to look at, as [`Exposure::show`] tone-maps it. The file appears whole or not at
/// all.
///
/// # Errors
/// [`PanoramaError::Unwritable`] for a picture without pixels; [`PanoramaError::Io`] when the file system refuses.
pub fn write_png(path: &Path, picture: &Picture, exposure: Exposure) -> Result<()> {
    let (width, height) = (picture.width as u32, picture.height as u32);
    let bytes = |p: &glam::Vec3| (exposure.show(*p) * 255.0 + 0.5).to_array().map(|v| v as u8);
    let pixels: Vec<u8> = picture.pixels.iter().flat_map(bytes).collect();
    write_atomically(
        path,
        |e| PanoramaError::io(path, e),
        |file| {
            use image::ImageEncoder;
            let encoder = image::codecs::png::PngEncoder::new(file);
            encoder.write_image(&pixels, width, height, image::ExtendedColorType::Rgb8).map_err(|e| match e {
                image::ImageError::IoError(e) => PanoramaError::io(path, e),
                other => PanoramaError::unwritable(path, other.to_string()),
            })
        },
    )
}

fn exr_channel(path: &Path, name: &str, values: &[f32], half: bool, count: usize) -> Result<AnyChannel<FlatSamples>> {
    if values.len() != count {
        let what = format!("channel {name} has {} values for {count} pixels", values.len());
        return Err(PanoramaError::unwritable(path, what));
    }
    let samples = if half {
        // infinity from an overflow would poison whoever reads the file
        let narrow = |&v: &f32| f16::from_f32(if v.is_finite() { v.clamp(-65504.0, 65504.0) } else { v });
        FlatSamples::F16(values.iter().map(narrow).collect())
    } else {
        FlatSamples::F32(values.to_vec())
    };
    Ok(AnyChannel::new(text(path, name)?, samples))
}

fn text(path: &Path, s: &str) -> Result<Text> {
    let plain = s.is_ascii() && !s.is_empty();
    Text::new_or_none(s)
        .filter(|_| plain)
        .ok_or_else(|| PanoramaError::unwritable(path, format!("{s:?} is not plain ASCII text")))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::panorama::read;
    use glam::Vec3;

    fn ramp(width: usize, height: usize) -> Picture {
        let mut picture = Picture::new(width, height);
        for (i, p) in picture.pixels.iter_mut().enumerate() {
            *p = Vec3::new(i as f32 * 0.37, 1e-6 * i as f32, 1e9 - i as f32);
        }
        picture
    }

    #[test]
    fn what_is_written_reads_back_exactly() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        let mut picture = ramp(37, 21);
        picture.pixels[5] = Vec3::new(f32::NAN, f32::INFINITY, -1.0);
        let layers = [
            Layer::rgb("", &picture),
            Layer::vectors("normal", ["X", "Y", "Z"], &picture.pixels, true),
            Layer::scalars("depth", "Z", vec![2.5; 37 * 21], false),
        ];
        write_exr(&path, 37, 21, &layers, Some("{\"a\":1}")).unwrap();
        let back = read(&path).unwrap();
        assert_eq!((back.width, back.height), (37, 21));
        for (a, b) in picture.pixels.iter().zip(&back.pixels) {
            assert_eq!(a.to_array().map(f32::to_bits), b.to_array().map(f32::to_bits));
        }
        assert_eq!(crate::panorama::dimensions(&path).unwrap(), (37, 21));
        let first = fs::read(&path).unwrap();
        write_exr(&path, 37, 21, &layers, Some("{\"a\":1}")).unwrap();
        assert!(first == fs::read(&path).unwrap(), "the same input must give the same bytes");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1, "temporary files must be gone");
    }

    #[test]
    fn a_png_shows_what_exposure_says() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        let picture = ramp(20, 10);
        write_png(&path, &picture, Exposure(0.003)).unwrap();
        let back = read(&path).unwrap();
        for (a, b) in picture.pixels.iter().zip(&back.pixels) {
            let shown = Exposure(0.003).show(*a);
            let stored = Vec3::from(b.to_array().map(crate::panorama::linear_to_srgb));
            assert!(shown.distance(stored) < 0.5 / 255.0 * 3f32.sqrt() + 1e-4, "{shown} {stored}");
        }
        assert!(write_png(&path, &Picture { width: 3, height: 0, pixels: vec![] }, Exposure(1.0)).is_err());
    }

    #[test]
    fn a_failure_leaves_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        let short = Layer::scalars("", "Y", vec![1.0; 3], false);
        assert!(matches!(write_exr(&path, 2, 2, &[short], None), Err(PanoramaError::Unwritable { .. })));
        let failed =
            write_atomically(&path, |e| PanoramaError::io(&path, e), |_| Err(PanoramaError::unwritable(&path, "test")));
        assert!(failed.is_err());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    }
}
