//! Reading OpenEXR: one layer's colour, placed in the display window.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use exr::block::{self, UncompressedBlock};
use exr::meta::MetaData;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::prelude::f16;
use glam::{DMat3, DVec2, Vec3};
use rayon::prelude::*;

use super::dwa;
use super::limits::{Result, allocate, check_size, picture_bytes};
use crate::memory;
use crate::panorama::primaries::{Primaries, converted};
use crate::panorama::{PanoramaError, Picture};

/// How a layer stores colour: its channels by index.
enum Channels {
    Rgb([usize; 3]),
    Luminance(usize),
    /// Luminance and the chroma RY = (R − Y)/Y, BY = (B − Y)/Y at full resolution.
    Chroma([usize; 3]),
}

pub(crate) fn dimensions(path: &Path, file: BufReader<File>) -> Result<(usize, usize)> {
    let meta = MetaData::read_from_buffered(file, false).map_err(|e| decode_error(path, e))?;
    let (layer, _) = find_colour(path, &meta)?;
    checked_windows(path, &meta.headers[layer])
}

pub(crate) fn read(path: &Path, file: BufReader<File>) -> Result<Picture> {
    let reader = block::read(file, false).map_err(|e| decode_error(path, e))?;
    let meta = reader.meta_data().clone();
    let (layer, channels) = find_colour(path, &meta)?;
    let header = &meta.headers[layer];
    let (width, height) = checked_windows(path, header)?;
    let primaries = primaries(header);
    let unusable = || PanoramaError::damaged(path, "its chromaticities span no colour space");
    let weights = primaries.weights().ok_or_else(unusable)?;
    let to_rec709 = primaries.to_rec709().ok_or_else(unusable)?;
    let wanted =
        |_: &MetaData, _, index: block::BlockIndex| index.layer == layer && index.level == exr::math::Vec2(0, 0);
    let at_once = blocks_at_once(path, header, picture_bytes(width as u64, height as u64))?;
    let mut chunks = reader.filter_chunks(false, wanted).map_err(|e| decode_error(path, e))?;
    // only once the first pixels prove right: a lying header must not cost memory
    let mut picture = None;
    loop {
        // decompress in the caller's own thread pool, a bounded batch at a time
        let batch =
            chunks.by_ref().take(at_once).collect::<exr::error::Result<Vec<_>>>().map_err(|e| decode_error(path, e))?;
        if batch.is_empty() {
            break;
        }
        for chunk in &batch {
            if !dwa::counts_fit(chunk, header).map_err(|e| decode_error(path, e))? {
                return Err(PanoramaError::damaged(path, "a compressed block claims to hold more than fits"));
            }
        }
        let blocks: Vec<_> =
            batch.into_par_iter().map(|chunk| UncompressedBlock::decompress_chunk(chunk, &meta, false)).collect();
        for block in blocks {
            let block = block.map_err(|e| decode_error(path, e))?;
            let picture = match &mut picture {
                Some(picture) => picture,
                none => none.insert(allocate(path, width, height)?),
            };
            place(&block, header, &channels, weights, picture);
        }
    }
    let mut picture = picture.ok_or_else(|| PanoramaError::damaged(path, "it holds no pixels"))?;
    if to_rec709 != DMat3::IDENTITY {
        picture.pixels.par_iter_mut().for_each(|p| *p = converted(&to_rec709, *p));
    }
    Ok(picture)
}

/// What may be a picture's light: the layer's name, or the part's, empty without one; the part; and how it stores colour.
type Candidate = (String, usize, Channels);

/// Least is best: what is surely not light last, then R, G and B before chroma and luminance, then by its name.
fn order((name, _, channels): &Candidate) -> (bool, u8, u8) {
    let kind = match channels {
        Channels::Rgb(_) => 0,
        Channels::Chroma(_) => 1,
        Channels::Luminance(_) => 2,
    };
    let rank = rank(name);
    (rank == NOT_LIGHT, kind, rank)
}

/// The rank of passes that hold no light, or a part of it.
const NOT_LIGHT: u8 = 4;

/// How surely a layer of this name is the light of all passes: by its last word, which in stereo comes before the eye's.
fn rank(name: &str) -> u8 {
    let name = name.to_lowercase();
    match name.rsplit('.').find(|word| !matches!(*word, "left" | "right")).unwrap_or("") {
        // as `render --layers` names it
        "radiance" => 0,
        "" => 1,
        "combined" | "beauty" | "rgba" | "rgb" | "c" | "color" | "composite" => 2,
        "ao" | "albedo" | "diffcol" | "glosscol" | "transcol" | "normal" | "n" | "position" | "depth" | "shadow"
        | "emit" => NOT_LIGHT,
        word if word.starts_with("crypto") || word.starts_with("denoising") => NOT_LIGHT,
        _ => 3,
    }
}

