//! The sheet itself.

use super::subject::{AuditSheet, look};
use super::{key_plan, pictures, table, words};
use crate::audit::{Shares, Verdict};
use crate::report::draw::a3::{GAP, MARGIN, SIZE, draw_headline, headline};
use crate::report::draw::imprint::{TITLE_BLOCK, title_block};
use crate::report::style::{BLACK, FINE_PRINT, GREY, LIGHT, Style};
use crate::report::{Anchor, Fingerprint, Svg, Text, wrap};

const SMALL: f64 = 2.6;

/// Height of a line of fine print.
const LINE: f64 = 3.2;

/// Widths of the key plan and of the legend below it.
const PLAN: f64 = 88.0;
const LEGEND: f64 = 66.0;

/// Height of the foot, where method and inputs stand.
const FOOT: f64 = 39.0;

/// Draws the sheet of one view; its SVG groups are `header`, `photograph`, `render`, `neutral`, `classified`, `legend`, `key-plan`,
/// `findings` and `method`, with ids of the same names, and a `finding-row` each with the id `row-` and the finding's.
pub(super) fn audit_sheet(about: &AuditSheet) -> Svg {
    let name = &about.view().summary.view;
    let says = words::headline(about);
    let mut svg = Svg::new(SIZE[0], SIZE[1], &format!("{}: audit of the view {name}", about.site.name), &says);
    let mut y = 0.0;
    svg.group("header", "header", |svg| y = header(svg, about, &says));
    let room = SIZE[0] - 2.0 * MARGIN - 3.0 * GAP;
    let top = y + 6.0;
    let [_, high] = pictures::draw(&mut svg, about, [MARGIN, top], [room / 4.0, 80.0], GAP);
    let below = top + high + 6.0;
    let bottom = SIZE[1] - MARGIN - TITLE_BLOCK - FOOT;
    let rest = bottom - below;
    let beside = MARGIN + PLAN + GAP;
    svg.group("legend", "legend", |svg| legend(svg, about, [beside, below + 6.0, LEGEND]));
    svg.group("key-plan", "key-plan", |svg| {
        svg.text([MARGIN, below + 4.0], "Key plan, cut at the camera's height", &Text::new(3.2).bold());
        let frame = [MARGIN, below + 6.0, PLAN, rest - 8.0];
        if let Some(view) = about.site.views.iter().find(|v| v.name == *name) {
            key_plan::draw(svg, about, view, frame);
        }
        svg.rectangle(frame, &Style::line(GREY, 0.2));
    });
    svg.group("findings", "findings", |svg| {
        let left = beside + LEGEND + GAP;
        table::draw(svg, about, [left, below, SIZE[0] - MARGIN - left, rest - 2.0]);
    });
    svg.group("method", "method", |svg| foot(svg, about, bottom + 2.0));
    let place = [MARGIN, SIZE[1] - MARGIN - TITLE_BLOCK, SIZE[0] - 2.0 * MARGIN];
    let number = [about.index + 1, about.audit.views.len()];
    title_block(&mut svg, place, &about.site.name, &about.site.project, number);
    svg
}

/// Title, dates and the sentence that matters most; gives where they end.
fn header(svg: &mut Svg, about: &AuditSheet, says: &str) -> f64 {
    let view = &about.view().summary;
    let sheet = format!("Sheet {} of {}", about.index + 1, about.audit.views.len());
    svg.text(
        [MARGIN, 16.0],
        &format!("{} — audit of the view “{}”", about.site.name, view.view),
        &Text::new(6.0).bold(),
    );
    let right = |svg: &mut Svg, y: f64, text: &str, look: Text| {
        svg.text([SIZE[0] - MARGIN, y], text, &look.anchor(Anchor::End));
    };
    right(svg, 13.0, &sheet, Text::new(3.6).bold());
    let surveyed = match about.surveyed {
        "" => "date of the photograph not stated".to_owned(),
        date => format!("photograph taken {date}"),
    };
    right(svg, 17.5, &format!("{surveyed} · audited {}", about.audited), Text::new(SMALL).colour(GREY));
    draw_headline(svg, &headline(says))
}

