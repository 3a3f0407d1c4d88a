//! The pictures of an audit sheet: photograph, the model relit and in neutral light, and what the audit says.

use glam::Vec3;

use super::labels::apart;
use super::outline::Cells;
use super::subject::{AuditSheet, look, look_of, verdict_of};
use crate::audit::{Audit, AuditedView, Finding, Verdict};
use crate::panorama::{Exposure, Picture, linear_to_srgb, luminance};
use crate::report::draw::png::encoded;
use crate::report::style::{BLACK, Hatch, Style, WHITE};
use crate::report::{Anchor, Point, ReportError, Svg, Text};

/// Cells along a picture's longer side in which regions are drawn.
const CELLS: usize = 320;

/// About how long a picture's longer side is on a sheet, millimetres.
const PRINTED: f64 = 80.0;

/// Room that a finding's name takes on a sheet, millimetres.
const LABEL: f64 = 8.0;

/// Pixels along the longer side of a picture on the sheet.
const PIXELS: usize = 720;

/// Draws the pictures side by side from the upper left corner `at`, each at most this wide and high; gives the
/// size of one.
pub(super) fn draw(svg: &mut Svg, about: &AuditSheet, at: Point, most: [f64; 2], gap: f64) -> [f64; 2] {
    let view = about.view();
    let [pw, ph] = view.summary.size.map(f64::from);
    let scale = (most[0] / pw).min(most[1] / ph);
    let (w, h) = (pw * scale, ph * scale);
    let exposure = Exposure::of(&view.photograph);
    let shown = shown(about.audit, view);
    let frames = [0.0, 1.0, 2.0, 3.0].map(|i| [at[0] + i * (w + gap), at[1], w, h]);
    // relit from what the probes saw of the real room, the model's own wrong colours hardly show
    let titles = ["Photograph", "Model in the probes' light", "Model in neutral light", "What the audit says"];
    for (frame, title) in frames.iter().zip(titles) {
        svg.text([frame[0], frame[1] - 1.8], title, &Text::new(3.2).bold());
    }
    svg.group("photograph", "photograph", |svg| {
        picture(svg, frames[0], &view.photograph, "The photograph", |p| exposure.show(p));
        outlines(svg, &shown, frames[0], 1.0);
    });
    svg.group("render", "render", |svg| {
        picture(svg, frames[1], &view.render, "The model, relit from the probes", |p| exposure.show(p));
    });
    svg.group("neutral", "neutral", |svg| {
        picture(svg, frames[2], &view.neutral, "The model's own colours, in neutral light", in_neutral_light);
    });
    svg.group("classified", "classified", |svg| {
        picture(svg, frames[3], &view.photograph, "The photograph, pale, below the audit's verdicts", |p| {
            pale(exposure, p)
        });
        for verdict in [Verdict::Untestable, Verdict::Ambiguous, Verdict::Texture, Verdict::Geometry] {
            svg.group(verdict.name(), &format!("classified-{}", verdict.name()), |svg| {
                let cells = Cells::of(view.size(), CELLS, |i| view.verdicts[i] == verdict);
                region(svg, &cells, frames[3], verdict, 1.0);
            });
        }
        outlines(svg, &shown, frames[3], 1.0);
    });
    for frame in frames {
        svg.rectangle(frame, &Style::line(BLACK, 0.25));
    }
    [w, h]
}

/// The model's own colours as a screen shows them.
pub(super) fn in_neutral_light(p: Vec3) -> Vec3 {
    p.clamp(Vec3::ZERO, Vec3::ONE).map(linear_to_srgb)
}

/// In grey, so that hatches stand out.
fn pale(exposure: Exposure, p: Vec3) -> Vec3 {
    Vec3::splat(0.45 + 0.55 * luminance(exposure.show(p)))
}

/// A view's photograph, pale, with the findings and doubts that this view shows best hatched, outlined and named as on its
/// sheet: a PNG file of the photograph's size. `None` where there are none, or the view was not audited.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn marked(audit: &Audit, view: &str, photo: &Picture, exposure: Exposure) -> Result<Option<Vec<u8>>, ReportError> {
    let Some(audited) = audit.views.iter().find(|v| v.summary.view == view) else { return Ok(None) };
    let mut shown = shown(audit, audited);
    shown.retain(|s| s.finding.view == view);
    if shown.is_empty() {
        return Ok(None);
    }
    let [w, h] = [photo.width, photo.height].map(|n| n as f64);
    let frame = [0.0, 0.0, w, h];
    let mut svg = Svg::new(w, h, "Findings", "");
    if let Some(png) = png(photo, |p| pale(exposure, p)) {
        svg.png(frame, &png, "photograph");
    }
    for Shown { finding, cells } in &shown {
        region(&mut svg, cells, frame, verdict_of(finding), w.max(h) / PRINTED);
    }
    outlines(&mut svg, &shown, frame, w.max(h) / PRINTED);
    // one pixel a millimetre of the drawing
    crate::report::png(&svg.finish(), 25.4).map(Some)
}

