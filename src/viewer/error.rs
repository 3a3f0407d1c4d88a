//! Why no page was made.

use std::path::PathBuf;

use crate::bake::BakeError;
use crate::panorama::PanoramaError;
use crate::photograph::PhotographError;

/// Why no page can be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewerError {
    /// A photograph cannot be used.
    #[error(transparent)]
    Photograph(#[from] PhotographError),
    /// A picture cannot be used.
    #[error(transparent)]
    Picture(#[from] PanoramaError),
    /// A texture cannot be used, or the page cannot be written.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// Findings or a plan cannot be read.
    #[error("{}: {why}. Expected what `{from}` writes", path.display())]
    Unusable {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        why: String,
        /// The verb that makes such a file.
        from: String,
    },
}
