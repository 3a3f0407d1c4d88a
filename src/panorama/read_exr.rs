//! Reading OpenEXR: one layer's colour, placed in the display window.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use exr::block::{self, UncompressedBlock};
use exr::meta::MetaData;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::prelude::f16;
use glam::Vec3;
use rayon::prelude::*;

use super::read::{allocate, check_size};
use super::{PanoramaError, Picture};

type Result<T> = std::result::Result<T, PanoramaError>;

/// Where a picture's colour is stored: the layer and its channels by index.
struct Colour {
    layer: usize,
    channels: Channels,
}

/// How a layer stores colour.
enum Channels {
    Rgb([usize; 3]),
    Luminance(usize),
    /// Luminance and the chroma RY = (R − Y)/Y, BY = (B − Y)/Y at full resolution.
    Chroma([usize; 3]),
}

pub(super) fn dimensions(path: &Path, file: BufReader<File>) -> Result<(usize, usize)> {
    let meta = MetaData::read_from_buffered(file, false).map_err(|e| told(path, e))?;
    let colour = find_colour(path, &meta)?;
    checked_windows(path, &meta.headers[colour.layer])
}

pub(super) fn read(path: &Path, file: BufReader<File>) -> Result<Picture> {
    let reader = block::read(file, false).map_err(|e| told(path, e))?;
    let meta = reader.meta_data().clone();
    let colour = find_colour(path, &meta)?;
    let header = &meta.headers[colour.layer];
    let (width, height) = checked_windows(path, header)?;
    let mut picture = allocate(path, width, height)?;

    let wanted =
        |_: &MetaData, _, index: block::BlockIndex| index.layer == colour.layer && index.level == exr::math::Vec2(0, 0);
    let mut chunks = reader.filter_chunks(false, wanted).map_err(|e| told(path, e))?;
    loop {
        // decompress in the caller's own thread pool, a bounded batch at a time
        let batch = chunks.by_ref().take(64).collect::<exr::error::Result<Vec<_>>>().map_err(|e| told(path, e))?;
        if batch.is_empty() {
            break;
        }
        let blocks: Vec<_> =
            batch.into_par_iter().map(|chunk| UncompressedBlock::decompress_chunk(chunk, &meta, false)).collect();
        for block in blocks {
            place(&block.map_err(|e| told(path, e))?, header, &colour.channels, &mut picture);
        }
    }
    Ok(picture)
}

/// The first layer with R, G and B; those without a layer's name first; else the first with luminance.
fn find_colour(path: &Path, meta: &MetaData) -> Result<Colour> {
    let flat = || meta.headers.iter().enumerate().filter(|(_, h)| !h.deep);
    let choices: [fn(&Header) -> Option<Channels>; 4] = [plain_rgb, named_rgb, chroma, luminance];
    for choice in choices {
        if let Some((layer, channels)) = flat().find_map(|(i, h)| Some((i, choice(h)?))) {
            return Ok(Colour { layer, channels });
        }
    }
    if meta.headers.iter().all(|h| h.deep) {
        return Err(PanoramaError::unsupported(path, "deep OpenEXR data", "flatten it and export again"));
    }
    let names: Vec<_> = flat().flat_map(|(_, h)| h.channels.list.iter().map(|c| c.name.to_string())).collect();
    let what = format!("no colour among its channels ({})", names.join(", "));
    Err(PanoramaError::unsupported(path, what, "export it with channels R, G and B"))
}

fn find(header: &Header, name: &str) -> Option<usize> {
    header.channels.list.iter().position(|c| c.name.eq_case_insensitive(name))
}

fn plain_rgb(header: &Header) -> Option<Channels> {
    Some(Channels::Rgb([find(header, "R")?, find(header, "G")?, find(header, "B")?]))
}

fn named_rgb(header: &Header) -> Option<Channels> {
    header.channels.list.iter().find_map(|c| {
        let name = c.name.to_string();
        let prefix = name.strip_suffix(".R").or_else(|| name.strip_suffix(".r"))?;
        let of = |letter| find(header, &format!("{prefix}.{letter}"));
        Some(Channels::Rgb([of("R")?, of("G")?, of("B")?]))
    })
}

fn chroma(header: &Header) -> Option<Channels> {
    Some(Channels::Chroma([find(header, "RY")?, find(header, "Y")?, find(header, "BY")?]))
}

fn luminance(header: &Header) -> Option<Channels> {
    find(header, "Y").map(Channels::Luminance)
}

/// The size of the display window, after a look at all sizes that reading depends on.
fn checked_windows(path: &Path, header: &Header) -> Result<(usize, usize)> {
    check_size(path, header.layer_size.x() as u64, header.layer_size.y() as u64)?;
    let display = header.shared_attributes.display_window;
    check_size(path, display.size.x() as u64, display.size.y() as u64)
}

/// Copies one block's colour to where it lies in the display window; what lies outside is dropped.
fn place(block: &UncompressedBlock, header: &Header, channels: &Channels, picture: &mut Picture) {
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
                Channels::Chroma([ry, l, by]) => from_chroma(value(ry, column), value(l, column), value(by, column)),
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

/// RGB from OpenEXR's luminance and chroma, with Rec. 709 weights (*Technical Introduction to OpenEXR*,
/// "Luminance/Chroma Images").
fn from_chroma(ry: f32, y: f32, by: f32) -> Vec3 {
    let r = (ry + 1.0) * y;
    let b = (by + 1.0) * y;
    let g = (y - 0.2126 * r - 0.0722 * b) / 0.7152;
    Vec3::new(r, g, b)
}

fn told(path: &Path, error: exr::error::Error) -> PanoramaError {
    use exr::error::Error;
    match error {
        Error::NotSupported(what) => {
            PanoramaError::unsupported(path, what, "export it as an ordinary scan-line OpenEXR file")
        }
        Error::Invalid(what) => PanoramaError::damaged(path, what),
        Error::Io(source) => PanoramaError::io(path, source),
        Error::Aborted => PanoramaError::damaged(path, "reading stopped"),
    }
}
