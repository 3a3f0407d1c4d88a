//! Cameras that other programs have solved: COLMAP, RealityCapture, Metashape.
//!
//! Each reader gives cameras in one convention: axes x right, y down, z forward (those of OpenCV and of all three
//! programs), positions in the file's own axes and units, pixel (0, 0) at the top-left pixel's top-left corner.

mod colmap;
mod metashape;
mod realitycapture;
mod xml;

use glam::{DMat3, DVec2, DVec3};
use std::path::{Path, PathBuf};

use crate::panorama::{Distortion, Lens};

/// A camera of a pose file.
#[derive(Clone, Debug)]
pub(super) struct SolvedCamera {
    /// The photograph's name as the file has it; perhaps without an ending, perhaps with folders.
    pub(super) photo: String,
    /// In the file's axes and units.
    pub(super) position: DVec3,
    /// From the camera's axes (x right, y down, z forward) to the file's.
    pub(super) rotation: DMat3,
    /// Its lens.
    pub(super) intrinsics: Intrinsics,
}

/// A lens, in pixels of its picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Intrinsics {
    /// Width and height; `None`: all lengths are in units of the longer side, and the centre from the middle.
    pub(super) size: Option<[u32; 2]>,
    pub(super) lens: Lens,
    pub(super) focal: DVec2,
    pub(super) centre: DVec2,
    pub(super) skew: f64,
    pub(super) distortion: Distortion,
    /// Whether pixels are those stored in the file, whatever its EXIF orientation says; else those of the upright
    /// picture.
    pub(super) as_stored: bool,
}

/// What a pose file holds.
#[derive(Debug, Default)]
pub(super) struct PoseFile {
    pub(super) cameras: Vec<SolvedCamera>,
    /// What is odd, a sentence each.
    pub(super) warnings: Vec<String>,
    /// Positions are on the globe (geocentric), not in any model's axes.
    pub(super) geocentric: bool,
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

type Result<T> = std::result::Result<T, PoseFileError>;

/// Reads a pose file: a folder with COLMAP's `cameras` and `images` (`.bin` or `.txt`), a folder of RealityCapture's
/// `.xmp` or one such file, or Metashape's `.xml`.
///
/// # Errors
///
/// [`PoseFileError`] names the file and the place in it.
pub(super) fn read(path: &Path) -> Result<PoseFile> {
    let unknown = |what: &str| {
        Err(PoseFileError::Unsupported {
            path: path.into(),
            what: what.into(),
            remedy: "give COLMAP's sparse folder, RealityCapture's folder of .xmp files, or Metashape's .xml",
        })
    };
    if path.is_dir() {
        for ending in ["bin", "txt"] {
            if path.join(format!("images.{ending}")).is_file() {
                return colmap::read(path, ending);
            }
        }
        let files = xmp_files(path)?;
        if files.is_empty() {
            return unknown("the folder holds neither images.bin, images.txt nor .xmp files");
        }
        return realitycapture::read(&files);
    }
    match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
        Some("xmp") => realitycapture::read(&[path.to_owned()]),
        Some("xml") => metashape::read(path),
        Some("bin" | "txt") => unknown("expected COLMAP's folder, found a file"),
        _ => unknown("not a pose file known here"),
    }
}

/// The names of the photographs whose cameras a pose file holds; what is read is told at `[cameras]` in docs/site-file.md.
///
/// # Errors
///
/// [`PoseFileError`] names the file and the place in it.
pub fn photographs(path: &Path) -> Result<Vec<String>> {
    Ok(read(path)?.cameras.into_iter().map(|camera| camera.photo).collect())
}

/// The files that [`read`] reads: of a folder, those that hold poses.
pub(super) fn files(path: &Path) -> Vec<PathBuf> {
    if !path.is_dir() {
        return vec![path.to_owned()];
    }
    let ending = ["bin", "txt"].into_iter().find(|e| path.join(format!("images.{e}")).is_file());
    match ending {
        Some(ending) => ["cameras", "images"].map(|stem| path.join(format!("{stem}.{ending}"))).into(),
        None => xmp_files(path).unwrap_or_default(),
    }
}

fn xmp_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let io = |source| PoseFileError::Io { path: folder.into(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xmp")) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// A rotation matrix made exactly one, if it is one to 10⁻³.
fn rotation(m: DMat3) -> Option<DMat3> {
    let departure = (m * m.transpose() - DMat3::IDENTITY).to_cols_array().iter().fold(0.0, |a: f64, v| a.max(v.abs()));
    (m.is_finite() && departure < 2e-3 && m.determinant() > 0.0)
        .then(|| DMat3::from_quat(glam::DQuat::from_mat3(&m).normalize()))
}

/// A few names, and how many more there are.
pub(super) fn listed(names: &[String]) -> String {
    const MOST: usize = 8;
    let shown = names.iter().take(MOST).cloned().collect::<Vec<_>>().join(", ");
    match names.len().checked_sub(MOST).filter(|n| *n > 0) {
        Some(more) => format!("{shown} and {more} more"),
        None => shown,
    }
}

#[cfg(test)]
mod tests;
