//! A building's floors, found in its mesh: columns of solid spans (`heightfield`), where one can walk (`walkable`), the
//! heights at which there are floors (`levels`), and on each the maps of a [`floor`] on a grid ([`raster`]).

mod disconnected;
pub mod find;
pub mod floor;
mod heightfield;
mod levels;
pub mod raster;
mod walkable;
