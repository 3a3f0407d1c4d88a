//! The report's page: one HTML file that reads without network, script or mouse.

mod data;
mod sections;
#[cfg(test)]
mod tests;

pub use data::*;

use super::svg::escape;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The whole of `index.html`. All that it shows lies in its own folder; style and script are inside it.
pub fn page(archive: &Archive) -> String {
    let parts = sections::all(archive);
    let links: String =
        parts.iter().map(|part| format!("<li><a href=\"#{}\">{}</a></li>\n", part.id, escape(part.title))).collect();
    let body: String = parts
        .iter()
        .map(|part| {
            format!(
                "<section id=\"{0}\" aria-labelledby=\"{0}-title\">\n<h2 id=\"{0}-title\">{1}</h2>\n{2}</section>\n",
                part.id,
                escape(part.title),
                part.html
            )
        })
        .collect();
    let (site, software) = (escape(&archive.site), escape(&archive.software));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src 'self' data: file:; style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n\
         <meta name=\"generator\" content=\"{software}\">\n<title>{site}: report</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <a class=\"skip\" href=\"#main\">Skip to the report</a>\n\
         <header>\n<h1>{site}</h1>\n<p>Survey, relighting and audit of the model, made with {software}.</p>\n</header>\n\
         <nav aria-label=\"Parts of the report\">\n<ul>\n{links}</ul>\n</nav>\n\
         <main id=\"main\">\n{body}</main>\n\
         <footer>\n<p>Everything this page shows lies in its own folder; <a href=\"manifest.json\">manifest.json</a> \
         lists every file with its SHA-256, the commands and the settings.</p>\n</footer>\n\
         <script>\n{SCRIPT}</script>\n</body>\n</html>\n"
    )
}