/// Of all layers and parts with colour the one that is light, as far as names tell; the file's first of those alike. Its part,
/// and how that stores it.
fn find_colour(path: &Path, meta: &MetaData) -> Result<(usize, Channels)> {
    let flat = || meta.headers.iter().enumerate().filter(|(_, h)| !h.deep);
    let candidates: Vec<Candidate> = flat()
        .flat_map(|(layer, header)| {
            let part = header.own_attributes.layer_name.as_ref().map_or_else(String::new, |name| name.to_string());
            let plain = unnamed(header).map(move |channels| (part.clone(), channels));
            plain.chain(named_rgb(header)).map(move |(name, channels)| (name, layer, channels))
        })
        .collect();
    let names: Vec<_> = candidates.iter().map(|(name, ..)| name.clone()).collect();
    match candidates.into_iter().min_by_key(order) {
        Some((name, layer, channels)) if rank(&name) < NOT_LIGHT => return Ok((layer, channels)),
        Some(_) => {
            let what = format!("no light among its layers of colour ({})", names.join(", "));
            let cure = "export it with the combined picture, as channels R, G and B";
            return Err(PanoramaError::unsupported(path, what, cure));
        }
        None => {}
    }
    if meta.headers.iter().all(|h| h.deep) {
        return Err(deep(path));
    }
    let names: Vec<_> = flat().flat_map(|(_, h)| h.channels.list.iter().map(|c| c.name.to_string())).collect();
    let what = format!("no colour among its channels ({})", names.join(", "));
    Err(PanoramaError::unsupported(path, what, "export it with channels R, G and B"))
}

fn find(header: &Header, name: &str) -> Option<usize> {
    header.channels.list.iter().position(|c| c.name.eq_case_insensitive(name))
}

fn three(header: &Header, names: [&str; 3]) -> Option<[usize; 3]> {
    let [a, b, c] = names.map(|name| find(header, name));
    Some([a?, b?, c?])
}

/// A part's own colour, in each way that it is stored in.
fn unnamed(header: &Header) -> impl Iterator<Item = Channels> {
    let rgb = three(header, ["R", "G", "B"]).map(Channels::Rgb);
    let chroma = three(header, ["RY", "Y", "BY"]).map(Channels::Chroma);
    [rgb, chroma, find(header, "Y").map(Channels::Luminance)].into_iter().flatten()
}

/// The named layers of colour within a part.
fn named_rgb(header: &Header) -> impl Iterator<Item = (String, Channels)> + '_ {
    header.channels.list.iter().filter_map(move |channel| {
        let name = channel.name.to_string();
        let prefix = name.strip_suffix(".R").or_else(|| name.strip_suffix(".r"))?;
        let [r, g, b] = ["R", "G", "B"].map(|letter| format!("{prefix}.{letter}"));
        Some((prefix.to_owned(), Channels::Rgb(three(header, [&r, &g, &b])?)))
    })
}

/// The file's own primaries, Rec. 709 where it states none.
fn primaries(header: &Header) -> Primaries {
    let xy = |c: exr::math::Vec2<f32>| DVec2::new(c.x().into(), c.y().into());
    let stated = header.shared_attributes.chromaticities;
    stated.map_or(Primaries::REC709, |c| Primaries {
        red: xy(c.red),
        green: xy(c.green),
        blue: xy(c.blue),
        white: xy(c.white),
    })
}

/// The size of the display window, after a look at all sizes that reading depends on.
fn checked_windows(path: &Path, header: &Header) -> Result<(usize, usize)> {
    check_size(path, header.layer_size.x() as u64, header.layer_size.y() as u64)?;
    let display = header.shared_attributes.display_window;
    check_size(path, display.size.x() as u64, display.size.y() as u64)
}

