//! The sheet to take on site: where to put the tripod on a floor, and what is seen from there.

use super::floor_map::{FURNITURE, FloorMap, MARGIN, Sample, VOID, WALL, legend, words};
use crate::plan::export::tables::{Outward, at_least, counted};
use crate::plan::floors::raster::Map;
use crate::plan::stations::result::FloorPlan;
use crate::report::draw::imprint::{BLANKS, SOFTWARE, TITLE_BLOCK, blanks, title_block};
use crate::report::draw::lengths::Lengths;
use crate::report::draw::png::text_width;
use crate::report::draw::style::{
    BLACK, BLUE, FINE_PRINT, GREEN, GREY, Hatch, LIGHT, ORANGE, PURPLE, Pattern, SKY, Style, VERMILION, YELLOW,
};
use crate::report::draw::svg::{Anchor, Svg, Text};
use crate::site::{Site, UNITS};

const COLOURS: [&str; 7] = [BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION, YELLOW];
/// Seen by no station, though one could.
pub(super) const UNSEEN: Style =
    Style::hatch(Hatch { pattern: Pattern::Lines(45), colour: VERMILION, spacing: 1.4, weight: 0.35 });
/// Seen from no place where a tripod can stand.
pub(super) const UNREACHABLE: Style =
    Style::hatch(Hatch { pattern: Pattern::Cross(45), colour: BLACK, spacing: 1.3, weight: 0.22 });
/// A taped distance.
const TAPE: Style = Style::line(BLACK, 0.2).dashed(1.2, 0.8);
/// Millimetres between rows of the table.
const ROW: f64 = 4.3;
/// The most rows that a sheet has room for.
const ROWS: usize = 24;

/// Draws a floor's plan sheet; `number` is which sheet of how many it is.
pub(super) fn plan_sheet(site: &Site, number: [usize; 2], plan: &FloorPlan, out: &Outward) -> Svg {
    let lengths = Lengths::of(&out.frame);
    let rows = plan.stations.len().min(ROWS);
    let panel = (14.0 + ROW * rows as f64).max(48.0) + 26.0 + BLANKS + TITLE_BLOCK;
    let map = FloorMap::of(plan, panel, lengths);
    let title = format!("{}: {}", site.name, plan.floor.name);
    let says =
        format!("Plan of the {} with {}", plan.floor.name.to_lowercase(), counted(plan.stations.len(), "station"));
    let mut svg = Svg::new(map.paper[0], map.paper[1], &title, &says);
    map.head(&mut svg, &format!("{title} — where to put the tripod"), &figures(plan, out));
    let [_, _, width, _] = map.frame;
    svg.clipped(map.frame, |svg| {
        map.void(svg, plan);
        isovists(svg, plan, &map);
        svg.group("unseen", "unseen", |svg| {
            let floor = &plan.floor;
            let unseen =
                Map::of(floor.target.grid, |c| floor.target.on[c] && plan.seen[c] == 0 && !plan.unreachable.on[c]);
            map.map(svg, &unseen.without_specks(0.03), &UNSEEN.outlined(VERMILION, 0.15));
        });
        svg.group("unreachable", "unreachable", |svg| {
            map.map(svg, &plan.unreachable.clone().without_specks(0.03), &UNREACHABLE);
        });
        map.walls(svg, plan);
        tapes(svg, plan, &map, lengths);
        map.stations(svg, plan);
    });
    map.bar_and_north(&mut svg, out.frame.north_deg);
    let top = map.frame[1] + map.frame[3] + 5.0;
    let left = 68.0;
    legend(&mut svg, [MARGIN, top], &entries(plan));
    table(&mut svg, [MARGIN + left, top + 2.0], width - left, plan, out);
    let foot = map.paper[1] - MARGIN - TITLE_BLOCK + 4.0;
    words(&mut svg, [MARGIN, foot - BLANKS - 17.0], width, FINE_PRINT, &notes(plan, out));
    blanks(&mut svg, [MARGIN, foot - BLANKS, width], &["On site: by", "date", "camera", "lens above floor"]);
    title_block(&mut svg, [MARGIN, foot, width], &site.name, &site.project, number);
    svg
}

