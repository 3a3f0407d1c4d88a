//! A plot with both axes in logarithms.

use super::style::{BLACK, FINE_PRINT, GREY, LIGHT, Style, WHITE};
use super::svg::{Anchor, Point, Svg, Text};

/// The shape of a point, so that nothing is said by colour alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::report) enum Mark {
    /// A filled disc.
    Disc,
    /// An open square.
    Square,
    /// A filled triangle.
    Triangle,
    /// An open diamond.
    Diamond,
    /// A cross.
    Cross,
}

impl Mark {
    /// Draws it with a half width in millimetres.
    pub(in crate::report) fn draw(self, svg: &mut Svg, [x, y]: Point, r: f64, colour: &'static str) {
        let open = Style::fill(WHITE).outlined(colour, 0.4);
        match self {
            Self::Disc => svg.circle([x, y], r, &Style::fill(colour)),
            Self::Square => svg.rectangle([x - 0.9 * r, y - 0.9 * r, 1.8 * r, 1.8 * r], &open),
            Self::Triangle => {
                svg.area(&[[[x, y - 1.2 * r], [x + 1.1 * r, y + r], [x - 1.1 * r, y + r]]], &Style::fill(colour));
            }
            Self::Diamond => {
                let s = 1.25 * r;
                svg.area(&[[[x, y - s], [x + s, y], [x, y + s], [x - s, y]]], &open);
            }
            Self::Cross => {
                svg.line([x - r, y - r], [x + r, y + r], &Style::line(colour, 0.5));
                svg.line([x - r, y + r], [x + r, y - r], &Style::line(colour, 0.5));
            }
        }
    }
}

/// A frame on the sheet with ranges of both axes.
pub(in crate::report) struct Plot {
    frame: [f64; 4],
    /// Decimal logarithms of the ends of the axes.
    x: [f64; 2],
    y: [f64; 2],
}

