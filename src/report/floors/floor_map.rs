//! What the sheets of a floor share: paper, scale, walls, scale bar and north arrow.

use glam::DVec2;

use crate::plan::floors::raster::Map;
use crate::plan::free_space::contour::polygons;
use crate::plan::stations::result::{FloorPlan, Station};
use crate::report::draw::lengths::Lengths;
use crate::report::draw::png::{text_width, wrap};
use crate::report::draw::style::{BLACK, GREY, Hatch, LIGHT, Pattern, Style, WHITE};
use crate::report::draw::svg::{Anchor, Point, Svg, Text};

/// Millimetres left free around the sheet.
pub(super) const MARGIN: f64 = 12.0;
/// Where the map begins below the sheet's upper edge, millimetres.
const TOP: f64 = 27.0;
/// Height of a station's name, and how far right of its place it begins, millimetres.
const NAME: f64 = 2.6;
const NAME_GAP: f64 = 2.4;

/// The model cut at lens height, and lower down.
pub(super) const WALL: Style = Style::line(BLACK, 0.35);
pub(super) const FURNITURE: Style = Style::line(GREY, 0.15);

/// A floor's place on an A4 sheet.
pub(super) struct FloorMap {
    /// The map's frame on the sheet: x, y, width, height in millimetres.
    pub(super) frame: [f64; 4],
    /// The sheet's width and height in millimetres.
    pub(super) paper: [f64; 2],
    /// The map is 1 to this.
    pub(super) scale: f64,
    middle: DVec2,
    lengths: Lengths,
}

impl FloorMap {
    /// Chooses how the sheet lies and a usual scale, so that the floor fits above `panel` millimetres of text.
    pub(super) fn of(plan: &FloorPlan, panel: f64, lengths: Lengths) -> Self {
        let corners = || plan.outline.iter().flat_map(|p| &p.outer).copied();
        let low = corners().fold(DVec2::INFINITY, DVec2::min);
        let high = corners().fold(DVec2::NEG_INFINITY, DVec2::max);
        let size = (high - low).max(DVec2::splat(0.1));
        let paper = if size.x > 1.2 * size.y { [297.0, 210.0] } else { [210.0, 297.0] };
        let frame = [MARGIN, TOP, paper[0] - 2.0 * MARGIN, paper[1] - TOP - panel - MARGIN];
        // room for walls, numbers and the bar
        let needed = 1000.0 * (size.x / (frame[2] - 12.0)).max(size.y / (frame[3] - 20.0));
        Self { frame, paper, scale: lengths.scale(needed), middle: (low + high) / 2.0, lengths }
    }

    /// Millimetres on the sheet of a point in local metres; north is up.
    pub(super) fn at(&self, p: DVec2) -> Point {
        let [x, y, w, h] = self.frame;
        let mm = (p - self.middle) * 1000.0 / self.scale;
        [x + w / 2.0 + mm.x, y + (h - 8.0) / 2.0 - mm.y]
    }

    /// A ring of points.
    pub(super) fn ring(&self, ring: &[DVec2]) -> Vec<Point> {
        ring.iter().map(|p| self.at(*p)).collect()
    }

    /// The sheet's head: what it is, of which site and floor, and the figures in a line.
    pub(super) fn head(&self, svg: &mut Svg, title: &str, subtitle: &str) {
        svg.group("head", "head", |svg| {
            svg.text([MARGIN, 16.0], title, &Text::new(5.6).bold());
            let wide = text_width(subtitle, 3.2, false);
            let size = 3.2 * ((self.paper[0] - 2.0 * MARGIN) / wide).min(1.0);
            svg.text([MARGIN, 22.0], subtitle, &Text::new(size).colour("#333333"));
            svg.line([MARGIN, 24.5], [self.paper[0] - MARGIN, 24.5], &Style::line(BLACK, 0.3));
        });
    }

    /// Walls: what blocks sight is filled grey, and the model cut at lens height is drawn black; lower down, grey.
    pub(super) fn walls(&self, svg: &mut Svg, plan: &FloorPlan) {
        svg.group("walls", "walls", |svg| {
            for polygon in &plan.outline {
                for hole in &polygon.holes {
                    svg.area(&[self.ring(hole)], &Style::fill(LIGHT));
                }
            }
            svg.group("furniture", "furniture", |svg| {
                plan.furniture.iter().for_each(|line| svg.polyline(&self.ring(line), &FURNITURE));
            });
            plan.section.iter().for_each(|line| svg.polyline(&self.ring(line), &WALL));
        });
    }

    /// What is open at probe height, but has another floor below: the void beside a gallery.
    pub(super) fn void(&self, svg: &mut Svg, plan: &FloorPlan) {
        let floor = &plan.floor;
        let void = Map::of(floor.open.grid, |c| floor.open.on[c] && !floor.target.on[c]);
        svg.group("void", "void", |svg| self.map(svg, &void.without_specks(0.2), &VOID));
    }

    /// The outline of a map's cells, filled.
    pub(super) fn map(&self, svg: &mut Svg, map: &Map, style: &Style) {
        for polygon in polygons(map, 0.7 * map.grid.cell_m) {
            let rings: Vec<Vec<Point>> = polygon.rings().map(|r| self.ring(r)).collect();
            svg.area(&rings, style);
        }
    }

