//! What else a region may be than right: displaced, not there, of another colour or picture, laid or standing otherwise.

pub(crate) mod absent;
pub(crate) mod borders;
pub(crate) mod displaced;
pub(crate) mod extent;
pub(crate) mod laying;
pub(crate) mod opening;
pub(crate) mod other_picture;
pub(crate) mod recoloured;
pub(crate) mod second_surface;
pub(crate) mod sideways;
pub(crate) mod silhouette;

/// How far off its place something is looked for, metres.
pub(crate) const FARTHEST_M: f32 = 0.3;
