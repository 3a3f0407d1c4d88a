//! The study sheet's figures: how error falls with each parameter, and the table of settings.

use std::collections::BTreeMap;

use crate::report::draw::style::{BLACK, FINE_PRINT, GREY, Style};
use crate::report::draw::svg::{Anchor, Svg, Text};
use crate::study::{Method, Parameter, Row, Summary};

/// Millimetres.
const LINE: f64 = 3.2;

/// Sentences on how error falls, a method and parameter each: an order p means error ~ parameter to the power p.
pub(super) fn orders(summary: &Summary) -> Vec<String> {
    let mut by_parameter: BTreeMap<(Method, Parameter), Vec<String>> = BTreeMap::new();
    for c in &summary.convergence {
        let [value, low, high] = [c.order.value, c.order.low, c.order.high].map(f64::exp2);
        let doubled = format!("{} × {value:.2} ({low:.2} to {high:.2})", c.metric.name());
        by_parameter.entry((c.method, c.parameter)).or_default().push(doubled);
    }
    let one = |((method, parameter), errors): ((Method, Parameter), Vec<String>)| {
        format!("{}, {}: {}", words(method), parameter.name(), errors.join("; "))
    };
    by_parameter.into_iter().map(one).collect()
}

/// What the sheet calls a method.
fn words(method: Method) -> &'static str {
    match method {
        Method::Ibs => "image-based shooting",
        Method::Paper => "published method",
        Method::PathTracing => "path tracing",
    }
}

/// The table of settings from `top` down to `bottom`. Where not all fit, each method as it comes and what nothing beats
/// go first, and a line says how many more there are.
pub(super) fn table(svg: &mut Svg, top: f64, bottom: f64, left: f64, right: f64, summary: &Summary) {
    let columns: [(&str, f64); 8] = [
        ("method", left),
        ("setting", left + 30.0),
        ("set-up s", left + 78.0),
        ("frame s", left + 94.0),
        ("RMSE", left + 112.0),
        ("relMSE", left + 131.0),
        ("FLIP (95 %)", left + 164.0),
        ("SSIM", left + 181.0),
    ];
    // the head, the rows, the note
    let room = ((bottom - top) / LINE).floor() as usize;
    let Some(room) = room.checked_sub(2).filter(|n| *n > 0) else { return };
    let text = |svg: &mut Svg, y: f64, cells: [String; 8], bold: bool| {
        for (i, cell) in cells.iter().enumerate() {
            let look = if bold { Text::new(FINE_PRINT).bold() } else { Text::new(FINE_PRINT) };
            let look = if i < 2 { look } else { look.anchor(Anchor::End) };
            svg.text([columns[i].1, y], cell, &look);
        }
    };
    text(svg, top, columns.map(|c| c.0.to_owned()), true);
    svg.line([left, top + 1.0], [right, top + 1.0], &Style::line(BLACK, 0.2));
    let shown = shown(&summary.rows, room);
    let mut y = top + 4.0;
    for row in &shown {
        let star = if row.pareto { " *" } else { "" };
        let flip = format!("{:.4} ({:.3}–{:.3})", row.flip.value, row.flip.low, row.flip.high);
        let cells = [
            words(row.setting.method).to_owned(),
            format!("{}{star}", row.label),
            format!("{:.2}", row.setup.cpu_s),
            format!("{:.3}", row.frame.cpu_s),
            format!("{:.4}", row.rmse.value),
            format!("{:.4}", row.relmse.value),
            flip,
            format!("{:.3}", row.ssim.value),
        ];
        text(svg, y, cells, false);
        y += LINE;
    }
    let mut note =
        "Seconds of the processor, all threads; * nothing else is both quicker in a frame and nearer by FLIP."
            .to_owned();
    let more = summary.rows.len() - shown.len();
    if more > 0 {
        note += &format!(" Not shown: {more} settings, all in study.csv.");
    }
    svg.text([left, y], &note, &Text::new(FINE_PRINT).colour(GREY));
}

/// As many rows as there is room for, in their order.
fn shown(rows: &[Row], room: usize) -> Vec<&Row> {
    let first = |r: &Row| r.pareto || r.setting.parameter == Parameter::AsItComes;
    let mut ranked: Vec<usize> = (0..rows.len()).collect();
    ranked.sort_by_key(|&i| !first(&rows[i]));
    ranked.truncate(room);
    ranked.sort_unstable();
    ranked.into_iter().map(|i| &rows[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::{Interval, Metric, Seconds, Setting};

    fn row(k: usize, pareto: bool, parameter: Parameter) -> Row {
        let setting = Setting { method: Method::Ibs, parameter, value: k as f64 };
        let (setup, frame, none) = (Seconds::default(), Seconds::default(), Interval::default());
        Row { setting, label: k.to_string(), setup, frame, rmse: none, relmse: none, flip: none, ssim: none, pareto }
    }

    #[test]
    fn what_matters_stays_where_room_is_short() {
        let rows: Vec<Row> =
            (0..9).map(|k| row(k, k == 7, if k == 4 { Parameter::AsItComes } else { Parameter::Rays })).collect();
        let of = |room| shown(&rows, room).iter().map(|r| r.label.clone()).collect::<String>();
        assert_eq!([of(20), of(4), of(2), of(1)], ["012345678", "0147", "47", "4"]);
    }

    #[test]
    fn metrics_of_one_parameter_share_a_line() {
        let of = |metric, value| crate::study::Convergence {
            method: Method::PathTracing,
            parameter: Parameter::Samples,
            metric,
            order: Interval { value, low: value - 0.01, high: value + 0.01 },
            tail: None,
            points: 3,
        };
        let summary = Summary {
            rows: vec![],
            speed_ups: vec![],
            equal_time: vec![],
            convergence: vec![of(Metric::Rmse, -0.5), of(Metric::Flip, -0.3)],
            recommended: None,
            probe_order: vec![],
            losses: vec![],
        };
        let said = "path tracing, samples a pixel: RMSE × 0.71 (0.70 to 0.71); FLIP × 0.81 (0.81 to 0.82)";
        assert_eq!(orders(&summary), [said]);
    }
}
