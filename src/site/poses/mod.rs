//! Cameras that other programs have solved: COLMAP, RealityCapture, Metashape.
//!
//! Each reader gives cameras in one convention: axes x right, y down, z forward (those of OpenCV and of all three
//! programs), positions in the file's own axes and units, pixel (0, 0) at the top-left pixel's top-left corner.

mod colmap;
mod metashape;
mod realitycapture;
mod solved;
mod xml;

pub use solved::PoseFileError;
pub(super) use solved::{PoseFile, Similarity, SolvedCamera, listed};

use std::path::{Path, PathBuf};

use solved::Result;

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
        if let Some(ending) = colmap_ending(path) {
            return colmap::read(path, ending);
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
pub(crate) fn files(path: &Path) -> Vec<PathBuf> {
    if !path.is_dir() {
        return vec![path.to_owned()];
    }
    match colmap_ending(path) {
        Some(ending) => ["cameras", "images"].map(|stem| path.join(format!("{stem}.{ending}"))).into(),
        None => xmp_files(path).unwrap_or_default(),
    }
}

/// The ending of COLMAP's files in a folder that holds them.
fn colmap_ending(folder: &Path) -> Option<&'static str> {
    ["bin", "txt"].into_iter().find(|ending| folder.join(format!("images.{ending}")).is_file())
}

fn xmp_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let io = |source| PoseFileError::Io { path: folder.into(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xmp")) && path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests;
