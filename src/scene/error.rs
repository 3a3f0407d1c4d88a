//! What can go wrong with a model's files.

use std::path::{Path, PathBuf};

use crate::memory::OverLimit;

/// The most pixels a texture may have along a side.
pub(super) const MAX_SIDE: u32 = 32_768;

/// Why a model could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A file could not be read.
    #[error("{}: {why}. Check the name and your right to read it", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What happened.
        why: String,
    },
    /// A line of the model makes no sense.
    #[error("{}{}: {problem}. Export the model again, or correct it", path.display(), if *line > 0 { format!(":{line}") } else { String::new() })]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line, from 1; 0 where the file has no lines.
        line: usize,
        /// What was found and what was expected.
        problem: String,
    },
    /// The file is not a model this program reads.
    #[error("{}: expected an OBJ, PLY, glTF or E57 model, found {found}. {cure}", path.display())]
    NotAModel {
        /// The file.
        path: PathBuf,
        /// What it seems to be.
        found: String,
        /// How to make one of it that is read.
        cure: &'static str,
    },
    /// The model has no triangle that could be used.
    #[error("{}: the model has no usable triangle ({why}). Export its faces", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// What became of what it holds.
        why: String,
    },
    /// A texture is broken or too large.
    #[error("{}: the picture cannot be used: {why}. Save it again as PNG, JPEG or TIFF of at most {} pixels a side", path.display(), MAX_SIDE)]
    Texture {
        /// The file.
        path: PathBuf,
        /// What happened.
        why: String,
    },
    /// A texture would take more memory than it may.
    #[error("{}: {over}", path.display())]
    Memory {
        /// The file.
        path: PathBuf,
        /// How much, and how much it may.
        over: OverLimit,
    },
}

impl SceneError {
    pub(super) fn io(path: &Path, error: &std::io::Error) -> Self {
        Self::Unreadable { path: path.to_owned(), why: error.to_string() }
    }

    /// A file that makes no sense as a whole, or has no lines.
    pub(super) fn malformed(path: &Path, problem: String) -> Self {
        Self::Malformed { path: path.to_owned(), line: 0, problem }
    }
}
