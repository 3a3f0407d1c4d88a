//! What is seen from a point: in plan its [`isovist`] and the [`region`] of it within range, in space the [`surface`] in
//! [`patches`]; and the [`witness`]es that stand for what must be seen.

pub mod isovist;
mod line_of_sight;
pub mod patches;
pub mod region;
pub mod surface;
pub mod witness;
