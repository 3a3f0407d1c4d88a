//! The plane that sight can cross: polygons with holes from a map's [`contour`], noded and triangulated
//! ([`open_space`]), and the walls that a level cut through the model shows ([`section`]).

pub(crate) mod cells;
pub mod contour;
pub(crate) mod noding;
pub mod open_space;
pub mod polygon;
pub(crate) mod predicates;
pub mod section;
pub(crate) mod triangulation;
