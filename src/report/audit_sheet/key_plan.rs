//! The key plan: a section through the model, what is below it as seen from above, camera, probes, findings and north.

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::labels::{apart, beside};
use super::pictures::png;
use super::subject::{AuditSheet, listed};
use crate::audit::Finding;
use crate::panorama::Picture;
use crate::report::style::{BLACK, FINE_PRINT, GREY, Style, WHITE};
use crate::report::{Anchor, Point, Svg, Text, text_width};
use crate::scene::{Ray, Scene};

/// Shorter pieces of the section, in millimetres on the sheet, are left out.
const SHORTEST: f64 = 0.15;

/// Radius of a finding's mark and of a probe's, millimetres.
const MARK: f64 = 2.4;
const PROBE: f64 = 1.6;

/// Pixels to a millimetre of what is below the section.
const PIXELS_PER_MM: f64 = 4.0;

/// Draws the key plan into a rectangle `[x, y, width, height]`.
pub(super) fn draw(svg: &mut Svg, about: &AuditSheet, view: &crate::site::View, frame: [f64; 4]) {
    let eye = about.scene.local(view.camera.pose.position);
    let cut = section(about, eye.z);
    let probes = &about.site.probes;
    // the probes', and the camera's
    let places = probes.iter().map(|p| about.scene.local(p.pose.position)).chain([eye]);
    let marks: Vec<DVec2> = places.map(|p| p.truncate().as_dvec2()).collect();
    let [low, high] = extent(&cut, &marks);
    let [left, top, width, height] = frame;
    let room = [width - 4.0, height - 14.0];
    let size = (high - low).max(DVec2::splat(0.5));
    let scale = (room[0] / size.x).min(room[1] / size.y);
    let centre = 0.5 * (low + high);
    let middle = DVec2::new(left + 0.5 * width, top + 0.5 * room[1] + 4.0);
    let at = |p: DVec2| -> Point { [middle.x + (p.x - centre.x) * scale, middle.y - (p.y - centre.y) * scale] };
    svg.group("below", "", |svg| {
        let corner = centre + (DVec2::new(left, top) - middle) * DVec2::new(1.0, -1.0) / scale;
        let size = [width, height].map(|side| (side * PIXELS_PER_MM) as usize);
        let below =
            slopes_below(about.scene, corner.as_vec2().extend(eye.z), (scale * PIXELS_PER_MM).recip() as f32, size);
        if let Some(png) = png(&below, |p| p) {
            svg.png(frame, &png, "The model below the camera's height, from above");
        }
    });
    svg.clipped(frame, |svg| {
        svg.group("section", "", |svg| {
            for [a, b] in cut.iter().filter(|[a, b]| a.distance(*b) * scale > SHORTEST) {
                svg.line(at(*a), at(*b), &Style::line(BLACK, 0.25));
            }
        });
    });
    if cut.is_empty() {
        svg.text([left + 2.0, top + 8.0], "The model has no wall at the camera's height.", &Text::new(FINE_PRINT));
    }
    let marks: Vec<Point> = marks.into_iter().map(at).collect();
    let standpoint = marks[probes.len()];
    svg.group("field-of-view", "", |svg| field_of_view(svg, view, standpoint));
    svg.group("probes", "", |svg| {
        marks[..probes.len()].iter().for_each(|place| probe(svg, *place));
        let widths: Vec<f64> = probes.iter().map(|p| text_width(&p.name, FINE_PRINT, false)).collect();
        for (p, label) in probes.iter().zip(beside(&marks, &widths, FINE_PRINT, PROBE, frame)) {
            if let Some([x, y]) = label {
                svg.text([x, y + 0.35 * FINE_PRINT], &p.name, &Text::new(FINE_PRINT).anchor(Anchor::Middle).halo(0.4));
            }
        }
    });
    svg.group("camera", "", |svg| camera(svg, standpoint));
    svg.group("finding-places", "", |svg| {
        let findings = listed(about);
        let place =
            |f: &Finding| at(about.scene.local(about.site.frame.point_in(f.position.into())).truncate().as_dvec2());
        let places: Vec<Point> = findings.iter().map(|(f, _)| place(f)).collect();
        let labels = apart(&places, 2.0 * MARK + 0.4, frame);
        for (place, label) in places.iter().zip(&labels) {
            svg.line(*place, *label, &Style::line(BLACK, 0.25));
        }
        for ((f, _), [x, y]) in findings.iter().zip(labels) {
            svg.circle([x, y], MARK, &Style::fill(WHITE).outlined(BLACK, 0.35));
            svg.text([x, y + 0.8], &f.id, &Text::new(FINE_PRINT).bold().anchor(Anchor::Middle));
        }
    });
    svg.group("scale-bar", "", |svg| scale_bar(svg, [left + 2.0, top + height - 3.0], scale));
    svg.group("north", "", |svg| {
        north(svg, [left + width - 8.0, top + height - 8.0], about.site.frame.north_deg);
    });
}

