//! `clerestory summary DIR…`.

use anyhow::Context;
use clap::{Args, ValueHint};
use clerestory::report::page::address;
use clerestory::report::{Overview, overview, overview_csv, overview_page, write_file};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::terminal::output::Told;

/// Gather many reports in one table: a row a site.
///
/// Reads the JSON files of folders that `report` made, and prints a line each; with --out, writes summary.csv and
/// summary.html, which links the reports.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    clerestory summary reports/*/\n  \
    clerestory summary reports/*/ --out reports\n  \
    clerestory summary reports/*/ --json")]
pub(crate) struct SummaryArgs {
    /// Folders that `report` made
    #[arg(required = true, value_name = "DIR", value_hint = ValueHint::DirPath)]
    reports: Vec<PathBuf>,
    /// Write summary.csv and summary.html into this folder
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    out: Option<PathBuf>,
    #[command(flatten)]
    told: Told,
}

/// Gathers the reports and tells `out` about them.
pub(crate) fn run(args: &SummaryArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let rows = args.reports.iter().map(|folder| overview(folder)).collect::<Result<Vec<Overview>, _>>()?;
    if let Some(folder) = &args.out {
        std::fs::create_dir_all(folder).with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
        let home = folder.canonicalize()?;
        let links = args.reports.iter().map(|r| link(r, &home)).collect::<io::Result<Vec<String>>>()?;
        write_file(&folder.join("summary.csv"), overview_csv(&rows).as_bytes())?;
        write_file(&folder.join("summary.html"), overview_page(&rows, &links).as_bytes())?;
    }
    args.told.tell(&rows, out, |out| print(&rows, out))
}

fn print(rows: &[Overview], out: &mut impl Write) -> io::Result<()> {
    let wide = rows.iter().map(|r| r.site.chars().count()).max().unwrap_or(0);
    for r in rows {
        let mut said = Vec::new();
        if let (Some(shape), Some(texture)) = (r.findings_geometry, r.findings_texture) {
            let untestable =
                r.untestable_share.map_or_else(String::new, |v| format!(", {:.0} % not testable", 100.0 * v));
            said.push(format!(
                "{shape} wrong in shape, {texture} in texture, {} doubts{untestable}",
                r.doubts.unwrap_or(0)
            ));
        }
        said.extend(r.flip.map(|v| format!("FLIP {v:.3}")));
        said.extend(r.stations.map(|n| format!("{n} stations planned")));
        said.extend(r.warnings.filter(|n| *n > 0).map(|n| format!("{n} warnings")));
        if !r.failed.is_empty() {
            said.push(format!("came to no end: {}", r.failed));
        }
        writeln!(out, "{:<wide$}  {}", r.site, said.join("; "))?;
    }
    Ok(())
}

/// The address of a report's page from a folder: relative where both lie in one folder or below, else whole.
fn link(report: &Path, home: &Path) -> io::Result<String> {
    let report = report.canonicalize()?;
    let page = report.join("index.html");
    Ok(match page.strip_prefix(home) {
        Ok(inside) => address(&inside.to_string_lossy().replace('\\', "/")),
        Err(_) => match home.parent().and_then(|above| page.strip_prefix(above).ok()) {
            Some(beside) => format!("../{}", address(&beside.to_string_lossy().replace('\\', "/"))),
            None => format!("file://{}", address(&page.to_string_lossy().replace('\\', "/"))),
        },
    })
}
