//! One floor made discrete: candidates, what each sees, and what must be seen.

use glam::DVec2;
use rayon::prelude::*;

use crate::plan::PlanError;
use crate::plan::floors::floor::Floor;
use crate::plan::free_space::contour::polygons;
use crate::plan::free_space::open_space::OpenSpace;
use crate::plan::visibility::region::VisibilityRegion;
use crate::plan::visibility::witness::Witnesses;
use crate::scene::Scene;
use crate::site::Plan;

/// The most candidates on a floor, but for fixed places.
const MOST: f64 = 500.0;

/// A floor with the stations that could be, and their sights.
pub(crate) struct FloorProblem {
    /// The open region at probe height.
    pub(crate) open: OpenSpace,
    /// Points and walls to be seen.
    pub(crate) witnesses: Witnesses,
    /// Where a station may be: fixed places first, then the rest.
    pub(crate) candidates: Vec<DVec2>,
    /// What each candidate sees.
    pub(crate) regions: Vec<VisibilityRegion>,
    /// The witnesses that each candidate sees.
    pub(crate) sights: Vec<Vec<u32>>,
    /// Probes that are there already: what each sees, and the witnesses among it.
    pub(crate) present: Vec<(VisibilityRegion, Vec<u32>)>,
}

impl FloorProblem {
    /// Spreads candidates and witnesses and finds who sees what. `fixed` and `present` are local.
    ///
    /// # Errors
    ///
    /// An outline that is no polygon.
    pub(crate) fn new(
        floor: &Floor,
        scene: &Scene,
        plan: &Plan,
        fixed: &[DVec2],
        present: &[DVec2],
    ) -> Result<Self, PlanError> {
        let outline = |source| PlanError::Outline { floor: floor.name.to_lowercase(), source };
        let open = OpenSpace::new(&polygons(&floor.open, 0.9 * floor.open.grid.cell_m)).map_err(outline)?;
        let witnesses = Witnesses::of(floor, &open, scene, plan);
        let mut candidates = fixed.to_vec();
        candidates.extend(spread(floor).into_iter().filter(|c| open.contains(*c)));
        let look = |at: &DVec2| {
            let isovist = open.visibility(*at).unwrap_or_default();
            let region = VisibilityRegion::new(isovist, plan.range_m);
            let seen = witnesses.seen(&region, plan);
            (region, seen)
        };
        let (regions, sights) = candidates.par_iter().map(look).unzip();
        let present = present.par_iter().map(look).collect();
        Ok(Self { open, witnesses, candidates, regions, sights, present })
    }
}

/// In each square of the floor, the place that is farthest from obstacles.
fn spread(floor: &Floor) -> Vec<DVec2> {
    let grid = floor.standable.grid;
    let side = (floor.standable.area() / MOST).sqrt().max(0.3);
    let block = (side / grid.cell_m).round().max(1.0) as usize;
    let wide = grid.width.div_ceil(block);
    let distance = floor.walkable.inverted().distance();
    let mut best: Vec<Option<usize>> = vec![None; wide * grid.height.div_ceil(block)];
    for cell in floor.standable.cells() {
        let slot = &mut best[cell / grid.width / block * wide + cell % grid.width / block];
        if slot.is_none_or(|b| distance[cell] > distance[b]) {
            *slot = Some(cell);
        }
    }
    best.into_iter().flatten().map(|c| grid.middle(c)).collect()
}
