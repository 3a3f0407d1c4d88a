//! Writing sheets and other results, each whole or not at all.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::draw::pdf::pdf;
use super::draw::png::png;
use super::draw::svg::Svg;
use super::error::ReportError;
use crate::atomic_write::write_atomically;

/// Dots per inch of the PNG that goes with a sheet.
const DPI: f32 = 150.0;

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

/// Removes a file that an earlier run left, if it is there.
///
/// # Errors
/// If the file system refuses.
pub fn remove_earlier(path: &Path) -> Result<(), ReportError> {
    if path.is_file() {
        std::fs::remove_file(path).map_err(|source| ReportError::Io { path: path.into(), source })?;
    }
    Ok(())
}

/// Writes a value as JSON for people to read, with a line's end.
///
/// # Errors
/// If JSON cannot hold it, or the file system refuses.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), ReportError> {
    let io = |e: serde_json::Error| ReportError::Io { path: path.into(), source: e.into() };
    let text = serde_json::to_string_pretty(value).map_err(io)? + "\n";
    write_file(path, text.as_bytes())
}

/// Writes a sheet as `<stem>.svg`, `<stem>.png` (150 dots per inch) and `<stem>.pdf`; gives the first one's path.
///
/// # Errors
/// If the sheet cannot be drawn, or the file system refuses.
pub fn write_sheet(sheet: &Svg, folder: &Path, stem: &str) -> Result<PathBuf, ReportError> {
    let svg = sheet.finish();
    let path = folder.join(format!("{stem}.svg"));
    let picture = png(&svg, DPI)?;
    write_file(&path, svg.as_bytes())?;
    write_file(&folder.join(format!("{stem}.png")), &picture)?;
    write_file(&folder.join(format!("{stem}.pdf")), &pdf(stem, &[&svg], None)?)?;
    Ok(path)
}
