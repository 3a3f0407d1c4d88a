//! What another program's pose file holds, and what can be wrong with it.

use glam::{DMat3, DVec2, DVec3, UVec2};
use std::path::{Path, PathBuf};

use crate::panorama::{CameraModel, Distortion, Lens};

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

impl SolvedCamera {
    /// The camera in other axes and units.
    pub(in crate::site) fn moved(self, by: &Similarity) -> Self {
        let position = by.rotation * self.position * by.scale + by.translation;
        Self { position, rotation: by.rotation * self.rotation, ..self }
    }
}

/// From some axes and units to others: scale · rotation · x + translation.
#[derive(Clone, Copy, Debug)]
pub(in crate::site) struct Similarity {
    pub(in crate::site) scale: f64,
    pub(in crate::site) rotation: DMat3,
    pub(in crate::site) translation: DVec3,
}

/// A lens.
#[derive(Clone, Copy, Debug)]
pub(in crate::site) struct Intrinsics {
    /// Width and height of the picture as it is stored, whatever its EXIF orientation says, which the lengths below count in
    /// pixels of. `None`: they are in units of the longer side of the upright picture, and the centre is from its middle.
    pub(in crate::site) size: Option<[u32; 2]>,
    pub(in crate::site) lens: Lens,
    pub(in crate::site) focal: DVec2,
    pub(in crate::site) centre: DVec2,
    pub(in crate::site) skew: f64,
    pub(in crate::site) distortion: Distortion,
}

impl Intrinsics {
    /// The lens before its picture; `size` is the picture's where the file does not tell it.
    pub(in crate::site) fn model(&self, size: [u32; 2]) -> CameraModel {
        let Self { lens, focal, centre, skew, distortion, .. } = *self;
        let Some(size) = self.size else {
            let sides = UVec2::from(size).as_dvec2();
            let unit = sides.max_element();
            let (focal, centre) = (focal * unit, centre * unit + 0.5 * sides);
            return CameraModel { size, lens, focal, centre, skew: skew * unit, distortion };
        };
        CameraModel { size, lens, focal, centre, skew, distortion }
    }
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

/// A file's text, without a byte order mark.
pub(in crate::site) fn text(path: &Path) -> Result<String> {
    Ok(String::from_utf8_lossy(&bytes(path)?).trim_start_matches('\u{feff}').to_owned())
}

pub(in crate::site) type Result<T> = std::result::Result<T, PoseFileError>;

/// A few names, and how many more there are.
pub(in crate::site) fn listed(names: &[String]) -> String {
    const MOST: usize = 8;
    let shown = names.iter().take(MOST).cloned().collect::<Vec<_>>().join(", ");
    match names.len().checked_sub(MOST).filter(|n| *n > 0) {
        Some(more) => format!("{shown} and {more} more"),
        None => shown,
    }
}
