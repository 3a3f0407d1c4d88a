//! The table of findings: what, where, how large, how sure, and room for the surveyor's verdict.

use glam::Vec3;

use super::pictures::{in_neutral_light, png, reduced};
use super::subject::{AuditSheet, listed, look_of};
use super::words;
use crate::audit::{Finding, Kind, What};
use crate::panorama::{Exposure, Picture};
use crate::report::draw::png::capital;
use crate::report::style::{BLACK, FINE_PRINT, GREY, LIGHT, Style};
use crate::report::{Svg, Text, wrap};

const BODY: f64 = 2.6;

/// Columns and their widths in millimetres; the second is what is left.
const COLUMNS: [(&str, f64); 9] = [
    ("", 11.0),
    ("photo · model", 0.0),
    ("what is wrong", 0.0),
    ("kind", 17.0),
    ("how sure", 19.0),
    ("area", 18.0),
    ("displacement", 24.0),
    ("place (x, y, z)", 25.0),
    ("surveyor's verdict", 36.0),
];

/// Draws the table into a rectangle `[x, y, width, height]`.
pub(super) fn draw(svg: &mut Svg, about: &AuditSheet, [left, top, width, height]: [f64; 4]) {
    let rows = listed(about);
    let head = 6.0;
    let foot = 3.6;
    // more rows make them lower
    let fit = |row: f64| ((height - head - foot) / row) as usize;
    let row = [23.2, 17.0, 14.0, 11.5, 10.0].into_iter().find(|r| rows.len() <= fit(*r)).unwrap_or(10.0);
    let shown = rows.len().min(fit(row));
    let crop = crop_of(row);
    let mut columns = COLUMNS.map(|c| c.1);
    columns[1] = 2.0 * crop + 3.0;
    columns[2] = width - columns.iter().sum::<f64>();
    let starts: Vec<f64> = columns.iter().scan(left, |x, w| Some(std::mem::replace(x, *x + w))).collect();
    for (x, (title, _)) in starts.iter().zip(COLUMNS) {
        svg.text([x + 1.0, top + 4.0], title, &Text::new(FINE_PRINT).bold());
    }
    svg.line([left, top + head], [left + width, top + head], &Style::line(BLACK, 0.35));
    for (i, (finding, here)) in rows.iter().take(shown).enumerate() {
        let y = top + head + i as f64 * row;
        svg.group("finding-row", &format!("row-{}", finding.id), |svg| {
            cells(svg, about, finding, *here, &starts, &columns, [y, row]);
        });
        svg.line([left, y + row], [left + width, y + row], &Style::line(LIGHT, 0.2));
    }
    let y = top + head + shown as f64 * row + 3.2;
    if rows.is_empty() {
        svg.text([left + 1.0, top + head + 5.0], "Nothing was found wrong in what could be tested.", &Text::new(BODY));
    } else if shown < rows.len() {
        let more = format!("and {} more in findings.csv", rows.len() - shown);
        svg.text([left + 1.0, y], &more, &Text::new(FINE_PRINT).bold());
    }
    for x in starts.iter().skip(1) {
        let bottom = top + head + shown as f64 * row;
        svg.line([*x, top + 1.0], [*x, bottom], &Style::line(LIGHT, 0.2));
    }
}

fn cells(svg: &mut Svg, about: &AuditSheet, f: &Finding, here: bool, x: &[f64], w: &[f64], [y, row]: [f64; 2]) {
    let line = |k: usize| y + 3.4 + k as f64 * 3.1;
    let most = ((row - 1.0) / 3.1) as usize;
    svg.rectangle([x[0] + 0.8, y + 1.2, 1.2, row - 2.4], &Style::fill(look_of(f)));
    svg.text([x[0] + 2.8, line(0) + 0.4], &f.id, &Text::new(3.2).bold());
    crops(svg, about, f, [x[1] + 1.0, y + 0.8, crop_of(row)]);
    let mut put = |k: usize, lines: Vec<String>, look: Text| {
        for (i, text) in lines.iter().take(most).enumerate() {
            svg.text([x[k] + 1.0, line(i)], text, &look);
        }
    };
    let best = if here { String::new() } else { format!(" (best seen in “{}”)", f.view) };
    let mut note = wrap(&(capital(&f.note) + &best), w[2] - 2.0, BODY, false);
    if note.len() > most && most > 0 {
        note.truncate(most);
        note[most - 1].push_str(" …");
    }
    put(2, note, Text::new(BODY));
    put(3, vec![f.kind.name().to_owned(), f.what.name().to_owned()], Text::new(BODY));
    put(5, vec![words::area(f.area_cm2)], Text::new(BODY));
    put(6, displacement(f, here), Text::new(BODY));
    put(7, f.position.map(|v| format!("{v:.2}")).to_vec(), Text::new(FINE_PRINT));
    svg.text([x[4] + 1.0, line(0)], &format!("{:.0} %", 100.0 * f.score), &Text::new(BODY).bold());
    let bar = [x[4] + 1.0, line(0) + 1.0, w[4] - 3.0, 1.6];
    svg.rectangle([bar[0], bar[1], bar[2] * f.score.clamp(0.0, 1.0), bar[3]], &Style::fill(GREY));
    svg.rectangle(bar, &Style::line(BLACK, 0.15));
    for (i, choice) in ["confirmed", "not so", "go and see"].into_iter().enumerate() {
        let [left, base] = [x[8] + 1.5, line(i)];
        svg.rectangle([left, base - 1.9, 2.0, 2.0], &Style::line(BLACK, 0.2));
        svg.text([left + 2.8, base - 0.1], choice, &Text::new(FINE_PRINT));
    }
}

