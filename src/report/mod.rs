//! Drawing: sheets in SVG and PNG, and the report's page with its manifest.
//!
//! A sheet is an [`Svg`] in millimetres, made by one function per kind of sheet from that stage's typed result; [`png()`]
//! draws a picture of it. What is computed elsewhere is only shown here.

mod audit_sheet;
mod coverage_sheet;
mod dxf;
mod floor_map;
pub mod gallery_sheet;
mod imprint;
mod lengths;
mod loglog;
mod manifest;
mod marked;
mod markers;
mod overview;
pub mod page;
mod pdf;
mod plan_sheet;
mod png;
mod register_sheet;
mod study_sheet;
mod study_table;
pub mod style;
mod svg;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

pub use audit_sheet::{AuditSheet, audit_sheet, write_audit_sheets};
pub use coverage_sheet::coverage_sheet;
pub use dxf::plan_dxf;
pub use imprint::{Imprint, TITLE_BLOCK, title_block};
pub use manifest::{Fingerprint, Manifest, fingerprints};
pub use marked::{Mark, marked};
pub use markers::{Marker, cloud_compare, maya, write_markers};
pub use overview::{Overview, overview, overview_csv, overview_page};
pub use pdf::pdf;
pub use plan_sheet::plan_sheet;
pub use png::{png, text_width, wrap};
pub use register_sheet::{RegisterSheet, register_sheet, register_stem, register_words};
pub use study_sheet::study_sheet;
pub use svg::{Anchor, Point, Svg, Text, escape};

use crate::atomic_write::write_atomically;

/// Dots per inch of the PNG that goes with a sheet.
pub const DPI: f32 = 150.0;

/// Why a sheet could not be drawn or written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file system refused.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A folder or file that no report is made of.
    #[error("{path}: {what}")]
    NotAReport {
        /// The folder or file.
        path: PathBuf,
        /// What was expected, what was found, and what to do.
        what: String,
    },
    /// No picture can be made of the sheet.
    #[error("a sheet could not be drawn: {what}")]
    Drawing {
        /// What was found.
        what: String,
    },
}

/// Writes a file, whole or not at all, making its folder if need be.
///
/// # Errors
/// If the file system refuses.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    let io = |source| ReportError::Io { path: path.into(), source };
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(io)?;
    }
    write_atomically(path, io, |file| std::io::Write::write_all(file, bytes).map_err(io))
}

/// Writes a sheet as `<stem>.svg`, `<stem>.png` (at [`DPI`]) and `<stem>.pdf`; gives the paths of the first two.
///
/// # Errors
/// If the sheet cannot be drawn, or the file system refuses.
pub fn write_sheet(sheet: &Svg, folder: &Path, stem: &str) -> Result<[PathBuf; 2], ReportError> {
    let svg = sheet.finish();
    let picture = png(&svg, DPI)?;
    let paths = [folder.join(format!("{stem}.svg")), folder.join(format!("{stem}.png"))];
    write_file(&paths[0], svg.as_bytes())?;
    write_file(&paths[1], &picture)?;
    write_file(&folder.join(format!("{stem}.pdf")), &pdf(stem, &[&svg])?)?;
    Ok(paths)
}
