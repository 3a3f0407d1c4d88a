//! Lenses: the perspective projection, its distortion, and a photograph without it.

pub(crate) mod camera_model;
pub(crate) mod distortion;
pub(crate) mod undistort;