/// What the plan has to show: all marks, and the section but for a hundredth of its length on each side, as far out as a scan's strays lie.
fn extent(cut: &[[DVec2; 2]], marks: &[DVec2]) -> [DVec2; 2] {
    const STRAYS: f64 = 0.01;
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for k in 0..2 {
        let ends = cut.iter().flat_map(|[a, b]| [a, b].map(|end| (end[k], 0.5 * a.distance(*b))));
        let mut ends: Vec<(f64, f64)> = ends.collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let strays = STRAYS * ends.iter().map(|(_, length)| length).sum::<f64>();
        let of_marks = || marks.iter().map(|p| p[k]);
        low[k] = of_marks().chain(beyond(ends.iter(), strays)).fold(f64::INFINITY, f64::min);
        high[k] = of_marks().chain(beyond(ends.iter().rev(), strays)).fold(f64::NEG_INFINITY, f64::max);
    }
    [low, high]
}

/// The first place that has more of the section's length before it than strays are.
fn beyond<'a>(mut ends: impl Iterator<Item = &'a (f64, f64)>, strays: f64) -> Option<f64> {
    let mut passed = 0.0;
    let within = ends.find(|(_, length)| {
        passed += length;
        passed > strays
    });
    within.map(|(place, _)| *place)
}

/// The model below a level plane as seen from above, the darker the steeper, so that things have outlines; white where it ends. `corner` is
/// the upper left one in the plane, local metres; `pixel` is in metres.
fn slopes_below(scene: &Scene, corner: Vec3, pixel: f32, [width, height]: [usize; 2]) -> Picture {
    const LEVEL: f32 = 0.9;
    const STEEP: f32 = 0.5;
    let depth = |i: usize| {
        let at = Vec2::new((i % width) as f32 + 0.5, -((i / width) as f32 + 0.5)) * pixel;
        let ray = Ray { origin: corner + at.extend(0.0), direction: Vec3::NEG_Z };
        scene.tracer.closest(&ray, 0.0).map_or(f32::INFINITY, |hit| hit.t)
    };
    let depths: Vec<f32> = (0..width * height).into_par_iter().map(depth).collect();
    let shade = |i: usize| {
        let (x, y) = (i % width, i / width);
        let rise = |a: usize, b: usize| (depths[a] - depths[b]) / (2.0 * pixel);
        let across = rise(y * width + x.saturating_sub(1), y * width + (x + 1).min(width - 1));
        let along = rise(y.saturating_sub(1) * width + x, (y + 1).min(height - 1) * width + x);
        let level = (1.0 + across * across + along * along).sqrt().recip();
        if depths[i].is_infinite() { 1.0 } else { STEEP + (LEVEL - STEEP) * if level.is_nan() { 0.0 } else { level } }
    };
    Picture { width, height, pixels: (0..width * height).map(|i| Vec3::splat(shade(i))).collect() }
}

/// Where a level plane at local height `z` cuts the model's triangles.
fn section(about: &AuditSheet, z: f32) -> Vec<[DVec2; 2]> {
    let mesh = &about.scene.mesh;
    let piece = |t: &[u32; 3]| {
        let corners = t.map(|i| mesh.positions[i as usize]);
        let crossing = |a: Vec3, b: Vec3| {
            // one end counts as below, so that an edge that is met is met once
            ((a.z < z) != (b.z < z)).then(|| a.lerp(b, (z - a.z) / (b.z - a.z)).truncate().as_dvec2())
        };
        let [a, b, c] = corners;
        let mut met = [crossing(a, b), crossing(b, c), crossing(c, a)].into_iter().flatten();
        Some([met.next()?, met.next()?])
    };
    mesh.triangles.iter().filter_map(piece).collect()
}

