//! What can go wrong with a report.

use std::path::PathBuf;

/// Why a sheet could not be drawn or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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
