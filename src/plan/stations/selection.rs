//! Choosing stations: enough in plan, then in space, then linked.

use glam::Vec3;
use rayon::prelude::*;

use super::problem::{FloorProblem, Viewpoint};
use crate::plan::cover::coverage::Coverage;
use crate::plan::cover::greedy::{Goal, Selection, select};
use crate::plan::cover::overlap::Overlap;
use crate::plan::cover::partial_bound::partial_bound;
use crate::plan::floors::floor::Floor;
use crate::plan::floors::raster::Map;
use crate::plan::visibility::surface::Surface;
use crate::site::Plan;

/// The most missed patches that come back as witnesses in a round, and how many rounds.
const MISSED: usize = 1500;
const ROUNDS: usize = 2;
/// The most candidates that rays are cast from to learn what can be seen at all.
const LOOKOUTS: usize = 200;
/// Walls are about so thick, metres.
const WALL_M: f64 = 0.5;
/// A station for the surface alone must add this share to what counts.
const WORTH: f64 = 0.005;

/// Candidates chosen on a floor.
#[derive(Clone, Debug, Default)]
pub(crate) struct SelectedStations {
    /// Numbers of the candidates; the fixed ones first.
    pub(crate) stations: Vec<usize>,
    /// How many reach the target in plan.
    pub(crate) needed: usize,
    /// So many are needed at least for that.
    pub(crate) lower_bound: usize,
    /// Groups that are not linked by overlap.
    pub(crate) groups: usize,
}

/// Chooses enough stations on each floor to see the wanted share in plan, and shares `max_probes` out among the floors
/// where that is too many: to those that gain most.
pub(crate) fn in_plan(problems: &[FloorProblem], plan: &Plan) -> Vec<SelectedStations> {
    let mut all: Vec<(SelectedStations, Selection)> = problems.iter().map(|p| on_floor(p, None, plan)).collect();
    let total: usize = all.iter().map(|(c, _)| c.stations.len()).sum();
    if total > plan.max_probes as usize {
        let shares = shared(&all, problems, plan.max_probes as usize);
        for (i, problem) in problems.iter().enumerate() {
            let before = (all[i].0.needed, all[i].0.lower_bound);
            all[i] = on_floor(problem, Some(shares[i]), plan);
            (all[i].0.needed, all[i].0.lower_bound) = before;
        }
    }
    all.into_iter().map(|(chosen, _)| chosen).collect()
}

/// How many stations may still be added.
pub(crate) fn left(chosen: &[SelectedStations], plan: &Plan) -> usize {
    (plan.max_probes as usize).saturating_sub(chosen.iter().map(|c| c.stations.len()).sum())
}

/// What is chosen in any case, in the numbering of [`FloorProblem::viewpoints`]: probes that are there first, then some
/// candidates.
fn first(problem: &FloorProblem, candidates: impl IntoIterator<Item = usize>) -> Vec<usize> {
    (problem.candidates.len()..problem.viewpoints().count()).chain(candidates).collect()
}

fn on_floor(problem: &FloorProblem, at_most: Option<usize>, plan: &Plan) -> (SelectedStations, Selection) {
    let sights = problem.viewpoints().map(|v| v.sight.iter().copied());
    let coverage = Coverage::new(problem.witnesses.weights(), sights);
    let goal = Goal {
        target: plan.target_coverage,
        at_most: at_most.map(|n| n + problem.present.len()),
        fixed: first(problem, 0..problem.fixed),
    };
    let new = |selection: &Selection| -> Vec<usize> {
        selection.chosen.iter().copied().filter(|c| *c < problem.candidates.len()).collect()
    };
    let mut selection = select(&coverage, &goal);
    let (lower_bound, fewer) = bound(problem, &coverage, plan, new(&selection).len());
    if !fewer.is_empty() && problem.fixed == 0 && at_most.is_none() {
        selection = select(&coverage, &Goal { fixed: first(problem, fewer), ..goal });
    }
    let stations = new(&selection);
    (SelectedStations { needed: stations.len(), lower_bound, stations, groups: 1 }, selection)
}

/// So many new stations are needed at least, given the probes that are there; and such, if fewer than `upper` can do.
fn bound(problem: &FloorProblem, coverage: &Coverage, plan: &Plan, upper: usize) -> (usize, Vec<usize>) {
    let mut weights = problem.witnesses.weights();
    let mut wanted = plan.target_coverage * coverage.coverable();
    for witness in problem.present.iter().flat_map(|(_, v)| &v.sight) {
        wanted -= std::mem::take(&mut weights[*witness as usize]);
    }
    // a hair less, as the selection itself may stop there
    let wanted = wanted - 1e-9 * coverage.coverable();
    let sights = problem.candidates.iter().map(|v| v.sight.iter().copied());
    partial_bound(&Coverage::new(weights, sights), wanted, upper)
}

/// Each floor's number of stations when there are `most` in all: always the next best one.
fn shared(all: &[(SelectedStations, Selection)], problems: &[FloorProblem], most: usize) -> Vec<usize> {
    let mut shares: Vec<usize> = problems.iter().map(|p| p.fixed).collect();
    let gain = |floor: usize, station: usize| {
        let curve = &all[floor].1.curve;
        let k = problems[floor].present.len() + station;
        let before = if k == 0 { 0.0 } else { curve[k - 1] };
        curve.get(k).map(|after| after - before)
    };
    while shares.iter().sum::<usize>() < most {
        let next = (0..all.len())
            .filter(|f| shares[*f] < all[*f].0.stations.len())
            .filter_map(|f| Some((gain(f, shares[f])?, f)))
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        match next {
            Some((_, floor)) => shares[floor] += 1,
            None => break,
        }
    }
    shares
}

