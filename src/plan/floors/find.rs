//! A building's floors: on each, where a tripod can stand, what is open at probe height, and what is to be seen.
//!
//! The two differ: a bench stops a tripod, not a lens. Nothing is told from one slice: what is solid anywhere within a
//! slab about probe height blocks sight, gaps narrower than [`GAP_M`] are closed, and the open region is flooded from
//! where a tripod can stand and ends where the place is no longer enclosed.

use glam::DVec2;
use rayon::prelude::*;

use super::disconnected::disconnected_parts;
use super::floor::Floor;
use super::heightfield::Heightfield;
use super::levels::{Level, SPREAD_M, find_levels};
use super::raster::{Grid, Map};
use super::walkable::{BLOCK_M, Enclosure, Side, WalkableSpans};
use crate::plan::PlanError;
use crate::plan::error::no_place;
use crate::scene::Scene;
use crate::site::Plan;

/// The finest cell, metres, and the most cells.
const CELL_M: f64 = 0.05;
const MOST_CELLS: usize = 1_000_000;
/// Gaps in walls narrower than this are closed, metres.
pub const GAP_M: f64 = 0.15;
/// Half the slab that is looked at about probe height, metres.
const SLAB_M: f32 = 0.1;
/// A tripod's legs stand within this of its middle, metres, on ground level within [`LEVEL_M`].
const FEET_M: f64 = 0.25;
const LEVEL_M: f32 = 0.05;
/// Things smaller than this in plan do not block sight, m²: candles, rods.
const SPECK_M2: f64 = 0.02;
/// Holes in the floor smaller than this still count as floor, m².
const HOLE_M2: f64 = 4.0;
/// Open regions smaller than this are not worth a station, m².
const NOOK_M2: f64 = 0.5;

/// What was found on the way, for the user to know.
#[derive(Clone, Debug)]
pub struct Found {
    /// The floors from the lowest.
    pub floors: Vec<Floor>,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
}

/// Finds a model's floors. Small parts that cannot be walked to and are open to what is not the floor are left out,
/// unless `all_parts` asks for them.
///
/// # Errors
///
/// No floor, no place for a tripod on any, or a model that encloses nothing.
pub fn find_floors(scene: &Scene, plan: &Plan, all_parts: bool) -> Result<Found, PlanError> {
    let (low, high) = scene.mesh.bounds();
    let grid = Grid::covering(low.truncate().as_dvec2(), high.truncate().as_dvec2(), CELL_M, MOST_CELLS);
    let height = plan.probe_height_m as f32;
    let headroom = (height + 0.2).max(1.8);
    let places = WalkableSpans::new(Heightfield::new(&scene.mesh, grid), scene, headroom, height);
    let area_m2 = places.list.len() as f64 * grid.cell_area();
    if area_m2 < 1.0 {
        return Err(PlanError::NoFloor { headroom_m: headroom });
    }
    if places.list.iter().filter(|p| p.indoors).count() as f64 * grid.cell_area() < 1.0 {
        return Err(PlanError::OpenModel { area_m2 });
    }
    let levels = find_levels(&places, scene);
    if levels.is_empty() {
        return Err(PlanError::NoFloor { headroom_m: headroom });
    }
    let mut warnings = Vec::new();
    if grid.cell_m > 2.0 * CELL_M {
        warnings.push(format!(
            "The model is so wide that its plan has cells of {:.0} cm: leave far terrain out of the model.",
            100.0 * grid.cell_m
        ));
    }
    let mut all: Vec<Floor> = levels.iter().map(|level| floor(level, &levels, &places, scene, plan)).collect();
    for i in 0..all.len() {
        all[i].target = own(&all, i, &places.columns, plan);
    }
    for floor in all.iter_mut().filter(|_| !all_parts) {
        let lens = floor.elevation + height;
        floor.left_out = disconnected_parts(floor, &places, |c| !places.columns.solid(c, lens - SLAB_M, lens + SLAB_M));
        floor.target = floor.target.without(&floor.left_out);
        floor.standable = floor.standable.without(&floor.left_out);
    }
    let (mut floors, unfit): (Vec<Floor>, Vec<Floor>) = all.into_iter().partition(|f| f.standable.count() > 0);
    if floors.is_empty() {
        let widest_m = unfit.iter().map(Floor::widest).fold(0.0, f64::max);
        return Err(PlanError::NoPlace { floors: unfit.len(), clearance_m: plan.clearance_m, widest_m });
    }
    for floor in unfit.iter().filter(|f| f.walkable.area() > NOOK_M2) {
        warnings.push(format!(
            "A level of {:.1} m² has no place for a tripod and is left out: {}.",
            floor.walkable.area(),
            no_place(plan.clearance_m, floor.widest())
        ));
    }
    for (i, floor) in floors.iter_mut().enumerate() {
        (floor.name, floor.slug) = name(i);
        if floor.left_out.area() >= NOOK_M2 {
            warnings.push(format!(
                "{}: {:.1} m² beside it cannot be walked to, are open to what is not this floor, and are left out; \
                 --all-parts counts them.",
                floor.name,
                floor.left_out.area()
            ));
        }
    }
    Ok(Found { floors, warnings })
}

