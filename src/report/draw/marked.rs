//! A photograph with the audit's findings marked on it.

use image::{ExtendedColorType, GrayImage, Rgb, RgbImage, Rgba, RgbaImage};

use super::png::{encoded, png};
use super::style::{BLACK, GREY, Style};
use super::svg::{Anchor, Svg, Text};
use crate::report::error::ReportError;

/// A finding to mark.
#[derive(Clone, Debug)]
pub struct Mark {
    /// What stands beside it.
    pub id: String,
    /// `texture` or `geometry`; anything else is marked as ambiguous.
    pub kind: String,
    /// White where the finding is, of the photograph's size.
    pub mask: GrayImage,
    /// Pixels: left, top, right, bottom.
    pub bbox: [f64; 4],
}

/// Stripes that tell kinds apart without colour, and a colour-blind safe colour: geometry has level stripes, texture
/// slanting ones, the rest dots.
fn ink(kind: &str, x: u32, y: u32, period: u32) -> (bool, Rgb<u8>) {
    let third = (period / 3).max(1);
    match kind {
        "geometry" => (y % period < third, Rgb([0xd5, 0x5e, 0x00])),
        "texture" => ((x + y) % period < third, Rgb([0x00, 0x72, 0xb2])),
        _ => (x % period < third && y % period < third, Rgb([0x60, 0x60, 0x60])),
    }
}

/// The photograph in grey with each finding striped in its colour, outlined, and named; a PNG file of the photograph's
/// size. A mask of another size is left out.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn marked(photo: &RgbImage, marks: &[Mark]) -> Result<Vec<u8>, ReportError> {
    let (width, height) = photo.dimensions();
    let mut picture = RgbaImage::from_fn(width, height, |x, y| {
        let Rgb([r, g, b]) = *photo.get_pixel(x, y);
        let grey = (0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b)) as u8;
        // paler, so that marks stand out
        let grey = 60 + (u16::from(grey) * 195 / 255) as u8;
        Rgba([grey, grey, grey, 255])
    });
    let unit = (width.max(height) / 256).max(1);
    let fitting = || marks.iter().filter(|m| m.mask.dimensions() == (width, height));
    for mark in fitting() {
        let inside = |x: i64, y: i64| {
            (0..i64::from(width)).contains(&x)
                && (0..i64::from(height)).contains(&y)
                && mark.mask.get_pixel(x as u32, y as u32).0[0] > 127
        };
        for (x, y, pixel) in picture.enumerate_pixels_mut() {
            let (cx, cy) = (i64::from(x), i64::from(y));
            if !inside(cx, cy) {
                continue;
            }
            let u = i64::from(unit);
            let rim = [(-u, 0), (u, 0), (0, -u), (0, u)].iter().any(|(dx, dy)| !inside(cx + dx, cy + dy));
            let (striped, colour) = ink(&mark.kind, x, y, 6 * unit);
            let Rgb([r, g, b]) = colour;
            if rim {
                *pixel = Rgba([r / 3, g / 3, b / 3, 255]);
            } else if striped {
                *pixel = Rgba([r, g, b, 255]);
            }
        }
    }
    let bytes = encoded(&picture, [width, height].map(|n| n as usize), ExtendedColorType::Rgba8)
        .ok_or_else(|| ReportError::Drawing { what: format!("{width} × {height} pixels as PNG") })?;
    let (w, h) = (f64::from(width), f64::from(height));
    let mut svg = Svg::new(w, h, "Findings", "");
    svg.png([0.0, 0.0, w, h], &bytes, "photograph");
    let size = (w.max(h) / 28.0).max(8.0);
    for mark in fitting() {
        let [x0, y0, x1, y1] = mark.bbox;
        let unit = f64::from(unit);
        svg.rectangle([x0, y0, x1 - x0, y1 - y0], &Style::line(GREY, unit).dashed(4.0 * unit, 3.0 * unit));
        let y = if y0 > 1.3 * size { y0 - 0.3 * size } else { (y1 + size).min(h - 0.2 * size) };
        let x = (0.5 * (x0 + x1)).clamp(2.0 * size, (w - 2.0 * size).max(2.0 * size));
        svg.text([x, y], &mark.id, &Text::new(size).bold().anchor(Anchor::Middle).halo(0.2 * size).colour(BLACK));
    }
    // one pixel a millimetre of the sheet
    png(&svg.finish(), 25.4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_differ_in_colour_and_in_grey_pattern() {
        let photo = RgbImage::from_pixel(256, 128, Rgb([200, 200, 200]));
        let mask = |from: u32| {
            let inside = |x: u32, y: u32| (from..from + 60).contains(&x) && (40..100).contains(&y);
            GrayImage::from_fn(256, 128, |x, y| image::Luma([if inside(x, y) { 255 } else { 0 }]))
        };
        let mark = |id: &str, kind: &str, x: u32| Mark {
            id: id.into(),
            kind: kind.into(),
            mask: mask(x),
            bbox: [f64::from(x), 40.0, f64::from(x) + 60.0, 100.0],
        };
        let small = Mark { mask: GrayImage::new(3, 3), ..mark("T9", "texture", 0) };
        let bytes = marked(&photo, &[mark("G1", "geometry", 20), mark("T1", "texture", 150), small]).unwrap();
        let picture = image::load_from_memory(&bytes).unwrap().to_luma8();
        assert_eq!(picture.dimensions(), (256, 128));
        // level stripes are the same along a row, slanting ones are not
        let row = |y: u32, from: u32| (from..from + 40).map(|x| picture.get_pixel(x, y).0[0]).collect::<Vec<_>>();
        let flat = |r: Vec<u8>| r.iter().all(|v| v.abs_diff(r[0]) < 4);
        assert!((50..90).all(|y| flat(row(y, 30))), "geometry has level stripes");
        assert!((50..90).all(|y| !flat(row(y, 160))), "texture has slanting stripes");
        assert!((0..30).all(|y| picture.get_pixel(245, y).0[0] > 200), "elsewhere the photograph stays");
    }
}
