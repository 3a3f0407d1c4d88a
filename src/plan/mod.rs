//! Where to stand: open space, what is seen from a point of it, and the fewest points that see all of it.

pub mod cover;
pub mod gallery;
mod noding;
pub mod open_space;
mod orient;
pub mod polygon;
pub mod sight;
mod triangulate;
pub mod visibility;
