//! Writing a study's sheet and table.

use std::path::Path;

use super::sheet::study_sheet;
use crate::csv::Table;
use crate::report::draw::imprint::Imprint;
use crate::report::error::ReportError;
use crate::report::files::{write_file, write_sheet};
use crate::site::Site;
use crate::study::{Outside, Row, Study, Summary};

/// The columns of `study.csv`. Seconds are of a frame on the wall; `cpu_` ones of the processor, all threads.
pub(in crate::report) const COLUMNS: [&str; 19] = [
    "method",
    "setting",
    "seconds",
    "rmse",
    "relmse",
    "flip",
    "ssim",
    "cpu_seconds",
    "setup_seconds",
    "setup_cpu_seconds",
    "flip_low",
    "flip_high",
    "relmse_low",
    "relmse_high",
    "rmse_low",
    "rmse_high",
    "ssim_low",
    "ssim_high",
    "pareto",
];

/// Writes `study.svg`, `.png` and `.pdf`, and `study.csv`. `shown` is what a person calls the site on the command line.
///
/// # Errors
/// If the sheet cannot be drawn, or the file system refuses.
pub fn write_study(
    site: &Site,
    shown: &str,
    study: &Study,
    summary: &Summary,
    outside: &[Outside],
    folder: &Path,
) -> Result<(), ReportError> {
    let mut table = Table::new(COLUMNS);
    study_rows(&summary.rows).iter().for_each(|row| table.row(row));
    write_file(&folder.join("study.csv"), table.finish().as_bytes())?;
    let made_by = format!("clerestory {}, clerestory study {shown}", env!("CARGO_PKG_VERSION"));
    let imprint = Imprint { site: &site.name, project: &site.project, sheet: [1, 1], made_by: &made_by };
    write_sheet(&study_sheet(&imprint, study, summary, outside), folder, "study")?;
    Ok(())
}

/// The rows of `study.csv`, one a run; the first of each method names its set-up time.
pub(in crate::report) fn study_rows(runs: &[Row]) -> Vec<Vec<String>> {
    let mut last = None;
    let row = |r: &Row| {
        let first = last.replace(r.setting.method) != Some(r.setting.method);
        let setup = if first { format!("; set-up {:.3} s", r.setup.wall_s) } else { String::new() };
        let figures = [
            r.frame.wall_s,
            r.rmse.value,
            r.relmse.value,
            r.flip.value,
            r.ssim.value,
            r.frame.cpu_s,
            r.setup.wall_s,
            r.setup.cpu_s,
            r.flip.low,
            r.flip.high,
            r.relmse.low,
            r.relmse.high,
            r.rmse.low,
            r.rmse.high,
            r.ssim.low,
            r.ssim.high,
        ];
        let mut cells = vec![r.setting.method.name().to_owned(), format!("{}{setup}", r.label)];
        cells.extend(figures.map(|v| format!("{v:.6}")));
        cells.push(u8::from(r.pareto).to_string());
        cells
    };
    runs.iter().map(row).collect()
}
