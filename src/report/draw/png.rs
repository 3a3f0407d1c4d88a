//! PNG pictures of sheets, drawn by resvg from the very SVG that is shipped, with the one font that is shipped.

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::sync::{Arc, LazyLock};

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{self, fontdb};

use crate::report::error::ReportError;

const PLAIN: &[u8] = include_bytes!("font/DejaVuSans.ttf");
const BOLD: &[u8] = include_bytes!("font/DejaVuSans-Bold.ttf");

static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(PLAIN.to_vec());
    fonts.load_font_data(BOLD.to_vec());
    Arc::new(fonts)
});

/// How sheets are read: with no font of the system, so that the same sheet gives the same bytes everywhere.
pub(super) fn options(dpi: f32) -> usvg::Options<'static> {
    usvg::Options {
        fontdb: FONTS.clone(),
        font_family: "DejaVu Sans".into(),
        dpi, // a millimetre is dpi/25.4 pixels
        ..usvg::Options::default()
    }
}

/// A PNG file of an SVG sheet at `dpi` dots per inch (of the sheet's own millimetres).
///
/// # Errors
/// If the SVG cannot be read, or the picture would have no pixel or more than 2²⁸.
pub fn png(svg: &str, dpi: f32) -> Result<Vec<u8>, ReportError> {
    let bad = |what: String| ReportError::Drawing { what };
    let tree = usvg::Tree::from_str(svg, &options(dpi)).map_err(|e| bad(e.to_string()))?;
    let size = tree.size().to_int_size();
    let (width, height) = (size.width(), size.height());
    let too_large = u64::from(width) * u64::from(height) > 1 << 28;
    let pixmap = if too_large { None } else { Pixmap::new(width, height) };
    let mut pixmap = pixmap.ok_or_else(|| bad(format!("{width} × {height} pixels at {dpi} dpi")))?;
    resvg::render(&tree, Transform::default(), &mut pixmap.as_mut());
    pixmap.encode_png().map_err(|e| bad(e.to_string()))
}

/// A PNG file of pixels, rows from the top; `None` where the encoder refuses.
pub(in crate::report) fn encoded(
    pixels: &[u8],
    [width, height]: [usize; 2],
    kind: ExtendedColorType,
) -> Option<Vec<u8>> {
    let mut png = Vec::new();
    PngEncoder::new(&mut png).write_image(pixels, width as u32, height as u32, kind).ok()?;
    Some(png)
}

/// The width of a line of text in the unit of `size` (the em), without kerning. A letter that the font lacks counts as
/// wide as an `M`.
pub fn text_width(text: &str, size: f64, bold: bool) -> f64 {
    let Ok(face) = ttf_parser::Face::parse(if bold { BOLD } else { PLAIN }, 0) else {
        return 0.6 * size * text.chars().count() as f64;
    };
    let advance = |c| face.glyph_hor_advance(face.glyph_index(c)?);
    let units: f64 = text.chars().map(|c| f64::from(advance(c).or_else(|| advance('M')).unwrap_or(0))).sum();
    units / f64::from(face.units_per_em()) * size
}

/// Words that begin with a capital.
pub(in crate::report) fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().into_iter().flat_map(char::to_uppercase).chain(letters).collect()
}

/// The text broken into lines no wider than `width` where its spaces allow.
pub fn wrap(text: &str, width: f64, size: f64, bold: bool) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(&format!("{line} {word}"), size, bold) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}
