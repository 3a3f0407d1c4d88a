//! What another program's pose file holds, and what can be wrong with it.

use glam::{DMat3, DVec2, DVec3};
use std::path::{Path, PathBuf};

use crate::panorama::{Distortion, Lens};

/// A camera of a pose file.
#[derive(Clone, Debug)]
pub(in crate::site) struct SolvedCamera {
    /// The photograph's name as the file has it; perhaps without an ending, perhaps with folders.
    pub(in crate::site) photo: String,
    /// In the file's axes and units.
    pub(in crate::site) position: DVec3,
    /// From the camera's axes (x right, y down, z forward) to the file's.
    pub(in crate::site) rotation: DMat3,
    /// Its lens.
    pub(in crate::site) intrinsics: Intrinsics,
}

/// A lens, in pixels of its picture.
#[derive(Clone, Copy, Debug)]
pub(in crate::site) struct Intrinsics {
    /// Width and height; `None`: all lengths are in units of the longer side, and the centre from the middle.
    pub(in crate::site) size: Option<[u32; 2]>,
    pub(in crate::site) lens: Lens,
    pub(in crate::site) focal: DVec2,
    pub(in crate::site) centre: DVec2,
    pub(in crate::site) skew: f64,
    pub(in crate::site) distortion: Distortion,
    /// Whether pixels are those stored in the file, whatever its EXIF orientation says; else those of the upright
    /// picture.
    pub(in crate::site) as_stored: bool,
}

/// What a pose file holds.
#[derive(Debug, Default)]
pub(in crate::site) struct PoseFile {
    pub(in crate::site) cameras: Vec<SolvedCamera>,
    /// What is odd, a sentence each.
    pub(in crate::site) warnings: Vec<String>,
    /// Positions are on the globe (geocentric), not in any model's axes.
    pub(in crate::site) geocentric: bool,
}

/// Why a pose file cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PoseFileError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file breaks its format's rules.
    #[error("{}: {place}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The line, byte or element.
        place: String,
        /// What was found and what was expected.
        what: String,
    },
    /// The file is right but says something that is not read here.
    #[error("{}: {what}; {remedy}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is not read.
        what: String,
        /// What to do instead.
        remedy: &'static str,
    },
}

/// A file's bytes.
pub(in crate::site) fn bytes(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|source| PoseFileError::Io { path: path.into(), source })
}

pub(in crate::site) type Result<T> = std::result::Result<T, PoseFileError>;

/// A rotation matrix made exactly one, if it is one to 10⁻³.
pub(in crate::site) fn rotation(m: DMat3) -> Option<DMat3> {
    let departure = (m * m.transpose() - DMat3::IDENTITY).to_cols_array().iter().fold(0.0, |a: f64, v| a.max(v.abs()));
    (m.is_finite() && departure < 2e-3 && m.determinant() > 0.0)
        .then(|| DMat3::from_quat(glam::DQuat::from_mat3(&m).normalize()))
}

/// A few names, and how many more there are.
pub(in crate::site) fn listed(names: &[String]) -> String {
    const MOST: usize = 8;
    let shown = names.iter().take(MOST).cloned().collect::<Vec<_>>().join(", ");
    match names.len().checked_sub(MOST).filter(|n| *n > 0) {
        Some(more) => format!("{shown} and {more} more"),
        None => shown,
    }
}
