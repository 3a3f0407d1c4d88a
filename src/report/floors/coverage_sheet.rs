//! The sheet that shows how often each part of a floor is seen, and what more stations would add.

use super::floor_map::{FloorMap, MARGIN, Sample, VOID, legend, words};
use super::plan_sheet::{UNREACHABLE, UNSEEN, figures, needed};
use crate::plan::export::tables::Outward;
use crate::plan::floors::raster::Map;
use crate::plan::stations::result::FloorPlan;
use crate::report::draw::imprint::{SOFTWARE, TITLE_BLOCK, title_block};
use crate::report::draw::lengths::Lengths;
use crate::report::draw::style::{BLACK, BLUE, FINE_PRINT, GREY, Hatch, LIGHT, Pattern, SKY, Style, VERMILION, YELLOW};
use crate::report::draw::svg::{Anchor, Svg, Text};
use crate::site::Site;

const PANEL: f64 = 78.0 + TITLE_BLOCK;
const ONCE: [Style; 2] = [
    Style::fill(YELLOW).opacity(0.6),
    Style::hatch(Hatch { pattern: Pattern::Dots, colour: GREY, spacing: 2.0, weight: 0.16 }),
];
const TWICE: [Style; 2] = [
    Style::fill(SKY).opacity(0.75),
    Style::hatch(Hatch { pattern: Pattern::Lines(-45), colour: BLUE, spacing: 2.2, weight: 0.15 }),
];
const MORE: [Style; 1] = [Style::fill(BLUE).opacity(0.75)];
const WALL_UNSEEN: Style = Style::line(VERMILION, 1.1).dashed(1.6, 0.8);
const STAND: Style = Style::line(BLACK, 0.15).dashed(0.8, 0.8);

/// Draws a floor's coverage sheet; `number` is which sheet of how many it is.
pub(super) fn coverage_sheet(site: &Site, number: [usize; 2], plan: &FloorPlan, out: &Outward) -> Svg {
    let lengths = Lengths::of(&out.frame);
    let map = FloorMap::of(plan, PANEL, lengths);
    let title = format!("{}: {}", site.name, plan.floor.name);
    let mut svg = Svg::new(map.paper[0], map.paper[1], &title, "How many stations see each part of the floor");
    map.head(&mut svg, &format!("{title} — how often it is seen"), &figures(plan, out));
    let floor = &plan.floor;
    let grid = floor.target.grid;
    svg.clipped(map.frame, |svg| {
        map.void(svg, plan);
        let mut class = |id: &str, styles: &[Style], of: &dyn Fn(u8) -> bool| {
            let cells = Map::of(grid, |c| floor.target.on[c] && of(plan.seen[c]) && !plan.unreachable.on[c]);
            svg.group("class", id, |svg| styles.iter().for_each(|style| map.map(svg, &cells, style)));
        };
        class("seen-0", &[UNSEEN], &|n| n == 0);
        class("seen-1", &ONCE, &|n| n == 1);
        class("seen-2", &TWICE, &|n| n == 2);
        class("seen-3", &MORE, &|n| n > 2);
        map.map(svg, &plan.unreachable, &UNREACHABLE);
        map.map(svg, &floor.standable, &STAND);
        map.walls(svg, plan);
        svg.group("walls-unseen", "walls-unseen", |svg| {
            for (wall, _) in plan.walls.iter().filter(|(_, n)| *n == 0) {
                svg.line(map.at(wall.ends[0]), map.at(wall.ends[1]), &WALL_UNSEEN);
            }
        });
        map.stations(svg, plan);
    });
    map.bar_and_north(&mut svg, out.frame.north_deg);
    let top = map.frame[1] + map.frame[3] + 5.0;
    let mut entries = vec![
        (Sample::Area(MORE.to_vec()), "seen from three places or more"),
        (Sample::Area(TWICE.to_vec()), "seen from two"),
        (Sample::Area(ONCE.to_vec()), "seen from one"),
        (Sample::Area(vec![UNSEEN]), "seen from none of them"),
        (Sample::Area(vec![UNREACHABLE]), "seen from nowhere allowed"),
        (Sample::Line(WALL_UNSEEN), "wall not seen, or too obliquely"),
        (Sample::Line(STAND), "a tripod can stand within"),
        (Sample::Number, "station"),
    ];
    if !plan.present.is_empty() {
        entries.push((Sample::Square, "probe taken already"));
    }
    if floor.open.count() > floor.target.count() + 200 {
        entries.push((Sample::Area(vec![VOID]), "open, not this floor below"));
    }
    legend(&mut svg, [MARGIN, top], &entries);
    let width = map.frame[2];
    let chart = (width - 72.0) * 0.5;
    curve(&mut svg, [MARGIN + 74.0, top + 2.0, chart - 8.0, 44.0], plan);
    words(&mut svg, [MARGIN + 74.0 + chart + 2.0, top + 4.0], width - 76.0 - chart, 2.7, &findings(plan, lengths));
    let foot = map.paper[1] - MARGIN - TITLE_BLOCK + 4.0;
    words(&mut svg, [MARGIN, foot - 2.0], width, FINE_PRINT, &[SOFTWARE.to_owned()]);
    title_block(&mut svg, [MARGIN, foot, width], &site.name, &site.project, number);
    svg
}

