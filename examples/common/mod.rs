//! What the examples that make sites share: a mesh, the parts of buildings, patterns.

pub mod mesh;
pub mod parts;
pub mod pattern;
