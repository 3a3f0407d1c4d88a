//! What the photographs say of the model.

use maud::{Markup, html};

use super::archive::ViewPictures;
use super::parts::{heads, percent, scroll, sortable, warnings};
use crate::audit::{Audit, Finding};

/// `shown` are the views whose pictures the page has.
pub(super) fn findings(audit: &Audit, shown: &[ViewPictures]) -> Markup {
    let views = || audit.views.iter().map(|v| &v.summary);
    let mut said = audit.warnings.clone();
    said.extend(views().flat_map(|v| v.warnings.iter().map(|w| format!("{}: {w}", v.view))));
    html! {
        @if audit.findings.is_empty() {
            p { "Nothing in the photographs contradicts the model, as far as it could be tested." }
        } @else {
            p {
                "What the photographs say of the model. Each finding is a proposal for a surveyor to confirm; the audit \
                sheets have a column for the verdict."
            }
            (table("Findings", &audit.findings, shown))
        }
        @if !audit.doubts.is_empty() {
            h3 { "Doubts" }
            p { "Something disagrees here, but these photographs and probes do not show what it is." }
            (table("Doubts", &audit.doubts, shown))
        }
        h3 { "What was tested" }
        p {
            "Shares of each photograph. Not testable is what no probe sees, what looks the same from everywhere, or is too \
            dark or too bright: it is neither right nor wrong."
        }
        (tested(audit))
        (warnings(&said))
    }
}

fn tested(audit: &Audit) -> Markup {
    let columns = [
        ("View", false),
        ("Agrees", true),
        ("Geometry wrong", true),
        ("Texture wrong", true),
        ("Unclear", true),
        ("Not testable", true),
    ];
    let rows = html! {
        @for v in audit.views.iter().map(|v| &v.summary) {
            @let s = v.shares;
            tr {
                th scope="row" { (v.view) }
                @for share in [s.ok, s.geometry, s.texture, s.ambiguous, s.untestable] {
                    td class="number" data-value=(share) { (percent(share)) }
                }
            }
        }
    };
    sortable("What was tested", &columns, &rows)
}

fn table(title: &str, list: &[Finding], shown: &[ViewPictures]) -> Markup {
    let columns =
        [("Id", false), ("What is wrong", false), ("Sure", true), ("Size", true), ("Place", false), ("Note", false)];
    let rows = html! {
        table class="sortable findings" {
            caption { (title) span class="screen" { "; a column’s title sorts by it" } }
            (heads(&columns))
            tbody { @for f in list { (row(f, shown)) } }
        }
    };
    scroll(title, &rows)
}

fn row(f: &Finding, shown: &[ViewPictures]) -> Markup {
    let kind = f.kind.name();
    html! {
        tr id={ "finding-" (f.id) } {
            th scope="row" { (f.id) }
            td { span class={ "kind " (kind) } { (kind) } " " (f.what.name()) }
            td class="number" data-value=(f.score) { (percent(f.score)) }
            td class="number" data-value=(f.size_m) {
                (format!("{:.2} m", f.size_m)) br; (format!("{:.0} cm²", f.area_cm2))
                @if let Some(d) = f.displacement {
                    br; (format!("off by {:+.1} ± {:.1} cm", 100.0 * d.metres, 100.0 * d.uncertainty_m))
                }
            }
            td {
                @if shown.iter().any(|v| v.name == f.view) { a href={ "#view-" (f.view) } { (f.view) } } @else { (f.view) }
                @if !f.material.is_empty() { ", " (f.material) }
                br; span class="place" { (f.position.map(|v| format!("{v:.2}")).join(", ")) }
            }
            td class="prose" { (f.note) }
        }
    }
}
