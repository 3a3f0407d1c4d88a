//! What can stop registration.

use crate::panorama::PanoramaError;
use crate::photograph::PhotographError;

/// Why pictures cannot be registered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RegisterError {
    /// A probe's picture cannot be read.
    #[error(transparent)]
    Panorama(#[from] PanoramaError),
    /// A photograph cannot be read.
    #[error(transparent)]
    Photograph(#[from] PhotographError),
    /// There is no picture to register.
    #[error(
        "{site}: no probe or view with a picture to register. Add a [[probe]] with an image, or a photo to a [[view]]"
    )]
    NoPicture {
        /// The site file.
        site: String,
    },
    /// A name that no probe or view has.
    #[error("{site}: there is no probe or view with a picture called “{name}”. Known: {known}")]
    NoSuch {
        /// The site file.
        site: String,
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
}
