//! From chosen candidates to a floor's plan: order of usefulness, names, shares, tour and check distances.

use glam::DVec2;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::check_distances::check_distances;
use super::problem::{FloorProblem, Viewpoint};
use super::result::{FloorPlan, Station};
use super::selection::SelectedStations;
use super::tour;
use crate::plan::floors::raster::Map;
use crate::plan::free_space::section;
use crate::plan::visibility::witness::{WallPiece, Witnesses};
use crate::scene::Scene;
use crate::site::Plan;

/// Walls are drawn to this depth behind what is seen of them, metres.
const WALL_M: f64 = 1.2;

/// Puts a floor's plan together; new names go to `names`.
pub(crate) fn floor_plan(
    problem: FloorProblem,
    chosen: &SelectedStations,
    scene: &Scene,
    limits: &Plan,
    names: &mut Vec<String>,
) -> FloorPlan {
    let walls = walls(&problem.witnesses, problem.taken(&chosen.stations));
    let FloorProblem { floor, open, witnesses, candidates, fixed, present } = problem;
    let grid = floor.target.grid;
    let cells: Vec<usize> = floor.target.cells().collect();
    let sees = |v: &Viewpoint, cell: usize| v.region.sees(grid.middle(cell), grid.cell_m);
    let seen_from = |v: &Viewpoint| -> Vec<bool> { cells.par_iter().map(|c| sees(v, *c)).collect() };
    let selected: Vec<&Viewpoint> = chosen.stations.iter().map(|c| &candidates[*c]).collect();
    let old: Vec<Vec<bool>> = present.iter().map(|(_, v)| seen_from(v)).collect();
    let new: Vec<Vec<bool>> = selected.iter().map(|v| seen_from(v)).collect();
    let reachable: Vec<bool> = (0..cells.len())
        .into_par_iter()
        .map(|i| old.iter().chain(&new).any(|s| s[i]) || candidates.iter().any(|v| sees(v, cells[i])))
        .collect();
    let total = count(&reachable).max(1) as f64;
    let station = |name: String, viewpoint: &Viewpoint, fixed: bool, seen: &[bool], covered: &mut [bool]| {
        let before = count(covered);
        covered.iter_mut().zip(seen).for_each(|(c, s)| *c |= s);
        Station {
            name,
            position: viewpoint.lens,
            fixed,
            region: viewpoint.region.clone(),
            covers_m2: count(seen) as f64 * grid.cell_area(),
            adds_fraction: (count(covered) - before) as f64 / total,
            adds_surface_fraction: None,
            check_distances: check_distances(scene, viewpoint.lens.as_vec3()),
        }
    };
    let mut covered = vec![false; cells.len()];
    let seen_by_present = present.iter().zip(&old);
    let present: Vec<Station> =
        seen_by_present.map(|((name, v), seen)| station(name.clone(), v, false, seen, &mut covered)).collect();
    let present_fraction = present.iter().map(|s| s.adds_fraction).sum();
    let mut stations = Vec::new();
    for i in by_use(&covered, &new, &chosen.stations) {
        let name = fresh_name(&floor.slug, names);
        stations.push(station(name, selected[i], i < fixed, &new[i], &mut covered));
    }
    let curve = stations
        .iter()
        .scan(present_fraction, |sum, s| {
            *sum += s.adds_fraction;
            Some(*sum)
        })
        .collect();
    let mut seen = vec![0u8; grid.len()];
    for (i, cell) in cells.iter().enumerate() {
        seen[*cell] = old.iter().chain(&new).filter(|s| s[i]).count().min(255) as u8;
    }
    let mut unreachable = grid.none();
    cells.iter().zip(&reachable).for_each(|(c, r)| unreachable.on[*c] = !r);
    let wall = |of: &dyn Fn(u8) -> bool| walls.iter().filter(|(_, n)| of(*n)).map(|(w, _)| w.length_m).sum::<f64>();
    let at: Vec<DVec2> = stations.iter().map(|s: &Station| s.position.truncate()).collect();
    let way = ways(&floor.walkable, &at);
    let walk = tour::shortest(&way);
    let lens = f64::from(floor.elevation) + limits.probe_height_m;
    FloorPlan {
        outline: open.polygons().to_vec(),
        section: section::section(&scene.mesh, lens, &floor.open, WALL_M),
        furniture: section::furniture(&scene.mesh, &floor, lens),
        walk_m: tour::length(&way, &walk),
        walk,
        area_m2: floor.target.area(),
        unreachable_m2: unreachable.area(),
        unreachable,
        seen,
        present_fraction,
        curve,
        wall_fraction: wall(&|n| n > 0) / wall(&|_| true).max(f64::MIN_POSITIVE),
        walls,
        lower_bound: chosen.lower_bound,
        needed: chosen.needed,
        discrete: [candidates.len(), witnesses.len()],
        groups: chosen.groups,
        surface: None,
        stations,
        present,
        floor,
    }
}