/// Colours and hatches with their shares, and why the rest could not be tested.
fn legend(svg: &mut Svg, about: &AuditSheet, [x, top, width]: [f64; 3]) {
    let view = &about.view().summary;
    let Shares { ok, texture, geometry, ambiguous, untestable } = view.shares;
    svg.text([x, top - 1.8], "Legend, share of picture", &Text::new(3.2).bold());
    let entries = [
        (Verdict::Geometry, geometry, "geometry wrong", "the surface is not where the model has it"),
        (Verdict::Texture, texture, "texture wrong", "the surface is right, its picture is not"),
        (Verdict::Ambiguous, ambiguous, "unclear", "something disagrees; see the reason"),
        (Verdict::Untestable, untestable, "not testable", "no pass: nothing can be told there"),
        (Verdict::Ok, ok, "agrees", "compared, and no fault found"),
    ];
    let mut y = top + 1.0;
    for (verdict, share, title, explained) in entries {
        let swatch = [x, y, 11.0, 7.0];
        if let Some((wash, opacity, hatch)) = look(verdict) {
            svg.rectangle(swatch, &Style::fill(wash).opacity(opacity));
            svg.rectangle(swatch, &Style::hatch(hatch));
        }
        svg.rectangle(swatch, &Style::line(BLACK, 0.25));
        svg.text([x + 13.0, y + 3.0], title, &Text::new(2.9).bold());
        svg.text([x + 13.0, y + 6.4], explained, &Text::new(FINE_PRINT));
        svg.text([x + width, y + 3.0], &percent(share), &Text::new(2.9).bold().anchor(Anchor::End));
        y += 10.0;
    }
    y += 1.0;
    svg.text([x, y + 2.0], "F1 … findings;  D1 … doubts, broken outline", &Text::new(FINE_PRINT));
    key_plan::probe(svg, [x + 2.0, y + 5.2]);
    svg.text([x + 5.0, y + 6.0], "light probe", &Text::new(FINE_PRINT));
    key_plan::camera(svg, [x + 25.0, y + 5.2]);
    svg.text([x + 28.0, y + 6.0], "camera, and what it sees", &Text::new(FINE_PRINT));
    let lines: Vec<String> = words::reasons(view, 4);
    if !lines.is_empty() {
        svg.text([x, y + 11.5], "Not tested or not told, because", &Text::new(SMALL).bold());
        y += 15.2;
        for line in lines.iter().flat_map(|l| wrap(&format!("– {l}"), width, SMALL, false)) {
            svg.text([x, y], &line, &Text::new(SMALL));
            y += 3.4;
        }
    }
}

fn percent(share: f64) -> String {
    let p = 100.0 * share;
    if p > 0.0 && p < 1.0 { format!("{p:.1} %") } else { format!("{p:.0} %") }
}

/// Method, fit and inputs in three columns.
fn foot(svg: &mut Svg, about: &AuditSheet, top: f64) {
    let view = &about.view().summary;
    let method = &about.audit.method;
    svg.line([MARGIN, top - 2.0], [SIZE[0] - MARGIN, top - 2.0], &Style::line(BLACK, 0.35));
    let widths = [126.0, 136.0, SIZE[0] - 2.0 * MARGIN - 126.0 - 136.0 - 2.0 * GAP];
    let thresholds: Vec<String> =
        method.thresholds.iter().map(|(name, value)| format!("{} {value}", name.replace('_', " "))).collect();
    let lighting = if method.lighting.is_empty() { String::new() } else { format!(" Lighting {}.", method.lighting) };
    let first = vec![format!("{}{lighting}", words::METHOD), format!("Thresholds: {}.", thresholds.join(", "))];
    let mut second: Vec<String> = view.warnings.iter().map(|w| format!("! {w}")).collect();
    second.extend(view.probes.iter().filter_map(|p| p.warning.as_ref()).map(|w| format!("! {w}")));
    second.extend(words::fitted(view));
    let mut x = MARGIN;
    for ((title, lines), width) in [("Method", first), ("Fit", second)].into_iter().zip(widths) {
        svg.text([x, top + 2.0], title, &Text::new(SMALL).bold());
        column(svg, [x, top + 5.2], width, &lines);
        x += width + GAP;
    }
    svg.text([x, top + 2.0], "Made from", &Text::new(SMALL).bold());
    let mut y = top + 5.2;
    for line in wrap(&format!("clerestory {}: {}", method.version, about.command), widths[2], FINE_PRINT, false) {
        svg.text([x, y], &line, &Text::new(FINE_PRINT));
        y += LINE;
    }
    for (i, Fingerprint { file, sha256, .. }) in about.inputs.iter().enumerate() {
        if y + LINE > top + FOOT - 3.0 && i + 1 < about.inputs.len() {
            svg.text([x, y], &format!("and {} files more", about.inputs.len() - i), &Text::new(FINE_PRINT));
            break;
        }
        // the whole fingerprint, whatever that leaves of the name
        svg.text([x, y], &shortened(file, 15), &Text::new(FINE_PRINT));
        svg.text([x + widths[2], y], sha256, &Text::new(FINE_PRINT).anchor(Anchor::End));
        y += LINE;
    }
    svg.line([x - 0.5 * GAP, top], [x - 0.5 * GAP, top + FOOT - 4.0], &Style::line(LIGHT, 0.2));
}

/// Lines of fine print as far as there is room.
fn column(svg: &mut Svg, [x, top]: [f64; 2], width: f64, lines: &[String]) {
    let most = ((FOOT - 8.0) / LINE) as usize;
    let all: Vec<String> = lines.iter().flat_map(|l| wrap(l, width, FINE_PRINT, false)).collect();
    for (i, line) in all.iter().take(most).enumerate() {
        svg.text([x, top + LINE * i as f64], line, &Text::new(FINE_PRINT).colour(BLACK));
    }
}

/// The end of a long name.
fn shortened(name: &str, most: usize) -> String {
    let count = name.chars().count();
    if count <= most {
        name.to_owned()
    } else {
        format!("…{}", name.chars().skip(count + 1 - most).collect::<String>())
    }
}
