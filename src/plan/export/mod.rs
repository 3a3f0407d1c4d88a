//! A plan as files: [`tables`] (JSON, CSV, blocks of a site file) and the surface as [`ply`].

pub mod ply;
pub mod tables;
