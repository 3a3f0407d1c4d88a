//! What several sections of the page are made of.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};

/// A whole page that looks like ours and whose controls work without a network.
pub(in crate::report) fn document(title: &str, metas: &Markup, body: &Markup) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                (metas)
                title { (title) }
                style { (PreEscaped(include_str!("page.css"))) }
            }
            body {
                (body)
                script { (PreEscaped(include_str!("page.js"))) }
            }
        }
    };
    markup.into_string()
}

/// A part that scrolls sideways by itself on a narrow screen.
pub(super) fn scroll(label: &str, inside: &Markup) -> Markup {
    html! { div class="scroll" tabindex="0" role="region" aria-label=(label) { (inside) } }
}

/// A column's head: its title, and whether it holds numbers.
pub(super) fn heads(columns: &[(&str, bool)]) -> Markup {
    html! {
        thead {
            tr { @for (title, number) in columns { th scope="col" class=[number.then_some("number")] { (title) } } }
        }
    }
}

/// A table that a click on a column's head sorts.
pub(in crate::report) fn sortable(label: &str, columns: &[(&str, bool)], rows: &Markup) -> Markup {
    scroll(label, &html! { table class="sortable" { (heads(columns)) tbody { (rows) } } })
}

/// A sheet that can be zoomed into, with its files in these formats.
pub(super) fn sheet(stem: &str, says: &str, formats: &[&str]) -> Markup {
    let href = file(stem);
    html! {
        figure class="zoom" {
            div class="viewport" tabindex="0" role="group" aria-label={ (stem) ": + and − zoom, 0 shows all, arrows move" } {
                img src={ (href) ".svg" } alt=(says);
            }
            div class="controls" {
                button type="button" data-act="in" { "Zoom in" }
                button type="button" data-act="out" { "Zoom out" }
                button type="button" data-act="reset" { "Whole sheet" }
            }
            figcaption {
                (says) ": "
                @for (i, format) in formats.iter().enumerate() {
                    @if i > 0 { ", " }
                    a href={ (href) "." (format) } { (format.to_uppercase()) }
                }
            }
        }
    }
}

/// Text to take along, with a button that copies it.
pub(super) fn snippet(id: &str, text: &str) -> Markup {
    html! {
        pre id=(id) { (text) }
        button type="button" class="copy" data-of=(id) { "Copy" }
    }
}

/// Sentences to mind.
pub(super) fn warnings(sentences: &[String]) -> Markup {
    html! {
        @if !sentences.is_empty() {
            ul class="warnings" { @for sentence in sentences { li { (sentence) } } }
        }
    }
}

pub(super) fn percent(share: f64) -> String {
    let p = 100.0 * share;
    if p == 0.0 || p.abs() >= 99.95 { format!("{p:.0} %") } else { format!("{p:.1} %") }
}

/// A file's name as a relative address: what a URL keeps for itself is percent-encoded.
pub fn file(name: &str) -> String {
    const ENCODED: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'~').remove(b'/');
    utf8_percent_encode(name, ENCODED).to_string()
}
