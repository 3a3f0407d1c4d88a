//! The study sheet: error against time, log–log, with what it says in words and a table.

use super::table::{orders, table};
use crate::plan::export::tables::counted;
use crate::report::draw::imprint::{SOFTWARE, TITLE_BLOCK, title_block};
use crate::report::draw::loglog::{Mark, Plot};
use crate::report::draw::png::{text_width, wrap};
use crate::report::draw::style::{BLUE, FINE_PRINT, GREEN, GREY, LIGHT, ORANGE, PURPLE, Style, VERMILION};
use crate::report::draw::svg::{Anchor, Svg, Text};
use crate::site::Site;
use crate::study::{
    EqualTime, How, Method, Metric, Outside, Parameter, Row, SpeedUp, Study, Summary, order_said, pareto, rounded,
};

/// A4 portrait, millimetres.
const SIZE: [f64; 2] = [210.0, 297.0];
const MARGIN: f64 = 12.0;
const BODY: f64 = 3.0;

/// Path tracing.
const TRACED: Mark = Mark::Square;
/// What curves of other programs are drawn with.
const OUTSIDE: [(Mark, &str); 2] = [(Mark::Diamond, ORANGE), (Mark::Cross, GREEN)];

/// The sheet of a study; `command` is the one that makes it, `outside` are other programs' curves.
pub(super) fn study_sheet(site: &Site, command: &str, study: &Study, summary: &Summary, outside: &[Outside]) -> Svg {
    let says = headline(summary);
    let mut svg = Svg::new(SIZE[0], SIZE[1], &format!("{}: error against run time", study.site), &says);
    svg.text([MARGIN, 17.0], &format!("{} — error against run time", study.site), &Text::new(5.2).bold());
    svg.text([MARGIN, 22.5], &subtitle(study), &Text::new(FINE_PRINT).colour(GREY));
    let mut y = 28.0;
    for line in wrap(&says, SIZE[0] - 2.0 * MARGIN, 3.4, true) {
        svg.text([MARGIN, y], &line, &Text::new(3.4).bold());
        y += 4.6;
    }
    let wide = 0.5 * (SIZE[0] - 2.0 * MARGIN) - 3.0;
    let top = y + 5.0;
    // other programs' figures need room below
    let tall = if outside.is_empty() { 74.0 } else { 62.0 };
    for (i, with_setup) in [false, true].into_iter().enumerate() {
        let left = MARGIN + i as f64 * (wide + 6.0);
        let frame = [left + 10.0, top, wide - 11.0, tall];
        let title = if with_setup { "One frame with all set-up" } else { "One frame, set-up done" };
        svg.text([frame[0], top - 2.0], title, &Text::new(BODY).bold());
        let id = if with_setup { "with-setup" } else { "frame" };
        svg.group("plot", id, |svg| panel(svg, frame, summary, outside, with_setup));
    }
    y = top + tall + 16.0;
    y = legend(&mut svg, y, outside) + 6.6;
    svg.group("findings", "findings", |svg| y = findings(svg, y, study, summary, outside));
    let foot = SIZE[1] - 8.0 - TITLE_BLOCK;
    let (bottom, right) = (foot - 4.0, SIZE[0] - MARGIN);
    svg.group("table", "table", |svg| table(svg, y + 3.0, bottom, MARGIN, right, summary));
    svg.text([MARGIN, foot - 1.6], &format!("{SOFTWARE}, {command}"), &Text::new(FINE_PRINT).colour(GREY));
    title_block(&mut svg, [MARGIN, foot, right - MARGIN], &site.name, &site.project, [1, 1]);
    svg
}

