//! What the sheets on A3 share: their size, and the sentence that matters most, over all their width.

use super::png::wrap;
use super::style::{BLACK, Style};
use super::svg::{Svg, Text};

/// A3 landscape, millimetres.
pub(in crate::report) const SIZE: [f64; 2] = [420.0, 297.0];
/// What is left free around a sheet's content, and between its parts.
pub(in crate::report) const MARGIN: f64 = 10.0;
pub(in crate::report) const GAP: f64 = 5.0;
/// Size and line height of the headline, and where its first line stands.
const HEADLINE: f64 = 4.2;
pub(in crate::report) const HEADLINE_LINE: f64 = 5.6;
const TOP: f64 = 24.0;

/// A headline's lines.
pub(in crate::report) fn headline(says: &str) -> Vec<String> {
    wrap(says, SIZE[0] - 2.0 * MARGIN, HEADLINE, true)
}

/// Draws a headline with a rule below it; gives where the next line would stand.
pub(in crate::report) fn draw_headline(svg: &mut Svg, lines: &[String]) -> f64 {
    let mut y = TOP;
    for line in lines {
        svg.text([MARGIN, y], line, &Text::new(HEADLINE).bold());
        y += HEADLINE_LINE;
    }
    svg.line([MARGIN, y - 2.5], [SIZE[0] - MARGIN, y - 2.5], &Style::line(BLACK, 0.35));
    y
}
