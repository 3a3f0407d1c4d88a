//! The report's page: one HTML file that reads without network, script or mouse, and prints on A4 or Letter.

mod archive;
mod figures;
mod findings;
mod floors;
mod health;
mod parts;
mod pictures;
mod summary;
#[cfg(test)]
mod tests;

pub use archive::{Archive, ViewPictures};
pub use parts::file as address;
pub(super) use parts::{document, sortable};

use maud::{Markup, html};

use super::SOFTWARE;

/// Nothing but the page's own style, script and pictures.
const POLICY: &str =
    "default-src 'none'; img-src 'self' data: file:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// The parts of the page, each with its id and its title, in the order in which a reader asks; the program's own figures
/// come last.
fn sections(archive: &Archive) -> Vec<(&'static str, &'static str, Markup)> {
    let parts = [
        ("summary", "In short", Some(summary::summary(archive))),
        ("findings", "Findings", archive.audit.as_ref().map(|audit| findings::findings(audit, &archive.views))),
        ("pictures", "Pictures", (!archive.views.is_empty()).then(|| pictures::pictures(&archive.views))),
        ("plan", "Where to put the tripod", archive.plan.as_ref().map(floors::floors)),
        ("check", "The site’s health", archive.check.as_ref().map(health::health)),
        ("method", "How this was made", Some(health::method(archive))),
        ("figures", "The program’s own figures", figures::figures(archive)),
    ];
    parts.into_iter().filter_map(|(id, title, html)| Some((id, title, html?))).collect()
}

/// The whole of `index.html`. All that it shows lies in its own folder; style and script are inside it.
pub fn page(archive: &Archive) -> String {
    let parts = sections(archive);
    let metas = html! {
        meta http-equiv="Content-Security-Policy" content=(POLICY);
        meta name="generator" content=(SOFTWARE);
    };
    let body = html! {
        a class="skip" href="#main" { "Skip to the report" }
        (head(archive))
        nav aria-label="Parts of the report" {
            ul { @for (id, title, _) in &parts { li { a href={ "#" (id) } { (title) } } } }
        }
        main id="main" {
            @for (id, title, html) in &parts {
                section id=(id) aria-labelledby={ (id) "-title" } {
                    h2 id={ (id) "-title" } { (title) }
                    (html)
                }
            }
        }
        footer {
            p {
                "Everything this page shows lies in its own folder; all sheets, to print at full size, are in "
                @if archive.sheets_pdf { a href="report.pdf" { "report.pdf" } } @else { "their own files" }
                "; " a href="manifest.json" { "manifest.json" }
                " lists every file with its SHA-256, the commands and the settings."
            }
        }
    };
    document(&format!("{}: report", archive.site), &metas, &body)
}

/// The title, and what the site file says of the work.
fn head(archive: &Archive) -> Markup {
    let p = &archive.project;
    let named = [
        ("Site", &archive.site),
        ("Institution", &p.institution),
        ("Author", &p.author),
        ("Date", &p.date),
        ("Rights", &p.rights),
    ];
    html! {
        header {
            h1 { @if p.title.is_empty() { (archive.site) } @else { (p.title) } }
            @if *p == crate::site::Project::default() {
                p { "Survey, relighting and audit of the model, made with " (SOFTWARE) "." }
            } @else {
                dl class="imprint" {
                    @for (name, value) in named.iter().filter(|n| !n.1.is_empty()) {
                        div { dt { (name) } dd { (value) } }
                    }
                    div { dt { "Made with" } dd { (SOFTWARE) } }
                }
            }
        }
    }
}