/// `Ground floor` and `ground` for 0, and so on.
fn name(floor: usize) -> (String, String) {
    const NAMES: [&str; 11] =
        ["Ground", "First", "Second", "Third", "Fourth", "Fifth", "Sixth", "Seventh", "Eighth", "Ninth", "Tenth"];
    match NAMES.get(floor) {
        Some(name) => (format!("{name} floor"), name.to_lowercase()),
        None => (format!("Floor {floor}"), format!("floor-{floor}")),
    }
}

fn floor(level: &Level, levels: &[Level], places: &WalkableSpans, scene: &Scene, plan: &Plan) -> Floor {
    let columns = &places.columns;
    let grid = columns.grid;
    let elevation = level.elevation;
    let nearest = |z: f32| levels.iter().all(|l| (l.elevation - z).abs() >= (elevation - z).abs());
    let mut ground = vec![f32::NAN; grid.len()];
    for (cell, ground) in ground.iter_mut().enumerate() {
        let fit = |i: &usize| {
            let p = places.list[*i];
            p.indoors && level.parts[p.part as usize] && (p.z - elevation).abs() <= SPREAD_M && nearest(p.z)
        };
        let heights = places.column(cell).filter(fit).map(|i| places.list[i].z);
        *ground = heights.min_by(|a, b| (a - elevation).abs().total_cmp(&(b - elevation).abs())).unwrap_or(f32::NAN);
    }
    let walkable = Map::of(grid, |c| ground[c].is_finite());
    let lens = elevation + plan.probe_height_m as f32;
    let free = Map::of(grid, |c| columns.solid(c, lens - SLAB_M, lens + SLAB_M)).closed(GAP_M).inverted();
    let could_stand = standable(&walkable, &ground, &free, scene, plan);
    let open = enclosed(free.flooded_from(&could_stand), scene, lens, places.side).flooded_from(&could_stand);
    let open = mended(open.inverted().without_specks(SPECK_M2).inverted().without_specks(NOOK_M2));
    let target = target(&open, columns, elevation, lens);
    let standable = Map::of(grid, |c| could_stand.on[c] && open.on[c]);
    let left_out = grid.none();
    Floor { name: String::new(), slug: String::new(), elevation, walkable, ground, standable, open, target, left_out }
}

