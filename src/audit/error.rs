//! Why a site cannot be audited.

use std::path::PathBuf;

use crate::panorama::PanoramaError;
use crate::photograph::PhotographError;
use crate::register::RegisterError;
use crate::render::SetupError;

/// Why a site cannot be audited.
#[derive(Debug, thiserror::Error)]
pub enum AuditError {
    /// A picture cannot be read.
    #[error(transparent)]
    Picture(#[from] PanoramaError),
    /// The probes cannot be used.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// There is nothing to compare with.
    #[error("{site}: no view has a photograph, so there is nothing to audit. Give a [[view]] a photo = \"…\"")]
    NoPhotograph {
        /// The site file.
        site: String,
    },
    /// No probe's picture fits the model.
    #[error("{site}: no probe is left to audit with. {why}")]
    NoProbeFits {
        /// The site file.
        site: String,
        /// What is wrong with each.
        why: String,
    },
    /// The probes' pictures cannot be compared with the model.
    #[error(transparent)]
    Register(#[from] RegisterError),
    /// A photograph cannot be used.
    #[error(transparent)]
    Photograph(#[from] PhotographError),
    /// A file could not be written.
    #[error("{}: cannot be written: {why}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What happened.
        why: String,
    },
}