impl Plot {
    /// A plot in a frame [left, top, width, height] that shows all points; `None` without any.
    pub(in crate::report) fn around(frame: [f64; 4], points: &[(f64, f64)]) -> Option<Self> {
        let logs = |part: fn(&(f64, f64)) -> f64| -> Option<[f64; 2]> {
            let all = points.iter().map(part).filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
            let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |r, v| (r.0.min(v), r.1.max(v)));
            (low <= high).then_some([low, high])
        };
        let (x, y) = (logs(|p| p.0)?, logs(|p| p.1)?);
        let room = |[low, high]: [f64; 2], share: f64| {
            let more = (share * (high - low)).max(0.08);
            [low - more, high + more]
        };
        let [low, high] = room(y, 0.08);
        // room for what is written under the lowest point
        Some(Self { frame, x: room(x, 0.05), y: [low - 0.12 * (high - low), high] })
    }

    /// Where a point stands on the sheet.
    pub(in crate::report) fn at(&self, x: f64, y: f64) -> Point {
        let [left, top, width, height] = self.frame;
        let along = |v: f64, [low, high]: [f64; 2]| (v.max(f64::MIN_POSITIVE).log10() - low) / (high - low);
        [left + width * along(x, self.x), top + height * (1.0 - along(y, self.y))]
    }

    /// What `draw` draws, cut at the frame.
    pub(in crate::report) fn clipped(&self, svg: &mut Svg, draw: impl FnOnce(&mut Svg)) {
        svg.clipped(self.frame, draw);
    }

    /// Frame, grid, figures and names of the axes.
    pub(in crate::report) fn axes(&self, svg: &mut Svg, x_name: &str, y_name: &str) {
        let [left, top, width, height] = self.frame;
        let small = Text::new(FINE_PRINT);
        let mut last = f64::NEG_INFINITY;
        for v in ticks(self.x) {
            let [x, _] = self.at(v, 1.0);
            svg.line([x, top], [x, top + height], &Style::line(LIGHT, 0.15));
            if x - last > 8.0 {
                svg.text([x, top + height + 3.4], &figure(v), &small.anchor(Anchor::Middle));
                last = x;
            }
        }
        let mut last = f64::INFINITY;
        for v in ticks(self.y) {
            let [_, y] = self.at(1.0, v);
            svg.line([left, y], [left + width, y], &Style::line(LIGHT, 0.15));
            if last - y > 3.5 {
                svg.text([left - 1.0, y + 0.8], &figure(v), &small.anchor(Anchor::End));
                last = y;
            }
        }
        svg.rectangle(self.frame, &Style::line(BLACK, 0.25));
        svg.text([left + 0.5 * width, top + height + 7.4], x_name, &Text::new(FINE_PRINT).anchor(Anchor::Middle));
        svg.text([left - 8.4, top + 0.5 * height], y_name, &Text::new(FINE_PRINT).anchor(Anchor::Middle).turn(-90.0));
    }

    /// A mark at a point.
    pub(in crate::report) fn mark(&self, svg: &mut Svg, mark: Mark, (x, y): (f64, f64), r: f64, colour: &'static str) {
        if x > 0.0 && y > 0.0 {
            mark.draw(svg, self.at(x, y), r, colour);
        }
    }

    /// An upright bar from the lower to the upper limit of y.
    pub(in crate::report) fn error_bar(&self, svg: &mut Svg, x: f64, [low, high]: [f64; 2], colour: &'static str) {
        if !(low > 0.0 && high.is_finite()) {
            return;
        }
        let (a, b) = (self.at(x, low), self.at(x, high));
        svg.line(a, b, &Style::line(colour, 0.25));
        for end in [a, b] {
            svg.line([end[0] - 0.6, end[1]], [end[0] + 0.6, end[1]], &Style::line(colour, 0.25));
        }
    }

    /// An arrow between two points of the plot.
    pub(in crate::report) fn arrow(&self, svg: &mut Svg, from: (f64, f64), to: (f64, f64)) {
        let (a, b) = (self.at(from.0, from.1), self.at(to.0, to.1));
        let d = [b[0] - a[0], b[1] - a[1]];
        let length = d[0].hypot(d[1]);
        if length < 2.0 {
            return;
        }
        let unit = [d[0] / length, d[1] / length];
        svg.line(a, b, &Style::line(GREY, 0.35));
        let side = |s: f64| [b[0] - 2.0 * unit[0] - s * unit[1], b[1] - 2.0 * unit[1] + s * unit[0]];
        svg.area(&[[b, side(0.8), side(-0.8)]], &Style::fill(GREY));
    }
}

/// 1, 2 and 5 times powers of ten within a range of decimal logarithms; only the powers where the range is wide.
fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let steps: &[f64] = if high - low > 3.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let decades = low.floor() as i32..=high.ceil() as i32;
    let all = decades.flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d)));
    all.filter(|v| (low..=high).contains(&v.log10())).collect()
}

fn figure(v: f64) -> String {
    let thousands = |v: f64| if v >= 1e4 { format!("{} 000", v / 1e3) } else { format!("{v}") };
    if v >= 1.0 { thousands(v) } else { format!("{}", (v * 1e9).round() / 1e9) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_stand_where_their_logarithms_say() {
        let plot = Plot::around([10.0, 10.0, 100.0, 50.0], &[(1.0, 0.1), (100.0, 1.0)]).unwrap();
        let [a, b, c] = [1.0, 10.0, 100.0].map(|x| plot.at(x, 0.1)[0]);
        assert!((b - a - (c - b)).abs() < 1e-9 && a > 10.0 && c < 110.0);
        assert!(plot.at(1.0, 1.0)[1] < plot.at(1.0, 0.1)[1], "up is more");
        assert!(Plot::around([0.0; 4], &[(f64::NAN, 1.0)]).is_none());
        let expected = [1.0, 2.0, 5.0, 10.0];
        assert!(ticks([-0.1, 1.1]).iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9));
        assert_eq!([0.05, 2.0, 20000.0].map(figure), ["0.05", "2", "20 000"]);
    }
}