/// The figures in a line.
pub(super) fn figures(plan: &FloorPlan, out: &Outward) -> String {
    let count = match plan.stations.len() {
        0 => "no new station".to_owned(),
        n => counted(n, "station"),
    };
    let space =
        plan.surface.map_or_else(String::new, |s| format!(", {:.1} % of surfaces in 3D", 100.0 * s.covered_fraction));
    format!(
        "Elevation {} · {} open · {count} (at least {} needed) · {:.1} % of floor seen{space}",
        out.elevation(plan.floor.elevation),
        Lengths::of(&out.frame).area(plan.area_m2, 0),
        plan.lower_bound,
        100.0 * plan.covered_fraction()
    )
}

/// How many stations are needed, and what for.
pub(super) fn needed(plan: &FloorPlan) -> String {
    if plan.stations.is_empty() {
        return "No new station is needed.".to_owned();
    }
    let more = match plan.stations.len().saturating_sub(plan.needed) {
        0 => String::new(),
        n => format!(" {n} more for walls and vaults, or for what neighbours must have in common."),
    };
    format!(
        "{} for the floor, where {} (it is cut into {} possible places and {} points).{more}",
        counted(plan.needed, "station"),
        at_least(plan.lower_bound),
        plan.discrete[0],
        plan.discrete[1]
    )
}

/// Transparent, the widest first, so that small ones stay visible; each with an outline.
fn isovists(svg: &mut Svg, plan: &FloorPlan, map: &FloorMap) {
    svg.group("isovists", "isovists", |svg| {
        for station in &plan.present {
            let ring = map.ring(&station.region.outline());
            svg.area(&[ring], &Style::fill(GREY).opacity(0.14).outlined(GREY, 0.15));
        }
        for (i, station) in plan.stations.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            let ring = map.ring(&station.region.outline());
            svg.area(&[ring], &Style::fill(colour).opacity(0.17).outlined(colour, 0.2));
        }
    });
}

/// The first two distances of each station, with their metres.
fn tapes(svg: &mut Svg, plan: &FloorPlan, map: &FloorMap, lengths: Lengths) {
    svg.group("tapes", "tapes", |svg| {
        let mut taken: Vec<[f64; 2]> = plan.stations.iter().map(|s| map.at(s.position.truncate())).collect();
        taken.extend(plan.present.iter().flat_map(|s| map.named(s)));
        for station in &plan.stations {
            let from = map.at(station.position.truncate());
            for tape in station.check_distances.iter().take(2) {
                let to = map.at(tape.to);
                svg.line(from, to, &TAPE);
                svg.circle(to, 0.5, &Style::fill(BLACK));
                // the words go where nothing else is, along the tape or at its end
                let along = |t: f64| [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])];
                let free = |p: &[f64; 2]| {
                    taken.iter().map(|q| ((p[0] - q[0]) / 2.0).hypot(p[1] - q[1])).fold(f64::INFINITY, f64::min)
                };
                let length = (to[0] - from[0]).hypot(to[1] - from[1]).max(1e-9);
                let places = [0.5, 0.65, 0.8, 1.0 + 3.0 / length, 1.0 + 5.0 / length].map(along);
                // where there is no room, the table tells
                let Some(best) = places.iter().find(|p| free(p) > 4.0) else { continue };
                taken.push(*best);
                let text = Text::new(FINE_PRINT).anchor(Anchor::Middle).halo(0.5);
                svg.text([best[0], best[1] + 0.8], &lengths.tape(tape.metres), &text);
            }
        }
    });
}

fn entries(plan: &FloorPlan) -> Vec<(Sample, &'static str)> {
    let mut all = vec![
        (Sample::Number, "station, in order of usefulness"),
        (
            Sample::Area(vec![
                Style::fill(BLUE).opacity(0.17).outlined(BLUE, 0.2),
                Style::fill(ORANGE).opacity(0.17).outlined(ORANGE, 0.2),
            ]),
            "seen from a station (overlapping)",
        ),
        (Sample::Area(vec![UNSEEN]), "seen by none of them"),
        (Sample::Area(vec![UNREACHABLE]), "seen from nowhere allowed"),
        (Sample::Line(WALL), "wall, the model cut at lens height"),
        (Sample::Line(FURNITURE), "furniture and steps, cut lower down"),
        (Sample::Area(vec![Style::fill(LIGHT)]), "solid at probe height"),
        (Sample::Line(TAPE), "distance to a wall, to check by tape"),
    ];
    if !plan.present.is_empty() {
        all.insert(1, (Sample::Square, "probe taken already"));
    }
    let floor = &plan.floor;
    if floor.open.count() > floor.target.count() + 200 {
        all.push((Sample::Area(vec![VOID]), "open, not this floor below"));
    }
    all
}

