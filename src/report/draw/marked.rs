//! A photograph with the audit's findings marked on it.

use image::ExtendedColorType;

use super::png::{encoded, png};
use super::style::{BLACK, GREY, Style};
use super::svg::{Anchor, Svg, Text};
use crate::audit::{Audit, Kind};
use crate::panorama::{Exposure, Picture};
use crate::report::error::ReportError;

/// Stripes that tell kinds apart without colour, and a colour-blind safe colour: geometry has level stripes, texture
/// slanting ones, doubts dots.
fn ink(kind: Option<Kind>, x: usize, y: usize, period: usize) -> (bool, [u8; 3]) {
    let third = (period / 3).max(1);
    match kind {
        Some(Kind::Geometry) => (y % period < third, [0xd5, 0x5e, 0x00]),
        Some(Kind::Texture) => ((x + y) % period < third, [0x00, 0x72, 0xb2]),
        None => (x % period < third && y % period < third, [0x60, 0x60, 0x60]),
    }
}

/// A view's photograph in grey with each finding and doubt that this view shows best striped in its colour, outlined, and
/// named; a PNG file of the photograph's size. `None` where there is nothing to mark.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn marked(audit: &Audit, view: &str, photo: &Picture, exposure: Exposure) -> Result<Option<Vec<u8>>, ReportError> {
    let (width, height) = (photo.width, photo.height);
    let masks = audit.views.iter().filter(|v| v.summary.view == view).flat_map(|v| &v.masks);
    let masks: Vec<_> = masks.filter(|(_, mask)| mask.len() == width * height).collect();
    let found = audit.findings.iter().map(|f| (f, Some(f.kind))).chain(audit.doubts.iter().map(|f| (f, None)));
    let marks: Vec<_> = found
        .filter(|(finding, _)| finding.view == view)
        .filter_map(|(finding, kind)| Some((finding, kind, &masks.iter().find(|(id, _)| *id == finding.id)?.1)))
        .collect();
    if marks.is_empty() {
        return Ok(None);
    }
    let grey = |p: &glam::Vec3| {
        let [r, g, b] = (exposure.show(*p) * 255.0 + 0.5).to_array().map(|v| f32::from(v as u8));
        let grey = (0.2126 * r + 0.7152 * g + 0.0722 * b) as u8;
        // paler, so that marks stand out
        let grey = 60 + (u16::from(grey) * 195 / 255) as u8;
        [grey, grey, grey, 255]
    };
    let mut pixels: Vec<[u8; 4]> = photo.pixels.iter().map(grey).collect();
    let unit = (width.max(height) / 256).max(1);
    for (_, kind, mask) in &marks {
        let inside = |x: usize, y: usize| x < width && y < height && mask[y * width + x];
        for (i, pixel) in pixels.iter_mut().enumerate().filter(|(i, _)| mask[*i]) {
            let (x, y) = (i % width, i / width);
            // beyond the left and upper edge, numbers wrap around to beyond the right and lower one
            let around = [(x.wrapping_sub(unit), y), (x + unit, y), (x, y.wrapping_sub(unit)), (x, y + unit)];
            let (striped, [r, g, b]) = ink(*kind, x, y, 6 * unit);
            if around.into_iter().any(|(x, y)| !inside(x, y)) {
                *pixel = [r / 3, g / 3, b / 3, 255];
            } else if striped {
                *pixel = [r, g, b, 255];
            }
        }
    }
    let bytes = encoded(pixels.as_flattened(), [width, height], ExtendedColorType::Rgba8)
        .ok_or_else(|| ReportError::Drawing { what: format!("{width} × {height} pixels as PNG") })?;
    let (w, h) = (width as f64, height as f64);
    let mut svg = Svg::new(w, h, "Findings", "");
    svg.png([0.0, 0.0, w, h], &bytes, "photograph");
    let size = (w.max(h) / 28.0).max(8.0);
    for (finding, ..) in &marks {
        let [x0, y0, x1, y1] = finding.bbox.map(f64::from);
        let unit = unit as f64;
        svg.rectangle([x0, y0, x1 - x0, y1 - y0], &Style::line(GREY, unit).dashed(4.0 * unit, 3.0 * unit));
        let y = if y0 > 1.3 * size { y0 - 0.3 * size } else { (y1 + size).min(h - 0.2 * size) };
        let x = (0.5 * (x0 + x1)).clamp(2.0 * size, (w - 2.0 * size).max(2.0 * size));
        svg.text([x, y], &finding.id, &Text::new(size).bold().anchor(Anchor::Middle).halo(0.2 * size).colour(BLACK));
    }
    // one pixel a millimetre of the sheet
    png(&svg.finish(), 25.4).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::{Finding, testing};

    #[test]
    fn kinds_differ_in_colour_and_in_grey_pattern() {
        let mut view = testing::view(testing::summary("v", [256, 128]));
        let photo = view.photograph.clone();
        let mut finding = |id: &str, kind: Kind, from: u32| {
            let inside = |i: usize| (from..from + 60).contains(&(i as u32 % 256)) && (40..100).contains(&(i / 256));
            view.masks.push((id.to_owned(), (0..256 * 128).map(inside).collect()));
            Finding { kind, bbox: [from, 40, from + 60, 100], ..testing::finding(id, "v") }
        };
        let findings = vec![finding("F1", Kind::Geometry, 20), finding("F2", Kind::Texture, 150)];
        let audit = testing::audit(view, findings);
        let exposure = Exposure::of(&photo);
        let bytes = marked(&audit, "v", &photo, exposure).unwrap().unwrap();
        let picture = image::load_from_memory(&bytes).unwrap().to_luma8();
        assert_eq!(picture.dimensions(), (256, 128));
        // level stripes are the same along a row, slanting ones are not
        let row = |y: u32, from: u32| (from..from + 40).map(|x| picture.get_pixel(x, y).0[0]).collect::<Vec<_>>();
        let flat = |r: Vec<u8>| r.iter().all(|v| v.abs_diff(r[0]) < 4);
        assert!((50..90).all(|y| flat(row(y, 30))), "geometry has level stripes");
        assert!((50..90).all(|y| !flat(row(y, 160))), "texture has slanting stripes");
        assert!(
            (0..30).all(|y| picture.get_pixel(245, y) == picture.get_pixel(0, 0)),
            "elsewhere the photograph stays"
        );
        assert!(marked(&audit, "another", &photo, exposure).unwrap().is_none());
        assert!(marked(&audit, "v", &Picture::new(3, 3), exposure).unwrap().is_none(), "a photograph of another size");
    }
}