/// The one sentence that matters most.
fn headline(summary: &Summary) -> String {
    let flip: Vec<&SpeedUp> = summary.speed_ups.iter().filter(|s| s.metric == Metric::Flip).collect();
    let mut equal = summary.equal_time.iter().filter(|e| e.metric == Metric::Flip);
    match flip.first() {
        None => match equal.find(|e| !e.with_setup) {
            None => "Image-based shooting against the truth; there is no other way to compare it with.".to_owned(),
            Some(e) => format!(
                "In the time of one frame, {} shows {}{} × the visible error (FLIP); it was not followed far enough to \
                 tell when it would show as little.",
                e.against,
                if e.how == How::First { "at least " } else { "" },
                rounded(e.ratio.value)
            ),
        },
        Some(s) => format!(
            "At the same visible error (FLIP {:.3}), {} takes {least}{} × as long for a frame, and {least}{} × as long with \
             all set-up counted{}.",
            s.error,
            s.against,
            rounded(s.frame.value),
            rounded(s.with_setup.value),
            if s.how == How::Extrapolated { " (extrapolated)" } else { "" },
            least = s.how.bound()
        ),
    }
}

fn subtitle(study: &Study) -> String {
    let lighting = if study.lighting.is_empty() { String::new() } else { format!(", lighting {}", study.lighting) };
    let share = match study.share {
        s if s >= 1.0 => String::new(),
        s => format!(", in tiles that make up {:.0} % of the pictures", 100.0 * s),
    };
    format!(
        "{}{lighting}; {}; error against {}{share}",
        counted(study.blocks.len(), "view"),
        counted(study.threads, "thread"),
        truth(study)
    )
}

fn truth(study: &Study) -> String {
    match study.truth.samples {
        None => "the photographs, whose own noise is not known here".to_owned(),
        Some(n) => format!("a path-traced reference of {n} samples a pixel"),
    }
}

/// Where a row stands: processor seconds, and FLIP.
fn place(row: &Row, with_setup: bool) -> (f64, f64) {
    let setup = if with_setup { row.setup.cpu_s } else { 0.0 };
    (row.frame.cpu_s + setup, row.flip.value)
}

fn panel(svg: &mut Svg, frame: [f64; 4], summary: &Summary, outside: &[Outside], with_setup: bool) {
    let places: Vec<(f64, f64)> = summary.rows.iter().map(|r| place(r, with_setup)).collect();
    let points = |o: &Outside| -> Vec<(f64, f64)> {
        o.points.iter().filter_map(|p| Some((p.cpu_s, p.error(Metric::Flip)?))).collect()
    };
    let flip = || summary.speed_ups.iter().filter(|s| s.metric == Metric::Flip);
    let mut reached: Vec<(f64, f64)> = places.iter().copied().chain(outside.iter().flat_map(points)).collect();
    reached.extend(flip().map(|s| (s.needed_cpu_s, s.error)));
    let Some(plot) = Plot::around(frame, &reached) else { return };
    plot.axes(svg, "processor seconds (all threads)", "visible error (FLIP)");
    plot.clipped(svg, |svg| {
        front(svg, &plot, &places);
        for (o, (mark, colour)) in outside.iter().zip(OUTSIDE) {
            curve(svg, &plot, &points(o), flip().find(|s| s.against == o.name), colour, mark);
        }
        let traced: Vec<_> = summary.rows.iter().filter(|r| r.setting.method == Method::PathTracing).collect();
        let points: Vec<_> = traced.iter().map(|r| place(r, with_setup)).collect();
        let end = flip().find(|s| s.against == Method::PathTracing.name());
        curve(svg, &plot, &points, end, VERMILION, TRACED);
        for row in &summary.rows {
            let (x, flip) = place(row, with_setup);
            let (mark, colour) = look(row);
            plot.error_bar(svg, x, [row.flip.low, row.flip.high], colour);
            plot.mark(svg, mark, (x, flip), 1.1, colour);
            if row.setting.method == Method::Ibs && row.setting.parameter == Parameter::AsItComes {
                svg.circle(plot.at(x, flip), 2.1, &Style::line(colour, 0.4));
            }
        }
    });
    arrows(svg, &plot, summary, with_setup);
}

