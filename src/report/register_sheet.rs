//! The registration sheet: a picture beside what the model shows from the pose found, and the model's outlines over the
//! picture, before and after.

use glam::Vec3;

use super::audit_sheet::{picture_png, reduced};
use super::draw::a3::{GAP, HEADLINE_LINE, MARGIN, SIZE, draw_headline, headline};
use super::draw::imprint::{SOFTWARE, TITLE_BLOCK, title_block};
use super::draw::png::{capital, encoded, wrap};
use super::draw::style::{BLACK, BLUE, FINE_PRINT, GREY, LIGHT, Style, VERMILION};
use super::draw::svg::{Anchor, Svg, Text};
use crate::panorama::{Exposure, Picture, luminance};
use crate::register::{Preview, Registered, Subject, Verdict, preview};
use crate::scene::Scene;
use crate::site::edit::in_site_file;
use crate::site::{Pose, Site};

/// Room for a picture's title, millimetres.
const TITLE: f64 = 6.0;

/// Height of the foot, where the numbers stand.
const FOOT: f64 = 28.0;

/// Pixels along the longer side of the picture and of the model beside it.
const PIXELS: usize = 1024;

/// What a registration sheet is made from.
#[derive(Clone, Copy)]
pub struct RegisterSheet<'a> {
    /// The site, with the poses given.
    pub site: &'a Site,
    /// Its model.
    pub scene: &'a Scene,
    /// What was found.
    pub found: &'a Registered,
    /// The picture that was registered.
    pub picture: &'a Picture,
    /// The command line.
    pub command: &'a str,
    /// Which sheet of how many this is, from 1.
    pub sheet: [usize; 2],
}

/// The file name of a sheet without its ending: probes and views may share a name.
pub fn register_stem(site: &Site, subject: Subject) -> String {
    format!("register-{}-{}", subject.kind(), subject.name(site))
}

/// The verdict in plain words: what was found, how sure it is, and what to do where it is not.
pub fn register_words(found: &Registered) -> String {
    let sure = format!("sure to \u{b1} {} and \u{b1} {}", metres(found.position_m()), degrees(found.direction_deg()));
    match found.verdict {
        Verdict::Found => match found.moved() {
            None => format!("found, {sure}"),
            Some((m, deg)) if m < 2.0 * found.position_m() && deg < 2.0 * found.direction_deg() => {
                format!("found where the site file has it, {sure}")
            }
            Some((m, deg)) => format!("found {} away, turned by {}; {sure}", metres(m), degrees(deg)),
        },
        Verdict::Ambiguous => {
            let other = found.rival.as_ref().map_or_else(String::new, |r| {
                let (away, turn) =
                    (r.pose.position.distance(found.pose.position), crate::register::turn_deg(&r.pose, &found.pose));
                let turned = if turn < 5.0 { String::new() } else { format!(" and turned by {}", degrees(turn)) };
                format!(
                    ": another place, {} away{turned}, fits about as well ({:.2}, this one {:.2})",
                    metres(away),
                    r.fit,
                    r.best
                )
            });
            format!(
                "ambiguous{other}. The site file stays as it is. Compare them on the sheet (clerestory register), set the right one in the site file, and \
                 search --within less"
            )
        }
        Verdict::NotFound => {
            "not found: no place within reach fits. The site file stays as it is. See whether the picture shows this \
                              room and is not mirrored or upside down; then search farther, with --within, --tilt or --anywhere"
                .to_owned()
        }
    }
}

/// A length in words: millimetres below 10 cm.
fn metres(m: f64) -> String {
    match m {
        m if m < 0.01 => format!("{:.1} mm", 1e3 * m),
        m if m < 0.1 => format!("{:.0} mm", 1e3 * m),
        m => format!("{m:.2} m"),
    }
}

fn degrees(d: f64) -> String {
    match d {
        d if d < 0.1 => format!("{d:.3}\u{b0}"),
        d if d < 10.0 => format!("{d:.2}\u{b0}"),
        d => format!("{d:.1}\u{b0}"),
    }
}