/// How many blocks to decompress at once, so that they take little beside the picture.
fn blocks_at_once(path: &Path, header: &Header, picture: u64) -> Result<usize> {
    /// Blocks that are smaller together are decompressed at once, if no more than 64.
    const IN_FLIGHT: u64 = 128 << 20;
    let exr::math::Vec2(width, height) = header.max_block_pixel_size();
    let pixels = (width as u64).saturating_mul(height as u64);
    let block = pixels.saturating_mul(header.channels.bytes_per_pixel as u64);
    let at_once = (IN_FLIGHT / block.max(1)).clamp(1, 64);
    // each is there compressed, decompressed, and in between
    let blocks = block.saturating_mul(3 * at_once);
    memory::check(picture.saturating_add(blocks)).map_err(|over| PanoramaError::memory(path, over))?;
    Ok(at_once as usize)
}

/// Copies one block's colour to where it lies in the display window; what lies outside is dropped.
fn place(block: &UncompressedBlock, header: &Header, channels: &Channels, weights: Vec3, picture: &mut Picture) {
    let list = &header.channels.list;
    let width = block.index.pixel_size.x();
    let mut offset = 0;
    let starts: Vec<_> = list
        .iter()
        .map(|c| {
            let start = offset;
            offset += width * c.sample_type.bytes_per_sample();
            start
        })
        .collect();
    let line_bytes = offset;
    let display = header.shared_attributes.display_window.position;
    let shift = header.own_attributes.layer_position;
    let left = block.index.pixel_position.x() as i64 + i64::from(shift.x()) - i64::from(display.x());
    let top = block.index.pixel_position.y() as i64 + i64::from(shift.y()) - i64::from(display.y());

    for row in 0..block.index.pixel_size.y() {
        let Some(y) = within(top + row as i64, picture.height) else { continue };
        let Some(line) = block.data.get(row * line_bytes..(row + 1) * line_bytes) else { continue };
        let value = |channel: usize, x: usize| sample(&line[starts[channel]..], list[channel].sample_type, x);
        for column in 0..width {
            let Some(x) = within(left + column as i64, picture.width) else { continue };
            picture.pixels[y * picture.width + x] = match *channels {
                Channels::Rgb([r, g, b]) => Vec3::new(value(r, column), value(g, column), value(b, column)),
                Channels::Luminance(l) => Vec3::splat(value(l, column)),
                Channels::Chroma([ry, l, by]) => {
                    from_chroma(weights, value(ry, column), value(l, column), value(by, column))
                }
            };
        }
    }
}

fn within(i: i64, len: usize) -> Option<usize> {
    usize::try_from(i).ok().filter(|&i| i < len)
}

fn sample(line: &[u8], kind: SampleType, x: usize) -> f32 {
    match kind {
        SampleType::F16 => f16::from_ne_bytes([line[2 * x], line[2 * x + 1]]).to_f32(),
        SampleType::F32 => f32::from_ne_bytes(four(line, x)),
        SampleType::U32 => u32::from_ne_bytes(four(line, x)) as f32,
    }
}

fn four(line: &[u8], x: usize) -> [u8; 4] {
    [line[4 * x], line[4 * x + 1], line[4 * x + 2], line[4 * x + 3]]
}

/// RGB from OpenEXR's luminance and chroma (*Technical Introduction to OpenEXR*, "Luminance/Chroma Images"); the
/// weights are the primaries' luminances.
fn from_chroma(weights: Vec3, ry: f32, y: f32, by: f32) -> Vec3 {
    let r = (ry + 1.0) * y;
    let b = (by + 1.0) * y;
    let g = (y - weights.x * r - weights.z * b) / weights.y;
    Vec3::new(r, g, b)
}

fn deep(path: &Path) -> PanoramaError {
    PanoramaError::unsupported(path, "deep OpenEXR data, many samples a pixel", "flatten it and export it again")
}

fn decode_error(path: &Path, error: exr::error::Error) -> PanoramaError {
    use exr::error::Error;
    match error {
        Error::NotSupported(what) if what.contains("deep") => deep(path),
        Error::NotSupported(what) => {
            PanoramaError::unsupported(path, what, "export it as an ordinary scan-line OpenEXR file")
        }
        Error::Invalid(what) if what == "reference to missing bytes" => {
            PanoramaError::damaged(path, "it is cut short, or its header points past its end")
        }
        Error::Invalid(what) if what.contains("exceeding integer maximum") => {
            PanoramaError::damaged(path, "its header claims an impossible size")
        }
        Error::Invalid(what) => PanoramaError::damaged(path, what),
        Error::Io(source) => PanoramaError::io(path, source),
        Error::Aborted => PanoramaError::damaged(path, "reading stopped"),
    }
}

