//! What the site's files are fit for, and how the report was made.

use maud::{Markup, html};

use super::archive::Archive;
use super::parts::{heads, scroll, warnings};
use crate::check::Check;
use crate::plan::export::tables::counted;
use crate::report::manifest::Run;

pub(super) fn health(check: &Check) -> Markup {
    let mut said: Vec<String> = check.causes.iter().map(|cause| cause.sentence.clone()).collect();
    said.extend(check.warnings.iter().chain(&check.model.warnings).chain(&check.edge_warnings).cloned());
    for probe in &check.probes {
        said.extend(probe.warnings.iter().map(|w| format!("Probe {}: {w}", probe.name)));
    }
    for view in &check.views {
        said.extend(view.warnings.iter().map(|w| format!("View {}: {w}", view.name)));
    }
    let metres = |d: Option<f32>| d.map_or_else(|| "–".into(), |d| format!("{d:.2}"));
    html! {
        @if said.is_empty() { p { "Nothing is wrong with the site’s files." } }
        (warnings(&said))
        h3 { "Stages of work" }
        table {
            (heads(&[("Stage", false), ("Verdict", false), ("Why", false)]))
            tbody {
                @for s in &check.stages {
                    tr { th scope="row" { (s.stage) } td { @if s.needed { "needed" } @else { "left out" } } td { (s.why) } }
                }
            }
        }
        h3 { "Probes" }
        table {
            (heads(&[("Probe", false), ("Above the floor, m", true), ("Nearest surface, m", true)]))
            tbody {
                @for p in &check.probes {
                    tr {
                        th scope="row" { (p.name) }
                        td class="number" { (metres(p.height_m)) }
                        td class="number" { (metres(p.nearest_m)) }
                    }
                }
            }
        }
    }
}

pub(super) fn method(archive: &Archive) -> Markup {
    let left: Vec<_> = archive.render.iter().flat_map(|r| &r.left_out).collect();
    html! {
        p {
            "The method is Image-Based Shooting (Happa, Bashford-Rogers, Debattista and Chalmers, VAST 2010): every pixel of \
            a panorama taken inside the real room is shot onto the model, where it tells the light that arrives at the \
            surface it saw. Surfaces are taken as matt and opaque, and the scene as standing still."
        }
        h3 { "Commands" }
        (scroll("Commands", &commands(&archive.runs)))
        @if !left.is_empty() {
            p { "Left out of rendering:" }
            ul { @for l in left { li { b { (l.what.stage) } ": " (l.what.why) } } }
        }
        h3 { "What was read" }
        details {
            summary { (counted(archive.inputs.len(), "file")) " with their SHA-256" }
            (scroll("Files read", &inputs(archive)))
        }
    }
}

fn commands(runs: &[Run]) -> Markup {
    html! {
        table {
            (heads(&[("Verb", false), ("The same by hand", false), ("Seconds", true), ("Note", false)]))
            tbody {
                @for r in runs {
                    tr {
                        th scope="row" { (r.verb) }
                        td class="hash" { (r.command) }
                        td class="number" { @if let Some(s) = r.seconds { (format!("{s:.1}")) } @else { "–" } }
                        td { @if r.seconds.is_none() { "left out: " } (r.note) }
                    }
                }
            }
        }
    }
}

fn inputs(archive: &Archive) -> Markup {
    html! {
        table class="files" {
            (heads(&[("File", false), ("Bytes", true), ("SHA-256", false)]))
            tbody {
                @for f in &archive.inputs {
                    tr {
                        th scope="row" { (f.file) }
                        td class="number" { (f.bytes) }
                        td class="hash" { (f.sha256) }
                    }
                }
            }
        }
    }
}
