//! Why a study may fail.

use std::path::PathBuf;

use crate::panorama::PanoramaError;
use crate::photograph::PhotographError;
use crate::reference::LightError;
use crate::render::SetupError;

/// Why a study did not come to an end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A picture cannot be used.
    #[error(transparent)]
    Picture(#[from] PanoramaError),
    /// The site cannot be relit.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The sky cannot be read.
    #[error(transparent)]
    Light(#[from] LightError),
    /// A photograph cannot be used.
    #[error(transparent)]
    Photograph(#[from] PhotographError),
    /// Nothing to measure.
    #[error("{}: {what}", file.display())]
    Nothing {
        /// The site file.
        file: PathBuf,
        /// What is missing and what to do.
        what: String,
    },
    /// Outside figures that make no sense.
    #[error("{}: these outside figures cannot be used: {why}", path.display())]
    Outside {
        /// The file.
        path: PathBuf,
        /// What happened.
        why: String,
    },
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// What was begun cannot be read.
    #[error("{}: this is no study that can be taken up again ({why}). Move it away, or start anew with --fresh", path.display())]
    Begun {
        /// The file.
        path: PathBuf,
        /// What happened.
        why: String,
    },
}
