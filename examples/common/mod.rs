//! What the examples that make sites share: a mesh, the parts of buildings, patterns, the ways of pixels.

pub mod eye;
pub mod mesh;
pub mod objects;
pub mod parts;
pub mod pattern;