/// The stepped line of what no other setting beats.
fn front(svg: &mut Svg, plot: &Plot, places: &[(f64, f64)]) {
    let best = pareto(places);
    let mut front: Vec<_> = places.iter().zip(best).filter(|p| p.1).map(|p| *p.0).collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut line = Vec::new();
    for pair in front.windows(2) {
        line.extend([plot.at(pair[0].0, pair[0].1), plot.at(pair[1].0, pair[0].1)]);
    }
    line.extend(front.last().map(|p| plot.at(p.0, p.1)));
    svg.polyline(&line, &Style::line(LIGHT, 1.6));
}

/// A measured curve, and broken lines to where it is continued.
fn curve(svg: &mut Svg, plot: &Plot, points: &[(f64, f64)], end: Option<&SpeedUp>, colour: &'static str, mark: Mark) {
    let mut at: Vec<_> = points.to_vec();
    at.sort_by(|a, b| a.0.total_cmp(&b.0));
    let line: Vec<_> = at.iter().map(|p| plot.at(p.0, p.1)).collect();
    svg.polyline(&line, &Style::line(colour, 0.35));
    if let (Some(last), Some(s)) = (line.last(), end.filter(|s| s.how == How::Extrapolated)) {
        svg.line(*last, plot.at(s.needed_cpu_s, s.error), &Style::line(colour, 0.35).dashed(1.2, 0.9));
    }
    for p in points {
        plot.mark(svg, mark, *p, 1.1, colour);
    }
}

fn look(row: &Row) -> (Mark, &'static str) {
    match row.setting.method {
        Method::Ibs => (Mark::Disc, BLUE),
        Method::Paper => (Mark::Triangle, PURPLE),
        Method::PathTracing => (TRACED, VERMILION),
    }
}

/// Equal error across, equal time up.
fn arrows(svg: &mut Svg, plot: &Plot, summary: &Summary, with_setup: bool) {
    let ours = |r: &&Row| r.setting.method == Method::Ibs && r.setting.parameter == Parameter::AsItComes;
    let Some(row) = summary.rows.iter().find(ours) else { return };
    let (x, y) = place(row, with_setup);
    let path = Method::PathTracing.name();
    let mine = |s: &&SpeedUp| s.metric == Metric::Flip && s.against == path;
    let halo = Text::new(FINE_PRINT).halo(0.5);
    if let Some(s) = summary.speed_ups.iter().find(mine) {
        let ratio = if with_setup { &s.with_setup } else { &s.frame };
        plot.arrow(svg, (x, y), (s.needed_cpu_s, y));
        let [_, line] = plot.at(x, y);
        let middle = 0.5 * (plot.at(x, y)[0] + plot.at(s.needed_cpu_s, y)[0]);
        svg.text(
            [middle, line + 4.0],
            &format!("{}{} × as long", s.how.bound(), rounded(ratio.value)),
            &halo.bold().anchor(Anchor::Middle),
        );
        let range = format!("95 %: {}", ratio.range());
        svg.text([middle, line + 7.2], &range, &halo.anchor(Anchor::Middle));
    }
    let same = |e: &&EqualTime| e.metric == Metric::Flip && e.against == path && e.with_setup == with_setup;
    if let Some(e) = summary.equal_time.iter().find(same) {
        plot.arrow(svg, (x, y), (x, e.error));
        let at = plot.at(x, (y * e.error).sqrt());
        let least = if e.how == How::First { "at least " } else { "" };
        svg.text([at[0] + 1.5, at[1]], &format!("{least}{} × the error", rounded(e.ratio.value)), &halo.bold());
        svg.text([at[0] + 1.5, at[1] + 3.2], "in the same time", &halo);
        svg.text([at[0] + 1.5, at[1] + 6.4], &format!("95 %: {}", e.ratio.range()), &halo);
    }
}

