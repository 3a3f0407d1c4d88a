//! Parts of a level that are no part of a floor: a recess under a chapel, an apse's hollow below its floor, deep sills.
//!
//! Rooms behind closed doors cannot be walked to in the model either, but walls are all about them. What is left out is
//! small, cannot be walked to from the floor's main part, and is open on a good share of its rim: there, it goes over
//! into what is not this floor.

use super::floor::Floor;
use super::raster::Map;
use super::walkable::WalkableSpans;

/// Smaller than this share of the largest part.
const SMALL: f64 = 0.125;
/// At least this share of the rim is no wall.
const OPEN_RIM: f64 = 0.25;

/// The parts of a floor's target that are none of its floor. `free` tells where nothing solid is at probe height.
pub(crate) fn disconnected_parts(floor: &Floor, places: &WalkableSpans, free: impl Fn(usize) -> bool) -> Map {
    let grid = floor.target.grid;
    let at = |cell: usize| places.column(cell).find(|i| places.list[*i].z == floor.ground[cell]);
    let main = floor.standable.parts().into_iter().max_by_key(Vec::len).unwrap_or_default();
    let reached = places.walked_to(main.into_iter().filter_map(at));
    let parts = floor.target.parts();
    let largest = parts.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let is_disconnected = |part: &&Vec<usize>| {
        let walked_to = part.iter().any(|c| floor.standable.on[*c] && at(*c).is_some_and(|i| reached[i]));
        let (mut rim, mut open) = (0u32, 0u32);
        for beside in part.iter().flat_map(|c| grid.neighbours(*c)).filter(|c| !floor.target.on[*c]) {
            rim += 1;
            open += u32::from(free(beside));
        }
        !walked_to && (part.len() as f64) < SMALL * largest && f64::from(open) >= OPEN_RIM * f64::from(rim)
    };
    let mut disconnected = grid.none();
    parts.iter().filter(is_disconnected).flatten().for_each(|c| disconnected.on[*c] = true);
    disconnected
}