fn count(of: &[bool]) -> usize {
    of.iter().filter(|on| **on).count()
}

/// The order in which each station adds most to those before it; the lower candidate first among equals.
fn by_use(base: &[bool], seen: &[Vec<bool>], candidates: &[usize]) -> Vec<usize> {
    let mut covered = base.to_vec();
    let mut rest: Vec<usize> = (0..seen.len()).collect();
    let mut order = Vec::new();
    loop {
        let gain = |i: usize| seen[i].iter().zip(&covered).filter(|(s, c)| **s && !**c).count();
        let use_of = |i: usize| (gain(i), count(&seen[i]), Reverse(candidates[i]));
        let Some(best) = (0..rest.len()).max_by_key(|k| use_of(rest[*k])) else { return order };
        let i = rest.remove(best);
        covered.iter_mut().zip(&seen[i]).for_each(|(c, s)| *c |= s);
        order.push(i);
    }
}

/// `ground-1`, `ground-2`, …: the next that is not taken.
fn fresh_name(slug: &str, names: &mut Vec<String>) -> String {
    let mut number = 1;
    loop {
        let name = format!("{slug}-{number}");
        if !names.contains(&name) {
            names.push(name.clone());
            return name;
        }
        number += 1;
    }
}

/// Each piece of wall with the number of stations, old and new, that see it.
fn walls<'a>(witnesses: &Witnesses, stations: impl Iterator<Item = &'a Viewpoint>) -> Vec<(WallPiece, u8)> {
    let first = witnesses.area.len() as u32;
    let mut seen = vec![0u8; witnesses.walls.len()];
    for witness in stations.flat_map(|v| &v.sight).filter(|w| **w >= first) {
        let n = &mut seen[(*witness - first) as usize];
        *n = n.saturating_add(1);
    }
    witnesses.walls.iter().copied().zip(seen).collect()
}

/// The lengths of the ways on foot between places; the straight line, doubled, where there is none.
fn ways(walkable: &Map, at: &[DVec2]) -> Vec<Vec<f64>> {
    at.par_iter()
        .map(|from| {
            let on_foot = on_foot(walkable, *from);
            at.iter()
                .map(|to| {
                    let metres = walkable.grid.cell(*to).map_or(f64::INFINITY, |c| f64::from(on_foot[c]));
                    if metres.is_finite() { metres } else { 2.0 * from.distance(*to) }
                })
                .collect()
        })
        .collect()
}

/// The way on foot to each cell in metres, cell by cell (Dijkstra 1959).
fn on_foot(walkable: &Map, from: DVec2) -> Vec<f32> {
    let grid = walkable.grid;
    let mut steps = vec![u32::MAX; grid.len()];
    let mut queue = BinaryHeap::new();
    if let Some(start) = grid.cell(from) {
        steps[start] = 0;
        queue.push((Reverse(0), start));
    }
    // thousandths of a cell, so that sums are exact
    let around = [(1, 0, 1000), (0, 1, 1000), (-1, 0, 1000), (0, -1, 1000)];
    let diagonal = [(1, 1, 1414), (-1, 1, 1414), (1, -1, 1414), (-1, -1, 1414)];
    while let Some((Reverse(so_far), cell)) = queue.pop() {
        if so_far > steps[cell] {
            continue;
        }
        for (dx, dy, step) in around.into_iter().chain(diagonal) {
            let Some(next) = grid.beside(cell, dx, dy).filter(|n| walkable.on[*n]) else { continue };
            let there = so_far.saturating_add(step);
            if there < steps[next] {
                steps[next] = there;
                queue.push((Reverse(there), next));
            }
        }
    }
    let metres = |s: u32| if s == u32::MAX { f32::INFINITY } else { s as f32 * 1e-3 * grid.cell_m as f32 };
    steps.into_iter().map(metres).collect()
}