fn table(svg: &mut Svg, [x, y]: [f64; 2], width: f64, plan: &FloorPlan, out: &Outward) {
    let lengths = Lengths::of(&out.frame);
    // shares of the width at which columns begin
    let narrow = width < 150.0;
    let columns = if narrow {
        [0.0, 0.06, 0.195, 0.29, 0.385, 0.48, 0.60, 0.70]
    } else {
        [0.0, 0.05, 0.19, 0.30, 0.41, 0.51, 0.60, 0.68]
    };
    let at = |k: usize| x + columns[k] * width;
    let axes = ["No.", "Name", "x", "y", "z", "Sees", "Total", &format!("Walls{} @ bearing", lengths.unit())];
    svg.group("stations-table", "table", |svg| {
        for (k, name) in axes.iter().enumerate() {
            svg.text([at(k), y], name, &Text::new(2.7).bold());
        }
        svg.line([x, y + 1.2], [x + width, y + 1.2], &Style::line(BLACK, 0.25));
        for (i, s) in plan.stations.iter().take(ROWS).enumerate() {
            let y = y + ROW * (i as f64 + 1.0) + 0.3;
            let p = out.point(s.position).map(|v| format!("{v:.*}", out.decimals().min(2)));
            let tapes: Vec<String> = s
                .check_distances
                .iter()
                .take(if narrow { 2 } else { 3 })
                .map(|t| {
                    format!(
                        "{} @ {:03.0}°",
                        lengths.tape(t.metres),
                        out.bearing(t.to - s.position.truncate()).round() % 360.0
                    )
                })
                .collect();
            let [px, py, pz] = p;
            let cells = [
                (i + 1).to_string(),
                s.name.clone(),
                px,
                py,
                pz,
                lengths.area(s.covers_m2, 1),
                format!("{:.1} %", 100.0 * plan.curve[i]),
                tapes.join(", "),
            ];
            let size = Text::new(if narrow { FINE_PRINT } else { 2.6 });
            for (k, cell) in cells.iter().enumerate() {
                let room = if k + 1 < columns.len() { at(k + 1) - 0.6 } else { x + width } - at(k);
                let fits = (room / text_width(cell, size.size, k == 0)).min(1.0);
                let look = Text { size: size.size * fits, bold: k == 0, ..size };
                svg.text([at(k), y], cell, &look);
            }
            svg.line([x, y + 1.2], [x + width, y + 1.2], &Style::line(LIGHT, 0.15));
        }
        if plan.stations.len() > ROWS {
            let y = y + ROW * (ROWS as f64 + 1.0);
            svg.text([x, y], &format!("and {} more: see plan.csv", plan.stations.len() - ROWS), &Text::new(2.6));
        }
    });
}

fn notes(plan: &FloorPlan, out: &Outward) -> Vec<String> {
    let lengths = Lengths::of(&out.frame);
    let mut order = String::new();
    if plan.walk.len() > 1 {
        let numbers: Vec<String> = plan.walk.iter().map(|i| (i + 1).to_string()).collect();
        order = format!("Shortest walk: {} ({}). ", numbers.join(" → "), lengths.walk(plan.walk_m));
    }
    let unit = UNITS.iter().find(|u| (u.metres / out.frame.metres_per_unit - 1.0).abs() < 1e-9);
    let unit = unit.map_or("model units", |u| u.name);
    vec![
        format!(
            "{order}x, y, z are the lens in the model's own axes, {unit}. Distances are level at lens height, bearings \
             clockwise from true north (N). Sees: open floor seen; total: share seen with all stations up to this one, \
             of what can be seen."
        ),
        format!("{} {SOFTWARE}", needed(plan)),
    ]
}
