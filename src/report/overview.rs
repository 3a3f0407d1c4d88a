//! Many reports at a glance: one row a site, as a table and as a page.

use std::path::Path;

use maud::{Markup, html};
use serde::Serialize;
use serde_json::Value;

use super::error::ReportError;
use super::page::{document, sortable};
use crate::csv::Table;
use crate::plan::export::tables::counted;
use crate::statistics::mean;

/// What one report comes to. What the report does not hold is `None`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Overview {
    /// The report's folder, as it was given.
    pub folder: String,
    /// The site's name.
    pub site: String,
    /// When the report was made: `YYYY-MM-DDThh:mm:ssZ`.
    pub made: String,
    /// Things that `check` warns of.
    pub warnings: Option<usize>,
    /// Findings of shape.
    pub findings_geometry: Option<usize>,
    /// Findings of texture.
    pub findings_texture: Option<usize>,
    /// What disagrees without telling how.
    pub doubts: Option<usize>,
    /// Share of the photographs of which nothing can be said, mean over views.
    pub untestable_share: Option<f64>,
    /// FLIP against the photographs, mean over views.
    pub flip: Option<f64>,
    /// Median relative error against the photographs, mean over views.
    pub median_error: Option<f64>,
    /// Share of the views' pixels that a probe sees, mean over views.
    pub covered_share: Option<f64>,
    /// Planned stations on all floors.
    pub stations: Option<usize>,
    /// The fewest stations that can do.
    pub least_stations: Option<f64>,
    /// Seconds that all verbs took.
    pub seconds: f64,
    /// What came to no end, and why; empty where nothing.
    pub failed: String,
}

/// Reads the JSON files of a report's folder; fields that another version of the program did not write count as nothing.
///
/// # Errors
/// A folder without a report's `manifest.json`, or a file in it that is damaged.
pub fn overview(folder: &Path) -> Result<Overview, ReportError> {
    let Some(made) = read(folder, "manifest.json")? else {
        let what = format!(
            "expected a report's folder, found no manifest.json. Make the report first: clerestory report SITE --out {}",
            folder.display()
        );
        return Err(ReportError::NotAReport { path: folder.to_owned(), what });
    };
    // a part that was left out or came to no end may have left an earlier run's file there
    let of = |verb: &str, name: &str| {
        let mut runs = list(&made["runs"]);
        let done = runs.any(|r| r["verb"] == verb && r["seconds"].is_number() && text(&r["note"]).is_empty());
        if done { read(folder, name) } else { Ok(None) }
    };
    let audit = of("audit", "findings.json")?;
    let render = of("render", "render.json")?;
    let plan = of("plan", "plan.json")?;
    let check = of("check", "check.json")?;
    let kind = |kind: &str| audit.as_ref().map(|a| list(&a["findings"]).filter(|f| f["kind"] == kind).count());
    let views = || render.iter().flat_map(|r| list(&r["views"]));
    let error = |measure: &str| mean(views().filter_map(|v| v["error"]["all"][measure].as_f64()));
    let floors = |of: fn(&Value) -> f64| plan.as_ref().map(|p| list(&p["floors"]).map(of).sum::<f64>());
    let seconds = |run: &Value| run["seconds"].as_f64();
    let failed = list(&made["runs"]).filter(|r| seconds(r).is_some() && !text(&r["note"]).is_empty());
    Ok(Overview {
        folder: folder.to_string_lossy().into_owned(),
        site: text(&made["site"]),
        made: text(&made["made"]),
        warnings: check.map(|c| {
            let of = |v: &Value| list(&v["warnings"]).count();
            let whole = list(&c["causes"]).count() + of(&c) + of(&c["model"]) + list(&c["edge_warnings"]).count();
            whole + list(&c["probes"]).chain(list(&c["views"])).map(of).sum::<usize>()
        }),
        findings_geometry: kind("geometry"),
        findings_texture: kind("texture"),
        doubts: audit.as_ref().map(|a| list(&a["doubts"]).count()),
        untestable_share: audit
            .as_ref()
            .and_then(|a| mean(list(&a["views"]).filter_map(|v| v["shares"]["untestable"].as_f64()))),
        flip: error("flip"),
        median_error: error("median"),
        covered_share: mean(views().filter_map(|v| v["covered_fraction"].as_f64())),
        stations: floors(|f| list(&f["stations"]).count() as f64).map(|n| n as usize),
        least_stations: floors(|f| f["lower_bound"].as_f64().unwrap_or(0.0)),
        seconds: list(&made["runs"]).filter_map(seconds).sum(),
        failed: failed.map(|r| format!("{}: {}", text(&r["verb"]), text(&r["note"]))).collect::<Vec<_>>().join("; "),
    })
}

/// The elements of a list; none of anything else.
fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

/// A file of a report; `None` where it is not there.
fn read(folder: &Path, name: &str) -> Result<Option<Value>, ReportError> {
    let path = folder.join(name);
    if !path.is_file() {
        return Ok(None);
    }
    let bytes = std::fs::read(&path).map_err(|source| ReportError::Io { path: path.clone(), source })?;
    let damaged = |e: serde_json::Error| ReportError::NotAReport {
        path: path.clone(),
        what: format!("expected JSON that this program wrote, found {e}. Make the report again"),
    };
    serde_json::from_slice(&bytes).map(Some).map_err(damaged)
}

