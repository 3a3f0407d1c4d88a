//! Pictures laid otherwise than the model has them: turned, mirrored, scaled, shifted, or on a surface that is off its place.

mod independent;
pub(crate) mod parts;
pub(crate) mod phase_correlation;
pub(crate) mod plane_picture;
pub(crate) mod retextured;
pub(crate) mod texture_alignment;