/// How outlines are drawn: the colour, and whether the line is broken, so that it is told without colour, too.
#[derive(Clone, Copy)]
struct Ink {
    colour: &'static str,
    broken: bool,
}

const BEFORE: Ink = Ink { colour: VERMILION, broken: true };
const AFTER: Ink = Ink { colour: BLUE, broken: false };

/// A picture of the sheet.
struct Panel<'a> {
    class: &'static str,
    title: &'static str,
    /// From which pose the model is drawn; the bare picture where there is none.
    pose: Option<(&'a Pose, Ink)>,
    /// The model's surfaces, not the picture, under the outlines.
    model: bool,
}

/// Draws the sheet; its SVG groups are `header`, `picture`, `model`, `before`, `after`, `rival` and `numbers`, with ids of
/// the same names.
pub fn register_sheet(about: &RegisterSheet) -> Svg {
    let RegisterSheet { site, found, picture, .. } = *about;
    let name = found.subject.name(site);
    let says = register_words(found);
    let title = format!("{}: pose of the {} {name}", site.name, found.subject.kind());
    let headline = headline(&(capital(&says) + "."));
    let top = 22.0 + HEADLINE_LINE * headline.len() as f64;
    let panels = panels(found);
    let aspect = picture.width as f64 / picture.height.max(1) as f64;
    let (columns, wide) = layout(panels.len(), aspect, SIZE[1] - FOOT - TITLE_BLOCK - MARGIN - top);
    let high = wide / aspect;
    let below = top + panels.len().div_ceil(columns) as f64 * (high + TITLE + 3.0) + 5.0;
    // the sheet ends where its content does
    let mut svg = Svg::new(SIZE[0], below + FOOT + TITLE_BLOCK + 4.0, &title, &says);
    svg.group("header", "header", |svg| header(svg, about, &headline));
    for (i, panel) in panels.iter().enumerate() {
        let left = MARGIN + (i % columns) as f64 * (wide + GAP);
        let y = top + TITLE + (i / columns) as f64 * (high + TITLE + 3.0);
        svg.group(panel.class, panel.class, |svg| draw(svg, about, panel, [left, y, wide, high]));
    }
    svg.group("numbers", "numbers", |svg| numbers(svg, about, below));
    let place = [MARGIN, below + FOOT - 3.0, SIZE[0] - 2.0 * MARGIN];
    title_block(&mut svg, place, &site.name, &site.project, about.sheet);
    svg
}

/// In how many columns so many pictures are largest, and how wide each then is, where all rows are this high at most.
fn layout(count: usize, aspect: f64, height: f64) -> (usize, f64) {
    let wide = |columns: usize| {
        let rows = count.div_ceil(columns) as f64;
        let room = (SIZE[0] - 2.0 * MARGIN - (columns - 1) as f64 * GAP) / columns as f64;
        room.min((height / rows - TITLE - 3.0) * aspect).max(10.0)
    };
    // of two that are about as large, more columns: the sheet is lower
    let all = (1..=count.max(1)).map(|c| (c, wide(c)));
    all.fold((1, 0.0), |best, next| if next.1 >= 0.95 * best.1 { next } else { best })
}

/// Title, command, and the sentence that matters.
fn header(svg: &mut Svg, about: &RegisterSheet, headline: &[String]) {
    let RegisterSheet { site, found, command, .. } = *about;
    let name = found.subject.name(site);
    let title = format!("{} \u{2014} pose of the {} \u{201c}{name}\u{201d}", site.name, found.subject.kind());
    svg.text([MARGIN, 16.0], &title, &Text::new(6.0).bold());
    svg.text(
        [SIZE[0] - MARGIN, 9.0],
        &format!("{SOFTWARE}: {command}"),
        &Text::new(FINE_PRINT).colour(GREY).anchor(Anchor::End),
    );
    draw_headline(svg, headline);
}

