//! What a report was made from, with fingerprints, so that it can be trusted in ten years.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::error::ReportError;

/// One verb as it was run for the report.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Run {
    /// The verb.
    pub verb: String,
    /// The command line that does the same.
    pub command: String,
    /// Seconds that it took; `None` where it was left out.
    pub seconds: Option<f64>,
    /// Why it was left out or came to no end; empty where it did.
    pub note: String,
}

/// `manifest.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Manifest {
    /// The program's name.
    pub software: &'static str,
    /// Its version.
    pub version: &'static str,
    /// The site's name.
    pub site: String,
    /// When the report was made: `YYYY-MM-DDThh:mm:ssZ`.
    pub made: String,
    /// The command line.
    pub command: String,
    /// The verbs that were run, with their settings (as command lines) and times.
    pub runs: Vec<Run>,
    /// Every file that was read, by its path from the site's folder.
    pub inputs: Vec<Fingerprint>,
    /// Every file of the report but this one.
    pub outputs: Vec<Fingerprint>,
}

/// A file's size and SHA-256.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// Its path, from the folder that the list is about; `/` between folders.
    pub file: String,
    /// Its size.
    pub bytes: u64,
    /// 64 hexadecimal digits.
    pub sha256: String,
}

/// The fingerprints of files, in their order, each named by its path from `folder` where it lies in there and by its
/// full path elsewhere.
///
/// # Errors
/// A file that cannot be read.
pub fn fingerprints(files: &[PathBuf], folder: &Path) -> Result<Vec<Fingerprint>, ReportError> {
    files.par_iter().map(|path| fingerprint(path, folder)).collect()
}

fn fingerprint(path: &Path, folder: &Path) -> Result<Fingerprint, ReportError> {
    let io = |source| ReportError::Io { path: path.into(), source };
    let mut file = File::open(path).map_err(io)?;
    let (mut hash, mut bytes, mut buffer) = (Sha256::new(), 0, vec![0; 1 << 16]);
    loop {
        let n = file.read(&mut buffer).map_err(io)?;
        if n == 0 {
            break;
        }
        hash.update(&buffer[..n]);
        bytes += n as u64;
    }
    let sha256 = hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
    let inside = path.strip_prefix(folder).unwrap_or(path);
    Ok(Fingerprint { file: inside.to_string_lossy().replace('\\', "/"), bytes, sha256 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_fingerprints() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("abc.txt");
        std::fs::write(&path, "abc").unwrap();
        let found = fingerprints(&[path], dir.path()).unwrap();
        // FIPS 180-2, appendix B.1
        let known = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(found, [Fingerprint { file: "abc.txt".into(), bytes: 3, sha256: known.into() }]);
        assert!(fingerprints(&[dir.path().join("absent")], dir.path()).is_err());
    }
}
