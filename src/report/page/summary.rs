//! The page's opening: what it comes to, for a reader who has a minute.

use maud::{Markup, html};

use super::archive::Archive;
use super::parts::{file, percent, warnings};
use crate::audit::{Audit, Kind};
use crate::check::Check;
use crate::plan::export::tables::{FloorJson, PlanJson, counted};
use crate::report::rendered::Rendered;
use crate::statistics;
use crate::study::Errors;

/// The most findings that the opening names.
const NAMED: usize = 5;

pub(super) fn summary(archive: &Archive) -> Markup {
    let failed: Vec<String> = archive
        .runs
        .iter()
        .filter(|r| r.seconds.is_some() && !r.note.is_empty())
        .map(|r| format!("{} came to no end: {}", r.verb, r.note))
        .collect();
    html! {
        div class="short" {
            p { (what(archive)) }
            @if let Some(audit) = &archive.audit { (verdict(audit)) }
            @if let Some(says) = archive.render.as_ref().and_then(likeness) { p { (says) } }
            @if let Some(plan) = &archive.plan { p { (visit(plan)) } }
            @if let Some(viewer) = &archive.viewer {
                p { a href=(file(viewer)) { "Walk through the relit model" } }
            }
        }
        (warnings(&failed))
        (facts(archive))
    }
}

/// What was done, in a sentence.
fn what(archive: &Archive) -> String {
    let size = archive.check.as_ref().map_or_else(String::new, |check| format!(" of {}", size(check)));
    let probes = archive.check.as_ref().map_or(0, |c| c.probes.len());
    let photos = archive.audit.as_ref().map_or(0, |a| a.views.len());
    let light =
        if probes == 0 { String::new() } else { format!(", lit by {} taken inside", counted(probes, "picture")) };
    match photos {
        0 => format!("This is a model{size}{light}. It was not compared with photographs."),
        n => format!("The model{size}{light}, was compared with {}.", counted(n, "photograph")),
    }
}

/// What the audit comes to.
fn verdict(audit: &Audit) -> Markup {
    let doubts = match audit.doubts.len() {
        0 => String::new(),
        n => format!(" {} to look at again: something disagrees there, and it is not clear what.", counted(n, "place")),
    };
    let tested = 1.0 - untestable(audit);
    html! {
        @match audit.findings.len() {
            0 => p { b { "Where it could be tested, no error was found." } (doubts) },
            n => {
                p {
                    b { (counted(n, "place")) " where the model is probably wrong" }
                    ": " (count(audit, Kind::Geometry)) " in shape, " (count(audit, Kind::Texture))
                    " in the picture on the surface." (doubts)
                }
                ul {
                    @for f in audit.findings.iter().take(NAMED) {
                        li {
                            a href={ "#finding-" (f.id) } { (f.id) } ", " (f.what.name()) ", " (percent(f.score)) " sure: " (f.note)
                        }
                    }
                    @if n > NAMED { li { "and " (n - NAMED) " more, below" } }
                }
            }
        }
        @if !audit.views.is_empty() {
            p {
                "About " (format!("{:.0} %", 100.0 * tested)) " of what the photographs show could be tested. Of the rest \
                nothing is known, which does not mean that it is right."
            }
        }
    }
}

/// How alike relit pictures and photographs are.
fn likeness(render: &Rendered) -> Option<String> {
    let median = statistics::mean(errors(render).map(|e| e.median))?;
    Some(format!(
        "Relit pictures of the same views differ from the photographs by {} of their brightness in the median.",
        percent(median)
    ))
}

/// The errors of the views that have a photograph.
fn errors(render: &Rendered) -> impl Iterator<Item = &Errors> {
    render.views.iter().filter_map(|v| Some(&v.error.as_ref()?.all))
}

/// What a next visit needs.
fn visit(plan: &PlanJson) -> String {
    let [stations, least] = stations(plan);
    let area: f64 = plan.floors.iter().map(|f| f.area_m2).sum();
    let seen = plan.floors.iter().map(|f| f.covered_fraction * f.area_m2).sum::<f64>() / area.max(1e-9);
    match stations {
        0 => "The probes taken already see what is wanted: no new place for the tripod is needed.".to_owned(),
        n => format!(
            "For a visit, {} for the tripod on {} see {} of the floor; fewer than {least} cannot.",
            counted(n, "place"),
            counted(plan.floors.len(), "floor"),
            percent(seen)
        ),
    }
}

/// The mean; 0 of nothing.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    statistics::mean(values).unwrap_or(0.0)
}

/// The model's width, depth and height.
fn size(check: &Check) -> String {
    let [x, y, z] = check.model.size_m;
    format!("{x:.1} × {y:.1} × {z:.1}\u{a0}m")
}

/// How many findings are of a kind.
fn count(audit: &Audit, kind: Kind) -> usize {
    audit.findings.iter().filter(|f| f.kind == kind).count()
}

/// The share of the photographs of which nothing can be said.
fn untestable(audit: &Audit) -> f64 {
    mean(audit.views.iter().map(|v| v.summary.shares.untestable))
}

/// The stations of all floors, and the fewest that can do.
fn stations(plan: &PlanJson) -> [usize; 2] {
    let sum = |of: fn(&FloorJson) -> usize| plan.floors.iter().map(of).sum::<usize>();
    [sum(|f| f.stations.len()), sum(|f| f.lower_bound)]
}

fn facts(archive: &Archive) -> Markup {
    let mut facts: Vec<(&str, String, String)> = Vec::new();
    if let Some(audit) = &archive.audit {
        let [shape, texture] = [Kind::Geometry, Kind::Texture].map(|kind| count(audit, kind));
        let kinds = format!("{shape} in shape, {texture} in texture");
        facts.push(("Findings", audit.findings.len().to_string(), kinds));
        facts.push(("Doubts", audit.doubts.len().to_string(), "to be looked at on site".to_owned()));
        facts.push((
            "Not testable",
            percent(untestable(audit)),
            "of the photographs: neither right nor wrong".to_owned(),
        ));
    }
    if let Some(render) = &archive.render {
        if let Some(flip) = statistics::mean(errors(render).map(|e| e.flip)) {
            let scale = "mean FLIP: 0 the same, 1 black against white".to_owned();
            facts.push(("Difference to the photographs", format!("{flip:.3}"), scale));
        }
        let seen = mean(render.views.iter().map(|v| v.covered_fraction));
        facts.push(("Seen by probes", percent(seen), "of the views’ pixels; the rest is estimated".to_owned()));
    }
    if let Some(plan) = &archive.plan {
        let [stations, least] = stations(plan);
        facts.push(("Planned stations", stations.to_string(), format!("at least {least} needed")));
    }
    if let Some(check) = &archive.check {
        facts.push(("Model", size(check), format!("{} triangles", check.model.triangles)));
        facts.push(("Probes", check.probes.len().to_string(), "pictures taken inside".to_owned()));
    }
    html! {
        dl class="facts" {
            @for (name, value, note) in &facts { div { dt { (name) } dd { (value) " " small { (note) } } } }
        }
    }
}
