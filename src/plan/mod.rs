//! Where to stand: open space, what is seen from a point of it, and the fewest points that see all of it.
//!
//! Each folder imports only from those before it: [`floors`] finds a building's floors in its mesh, [`free_space`] turns
//! one into polygons and triangles, [`visibility`] tells what is seen from where, [`cover`] solves set covers,
//! [`stations`] plans a site with all of these, and [`export`] writes the plan. [`gallery`] stands beside: guards for a
//! polygon, with proof.

pub mod cover;
mod error;
pub mod export;
pub mod floors;
pub mod free_space;
pub mod gallery;
pub mod stations;
pub mod visibility;

pub use error::PlanError;