fn picture(svg: &mut Svg, frame: [f64; 4], picture: &Picture, says: &str, show: impl Fn(Vec3) -> Vec3) {
    if let Some(png) = png(&reduced(picture, PIXELS), show) {
        svg.png(frame, &png, says);
    }
}

/// A PNG of a picture as `show` shows it, sRGB-encoded 0..=1.
pub(in crate::report) fn png(picture: &Picture, show: impl Fn(Vec3) -> Vec3) -> Option<Vec<u8>> {
    let bytes: Vec<u8> =
        picture.pixels.iter().flat_map(|p| show(*p).to_array()).map(|v| (v * 255.0).round() as u8).collect();
    encoded(&bytes, [picture.width, picture.height], image::ExtendedColorType::Rgb8)
}

/// A picture averaged down to at most so many pixels along its longer side.
pub(in crate::report) fn reduced(picture: &Picture, most: usize) -> Picture {
    let step = picture.width.max(picture.height).div_ceil(most).max(1);
    let (width, height) = (picture.width.div_ceil(step), picture.height.div_ceil(step));
    let mut small = Picture::new(width, height);
    for (i, pixel) in small.pixels.iter_mut().enumerate() {
        let (x0, y0) = (i % width * step, i / width * step);
        let (x1, y1) = ((x0 + step).min(picture.width), (y0 + step).min(picture.height));
        let block = (y0..y1).flat_map(|y| (x0..x1).map(move |x| picture.pixels[y * picture.width + x]));
        let (sum, count) = block.filter(|p| Picture::valid(*p)).fold((Vec3::ZERO, 0u32), |(s, n), p| (s + p, n + 1));
        *pixel = sum / count.max(1) as f32;
    }
    small
}

/// A region of one verdict, in its colour and hatch, so many times as coarse as on a sheet.
fn region(svg: &mut Svg, cells: &Cells, frame: [f64; 4], verdict: Verdict, scale: f64) {
    let rings = placed(&cells.rings(), frame);
    if let Some((wash, opacity, hatch)) = look(verdict) {
        let hatch = Hatch { spacing: scale * hatch.spacing, weight: scale * hatch.weight, ..hatch };
        svg.area(&rings, &Style::fill(wash).opacity(opacity));
        svg.area(&rings, &Style::hatch(hatch));
    }
}

/// A finding or a doubt where a view shows it.
struct Shown<'a> {
    finding: &'a Finding,
    cells: Cells,
}

/// The findings and doubts whose masks a view holds, the surest last, on top.
fn shown<'a>(audit: &'a Audit, view: &AuditedView) -> Vec<Shown<'a>> {
    let of = |(id, mask): &(String, Vec<bool>)| {
        let finding = audit.findings.iter().chain(&audit.doubts).find(|f| f.id == *id)?;
        Some(Shown { finding, cells: Cells::of(view.size(), CELLS, |i| mask[i]) })
    };
    view.masks.iter().rev().filter_map(of).collect()
}

/// Where a label of some size stands that is not to hide what it names: in the middle of its region, or below or above a small one.
fn beside_if_small(middle: Point, rings: &[Vec<Point>], frame: [f64; 4], label: f64) -> Point {
    let span = |k: usize| {
        let all = rings.iter().flatten().map(|p| p[k]);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    let ([left, right], [top, bottom]) = (span(0), span(1));
    if (right - left).max(bottom - top) > label {
        return middle;
    }
    let below = bottom + 0.4 * label;
    [middle[0], if below + 0.4 * label < frame[1] + frame[3] { below } else { top - 0.4 * label }]
}

/// The outline of each finding, with its name, so many times as coarse as on a sheet.
fn outlines(svg: &mut Svg, shown: &[Shown], frame: [f64; 4], scale: f64) {
    let mut labels = Vec::new();
    for Shown { finding, cells } in shown {
        let rings = placed(&cells.rings(), frame);
        let line = Style::line(look_of(finding), 0.5 * scale);
        svg.group("finding", "", |svg| {
            svg.area(&rings, &Style::line(WHITE, 1.1 * scale));
            svg.area(&rings, &if finding.is_sure() { line } else { line.dashed(1.4 * scale, 0.8 * scale) });
        });
        if let Some([x, y]) = cells.middle() {
            let middle = [frame[0] + x * frame[2], frame[1] + y * frame[3]];
            labels.push((&finding.id, beside_if_small(middle, &rings, frame, LABEL * scale)));
        }
    }
    let places: Vec<Point> = labels.iter().map(|(_, place)| *place).collect();
    for ((id, _), [x, y]) in labels.iter().zip(apart(&places, LABEL * scale, frame)) {
        svg.text([x, y + 1.4 * scale], id, &Text::new(3.8 * scale).bold().anchor(Anchor::Middle).halo(0.7 * scale));
    }
}

fn placed(rings: &[Vec<Point>], [x, y, w, h]: [f64; 4]) -> Vec<Vec<Point>> {
    rings.iter().map(|r| r.iter().map(|[u, v]| [x + u * w, y + v * h]).collect()).collect()
}
