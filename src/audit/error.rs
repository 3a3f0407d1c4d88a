//! Why a site cannot be audited.

use std::path::PathBuf;

use crate::panorama::PanoramaError;
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
    /// A photograph or mask of another size than the view's.
    #[error(
        "{}: expected {} × {} pixels as the view “{view}” says, found {} × {}. Correct the view's size or take the right picture",
        path.display(), wanted[0], wanted[1], found[0], found[1]
    )]
    Size {
        /// The picture's file.
        path: PathBuf,
        /// The view's name.
        view: String,
        /// What the view says.
        wanted: [u32; 2],
        /// What the picture has.
        found: [u32; 2],
    },
    /// A file could not be written.
    #[error("{}: cannot be written: {why}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What happened.
        why: String,
    },
}