    /// A bar of a round length and the scale, at the map's lower left, and an arrow to true north at its upper right.
    pub(super) fn bar_and_north(&self, svg: &mut Svg, north_deg: f64) {
        let [x, y, w, h] = self.frame;
        svg.group("scale", "scale", |svg| {
            let (length, says) = self.lengths.bar(60.0 * self.scale / 1000.0);
            let mm = length * 1000.0 / self.scale;
            let y = y + h - 5.0;
            for i in 0..5 {
                let style = if i % 2 == 0 { Style::fill(BLACK) } else { Style::fill(WHITE) };
                let part = [x + f64::from(i) * mm / 5.0, y, mm / 5.0, 1.8];
                svg.rectangle(part, &style.outlined(BLACK, 0.2));
            }
            svg.text([x, y - 1.0], "0", &Text::new(2.8));
            svg.text([x + mm, y - 1.0], &says, &Text::new(2.8).anchor(Anchor::Middle));
            svg.text([x + mm + 8.0, y + 1.8], &self.lengths.scale_says(self.scale), &Text::new(3.0));
        });
        svg.group("north", "north", |svg| {
            let middle = DVec2::new(x + w - 8.0, y + 10.0);
            let (sin, cos) = north_deg.to_radians().sin_cos();
            // clockwise from the sheet's up
            let turned = |p: DVec2| (middle + DVec2::new(p.x * cos - p.y * sin, p.x * sin + p.y * cos)).to_array();
            let p = |x: f64, y: f64| turned(DVec2::new(x, y));
            svg.area(&[[p(0.0, -7.0), p(2.6, 5.0), p(0.0, 3.0)]], &Style::fill(BLACK).outlined(BLACK, 0.2));
            svg.area(&[[p(0.0, -7.0), p(-2.6, 5.0), p(0.0, 3.0)]], &Style::fill(WHITE).outlined(BLACK, 0.2));
            let at = p(0.0, -9.5);
            svg.text([at[0], at[1] + 1.3], "N", &Text::new(3.6).bold().anchor(Anchor::Middle).halo(0.4));
        });
    }

    /// Points along what a station that is there already takes on the sheet, with its name.
    pub(super) fn named(&self, station: &Station) -> impl Iterator<Item = Point> {
        const APART: f64 = 4.0;
        let [x, y] = self.at(station.position.truncate());
        let long = NAME_GAP + text_width(&station.name, NAME, false);
        (0..=(long / APART).ceil() as usize).map(move |k| [x + long.min(k as f64 * APART), y])
    }

    /// The place of each station: a circle with its number, or a square with a name for one that is there already.
    pub(super) fn stations(&self, svg: &mut Svg, plan: &FloorPlan) {
        svg.group("stations", "stations", |svg| {
            for station in &plan.present {
                let [x, y] = self.at(station.position.truncate());
                svg.rectangle([x - 1.6, y - 1.6, 3.2, 3.2], &Style::fill(BLACK).outlined(WHITE, 0.3));
                svg.text([x + NAME_GAP, y + 1.0], &station.name, &Text::new(NAME).halo(0.4));
            }
            for (i, station) in plan.stations.iter().enumerate() {
                let [x, y] = self.at(station.position.truncate());
                svg.circle([x, y], 2.6, &Style::fill(WHITE).outlined(BLACK, if station.fixed { 0.9 } else { 0.5 }));
                let text = Text::new(3.4).bold().anchor(Anchor::Middle);
                svg.text([x, y + 1.2], &(i + 1).to_string(), &text);
            }
        });
    }
}

/// The void beside a gallery.
pub(super) const VOID: Style = Style::hatch(Hatch { pattern: Pattern::Dots, colour: GREY, spacing: 2.4, weight: 0.18 });

/// Lines of a legend: a sample and what it means.
pub(super) fn legend(svg: &mut Svg, at: Point, entries: &[(Sample, &str)]) {
    let step = 5.0;
    svg.group("legend", "legend", |svg| {
        svg.text([at[0], at[1] + 2.0], "Legend", &Text::new(3.2).bold());
        for (i, (sample, text)) in entries.iter().enumerate() {
            let (x, y) = (at[0], at[1] + 4.5 + i as f64 * step);
            match sample {
                Sample::Area(styles) => {
                    styles.iter().for_each(|s| svg.rectangle([x, y, 9.0, 3.6], s));
                    svg.rectangle([x, y, 9.0, 3.6], &Style::line(GREY, 0.15));
                }
                Sample::Line(style) => svg.line([x, y + 1.8], [x + 9.0, y + 1.8], style),
                Sample::Number => {
                    svg.circle([x + 4.5, y + 1.8], 1.9, &Style::fill(WHITE).outlined(BLACK, 0.45));
                    svg.text([x + 4.5, y + 2.75], "1", &Text::new(2.6).bold().anchor(Anchor::Middle));
                }
                Sample::Square => {
                    svg.rectangle([x + 3.0, y + 0.3, 3.0, 3.0], &Style::fill(BLACK));
                }
            }
            svg.text([x + 11.0, y + 2.9], text, &Text::new(2.7));
        }
    });
}

/// What stands before a legend's words.
pub(super) enum Sample {
    /// A patch with these fills, one over the other.
    Area(Vec<Style>),
    /// A line.
    Line(Style),
    /// A station's number.
    Number,
    /// A probe that is there already.
    Square,
}

/// Words in lines of a width, from a point down.
pub(super) fn words(svg: &mut Svg, [x, mut y]: Point, width: f64, size: f64, paragraphs: &[String]) {
    for paragraph in paragraphs {
        for line in wrap(paragraph, width, size, false) {
            svg.text([x, y], &line, &Text::new(size));
            y += size * 1.35;
        }
        y += size * 0.4;
    }
}