fn panels(found: &Registered) -> Vec<Panel<'_>> {
    let over = |class, title, pose, ink| Panel { class, title, pose: Some((pose, ink)), model: false };
    let model = |title| Panel { class: "model", title, pose: Some((&found.pose, AFTER)), model: true };
    let mut panels = vec![Panel { class: "picture", title: "The picture", pose: None, model: false }];
    let before =
        found.given.as_ref().map(|given| over("before", "BEFORE: edges from the pose given (broken)", given, BEFORE));
    let after = |title| over("after", title, &found.pose, AFTER);
    match found.verdict {
        Verdict::Found => {
            panels.push(model("The model from the pose found"));
            panels.extend(before);
            panels.push(after("AFTER: edges from the pose found (full)"));
        }
        Verdict::Ambiguous => {
            panels.push(model("The model from where it fits best"));
            panels.extend(before);
            panels.push(after("Edges from where it fits best (full)"));
            let other = |r| over("rival", "Edges from the other place (broken)", r, BEFORE);
            panels.extend(found.rival.as_ref().map(|r| other(&r.pose)));
        }
        Verdict::NotFound => {
            panels.push(model(if before.is_some() { "The model from the pose given" } else { "The nearest to a fit" }));
            panels.extend(before);
        }
    }
    panels
}

fn draw(svg: &mut Svg, about: &RegisterSheet, panel: &Panel, frame: [f64; 4]) {
    let RegisterSheet { site, scene, found, picture, .. } = *about;
    svg.text([frame[0], frame[1] - 1.6], panel.title, &Text::new(3.2).bold());
    let full = [picture.width, picture.height];
    let scale = PIXELS as f64 / picture.width.max(picture.height).max(1) as f64;
    let size = full.map(|n| ((n as f64 * scale).round() as usize).max(1));
    let shown = panel.pose.map(|(pose, ink)| (preview(site, scene, found.subject, pose, full, size), ink));
    let exposure = Exposure::of(picture);
    let under = match &shown {
        Some((model, _)) if panel.model => model_png(model),
        Some(_) => {
            // pale and grey, so that lines stand out
            picture_png(&reduced(picture, PIXELS), |p| Vec3::splat(0.3 + 0.7 * luminance(exposure.show(p))))
        }
        None => picture_png(&reduced(picture, PIXELS), |p| exposure.show(p)),
    };
    if let Some(png) = under {
        svg.png(frame, &png, panel.title);
    }
    if let Some((model, ink)) = shown
        && let Some(png) = outlines(&model, ink, size[0] as f64 / frame[2])
    {
        svg.png(frame, &png, "Edges of the model");
    }
    svg.rectangle(frame, &Style::line(BLACK, 0.25));
}

/// The model's surfaces in grey, as light as a photograph of them would be; white where the picture shows nothing.
fn model_png(model: &Preview) -> Option<Vec<u8>> {
    let mut picture = Picture::new(model.width, model.height);
    for (p, shade) in picture.pixels.iter_mut().zip(&model.shade) {
        *p = shade.map_or(Vec3::NAN, Vec3::splat);
    }
    let exposure = Exposure::of(&picture);
    picture_png(&picture, |p| if Picture::valid(p) { exposure.show(p) } else { Vec3::ONE })
}

/// The model's edges on nothing, at so many pixels a millimetre.
fn outlines(model: &Preview, ink: Ink, per_mm: f64) -> Option<Vec<u8>> {
    /// Line width and length of a dash, millimetres.
    const WIDTH: f64 = 0.3;
    const DASH: f64 = 1.2;
    let wide = (WIDTH * per_mm).round().max(1.0) as usize;
    let dash = (DASH * per_mm).round().max(2.0) as usize;
    let rgb = |k: usize| u8::from_str_radix(ink.colour.get(k..k + 2).unwrap_or("00"), 16).unwrap_or(0);
    let colour = [rgb(1), rgb(3), rgb(5), 255];
    let (w, h) = (model.width, model.height);
    let mut pixels = vec![0u8; 4 * w * h];
    for i in (0..w * h).filter(|&i| model.edge[i]) {
        let (x, y) = (i % w, i / w);
        // broken along level and upright lines alike
        if ink.broken && ((x + 2 * y) / dash) % 2 == 1 {
            continue;
        }
        for (dx, dy) in (0..wide * wide).map(|k| (k % wide, k / wide)) {
            if x + dx < w && y + dy < h {
                let j = 4 * ((y + dy) * w + x + dx);
                pixels[j..j + 4].copy_from_slice(&colour);
            }
        }
    }
    encoded(&pixels, [w, h], image::ExtendedColorType::Rgba8)
}

