//! Where to stand: open space, what is seen from a point of it, and the fewest points that see all of it.
//!
//! The plane half takes polygons: [`polygon`], [`open_space`], [`visibility`], [`cover`]. The site half finds them in a
//! model ([`floors`]: columns of spans, walkable places, levels, maps, [`contour`]) and plans stations on them
//! ([`mod@site`]: witnesses, choice, overlap, tour, taped distances, and a check on the model's surface).

mod annex;
mod assemble;
mod choice;
pub mod contour;
pub mod cover;
mod error;
pub mod floors;
pub mod gallery;
pub mod grid;
mod levels;
mod model;
mod noding;
pub mod open_space;
mod orient;
pub mod output;
mod overlap;
mod partial_bound;
pub mod patches;
mod places;
pub mod ply;
pub mod polygon;
pub mod section;
mod sight;
pub mod site;
mod spans;
pub mod star;
pub mod surface;
pub mod tape;
mod tour;
mod triangulate;
pub mod visibility;
pub mod witness;

pub use error::PlanError;
