//! What to render with, and where image-based shooting loses.

use super::compare::{Comparison, Errors};
use super::result::{Recommended, Row, SpeedUp, Whole, rounded};
use crate::study::curve::How;
use crate::study::metrics::blocks::Metric;
use crate::study::order::Ranked;
use crate::study::sweep::{Method, Parameter, Setting};

/// A setting is as good as the best if its FLIP is at most so many times the best one's.
const AS_GOOD: f64 = 1.03;

/// The cheapest of the image-based settings that are as good as the best, by set-up and one frame; `render` is the command that renders
/// the site with the settings as they come.
pub(crate) fn recommended(rows: &[Row], render: &str, order: &[Ranked]) -> Option<Recommended> {
    let ours = || rows.iter().filter(|r| r.setting.method == Method::Ibs && r.flip.value.is_finite());
    let best = ours().min_by(|a, b| a.flip.value.total_cmp(&b.flip.value))?;
    let cost = |r: &Row| r.setup.cpu_s + r.frame.cpu_s;
    let good = ours().filter(|r| r.flip.value <= AS_GOOD * best.flip.value);
    let chosen = good.min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
    let why = format!(
        "The cheapest setting within {:.0} % of the best FLIP ({:.4}, {}): FLIP {:.4}, set-up {:.1} s and {:.2} s a \
         frame of processor time.",
        100.0 * (AS_GOOD - 1.0),
        best.flip.value,
        best.label,
        chosen.flip.value,
        chosen.setup.cpu_s,
        chosen.frame.cpu_s
    );
    Some(Recommended { setting: chosen.setting, why, snippet: snippet(&chosen.setting, render, order) })
}

/// The command line that renders with a setting.
fn snippet(setting: &Setting, render: &str, order: &[Ranked]) -> String {
    let value = setting.value;
    match setting.parameter {
        Parameter::AsItComes | Parameter::Radius => render.to_owned(),
        Parameter::Width => format!("{render}   # panoramas {value} pixels wide are enough"),
        Parameter::Probes => {
            // the option takes the first of the site file
            let taken = &order[..order.len().min(value as usize)];
            let names = taken.iter().map(|r| r.name.as_str()).collect::<Vec<_>>().join(", ");
            match taken.iter().all(|r| (r.index as f64) < value) {
                true => format!("{render} --probes {value}"),
                false => format!("{render} --probes {value}   # {names} moved to the front of the site file"),
            }
        }
        Parameter::Cells => format!("{render} --cells {value}"),
        Parameter::Rays => format!("{render} --volume-rays {value}"),
        Parameter::Samples => format!("{render} --samples {value}"),
    }
}

/// Where image-based shooting loses or stops, a sentence each.
pub(crate) fn losses(whole: &[Whole], rows: &[Row], speed_ups: &[SpeedUp]) -> Vec<String> {
    let mut all = Vec::new();
    let Some(ours) = whole.iter().find(|w| w.run.is_plain_ibs()) else { return all };
    let mine = rows.iter().filter(|r| r.setting.method == Method::Ibs);
    if let Some(best) = mine.min_by(|a, b| a.flip.value.total_cmp(&b.flip.value)) {
        let nearer = |r: &Row| r.setting.method == Method::PathTracing && r.flip.value < best.flip.value;
        let tracer = if rows.iter().any(nearer) { " Path tracing does, given the time." } else { "" };
        all.push(format!(
            "It stops: no setting tried comes below FLIP {:.3} ({}).{tracer}",
            best.flip.value, best.label
        ));
    }
    let parts: Vec<&Comparison> = ours.run.views.iter().filter_map(|v| v.parts.as_ref()).collect();
    let mean = |of: fn(&Comparison) -> &Errors, part: fn(&Errors) -> f64| {
        let here = parts.iter().map(|c| of(c)).filter(|e| e.share > 0.0);
        let (sum, weight) = here.fold((0.0, 0.0), |(s, w), e| (s + e.share * part(e), w + e.share));
        (sum / weight, weight / parts.len() as f64)
    };
    let everywhere = (mean(|c| &c.all, |e| e.flip).0, mean(|c| &c.all, |e| e.relmse).0);
    for (what, of) in [
        ("Where no probe has a line of sight", (|c| &c.unseen) as fn(&Comparison) -> &Errors),
        ("Where the volume has to stand in for records", |c| &c.volume),
    ] {
        let ((flip, share), relmse) = (mean(of, |e| e.flip), mean(of, |e| e.relmse).0);
        if flip > everywhere.0 {
            all.push(format!(
                "{what} ({:.1} % of pixels) FLIP is {flip:.3} and relMSE {relmse:.3}, against {:.3} and {:.3} over all.",
                100.0 * share,
                everywhere.0,
                everywhere.1
            ));
        }
    }
    for s in speed_ups.iter().filter(|s| s.metric != Metric::Flip) {
        let flip = speed_ups.iter().find(|f| f.metric == Metric::Flip && f.against == s.against);
        // two bounds cannot be compared
        let known = |f: &&SpeedUp| f.how != How::AtLeast && s.how != How::AtLeast;
        let Some(flip) = flip.filter(known).filter(|f| s.frame.value < 0.5 * f.frame.value) else { continue };
        let verdict = match s.with_setup.value {
            r if r < 1.0 => format!(", and with all set-up counted {} is quicker", s.against),
            r => format!(" ({} × with all set-up)", rounded(r)),
        };
        all.push(format!(
            "By {} the lead over {} is {} × a frame{verdict}, not {} × as by FLIP.",
            s.metric.name(),
            s.against,
            rounded(s.frame.value),
            rounded(flip.frame.value)
        ));
    }
    for s in speed_ups.iter().filter(|s| s.metric == Metric::Flip && s.how != How::AtLeast && s.with_setup.value < 1.0)
    {
        all.push(format!("For a single frame with all set-up, {} is quicker at the same FLIP.", s.against));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snippets_name_the_option() {
        let probe =
            |(place, index): (usize, usize)| Ranked { index, name: format!("p{index}"), seen: 0.5 * place as f64 };
        let order: Vec<Ranked> = [1, 0, 3, 2].into_iter().enumerate().map(probe).collect();
        let of = |parameter, value| snippet(&Setting { method: Method::Ibs, parameter, value }, "render s", &order);
        assert_eq!(of(Parameter::Probes, 2.0), "render s --probes 2");
        assert!(of(Parameter::Probes, 3.0).ends_with("# p1, p0, p3 moved to the front of the site file"));
        assert_eq!(of(Parameter::Cells, 32.0), "render s --cells 32");
        assert_eq!(of(Parameter::Samples, 1.0), "render s --samples 1");
    }
}