#[cfg(test)]
mod tests {
    use crate::panorama::read;
    use crate::panorama::{PanoramaError, dimensions};
    use exr::meta::attribute::Chromaticities;
    use exr::prelude::{
        AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds,
        Layer, LayerAttributes, LineOrder, Text, Vec2, WritableImage, f16,
    };
    use glam::Vec3;
    use std::path::PathBuf;

    fn ramp(count: usize, scale: f32) -> FlatSamples {
        FlatSamples::F32((0..count).map(|i| i as f32 * scale).collect())
    }

    fn layer(
        size: (usize, usize),
        attributes: LayerAttributes,
        encoding: Encoding,
        channels: Vec<(&str, FlatSamples)>,
    ) -> Layer<AnyChannels<FlatSamples>> {
        let list = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
        Layer::new(size, attributes, encoding, AnyChannels::sort(list))
    }

    fn written(
        name: &str,
        display: IntegerBounds,
        layers: Vec<Layer<AnyChannels<FlatSamples>>>,
    ) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        Image::from_layers(ImageAttributes::new(display), layers).write().to_file(&path).unwrap();
        (folder, path)
    }

    fn bounds(x: i32, y: i32, width: usize, height: usize) -> IntegerBounds {
        IntegerBounds::new((x, y), (width, height))
    }

    #[test]
    fn colour_is_found_in_a_named_layer_beside_others() {
        let lossless = Encoding::SMALL_LOSSLESS;
        let depth = layer((4, 3), LayerAttributes::named("depth"), lossless, vec![("Z", ramp(12, 1.0))]);
        let beauty = vec![
            ("beauty.B", ramp(12, 3.0)),
            ("beauty.G", FlatSamples::F16((0..12).map(|i| f16::from_f32(i as f32 * 2.0)).collect())),
            ("beauty.R", FlatSamples::U32((0..12).collect())),
            ("normal.X", ramp(12, 9.0)),
        ];
        let beauty = layer((4, 3), LayerAttributes::named("beauty"), lossless, beauty);
        let (_folder, path) = written("layers.exr", bounds(0, 0, 4, 3), vec![depth, beauty]);
        let picture = read(&path).unwrap();
        for (i, p) in picture.pixels.iter().enumerate() {
            assert_eq!(*p, Vec3::new(1.0, 2.0, 3.0) * i as f32);
        }
    }

    #[test]
    fn plain_colour_goes_before_named_and_luminance_before_nothing() {
        let channels = ["R", "G", "B", "a.R", "a.G", "a.B"].map(|n| (n, ramp(4, if n.len() == 1 { 1.0 } else { 7.0 })));
        let both = layer((2, 2), LayerAttributes::default(), Encoding::FAST_LOSSLESS, channels.to_vec());
        let (_folder, path) = written("both.exr", bounds(0, 0, 2, 2), vec![both]);
        assert_eq!(read(&path).unwrap().pixels[3], Vec3::splat(3.0));

        // as `render --layers` writes it
        let names = ["albedo.B", "albedo.G", "albedo.R", "radiance.B", "radiance.G", "radiance.R"];
        let channels = names.map(|n| (n, ramp(4, if n.starts_with('a') { 7.0 } else { 1.0 })));
        let layered = layer((2, 2), LayerAttributes::default(), Encoding::FAST_LOSSLESS, channels.to_vec());
        let (_folder, path) = written("layered.exr", bounds(0, 0, 2, 2), vec![layered]);
        assert_eq!(read(&path).unwrap().pixels[3], Vec3::splat(3.0));

        let grey = layer((2, 2), LayerAttributes::default(), Encoding::UNCOMPRESSED, vec![("Y", ramp(4, 0.5))]);
        let (_folder, path) = written("grey.exr", bounds(0, 0, 2, 2), vec![grey]);
        assert_eq!(read(&path).unwrap().pixels[3], Vec3::splat(1.5));

        let none = layer((2, 2), LayerAttributes::default(), Encoding::UNCOMPRESSED, vec![("Z", ramp(4, 0.5))]);
        let (_folder, path) = written("none.exr", bounds(0, 0, 2, 2), vec![none]);
        let error = read(&path).unwrap_err();
        assert!(matches!(&error, PanoramaError::Unsupported { what, .. } if what.contains('Z')), "{error}");
    }

    #[test]
    fn of_several_passes_the_one_that_is_light_is_taken() {
        let channels = |prefixes: &[(&str, f32)]| -> Vec<(String, FlatSamples)> {
            let of = |&(prefix, scale): &(&str, f32)| ["R", "G", "B"].map(|c| (format!("{prefix}{c}"), ramp(4, scale)));
            prefixes.iter().flat_map(of).collect()
        };
        let part = |name: Option<&str>, prefixes: &[(&str, f32)]| {
            let attributes = name.map_or_else(LayerAttributes::default, |n| LayerAttributes::named(Text::from(n)));
            let all = channels(prefixes);
            let all = all.iter().map(|(name, samples)| (name.as_str(), samples.clone())).collect();
            layer((2, 2), attributes, Encoding::FAST_LOSSLESS, all)
        };
        let cases = [
            vec![part(None, &[("ViewLayer.AO.", 7.0), ("ViewLayer.Combined.", 1.0)])],
            vec![part(None, &[("Albedo.", 7.0), ("C.", 1.0)])],
            vec![part(Some("albedo"), &[("", 7.0)]), part(Some("beauty"), &[("", 1.0)])],
            vec![part(None, &[("V.AO.left.", 7.0), ("V.Combined.left.", 1.0)])],
        ];
        for (i, layers) in cases.into_iter().enumerate() {
            let (_folder, path) = written("passes.exr", bounds(0, 0, 2, 2), layers);
            assert_eq!(read(&path).unwrap().pixels[3], Vec3::splat(3.0), "case {i}");
        }
        let layers = vec![part(None, &[("AO.", 1.0), ("Denoising Albedo.", 1.0)])];
        let (_folder, path) = written("none.exr", bounds(0, 0, 2, 2), layers);
        let error = read(&path).unwrap_err().to_string();
        assert!(error.contains("AO, Denoising Albedo"), "{error}");
    }

    #[test]
    fn a_data_window_lies_where_it_belongs_in_the_display_window() {
        let attributes = LayerAttributes::default().with_position(Vec2(-3, 5));
        let channels = ["R", "G", "B"].map(|n| (n, ramp(8 * 4, 1.0))).to_vec();
        let crop = layer((8, 4), attributes, Encoding::SMALL_LOSSLESS, channels);
        let (_folder, path) = written("crop.exr", bounds(-1, 2, 10, 6), vec![crop]);
        assert_eq!(dimensions(&path).unwrap(), (10, 6));
        let picture = read(&path).unwrap();
        for (i, p) in picture.pixels.iter().enumerate() {
            let (x, y) = ((i % 10) as i32 - 1, (i / 10) as i32 + 2);
            let inside = (-3..5).contains(&x) && (5..9).contains(&y);
            let expected = if inside { ((y - 5) * 8 + x + 3) as f32 } else { 0.0 };
            assert_eq!(*p, Vec3::splat(expected), "({x}, {y})");
        }
    }

    #[test]
    fn other_primaries_become_rec_709() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("aces.exr");
        let channels = ["R", "G", "B"].map(|n| (n, ramp(4, 1.0))).to_vec();
        let layer = layer((2, 2), LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);
        let mut image = Image::from_layers(ImageAttributes::new(bounds(0, 0, 2, 2)), vec![layer]);
        image.attributes.chromaticities = Some(Chromaticities {
            red: Vec2(0.7347, 0.2653),
            green: Vec2(0.0, 1.0),
            blue: Vec2(0.0001, -0.077),
            white: Vec2(0.32168, 0.33767),
        });
        image.write().to_file(&path).unwrap();
        // grey is grey in any primaries
        assert!(read(&path).unwrap().pixels[3].distance(Vec3::splat(3.0)) < 1e-5);
        image.attributes.chromaticities.as_mut().unwrap().green = Vec2(0.7347, 0.2653);
        image.write().to_file(&path).unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("chromaticities"));
    }

    #[test]
    fn tiles_and_any_line_order_are_read() {
        for line_order in [LineOrder::Increasing, LineOrder::Decreasing] {
            for blocks in [Blocks::Tiles(Vec2(7, 5)), Blocks::ScanLines] {
                for compression in [Compression::PIZ, Compression::ZIP16, Compression::RLE, Compression::Uncompressed] {
                    let encoding = Encoding { compression, blocks, line_order };
                    let channels = ["A", "B", "G", "R"].map(|n| (n, ramp(300, 0.25))).to_vec();
                    let layer = layer((20, 15), LayerAttributes::named(Text::from("x")), encoding, channels);
                    let (_folder, path) = written("tiles.exr", bounds(0, 0, 20, 15), vec![layer]);
                    let picture = read(&path).unwrap();
                    assert!(picture.pixels.iter().enumerate().all(|(i, p)| *p == Vec3::splat(i as f32 * 0.25)));
                }
            }
        }
    }
}