/// The patches that a tripod on a floor could see.
pub(crate) fn reached(surface: &Surface<'_>, problem: &FloorProblem, house: &Map) -> Vec<bool> {
    let step = problem.candidates.len().div_ceil(LOOKOUTS).max(1);
    let from: Vec<Vec3> = problem.candidates.iter().step_by(step).map(|v| v.lens.as_vec3()).collect();
    surface.reached(&from, house, false)
}

/// Where surfaces count: above and below what is open on any floor, and a wall's thickness around. What rays meet
/// through a window or a crack beyond that is not the house.
pub(crate) fn house(problems: &[FloorProblem]) -> Option<Map> {
    let grid = problems.first()?.floor.open.grid;
    let any = Map::of(grid, |c| problems.iter().any(|p| p.floor.open.on[c]));
    Some(any.grown(WALL_M))
}

/// Points all over a floor's open space, at two heights.
pub(crate) fn inside(floor: &Floor, plan: &Plan) -> Vec<Vec3> {
    let cells: Vec<usize> = floor.target.cells().collect();
    let step = cells.len().div_ceil(LOOKOUTS).max(1);
    let grid = floor.target.grid;
    let height = plan.probe_height_m as f32;
    cells
        .into_iter()
        .step_by(step)
        .flat_map(|c| {
            let at = grid.middle(c);
            let lens = floor.lens(at, plan.probe_height_m);
            [at.as_vec2().extend(lens), at.as_vec2().extend(lens - 0.4 * height)]
        })
        .collect()
}

/// Adds stations, at most `left`, until the wanted share of the surface is seen too: patches that are missed but can be
/// seen come back as witnesses.
pub(crate) fn in_space(
    problem: &FloorProblem,
    surface: &Surface<'_>,
    reach: &[bool],
    plan: &Plan,
    left: usize,
    chosen: &mut SelectedStations,
) {
    let most = chosen.stations.len() + left;
    let weights = problem.witnesses.weights();
    let flat: f64 = weights.iter().sum();
    let all: f64 = (0..reach.len()).filter(|p| reach[*p]).map(|p| surface.areas[p]).sum();
    if all == 0.0 {
        return;
    }
    // floor and surface count alike
    let scale = flat / all;
    for _ in 0..ROUNDS {
        let stations: Vec<Vec3> = problem.taken(&chosen.stations).map(|v| v.lens.as_vec3()).collect();
        let mut missed = missed(surface, &stations, reach);
        let lost: f64 = missed.iter().map(|p| surface.areas[*p]).sum();
        if lost <= (1.0 - plan.target_coverage) * all || chosen.stations.len() >= most {
            return;
        }
        missed.sort_by(|a, b| surface.areas[*b].total_cmp(&surface.areas[*a]).then(a.cmp(b)));
        missed.truncate(MISSED);
        // those that stand for the rest carry its weight
        let part: f64 = missed.iter().map(|p| surface.areas[*p]).sum();
        let each = |p: usize| surface.areas[p] * scale * lost / part.max(f64::MIN_POSITIVE);
        let weights: Vec<f64> = weights.iter().copied().chain(missed.iter().map(|p| each(*p))).collect();
        let seen = |candidate: &Viewpoint| -> Vec<u32> {
            let lens = candidate.lens.as_vec3();
            let seen = (problem.witnesses.len()..).zip(&missed).filter(|(_, p)| surface.sees(lens, **p).is_some());
            candidate.sight.iter().copied().chain(seen.map(|(witness, _)| witness as u32)).collect()
        };
        let candidates: Vec<Vec<u32>> = problem.candidates.par_iter().map(seen).collect();
        let present = problem.present.iter().map(|(_, v)| v.sight.clone());
        let coverage = Coverage::new(weights, candidates.into_iter().chain(present));
        let allowed = (1.0 - plan.target_coverage) * 2.0 * flat;
        let goal = Goal {
            target: (1.0 - allowed / coverage.coverable().max(f64::MIN_POSITIVE)).max(0.0),
            at_most: Some(most + problem.present.len()),
            fixed: first(problem, chosen.stations.iter().copied()),
        };
        let next = select(&coverage, &goal);
        let gain = |k: usize| next.curve[k] - if k == 0 { 0.0 } else { next.curve[k - 1] };
        let before = goal.fixed.len();
        let kept = (before..next.chosen.len()).take_while(|k| gain(*k) >= WORTH * 2.0 * flat).count();
        if kept == 0 {
            return;
        }
        chosen.stations.extend(&next.chosen[before..before + kept]);
    }
}

/// Patches that can be seen, but not from these stations.
fn missed(surface: &Surface<'_>, stations: &[Vec3], reach: &[bool]) -> Vec<usize> {
    (0..reach.len())
        .into_par_iter()
        .filter(|p| reach[*p] && !stations.iter().any(|s| surface.sees(*s, *p).is_some()))
        .collect()
}

/// Adds stations, at most `left`, that link groups without enough in common.
pub(crate) fn link(problem: &FloorProblem, plan: &Plan, mut left: usize, chosen: &mut SelectedStations) {
    let weights = problem.witnesses.weights();
    let overlap = Overlap { weights: &weights, share: plan.overlap };
    loop {
        let sights: Vec<&[u32]> = problem.taken(&chosen.stations).map(|v| v.sight.as_slice()).collect();
        let groups = overlap.groups(&sights);
        chosen.groups = groups.iter().max().map_or(0, |g| *g as usize + 1);
        if chosen.groups < 2 || left == 0 {
            return;
        }
        let candidates = problem.candidates.iter().map(|v| v.sight.as_slice());
        let Some(link) = overlap.link(&sights, &groups, candidates) else { return };
        chosen.stations.push(link);
        left -= 1;
    }
}
