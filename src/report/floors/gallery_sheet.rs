//! The art gallery's drawing: walls, numbered guards, what each sees, and what nobody sees.

use crate::plan::export::tables::at_least;
use crate::plan::free_space::open_space::OpenSpace;
use crate::plan::gallery::{Guards, unseen_polygons};
use crate::report::draw::style::{
    BLACK, BLUE, GREEN, GREY, Hatch, ORANGE, PURPLE, Pattern, SKY, Style, VERMILION, WHITE,
};
use crate::report::draw::svg::{Anchor, Point, Svg, Text};
use glam::DVec2;

/// Millimetres: the drawing's longer side, its margin, and the lines of text below it.
const DRAWING: f64 = 180.0;
const MARGIN: f64 = 8.0;
const BELOW: f64 = 18.0;

/// Draws guards in an open space, in its own proportions, 180 mm wide or high.
pub fn gallery_sheet(open: &OpenSpace, result: &Guards) -> Svg {
    let (low, high) = open.bounds();
    let size = high - low;
    let scale = DRAWING / size.max_element();
    let (width, height) = ((size.x * scale).max(90.0) + 2.0 * MARGIN, size.y * scale + 2.0 * MARGIN + BELOW);
    let place = |p: DVec2| -> Point { [MARGIN + (p.x - low.x) * scale, MARGIN + (high.y - p.y) * scale] };
    let ring = |r: &[DVec2]| -> Vec<Point> { r.iter().map(|&p| place(p)).collect() };
    let words = sentence(result);
    let mut svg = Svg::new(width, height, "Guards of a gallery", &words);
    svg.rectangle([0.0, 0.0, width, height], &Style::fill(WHITE));
    svg.group("seen", "seen", |svg| {
        let colours = [SKY, ORANGE, GREEN, PURPLE, BLUE, VERMILION];
        for (k, &g) in result.guards.iter().enumerate() {
            let Some(seen) = open.visibility(g) else { continue };
            let colour = colours[k % colours.len()];
            svg.area(&[ring(&seen.ring)], &Style::fill(colour).opacity(0.3).outlined(GREY, 0.1));
        }
    });
    svg.group("unseen", "unseen", |svg| {
        let hatch = Style::hatch(Hatch::new(Pattern::Cross(45), BLACK));
        for polygon in unseen_polygons(open, &result.guards) {
            svg.area(&polygon.rings().map(|r| ring(r)).collect::<Vec<_>>(), &hatch);
        }
    });
    svg.group("walls", "walls", |svg| {
        for polygon in open.polygons() {
            svg.area(&polygon.rings().map(|r| ring(r)).collect::<Vec<_>>(), &Style::line(BLACK, 0.4));
        }
    });
    svg.group("guards", "guards", |svg| draw_guards(svg, result, place));
    let base = height - BELOW;
    svg.text([MARGIN, base + 4.0], &words, &Text::new(4.0).bold());
    svg.text(
        [MARGIN, base + 10.0],
        "Dots: guards, the widest view first. Tints: what each sees, darker where several",
        &Text::new(3.0),
    );
    svg.text([MARGIN, base + 14.0], "see. Cross-hatched: seen by nobody.", &Text::new(3.0));
    svg
}

fn draw_guards(svg: &mut Svg, result: &Guards, place: impl Fn(DVec2) -> Point) {
    // many guards want small dots
    let size = (60.0 / (result.guards.len() as f64).sqrt().max(1.0)).clamp(1.6, 4.0);
    for (k, &g) in result.guards.iter().enumerate() {
        let at = place(g);
        svg.circle(at, size * 0.3, &Style::fill(BLACK).outlined(WHITE, 0.2));
        let label = [at[0] + size * 0.45, at[1] - size * 0.3];
        svg.text(label, &(k + 1).to_string(), &Text::new(size).bold().anchor(Anchor::Start).halo(0.4));
    }
}

fn sentence(result: &Guards) -> String {
    let n = result.guards.len();
    let seen = result.covered_fraction * 100.0;
    if result.proved() {
        format!("{n} guards see {seen:.2} %; no fewer can")
    } else {
        format!("{n} guards see {seen:.2} %; {}", at_least(result.lower_bound))
    }
}