/// What the marks mean, line by line; gives where it ends.
fn legend(svg: &mut Svg, y: f64, outside: &[Outside]) -> f64 {
    let mut items = vec![
        (Mark::Disc, BLUE, "image-based shooting (ringed: its default settings)".to_owned()),
        (Mark::Triangle, PURPLE, "the published method, plain".to_owned()),
        (TRACED, VERMILION, "path tracing, our own".to_owned()),
    ];
    items.extend(outside.iter().zip(OUTSIDE).map(|(o, (mark, colour))| (mark, colour, o.name.clone())));
    let [mut x, mut y] = [MARGIN, y];
    for (mark, colour, name) in &items {
        let wide = 5.0 + text_width(name, FINE_PRINT, false);
        if x > MARGIN && x + wide > SIZE[0] - MARGIN {
            (x, y) = (MARGIN, y + 4.4);
        }
        mark.draw(svg, [x + 2.0, y - 0.9], 1.1, colour);
        svg.text([x + 5.0, y], name, &Text::new(FINE_PRINT));
        x += wide + 6.0;
    }
    y += 4.4;
    let note = "Grey steps: what no other setting beats in time and error. Bars: 95 % confidence. Broken lines: \
                extrapolated, not measured.";
    svg.text([MARGIN, y], note, &Text::new(FINE_PRINT).colour(GREY));
    y
}

/// Sentences; gives where they end.
fn findings(svg: &mut Svg, mut y: f64, study: &Study, summary: &Summary, outside: &[Outside]) -> f64 {
    let mut say = |heading: &str, sentences: &[String]| {
        if sentences.is_empty() {
            return;
        }
        svg.text([MARGIN, y], heading, &Text::new(BODY).bold());
        y += 4.0;
        for sentence in sentences {
            for (i, line) in wrap(sentence, SIZE[0] - 2.0 * MARGIN - 4.0, FINE_PRINT, false).iter().enumerate() {
                if i == 0 {
                    svg.text([MARGIN, y], "–", &Text::new(FINE_PRINT));
                }
                svg.text([MARGIN + 3.0, y], line, &Text::new(FINE_PRINT));
                y += 3.3;
            }
        }
        y += 1.6;
    };
    let flip = summary.speed_ups.iter().filter(|s| s.metric == Metric::Flip);
    say("Time to the same error", &flip.map(SpeedUp::sentence).collect::<Vec<_>>());
    let flip = summary.equal_time.iter().filter(|e| e.metric == Metric::Flip);
    say("Error in the same time", &flip.map(EqualTime::sentence).collect::<Vec<_>>());
    say("What twice as much of one setting does to the error (95 %)", &orders(summary));
    say("Where image-based shooting loses", &summary.losses);
    let mut known: Vec<String> = order_said(&summary.probe_order).into_iter().collect();
    if let (Some(rmse), Some(flip)) = (study.truth.noise_rmse, study.truth.noise_flip) {
        known.push(format!(
            "The reference's own noise is {rmse:.2e} RMSE, taken off RMSE and relMSE; its halves differ by FLIP {flip:.3}."
        ));
    }
    known.extend(outside.first().map(|o| {
        format!("Outside figures: {}. Their intervals hold our own uncertainty only, over whole pictures.", o.note)
    }));
    known.extend(outside.iter().filter(|o| o.points.iter().any(|p| p.carried)).map(|o| {
        format!("{}: its last points were measured in some views only and carried over by their ratio.", o.name)
    }));
    if !study.pending.is_empty() {
        let (n, first) = (study.pending.len(), &study.pending[0]);
        known.push(format!("The time budget left {n} settings undone, from “{first}” on; the same command goes on."));
    }
    known.extend(study.notes.iter().cloned());
    say("What to know", &known);
    if let Some(r) = &summary.recommended {
        say("Recommended", &[r.why.clone(), r.snippet.clone()]);
    }
    y
}