/// Bars: the share seen after each station; what each adds is the step.
fn curve(svg: &mut Svg, [x, y, width, height]: [f64; 4], plan: &FloorPlan) {
    svg.group("curve", "curve", |svg| {
        svg.text([x, y], "Floor seen after each station", &Text::new(3.2).bold());
        let (top, base) = (y + 6.0, y + height);
        let tall = base - top;
        for percent in [0, 25, 50, 75, 100] {
            let at = base - tall * f64::from(percent) / 100.0;
            svg.line([x + 9.0, at], [x + width, at], &Style::line(LIGHT, 0.2));
            svg.text([x + 8.0, at + 0.9], &format!("{percent} %"), &Text::new(FINE_PRINT).anchor(Anchor::End));
        }
        let bars: Vec<(String, f64)> = (!plan.present.is_empty())
            .then(|| ("now".to_owned(), plan.present_fraction))
            .into_iter()
            .chain(plan.curve.iter().enumerate().map(|(i, v)| ((i + 1).to_string(), *v)))
            .collect();
        let step = (width - 9.0) / bars.len().max(1) as f64;
        let mut before = 0.0;
        for (i, (name, value)) in bars.iter().enumerate() {
            let left = x + 9.0 + step * i as f64 + 0.15 * step;
            let wide = (0.7 * step).min(9.0);
            let bar = |from: f64, to: f64| [left, base - tall * to, wide, tall * (to - from).max(0.0)];
            svg.rectangle(bar(0.0, before), &Style::fill(SKY).outlined(BLACK, 0.15));
            svg.rectangle(bar(before, *value), &Style::fill(BLUE).outlined(BLACK, 0.15));
            let middle = left + wide / 2.0;
            svg.text([middle, base + 3.2], name, &Text::new(FINE_PRINT).anchor(Anchor::Middle));
            if step > 6.0 {
                let text = Text::new(FINE_PRINT).anchor(Anchor::Middle);
                svg.text([middle, base - tall * value - 0.8], &format!("{:.0}", 100.0 * value), &text);
            }
            before = *value;
        }
        svg.line([x + 9.0, base], [x + width, base], &Style::line(BLACK, 0.3));
    });
}

fn findings(plan: &FloorPlan, lengths: Lengths) -> Vec<String> {
    let area = |m2: f64, decimals| lengths.area(m2, decimals);
    let mut all = vec![
        format!(
            "In plan, {:.1} % of the floor that can be seen at all is seen, and {:.1} % of the walls at probe height.",
            100.0 * plan.covered_fraction(),
            100.0 * plan.wall_fraction
        ),
        format!("{} of {} can be seen from no allowed place.", area(plan.unreachable_m2, 1), area(plan.area_m2, 1)),
    ];
    if let Some(s) = plan.surface {
        all.push(format!(
            "In space, the lenses see {:.1} % of the {} of surface that can be seen from this floor. What they miss are \
             mostly vaults, ledges and what stands behind furniture. {} more cannot be seen from any allowed place.",
            100.0 * s.covered_fraction,
            area(s.reachable_m2, 0),
            area(s.unreachable_m2, 0)
        ));
    }
    all.push(needed(plan));
    all
}