impl Overview {
    /// Each column's name in the table, its head on the page, and the row's cell; empty where nothing is known.
    fn columns(&self) -> [(&'static str, &'static str, String); 15] {
        let count = |n: Option<usize>| n.map_or_else(String::new, |n| n.to_string());
        let share = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.4}"));
        let least = self.least_stations.map_or_else(String::new, |v| format!("{v:.0}"));
        [
            ("site", "Site", self.site.clone()),
            ("made", "Made", self.made.clone()),
            ("warnings", "Warnings", count(self.warnings)),
            ("findings_geometry", "Wrong in shape", count(self.findings_geometry)),
            ("findings_texture", "Wrong in texture", count(self.findings_texture)),
            ("doubts", "Doubts", count(self.doubts)),
            ("untestable_share", "Not testable", share(self.untestable_share)),
            ("flip", "FLIP", share(self.flip)),
            ("median_error", "Median error", share(self.median_error)),
            ("covered_share", "Seen by probes", share(self.covered_share)),
            ("stations", "Stations planned", count(self.stations)),
            ("least_stations", "at least", least),
            ("seconds", "Seconds", format!("{:.1}", self.seconds)),
            ("failed", "Came to no end", self.failed.clone()),
            ("folder", "Report", self.folder.clone()),
        ]
    }
}

/// The rows as CSV.
pub fn overview_csv(rows: &[Overview]) -> String {
    let mut table = Table::new(Overview::default().columns().map(|c| c.0));
    rows.iter().for_each(|row| table.row(row.columns().map(|c| c.2)));
    table.finish()
}

/// The rows as a page that needs no network. `links` are the addresses of the reports' own pages, one a row.
pub fn overview_page(rows: &[Overview], links: &[String]) -> String {
    let [heads @ .., _] = Overview::default().columns().map(|(_, head, _)| (head, false));
    let row = |(row, link): (&Overview, &String)| -> Markup {
        let [_, cells @ .., _] = row.columns();
        html! {
            tr {
                th scope="row" { a href=(link) { (row.site) } }
                @for (.., cell) in &cells {
                    td class=[cell.parse::<f64>().is_ok().then_some("number")] { (cell) }
                }
            }
        }
    };
    let body = html! {
        header { h1 { "Reports" } p { (counted(rows.len(), "site")) ", one a row." } }
        main {
            (sortable("Reports", &heads, &html! { @for pair in rows.iter().zip(links) { (row(pair)) } }))
            p { "Shares are of 1. FLIP: 0 is the same as the photograph, 1 black against white." }
        }
    };
    document(&format!("{} reports", rows.len()), &html! {}, &body)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_comes_to_a_row_and_what_it_lacks_stays_empty() {
        let dir = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
        assert!(matches!(overview(dir.path()), Err(ReportError::NotAReport { .. })));
        put(
            "manifest.json",
            r#"{"site": "=St <Ann>", "made": "2026-11-22T10:00:00Z", "runs": [{"verb": "plan", "seconds": 1.5,
            "note": "no floor"}, {"verb": "audit", "seconds": 2.0, "note": ""}, {"verb": "study", "note": "not asked for"}]}"#,
        );
        put(
            "findings.json",
            r#"{"findings": [{"kind": "geometry"}, {"kind": "texture"}, {"kind": "geometry"}], "doubts": [],
            "views": [{"shares": {"untestable": 0.5}}, {"shares": {"untestable": 0.25}}]}"#,
        );
        let row = overview(dir.path()).unwrap();
        assert_eq!((row.findings_geometry, row.findings_texture, row.doubts), (Some(2), Some(1), Some(0)));
        assert_eq!((row.untestable_share, row.flip, row.stations), (Some(0.375), None, None));
        assert_eq!((row.seconds, row.failed.as_str()), (3.5, "plan: no floor"));
        let csv = overview_csv(std::slice::from_ref(&row));
        assert!(
            csv.lines()
                .nth(1)
                .unwrap()
                .starts_with("'=St <Ann>,2026-11-22T10:00:00Z,,2,1,0,0.3750,,,,,,3.5,plan: no floor,"),
            "{csv}"
        );
        let page = overview_page(&[row], &["a%20b/index.html".to_owned()]);
        assert!(page.contains("<a href=\"a%20b/index.html\">=St &lt;Ann&gt;</a>"));
        put("findings.json", "{");
        let error = overview(dir.path()).unwrap_err().to_string();
        assert!(error.contains("findings.json") && error.contains("Make the report again"), "{error}");
    }

    #[test]
    fn what_an_earlier_run_left_is_not_this_ones() {
        let dir = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
        put(
            "manifest.json",
            r#"{"runs": [{"verb": "check", "seconds": 1.0, "note": ""}, {"verb": "plan", "seconds": 1.5, "note": "no floor"},
            {"verb": "render", "seconds": null, "note": "not asked for"}, {"verb": "audit", "seconds": null, "note": "not asked for"}]}"#,
        );
        put("findings.json", r#"{"findings": [{"kind": "geometry"}], "doubts": [], "views": []}"#);
        put("render.json", r#"{"views": [{"covered_fraction": 0.5, "error": {"all": {"flip": 0.1, "median": 0.1}}}]}"#);
        put("plan.json", r#"{"floors": [{"stations": [{}], "lower_bound": 1}]}"#);
        put("check.json", r#"{"probes": [{"warnings": ["a"]}], "views": [{"warnings": ["b", "c"]}]}"#);
        let row = overview(dir.path()).unwrap();
        assert_eq!((row.findings_geometry, row.doubts, row.stations), (None, None, None));
        assert_eq!((row.flip, row.covered_share, row.warnings), (None, None, Some(3)));
    }
}
