//! What can go wrong with a picture on disk.

use std::path::{Path, PathBuf};

use crate::memory::OverLimit;

/// Why a picture could not be read or written. Every message names the file and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PanoramaError {
    /// The file system refused.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not a format that is read here.
    #[error("{path}: not a picture format known here; use .exr, .hdr, .png, .jpg or .tif")]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file breaks its own format's rules, or is cut short.
    #[error("{path}: damaged picture ({what}); export or copy it again")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What was found.
        what: String,
    },
    /// The file is right but uses something that is not read here.
    #[error("{path}: {what}; {remedy}")]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is not read.
        what: String,
        /// What to do instead.
        remedy: &'static str,
    },
    /// More pixels than [`crate::panorama::MAX_PIXELS`].
    #[error(
        "{path}: the header claims {width} × {height} pixels, at most {limit} are read; check the file or scale it down"
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Claimed width in pixels.
        width: u64,
        /// Claimed height in pixels.
        height: u64,
        /// The most pixels that are read.
        limit: u64,
    },
    /// Decoding it would take more memory than it may.
    #[error("{path}: {over}")]
    Memory {
        /// The file.
        path: PathBuf,
        /// How much, and how much it may.
        over: OverLimit,
    },
    /// What was to be written does not fit the format.
    #[error("{path}: cannot be written: {what}")]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        what: String,
    },
}

impl PanoramaError {
    pub(super) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { path: path.into(), source }
    }

    pub(super) fn damaged(path: &Path, what: impl Into<String>) -> Self {
        Self::Damaged { path: path.into(), what: what.into() }
    }

    pub(super) fn unsupported(path: &Path, what: impl Into<String>, remedy: &'static str) -> Self {
        Self::Unsupported { path: path.into(), what: what.into(), remedy }
    }

    pub(super) fn memory(path: &Path, over: OverLimit) -> Self {
        Self::Memory { path: path.into(), over }
    }

    pub(super) fn unwritable(path: &Path, what: impl Into<String>) -> Self {
        Self::Unwritable { path: path.into(), what: what.into() }
    }
}
