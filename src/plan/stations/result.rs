//! A plan: floors, stations on each, and what they see in plan and in space.

use glam::DVec3;

use super::check_distances::CheckDistance;
use crate::plan::floors::{floor::Floor, raster::Map};
use crate::plan::free_space::{polygon::Polygon, section::Line};
use crate::plan::visibility::region::VisibilityRegion;
use crate::plan::visibility::surface::{PatchVisibility, Surface};
use crate::plan::visibility::witness::WallPiece;

/// A planned place for a tripod, or a probe that is there already.
#[derive(Clone, Debug)]
pub struct Station {
    /// Unique among the site's probes.
    pub name: String,
    /// The lens, local metres.
    pub position: DVec3,
    /// Whether the site file fixes it.
    pub fixed: bool,
    /// What it sees in plan.
    pub region: VisibilityRegion,
    /// Square metres of the floor that it sees.
    pub covers_m2: f64,
    /// The share of what can be seen of the floor that it adds to the stations before it.
    pub adds_fraction: f64,
    /// The share of the surface that can be seen from this floor and that no station before it sees; `None` without the
    /// check in space.
    pub adds_surface_fraction: Option<f64>,
    /// Distances that a tape can check.
    pub check_distances: Vec<CheckDistance>,
}

/// What the stations of a floor see of the model's surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceCover {
    /// What can be seen from anywhere a tripod can stand on this floor, within the limits, m².
    pub reachable_m2: f64,
    /// How much of that the stations see.
    pub covered_fraction: f64,
    /// What only a lens somewhere else on this floor would see, m².
    pub unreachable_m2: f64,
}

/// The plan of one floor.
pub struct FloorPlan {
    /// The floor.
    pub floor: Floor,
    /// Open region at probe height.
    pub outline: Vec<Polygon>,
    /// The model cut at lens height around the open region: walls where they stand.
    pub section: Vec<Line>,
    /// The model cut lower down, inside the open region.
    pub furniture: Vec<Line>,
    /// Pieces of wall, each with the number of stations that see it.
    pub walls: Vec<(WallPiece, u8)>,
    /// New stations, the most useful first.
    pub stations: Vec<Station>,
    /// Probes that are there already.
    pub present: Vec<Station>,
    /// Numbers of `stations` in the order of a short walk.
    pub walk: Vec<usize>,
    /// The length of that walk, metres.
    pub walk_m: f64,
    /// Open floor, m².
    pub area_m2: f64,
    /// The part of it that no station could see, m².
    pub unreachable_m2: f64,
    /// The same as a map.
    pub unreachable: Map,
    /// How many stations, old and new, see each cell of the floor.
    pub seen: Vec<u8>,
    /// Share of the rest that the probes that are there already see.
    pub present_fraction: f64,
    /// The share with the first 1, 2, … new stations too.
    pub curve: Vec<f64>,
    /// The share of wall, by length at probe height, that is seen.
    pub wall_fraction: f64,
    /// So many new stations are needed at least to reach the target on the discretised plan.
    pub lower_bound: usize,
    /// How many new stations were found to reach the target in plan, before the check in space, the overlap and the
    /// greatest number had their say.
    pub needed: usize,
    /// How many candidates and witnesses stand for the floor.
    pub discrete: [usize; 2],
    /// The groups that the stations, old and new, fall into when those with enough in common are joined.
    pub groups: usize,
    /// What is seen in space; `None` where that was not asked.
    pub surface: Option<SurfaceCover>,
}

impl FloorPlan {
    /// The share of what can be seen of the floor that is seen.
    pub fn covered_fraction(&self) -> f64 {
        self.curve.last().copied().unwrap_or(self.present_fraction)
    }
}

/// A plan for a site.
pub struct SitePlan<'a> {
    /// Its floors, from the lowest.
    pub floors: Vec<FloorPlan>,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
    /// The surface with how it is seen from all stations.
    pub surface: Option<SurfacePlan<'a>>,
}

/// How all stations together see the model.
pub struct SurfacePlan<'a> {
    /// The surface in patches.
    pub surface: Surface<'a>,
    /// Patches that can be seen from where a tripod can stand.
    pub reachable: Vec<bool>,
    /// Patches that face the open space, whether they can be seen or not.
    pub interior: Vec<bool>,
    /// By how many stations, and how squarely, each is seen.
    pub seen: PatchVisibility,
}
