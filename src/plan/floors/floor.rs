//! One floor of a building.

use glam::DVec2;

use super::raster::Map;

/// One floor of a building; maps and heights are in local metres.
#[derive(Clone, Debug)]
pub struct Floor {
    /// `Ground floor`, `First floor`, … from the lowest.
    pub name: String,
    /// The name for files: `ground`, `first`, ….
    pub slug: String,
    /// Height of most of it, local metres.
    pub elevation: f32,
    /// Where a person can walk.
    pub walkable: Map,
    /// Height of the ground in each walkable cell; NaN elsewhere.
    pub ground: Vec<f32>,
    /// Where a tripod can stand.
    pub standable: Map,
    /// What is open at probe height, the void beside a gallery included.
    pub open: Map,
    /// The part of the open that has this floor below it: what stations are to see.
    pub target: Map,
    /// Small parts that seemed to belong to it and are left out: none can be walked to, and all are open to what is not
    /// this floor.
    pub left_out: Map,
}

impl Floor {
    /// Height of the lens of a tripod at a place: over the ground there, or over the floor where there is none.
    pub fn lens(&self, at: DVec2, probe_height_m: f64) -> f32 {
        let ground = self.walkable.grid.cell(at).map_or(f32::NAN, |c| self.ground[c]);
        (if ground.is_finite() { ground } else { self.elevation }) + probe_height_m as f32
    }

    /// The greatest clearance anywhere on it, metres.
    pub(crate) fn widest(&self) -> f64 {
        let distance = self.walkable.inverted().distance();
        let most = f64::from(distance.into_iter().filter(|d| d.is_finite()).fold(0.0, f32::max));
        // to the obstacle cell's near side
        (most - 0.5 * self.walkable.grid.cell_m).max(0.0)
    }
}