/// A probe's mark.
pub(super) fn probe(svg: &mut Svg, [x, y]: Point) {
    let diamond = [[x, y - PROBE], [x + PROBE, y], [x, y + PROBE], [x - PROBE, y]];
    svg.area(&[diamond], &Style::fill(BLACK).outlined(WHITE, 0.3));
}

/// A camera's mark.
pub(super) fn camera(svg: &mut Svg, at: Point) {
    svg.circle(at, 1.5, &Style::fill(WHITE).outlined(BLACK, 0.6));
}

/// The edges of what a camera sees.
fn field_of_view(svg: &mut Svg, view: &crate::site::View, [x, y]: Point) {
    let c = &view.camera;
    let middle = 0.5 * f64::from(c.height);
    let edges = [0.0, f64::from(c.width)].map(|px| {
        let d = c.direction(px, middle).truncate().normalize_or_zero() * 13.0;
        [x + d.x, y - d.y]
    });
    svg.area(&[[[x, y], edges[0], edges[1]]], &Style::fill(GREY).opacity(0.25).outlined(BLACK, 0.3));
}

fn scale_bar(svg: &mut Svg, [x, y]: Point, scale: f64) {
    let metres =
        [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0].into_iter().rfind(|m| m * scale <= 35.0).unwrap_or(0.1);
    let half = 0.5 * metres * scale;
    svg.rectangle([x, y - 1.4, half, 1.4], &Style::fill(BLACK).outlined(BLACK, 0.2));
    svg.rectangle([x + half, y - 1.4, half, 1.4], &Style::fill(WHITE).outlined(BLACK, 0.2));
    svg.text([x + 2.0 * half + 1.5, y], &format!("{metres} m"), &Text::new(FINE_PRINT));
}

/// An arrow to true north, which lies `clockwise` degrees from the sheet's top.
fn north(svg: &mut Svg, [x, y]: Point, clockwise: f64) {
    let (sin, cos) = clockwise.to_radians().sin_cos();
    let turned = |dx: f64, dy: f64| [x + dx * cos - dy * sin, y + dx * sin + dy * cos];
    svg.area(&[[turned(0.0, -5.0), turned(2.0, 3.0), turned(0.0, 1.5)]], &Style::fill(BLACK).outlined(BLACK, 0.25));
    svg.area(&[[turned(0.0, -5.0), turned(-2.0, 3.0), turned(0.0, 1.5)]], &Style::fill(WHITE).outlined(BLACK, 0.25));
    let [tx, ty] = turned(0.0, -6.6);
    svg.text([tx, ty + 0.9], "N", &Text::new(2.6).bold().anchor(Anchor::Middle));
}

#[cfg(test)]
mod tests {
    use super::super::tests::room;
    use super::*;

    #[test]
    fn a_few_strays_do_not_widen_the_plan_but_marks_do() {
        let wall = |x: f64| [DVec2::new(x, 0.0), DVec2::new(x, 5.0)];
        let stray = [DVec2::new(-40.0, 90.0), DVec2::new(-40.0, 90.02)];
        let mark = DVec2::new(2.0, -1.0);
        let [low, high] = extent(&[wall(0.0), wall(6.0), stray], &[mark]);
        assert_eq!((low, high), (DVec2::new(0.0, -1.0), DVec2::new(6.0, 5.0)));
        assert_eq!(extent(&[], &[mark]), [mark, mark]);
    }

    #[test]
    fn what_is_below_is_pale_where_it_is_level_dark_at_its_ends_and_white_beyond() {
        let (_dir, _, scene) = room();
        // ten centimetres a pixel, a metre beyond the walls
        let corner = scene.local(glam::DVec3::new(-1.0, 6.0, 1.6));
        let map = slopes_below(&scene, corner, 0.1, [80, 70]);
        let tone = |x: usize, y: usize| map.pixels[y * 80 + x].x;
        let row: Vec<f32> = (0..80).map(|x| tone(x, 35)).collect();
        assert!(row[..9].iter().chain(&row[71..]).all(|t| *t == 1.0), "{row:?}");
        assert!(row[12..68].iter().all(|t| *t == 0.9) && row[10] == 0.5 && row[69] == 0.5, "{row:?}");
        assert!((0..80).all(|x| tone(x, 0) == 1.0));
    }
}
