//! What a study has found so far, and the file it can be taken up again from.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::StudyError;
use super::conclusions::result::Summary;
use super::measure::Run;
use super::options::Options;
use super::order::Ranked;
use super::sweep::Base;
use crate::atomic_write::write_atomically;
use crate::site::{Site, View};

/// Changes with how runs are made, so that figures of two ways never stand in one study.
const METHOD: &str = "probes in plan order; places of the volume gathered each for itself";

/// What a study has found so far. Serialises to `study.json`, from which it can be taken up again.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Study {
    /// SHA-256 of all that the figures depend on.
    pub fingerprint: String,
    /// The site's name.
    pub site: String,
    /// The lighting; empty for a lone one.
    pub lighting: String,
    /// Threads that worked.
    pub threads: usize,
    /// Whether processor time could be told; if not, it is the wall's.
    pub processor_time: bool,
    /// The share of each picture in which error was measured.
    pub share: f64,
    /// What error is measured against.
    pub truth: TruthNote,
    /// The settings as they come.
    pub base: Base,
    /// The probes in the order in which settings with fewer take them.
    #[serde(default)]
    pub order: Vec<Ranked>,
    /// Blocks of each view, in the order of [`ViewRun::blocks`](super::ViewRun).
    pub blocks: Vec<usize>,
    /// All settings that were measured.
    pub runs: Vec<Run>,
    /// What the budget left undone.
    pub pending: Vec<String>,
    /// What the site does not allow, and other remarks.
    pub notes: Vec<String>,
    /// What is made of it; not read back.
    #[serde(default, skip_deserializing)]
    pub summary: Option<Summary>,
}

/// What error is measured against.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TruthNote {
    /// `photographs` or `reference`.
    pub kind: String,
    /// Samples a pixel of a reference.
    pub samples: Option<u32>,
    /// Its root mean squared noise, already taken off RMSE and relative MSE; `None` where it is not known.
    pub noise_rmse: Option<f64>,
    /// FLIP between its two halves, which bounds what its noise adds to FLIP.
    pub noise_flip: Option<f64>,
}

impl Study {
    /// Whether its figures are of views with so many blocks each: a file may say anything.
    pub(super) fn is_of(&self, blocks: &[usize]) -> bool {
        let fits = |run: &Run| {
            run.views.len() != blocks.len() || run.views.iter().zip(blocks).all(|(view, n)| view.blocks.len() == *n)
        };
        self.blocks == blocks && self.runs.iter().all(fits)
    }

    /// Writes the study to a file, whole or not at all.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn save(&self, file: &Path) -> Result<(), StudyError> {
        let io = |source| StudyError::Io { path: file.to_owned(), source };
        write_atomically(file, io, |out| {
            serde_json::to_writer(&mut *out, self).map_err(|e| io(e.into()))?;
            writeln!(out).map_err(io)
        })
    }
}

/// The study that stands in a folder, if it is of the same things; one of other things is moved aside.
pub(super) fn begun(
    file: &Path,
    fingerprint: &str,
    fresh: bool,
    notes: &mut Vec<String>,
) -> Result<Option<Study>, StudyError> {
    if fresh || !file.exists() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(file).map_err(|source| StudyError::Io { path: file.to_owned(), source })?;
    let study: Study =
        serde_json::from_str(&text).map_err(|e| StudyError::Begun { path: file.to_owned(), why: e.to_string() })?;
    if study.fingerprint == fingerprint {
        return Ok(Some(study));
    }
    let aside = file.with_file_name("study.previous.json");
    std::fs::rename(file, &aside).map_err(|source| StudyError::Io { path: file.to_owned(), source })?;
    notes.push(format!("The study that stood here was of other input or settings: it is now {}.", aside.display()));
    Ok(None)
}

/// What the figures depend on, as one number; `model` are the files that the model names.
pub(super) fn fingerprint(
    site: &Site,
    model: &[PathBuf],
    views: &[&View],
    lighting: &str,
    options: &Options,
    photographs: bool,
) -> Result<String, StudyError> {
    let mut hash = Sha256::new();
    for path in site.files().iter().chain(model) {
        let bytes = std::fs::read(path).map_err(|source| StudyError::Io { path: path.clone(), source })?;
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(&bytes);
    }
    let names: Vec<&str> = views.iter().map(|v| v.name.as_str()).collect();
    let reference = (!photographs).then_some(options.reference_samples);
    let threads = rayon::current_num_threads();
    let rest = (env!("CARGO_PKG_VERSION"), METHOD, names, lighting, options.share, options.seed, reference, threads);
    hash.update(format!("{rest:?}"));
    Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect())
}
