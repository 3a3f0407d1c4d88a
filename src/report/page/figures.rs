//! How exact and how fast the program was: figures for those who judge the method.

use maud::{Markup, html};

use super::archive::Archive;
use super::parts::{percent, scroll, sheet, snippet, sortable};
use crate::report::rendered::Rendered;
use crate::report::study::{columns, study_rows};
use crate::study::Summary;

/// `None` where nothing was measured.
pub(super) fn figures(archive: &Archive) -> Option<Markup> {
    if archive.render.is_none() && archive.study.is_none() {
        return None;
    }
    Some(html! {
        @if let Some(render) = &archive.render {
            (errors(render))
            @let s = render.setup;
            p {
                (format!("Set-up took {:.1} s: reading {:.1}, shooting {:.1}, indexing {:.1}, volume {:.1}.",
                    s.load_s + s.shoot_s + s.index_s + s.volume_s, s.load_s, s.shoot_s, s.index_s, s.volume_s))
            }
        }
        @if let Some(study) = &archive.study { (measured(study)) }
    })
}

fn errors(render: &Rendered) -> Markup {
    let with_error: Vec<_> = render.views.iter().filter_map(|v| Some((v, v.error.as_ref()?))).collect();
    let heads = [
        ("View", false),
        ("Seen by probes", true),
        ("FLIP", true),
        ("Relative squared error", true),
        ("Median error", true),
        ("Milliseconds a frame", true),
    ];
    let rows = html! {
        @for (v, e) in &with_error {
            tr {
                th scope="row" { (v.name) }
                td class="number" { (percent(v.covered_fraction)) }
                td class="number" { (format!("{:.4}", e.all.flip)) }
                td class="number" { (format!("{:.4}", e.all.relmse)) }
                td class="number" { (percent(e.all.median)) }
                td class="number" { (format!("{:.0}", 1e3 * (v.rays_s + v.shade_s))) }
            }
        }
    };
    html! {
        @if !with_error.is_empty() {
            h3 { "How far the pictures are from the photographs" }
            (sortable("Errors", &heads, &rows))
        }
    }
}

fn measured(study: &Summary) -> Markup {
    html! {
        h3 { "Error against run time" }
        (words(study))
        (sheet("study", "Error against run time", &["svg", "png", "pdf", "csv"]))
        details {
            summary { "All runs" }
            (scroll("All runs", &html! {
                table class="sortable runs" {
                    thead { tr { @for cell in columns() { th scope="col" { (cell) } } } }
                    tbody { @for row in study_rows(&study.rows) { tr { @for cell in row { td { (cell) } } } } }
                }
            }))
        }
    }
}

/// What the study comes to.
fn words(summary: &Summary) -> Markup {
    html! {
        @if !summary.speed_ups.is_empty() {
            ul {
                @for s in &summary.speed_ups { li { (s.sentence()) } }
            }
        }
        @if !summary.losses.is_empty() {
            h4 { "Where image-based shooting loses" }
            ul { @for loss in &summary.losses { li { (loss) } } }
        }
        @if let Some(r) = &summary.recommended {
            p { (r.why) }
            (snippet("setting", &r.snippet))
        }
    }
}
