//! How well each pixel's observations go with a right model.

pub(crate) mod agreement;
pub(crate) mod appearance;
pub(crate) mod noise;
pub(crate) mod photo_consistency;
pub(crate) mod placement;
pub(crate) mod plane_sweep;
pub(crate) mod step;
pub(crate) mod structure;
pub(crate) mod warped;
