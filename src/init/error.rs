//! Why no site file was made.

use std::path::PathBuf;

use crate::scene::SceneError;

/// Why no site file could be drafted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InitError {
    /// The model cannot be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A folder of pictures cannot be read.
    #[error("{}: {why}. Name a folder of pictures", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        why: String,
    },
    /// The folder for a scan file's pictures holds something already.
    #[error("{}: the folder for the scan's pictures is in use. Move it away, or say that it may be written over (--overwrite)", path.display())]
    InUse {
        /// The folder.
        path: PathBuf,
    },
    /// A folder holds no picture.
    #[error("{}: there is no picture in the folder itself (looked for {endings}). Name the folder that holds them", path.display())]
    NoPicture {
        /// The folder.
        path: PathBuf,
        /// What was looked for.
        endings: String,
    },
}
