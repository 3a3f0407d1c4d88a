//! Writing a study's sheet and table.

use std::path::Path;

use super::sheet::study_sheet;
use crate::csv::Table;
use crate::report::error::ReportError;
use crate::report::files::{write_file, write_sheet};
use crate::site::Site;
use crate::study::{Outside, Row, Study, Summary};

/// A figure of `study.csv`: its column and where a row has it. Seconds are of a frame on the wall; `cpu_` ones of the
/// processor, all threads.
type Figure = (&'static str, fn(&Row) -> f64);

const FIGURES: [Figure; 16] = [
    ("seconds", |r| r.frame.wall_s),
    ("rmse", |r| r.rmse.value),
    ("relmse", |r| r.relmse.value),
    ("flip", |r| r.flip.value),
    ("ssim", |r| r.ssim.value),
    ("cpu_seconds", |r| r.frame.cpu_s),
    ("setup_seconds", |r| r.setup.wall_s),
    ("setup_cpu_seconds", |r| r.setup.cpu_s),
    ("flip_low", |r| r.flip.low),
    ("flip_high", |r| r.flip.high),
    ("relmse_low", |r| r.relmse.low),
    ("relmse_high", |r| r.relmse.high),
    ("rmse_low", |r| r.rmse.low),
    ("rmse_high", |r| r.rmse.high),
    ("ssim_low", |r| r.ssim.low),
    ("ssim_high", |r| r.ssim.high),
];

/// The columns of `study.csv`.
pub(in crate::report) fn columns() -> impl Iterator<Item = &'static str> {
    ["method", "setting"].into_iter().chain(FIGURES.map(|f| f.0)).chain(["pareto"])
}

/// Writes `study.svg`, `.png` and `.pdf`, and `study.csv`; `command` is the one that makes them.
///
/// # Errors
/// If the sheet cannot be drawn, or the file system refuses.
pub fn write_study(
    site: &Site,
    command: &str,
    study: &Study,
    summary: &Summary,
    outside: &[Outside],
    folder: &Path,
) -> Result<(), ReportError> {
    let mut table = Table::new(columns());
    study_rows(&summary.rows).iter().for_each(|row| table.row(row));
    write_file(&folder.join("study.csv"), table.finish().as_bytes())?;
    write_sheet(&study_sheet(site, command, study, summary, outside), folder, "study")?;
    Ok(())
}

/// The rows of `study.csv`, one a run; the first of each method names its set-up time.
pub(in crate::report) fn study_rows(runs: &[Row]) -> Vec<Vec<String>> {
    let mut last = None;
    let row = |r: &Row| {
        let first = last.replace(r.setting.method) != Some(r.setting.method);
        let setup = if first { format!("; set-up {:.3} s", r.setup.wall_s) } else { String::new() };
        let mut cells = vec![r.setting.method.name().to_owned(), format!("{}{setup}", r.label)];
        cells.extend(FIGURES.map(|(_, of)| format!("{:.6}", of(r))));
        cells.push(u8::from(r.pareto).to_string());
        cells
    };
    runs.iter().map(row).collect()
}
