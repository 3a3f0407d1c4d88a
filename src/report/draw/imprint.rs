//! What a sheet says of itself: the title block, and fields to fill in by hand.

use super::png::text_width;
use super::style::{BLACK, FINE_PRINT, GREY, Style};
use super::svg::{Svg, Text};
use crate::site::Project;

/// Height of a title block, millimetres.
pub(in crate::report) const TITLE_BLOCK: f64 = 9.0;
/// Height of a row of fields to fill in, millimetres.
pub(in crate::report) const BLANKS: f64 = 8.0;
/// Height of what stands in a field, millimetres.
const VALUE: f64 = 2.8;

/// The program and its version.
pub(crate) const SOFTWARE: &str = concat!("clerestory ", env!("CARGO_PKG_VERSION"));

/// Draws a title block, [`TITLE_BLOCK`] high, with its upper left corner at `[x, y]` and as wide as `width`, all in
/// millimetres: of which site the sheet is, what the site file says of the work, and which sheet of how many of its kind
/// this is, from 1. A field that the site file does not fill is left blank, for a pen.
pub(in crate::report) fn title_block(
    svg: &mut Svg,
    [x, y, width]: [f64; 3],
    site: &str,
    p: &Project,
    [number, count]: [usize; 2],
) {
    let title = if p.title.is_empty() { site } else { &p.title };
    let sheet = format!("{number} of {count}");
    // names, words and shares of the width
    let fields = [
        ("Project", title, 0.27),
        ("Institution", p.institution.as_str(), 0.22),
        ("Author", p.author.as_str(), 0.17),
        ("Date", p.date.as_str(), 0.11),
        ("Rights", p.rights.as_str(), 0.14),
        ("Sheet", sheet.as_str(), 0.09),
    ];
    svg.group("title-block", "title-block", |svg| {
        svg.rectangle([x, y, width, TITLE_BLOCK], &Style::line(BLACK, 0.3));
        let mut left = x;
        for (name, value, share) in fields {
            let wide = share * width;
            if left > x {
                svg.line([left, y], [left, y + TITLE_BLOCK], &Style::line(BLACK, 0.15));
            }
            svg.text([left + 1.2, y + 2.6], name, &Text::new(FINE_PRINT).colour(GREY));
            let fits = (wide - 2.4) / text_width(value, VALUE, false).max(1e-9);
            svg.text([left + 1.2, y + 6.9], value, &Text::new(VALUE * fits.min(1.0)));
            left += wide;
        }
    });
}

/// Draws a row of named lines to write on, [`BLANKS`] high.
pub(in crate::report) fn blanks(svg: &mut Svg, [x, y, width]: [f64; 3], names: &[&str]) {
    let wide = width / names.len().max(1) as f64;
    svg.group("blanks", "blanks", |svg| {
        for (i, name) in names.iter().enumerate() {
            let left = x + i as f64 * wide;
            svg.text([left, y + 5.0], name, &Text::new(FINE_PRINT));
            let from = left + text_width(name, FINE_PRINT, false) + 1.5;
            svg.line([from, y + 5.4], [left + wide - 3.0, y + 5.4], &Style::line(GREY, 0.2));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_stays_in_its_cell_and_what_is_not_known_stays_blank() {
        let project = Project { institution: "Office for the Care of Monuments ".repeat(4), ..Project::default() };
        let mut svg = Svg::new(200.0, 20.0, "t", "d");
        title_block(&mut svg, [10.0, 5.0, 180.0], "Chapel", &project, [2, 5]);
        let text = svg.finish();
        let document = roxmltree::Document::parse(&text).unwrap();
        let words: Vec<_> = document.descendants().filter(|n| n.has_tag_name("text")).collect();
        let said: Vec<&str> = words.iter().map(|n| n.text().unwrap_or_default()).collect();
        assert!(said.contains(&"Chapel") && said.contains(&"2 of 5") && said.contains(&""), "{said:?}");
        let long = words.iter().find(|n| n.text() == Some(project.institution.as_str())).unwrap();
        let number = |name: &str| long.attribute(name).unwrap().parse::<f64>().unwrap();
        let end = number("x") + text_width(&project.institution, number("font-size"), false);
        assert!(end <= 10.0 + 180.0 * 0.49 - 1.1, "{end}");
    }
}