/// The side of a picture in a row: words get what room a high row has beyond that.
fn crop_of(row: f64) -> f64 {
    row.min(17.0) - 1.6
}

/// The finding in the sheet's photograph and in the model, relit as the photograph is; a wrong picture and a thing that is not there in neutral
/// light, since relit from what the probes saw of the real room they hardly show.
fn crops(svg: &mut Svg, about: &AuditSheet, f: &Finding, [x, y, side]: [f64; 3]) {
    let view = about.view();
    let Some((_, mask)) = view.masks.iter().find(|(id, _)| *id == f.id) else { return };
    let pixels: Vec<usize> = (0..mask.len()).filter(|i| mask[*i]).collect();
    let (bbox, _) = view.in_photograph(&pixels);
    let exposure = Exposure::of(&view.photograph);
    let relit = |p: Vec3| exposure.show(p);
    let model: (_, _, _, &dyn Fn(Vec3) -> Vec3) = if f.kind == Kind::Texture || f.what == What::Extra {
        (&view.neutral, view.summary.reduced_by, "model, in neutral light", &in_neutral_light)
    } else {
        (&view.render, view.summary.reduced_by, "model", &relit)
    };
    let photograph = (&view.photograph, 1, "photograph", &relit as _);
    for (i, (picture, by, says, show)) in [photograph, model].into_iter().enumerate() {
        let Some(png) = png(&reduced(&cut(picture, by, view.summary.size, bbox), 200), show) else { continue };
        let at = [x + i as f64 * (side + 1.0), y, side, side];
        svg.png(at, &png, &format!("{} in the {says}", f.id));
        svg.rectangle(at, &Style::line(BLACK, 0.15));
    }
}

/// A square around a finding in a photograph of this size, with some of what surrounds it, in a picture that has one pixel for `by` along
/// each side of the photograph.
fn cut(picture: &Picture, by: u32, size: [u32; 2], [x0, y0, x1, y1]: [u32; 4]) -> Picture {
    let ([w, h], by) = (size.map(|side| side as usize), by as usize);
    let wanted = (f64::from((x1 - x0).max(y1 - y0)) * 1.3).max(24.0) as usize;
    let side = wanted.min(w).min(h);
    let from = |a: u32, b: u32, room: usize| ((a + b) as usize / 2).saturating_sub(side / 2).min(room - side);
    let (left, top) = (from(x0, x1, w), from(y0, y1, h));
    let (left, top, side) = (left / by, top / by, (side / by).max(1));
    let pixels = (0..side * side).map(|i| picture.pixels[(top + i / side) * picture.width + left + i % side]).collect();
    Picture { width: side, height: side, pixels }
}

/// How far it is off its place; sideways is as the photograph has it that shows it best, which is the sheet's own or not.
fn displacement(f: &Finding, here: bool) -> Vec<String> {
    if let Some((side, metres)) = f.shift.map(|s| s.words()) {
        let mut lines = vec![format!("{:.0} cm", 100.0 * metres), side.to_owned()];
        lines.extend((!here).then(|| format!("in “{}”", f.view)));
        return lines;
    }
    match &f.displacement {
        Some(d) => vec![words::centimetres(d), if d.metres >= 0.0 { "nearer" } else { "farther" }.to_owned()],
        None => vec!["–".to_owned()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_is_cut_out_of_averages_however_narrow_the_photograph_is() {
        for size in [[5u32, 4001], [4001, 3], [3, 3], [4000, 3000]] {
            let [w, h] = size;
            let averages = Picture::new(w.div_ceil(4) as usize, h.div_ceil(4) as usize);
            for bbox in [[0, 0, 1, 1], [w - 1, h - 1, w, h], [0, 0, w, h]] {
                let square = cut(&averages, 4, size, bbox);
                assert!(square.width >= 1 && square.pixels.len() == square.width * square.height, "{size:?} {bbox:?}");
            }
        }
    }
}