/// Where a tripod can stand: clear of what cannot be walked on, on level ground, not kept out.
fn standable(walkable: &Map, ground: &[f32], free: &Map, scene: &Scene, plan: &Plan) -> Map {
    let grid = walkable.grid;
    let distance = walkable.inverted().distance();
    // from the cell's middle to the obstacle cell's near side
    let clearance = (plan.clearance_m + 0.5 * grid.cell_m) as f32;
    let reach = (FEET_M / grid.cell_m).round() as isize;
    let feet: Vec<(isize, isize)> = (-reach..=reach)
        .flat_map(|x| (-reach..=reach).map(move |y| (x, y)))
        .filter(|(x, y)| x * x + y * y <= reach * reach)
        .collect();
    let level = |cell: usize| {
        feet.iter().filter_map(|(x, y)| grid.beside(cell, *x, *y)).all(|c| {
            let step = (ground[c] - ground[cell]).abs();
            step.is_nan() || step <= LEVEL_M
        })
    };
    let keep_out: Vec<Vec<DVec2>> =
        plan.keep_out.iter().map(|ring| ring.iter().map(|p| *p - scene.origin.truncate()).collect()).collect();
    let on = (0..grid.len())
        .into_par_iter()
        .map(|cell| {
            walkable.on[cell]
                && free.on[cell]
                && distance[cell] >= clearance
                && level(cell)
                && !keep_out.iter().any(|ring| inside(ring, grid.middle(cell)))
        })
        .collect();
    Map { grid, on }
}

/// Whether a point lies inside a ring, by the even-odd rule.
fn inside(ring: &[DVec2], p: DVec2) -> bool {
    let mut inside = false;
    for (i, a) in ring.iter().enumerate() {
        let b = ring[(i + 1) % ring.len()];
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y) {
            inside = !inside;
        }
    }
    inside
}

/// The part of a region that is indoors at a height.
fn enclosed(mut region: Map, scene: &Scene, height: f32, side: Side) -> Map {
    let outdoors = |cells: &Vec<usize>| {
        let middle = region.grid.middle(cells[cells.len() / 2]);
        !Enclosure::at(scene, middle.as_vec2().extend(height)).indoors(side)
    };
    let outdoors: Vec<Vec<usize>> = region.blocks(BLOCK_M).into_par_iter().filter(outdoors).collect();
    outdoors.into_iter().flatten().for_each(|c| region.on[c] = false);
    region
}

/// Blocks one cell wherever two blocked ones meet at a corner only, so that no outline touches itself.
fn mended(mut open: Map) -> Map {
    let w = open.grid.width;
    loop {
        let mut changed = false;
        for y in 0..open.grid.height - 1 {
            for x in 0..w - 1 {
                let c = y * w + x;
                let square = [c, c + 1, c + w, c + w + 1].map(|c| open.on[c]);
                if square == [true, false, false, true] {
                    open.on[c] = false;
                    changed = true;
                } else if square == [false, true, true, false] {
                    open.on[c + 1] = false;
                    changed = true;
                }
            }
        }
        if !changed {
            return open;
        }
    }
}

/// A floor's target without what another floor is the ground of: a raised choir is no part of the nave.
fn own(all: &[Floor], i: usize, columns: &Heightfield, plan: &Plan) -> Map {
    let lens = all[i].elevation + plan.probe_height_m as f32;
    let others = |c: usize| {
        let Some(ground) = columns.ground(c, lens) else { return false };
        let on = |f: &Floor| f.walkable.on[c] && (f.ground[c] - ground).abs() < 0.05;
        !on(&all[i]) && all.iter().any(on)
    };
    let target = &all[i].target;
    Map::of(target.grid, |c| target.on[c] && !others(c))
}

/// The open cells above this floor: ground, furniture or steps beneath, and small holes.
fn target(open: &Map, columns: &Heightfield, elevation: f32, lens: f32) -> Map {
    let floored = |c: usize| columns.ground(c, lens).is_some_and(|z| z >= elevation - SPREAD_M);
    let void = Map::of(open.grid, |c| open.on[c] && !floored(c)).without_specks(HOLE_M2);
    Map::of(open.grid, |c| open.on[c] && !void.on[c])
}