/// The poses in numbers, as the site file has them.
fn numbers(svg: &mut Svg, about: &RegisterSheet, top: f64) {
    let RegisterSheet { site, found, .. } = *about;
    const SMALL: f64 = 3.0;
    const COLUMNS: [(&str, f64); 6] = [
        ("", 0.0),
        ("position (model\u{2019}s axes and units)", 32.0),
        ("heading", 102.0),
        ("pitch", 122.0),
        ("roll", 142.0),
        ("fit", 160.0),
    ];
    for (title, x) in COLUMNS {
        svg.text([MARGIN + x, top], title, &Text::new(SMALL).bold());
    }
    let mut rows: Vec<_> = found.given.iter().zip(found.fit_given).map(|(given, fit)| ("before", given, fit)).collect();
    match (found.verdict, &found.rival) {
        (Verdict::Found, _) => rows.push(("found", &found.pose, found.fit)),
        (Verdict::Ambiguous, rival) => {
            rows.push(("fits best", &found.pose, found.fit));
            rows.extend(rival.as_ref().map(|r| ("other place", &r.pose, r.fit)));
        }
        (Verdict::NotFound, _) => {}
    }
    let mut y = top;
    for (name, pose, fit) in rows {
        svg.line([MARGIN, y + 1.6], [MARGIN + 172.0, y + 1.6], &Style::line(LIGHT, 0.2));
        y += 5.5;
        let (position, [heading, pitch, roll]) = in_site_file(&site.frame, pose);
        let cells = [name.to_owned(), position.join(", "), heading, pitch, roll, format!("{fit:.2}")];
        for (cell, (_, x)) in cells.iter().zip(COLUMNS) {
            let look = if x == 0.0 { Text::new(SMALL).bold() } else { Text::new(SMALL) };
            svg.text([MARGIN + x, y], cell, &look);
        }
    }
    let x = MARGIN + 190.0;
    let mut y = top;
    let mut lines = Vec::new();
    if found.verdict != Verdict::NotFound {
        let moved = found.moved().map_or_else(
            || "The site file had no place.".to_owned(),
            |(m, deg)| format!("Moved by {}, turned by {}.", metres(m), degrees(deg)),
        );
        lines.push(format!(
            "{moved} Standard deviation: place {}, direction {}.",
            metres(found.position_m()),
            degrees(found.direction_deg())
        ));
    }
    if let (Some(r), Verdict::Found) = (&found.rival, found.verdict) {
        lines.push(format!(
            "Next best: {} away, fit {:.2} where this one has {:.2}: {:.0} standard errors worse.",
            metres(r.pose.position.distance(found.pose.position)),
            r.fit,
            r.best,
            r.worse
        ));
    }
    lines.push(
        "Fit: correlation of the picture\u{2019}s edges with the model\u{2019}s, 1 at best; 0.5 to 0.7 is usual, for light and \
         shadow have edges that no model has. Read the sheet by the lines: from a right pose they run along corners, frames and \
         steps in the picture; from a wrong one they cross them."
            .to_owned(),
    );
    for line in lines.iter().flat_map(|l| wrap(l, SIZE[0] - MARGIN - x, SMALL, false)) {
        svg.text([x, y], &line, &Text::new(SMALL));
        y += 4.2;
    }
}
