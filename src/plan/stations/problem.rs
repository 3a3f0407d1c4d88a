//! One floor made discrete: candidates, what each sees, and what must be seen.

use glam::{DVec2, DVec3};
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

/// A place for a lens, and what is seen from there.
pub(crate) struct Viewpoint {
    /// Local metres.
    pub(crate) lens: DVec3,
    /// What it sees in plan.
    pub(crate) region: VisibilityRegion,
    /// The witnesses among that, in rising order.
    pub(crate) sight: Vec<u32>,
}

/// A floor with the stations that could be.
pub(crate) struct FloorProblem {
    pub(crate) floor: Floor,
    /// The open region at probe height.
    pub(crate) open: OpenSpace,
    /// Points and walls to be seen.
    pub(crate) witnesses: Witnesses,
    /// Where a station may be: fixed places first, then the rest.
    pub(crate) candidates: Vec<Viewpoint>,
    /// How many of them are fixed.
    pub(crate) fixed: usize,
    /// Probes that are there already, with their names.
    pub(crate) present: Vec<(String, Viewpoint)>,
}

impl FloorProblem {
    /// Spreads candidates and witnesses and finds who sees what. `fixed` and `present` are local.
    ///
    /// # Errors
    ///
    /// An outline that is no polygon.
    pub(crate) fn new(
        floor: Floor,
        scene: &Scene,
        plan: &Plan,
        fixed: &[DVec2],
        present: Vec<(String, DVec3)>,
    ) -> Result<Self, PlanError> {
        let outline = |source| PlanError::Outline { floor: floor.name.to_lowercase(), source };
        let open = OpenSpace::new(&polygons(&floor.open, 0.9 * floor.open.grid.cell_m)).map_err(outline)?;
        let witnesses = Witnesses::of(&floor, &open, scene, plan);
        let look = |lens: DVec3| {
            let region = VisibilityRegion::new(open.visibility(lens.truncate()).unwrap_or_default(), plan.range_m);
            let sight = witnesses.seen(&region, plan);
            Viewpoint { lens, region, sight }
        };
        let mut places = fixed.to_vec();
        places.extend(spread(&floor).into_iter().filter(|p| open.contains(*p)));
        let lens = |at: DVec2| at.extend(f64::from(floor.lens(at, plan.probe_height_m)));
        let candidates = places.into_par_iter().map(|at| look(lens(at))).collect();
        let present = present.into_par_iter().map(|(name, lens)| (name, look(lens))).collect();
        Ok(Self { floor, open, witnesses, candidates, fixed: fixed.len(), present })
    }

    /// The candidates and, after them, the probes that are there already.
    pub(crate) fn viewpoints(&self) -> impl Iterator<Item = &Viewpoint> {
        self.candidates.iter().chain(self.present.iter().map(|(_, viewpoint)| viewpoint))
    }

    /// The probes that are there already, and the candidates of these numbers.
    pub(crate) fn taken<'a>(&'a self, stations: &'a [usize]) -> impl Iterator<Item = &'a Viewpoint> {
        let present = self.present.iter().map(|(_, viewpoint)| viewpoint);
        present.chain(stations.iter().map(|c| &self.candidates[*c]))
    }
}

/// In each square of the floor, the place that is farthest from obstacles.
fn spread(floor: &Floor) -> Vec<DVec2> {
    let distance = floor.walkable.inverted().distance();
    let farther = |best: usize, cell: usize| if distance[cell] > distance[best] { cell } else { best };
    let side = (floor.standable.area() / MOST).sqrt().max(0.3);
    let cells = floor.standable.blocks(side).into_iter().filter_map(|cells| cells.into_iter().reduce(farther));
    cells.map(|c| floor.standable.grid.middle(c)).collect()
}
