//! The key plan: a section through the model with camera, probes, findings and north.

use glam::{DVec2, Vec3};

use super::labels::apart;
use super::subject::{AuditSheet, listed};
use crate::audit::Finding;
use crate::report::style::{BLACK, GREY, Style, WHITE};
use crate::report::{Anchor, Point, Svg, Text};

/// Shorter pieces of the section, in millimetres on the sheet, are left out.
const SHORTEST: f64 = 0.15;

/// Radius of a finding's mark, millimetres.
const MARK: f64 = 2.4;

/// Draws the key plan into a rectangle `[x, y, width, height]`.
pub(super) fn draw(svg: &mut Svg, about: &AuditSheet, view: &crate::site::View, frame: [f64; 4]) {
    let eye = about.scene.local(view.camera.pose.position);
    let cut = section(about, eye.z);
    let probes: Vec<(&str, Vec3)> =
        about.site.probes.iter().map(|p| (p.name.as_str(), about.scene.local(p.pose.position))).collect();
    let mut low = DVec2::new(eye.x.into(), eye.y.into());
    let mut high = low;
    let marks = probes.iter().map(|p| p.1.truncate().as_dvec2());
    for p in cut.iter().flatten().copied().chain(marks) {
        (low, high) = (low.min(p), high.max(p));
    }
    let [left, top, width, height] = frame;
    let room = [width - 4.0, height - 14.0];
    let extent = (high - low).max(DVec2::splat(0.5));
    let scale = (room[0] / extent.x).min(room[1] / extent.y);
    let centre = 0.5 * (low + high);
    let at = |p: DVec2| -> Point {
        [left + 0.5 * width + (p.x - centre.x) * scale, top + 0.5 * room[1] + 4.0 - (p.y - centre.y) * scale]
    };
    svg.group("section", "", |svg| {
        for [a, b] in cut.iter().filter(|[a, b]| a.distance(*b) * scale > SHORTEST) {
            svg.line(at(*a), at(*b), &Style::line(BLACK, 0.25));
        }
    });
    if cut.is_empty() {
        svg.text([left + 2.0, top + 8.0], "The model has no wall at the camera's height.", &Text::new(2.5));
    }
    svg.group("camera", "", |svg| camera(svg, view, &at, eye));
    svg.group("probes", "", |svg| {
        for (name, p) in &probes {
            let [x, y] = at(p.truncate().as_dvec2());
            let diamond = [[x, y - 1.6], [x + 1.6, y], [x, y + 1.6], [x - 1.6, y]];
            svg.area(&[diamond], &Style::fill(BLACK).outlined(WHITE, 0.3));
            svg.text([x, y + 4.2], name, &Text::new(2.5).anchor(Anchor::Middle).halo(0.4));
        }
    });
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
            svg.text([x, y + 0.8], &f.id, &Text::new(2.5).bold().anchor(Anchor::Middle));
        }
    });
    svg.group("scale-bar", "", |svg| scale_bar(svg, [left + 2.0, top + height - 3.0], scale));
    svg.group("north", "", |svg| {
        north(svg, [left + width - 8.0, top + height - 8.0], about.site.frame.north_deg);
    });
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

/// The camera with the edges of its field of view.
fn camera(svg: &mut Svg, view: &crate::site::View, at: &impl Fn(DVec2) -> Point, eye: Vec3) {
    let c = &view.camera;
    let [x, y] = at(eye.truncate().as_dvec2());
    let middle = 0.5 * f64::from(c.height);
    let edges = [0.0, f64::from(c.width)].map(|px| {
        let d = c.direction(px, middle).truncate().normalize_or_zero() * 13.0;
        [x + d.x, y - d.y]
    });
    svg.area(&[[[x, y], edges[0], edges[1]]], &Style::fill(GREY).opacity(0.25).outlined(BLACK, 0.3));
    svg.circle([x, y], 1.5, &Style::fill(WHITE).outlined(BLACK, 0.6));
}

fn scale_bar(svg: &mut Svg, [x, y]: Point, scale: f64) {
    let metres =
        [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0].into_iter().rfind(|m| m * scale <= 35.0).unwrap_or(0.1);
    let half = 0.5 * metres * scale;
    svg.rectangle([x, y - 1.4, half, 1.4], &Style::fill(BLACK).outlined(BLACK, 0.2));
    svg.rectangle([x + half, y - 1.4, half, 1.4], &Style::fill(WHITE).outlined(BLACK, 0.2));
    svg.text([x + 2.0 * half + 1.5, y], &format!("{metres} m"), &Text::new(2.5));
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
