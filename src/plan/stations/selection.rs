//! Choosing stations: enough in plan, then in space, then linked.

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use super::problem::FloorProblem;
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
    /// How many of them are fixed.
    pub(crate) fixed: usize,
    /// How many reach the target in plan.
    pub(crate) needed: usize,
    /// So many are needed at least for that.
    pub(crate) lower_bound: usize,
    /// Groups that are not linked by overlap.
    pub(crate) groups: usize,
}

/// Chooses enough stations on each floor to see the wanted share in plan, and shares `max_probes` out among the floors
/// where that is too many: to those that gain most.
pub(crate) fn in_plan(problems: &[FloorProblem], fixed: &[Vec<DVec2>], plan: &Plan) -> Vec<SelectedStations> {
    let mut all: Vec<(SelectedStations, Selection)> =
        problems.iter().zip(fixed).map(|(m, f)| on_floor(m, f.len(), None, plan)).collect();
    let total: usize = all.iter().map(|(c, _)| c.stations.len()).sum();
    if total > plan.max_probes as usize {
        let shares = shared(&all, problems, plan.max_probes as usize);
        for (i, problem) in problems.iter().enumerate() {
            let before = (all[i].0.needed, all[i].0.lower_bound);
            all[i] = on_floor(problem, fixed[i].len(), Some(shares[i]), plan);
            (all[i].0.needed, all[i].0.lower_bound) = before;
        }
    }
    all.into_iter().map(|(chosen, _)| chosen).collect()
}

/// How many stations may still be added.
pub(crate) fn left(chosen: &[SelectedStations], plan: &Plan) -> usize {
    (plan.max_probes as usize).saturating_sub(chosen.iter().map(|c| c.stations.len()).sum())
}

/// The candidates' sights and, after them, those of the probes that are there already.
fn sights(problem: &FloorProblem) -> Vec<Vec<u32>> {
    problem.sights.iter().chain(problem.present.iter().map(|(_, s)| s)).cloned().collect()
}

/// Fixed in the table's numbering: probes that are there first, then the site file's places.
fn first(problem: &FloorProblem, fixed: usize) -> Vec<usize> {
    (problem.candidates.len()..problem.candidates.len() + problem.present.len()).chain(0..fixed).collect()
}

fn on_floor(
    problem: &FloorProblem,
    fixed: usize,
    at_most: Option<usize>,
    plan: &Plan,
) -> (SelectedStations, Selection) {
    let coverage = Coverage::new(problem.witnesses.weights(), sights(problem));
    let there = problem.present.len();
    let goal = Goal { target: plan.target_coverage, at_most: at_most.map(|n| n + there), fixed: first(problem, fixed) };
    let new = |selection: &Selection| -> Vec<usize> {
        selection.chosen.iter().copied().filter(|c| *c < problem.candidates.len()).collect()
    };
    let mut selection = select(&coverage, &goal);
    let (lower_bound, fewer) = bound(problem, &coverage, plan, new(&selection).len());
    if !fewer.is_empty() && fixed == 0 && at_most.is_none() {
        selection = select(&coverage, &Goal { fixed: first(problem, 0).into_iter().chain(fewer).collect(), ..goal });
    }
    let stations = new(&selection);
    let chosen = SelectedStations { needed: stations.len(), lower_bound, fixed, stations, groups: 1 };
    (chosen, selection)
}

/// So many new stations are needed at least, given the probes that are there; and such, if fewer than `upper` can do.
fn bound(problem: &FloorProblem, coverage: &Coverage, plan: &Plan, upper: usize) -> (usize, Vec<usize>) {
    let mut weights = problem.witnesses.weights();
    let mut wanted = plan.target_coverage * coverage.coverable();
    for witness in problem.present.iter().flat_map(|(_, s)| s) {
        wanted -= std::mem::take(&mut weights[*witness as usize]);
    }
    // a hair less, as the selection itself may stop there
    let wanted = wanted - 1e-9 * coverage.coverable();
    partial_bound(&Coverage::new(weights, problem.sights.iter().cloned()), wanted, upper)
}

/// Each floor's number of stations when there are `most` in all: always the next best one.
fn shared(all: &[(SelectedStations, Selection)], problems: &[FloorProblem], most: usize) -> Vec<usize> {
    let mut shares: Vec<usize> = all.iter().map(|(c, _)| c.fixed).collect();
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
pub(crate) fn reached(surface: &Surface<'_>, lenses: &[Vec3], house: &Map) -> Vec<bool> {
    let step = lenses.len().div_ceil(LOOKOUTS).max(1);
    let from: Vec<Vec3> = lenses.iter().copied().step_by(step).collect();
    surface.reached(&from, house, false)
}

/// Where surfaces count: above and below what is open on any floor, and a wall's thickness around. What rays meet
/// through a window or a crack beyond that is not the house.
pub(crate) fn house(floors: &[Floor]) -> Option<Map> {
    let first = floors.first()?;
    let any = Map::of(first.open.grid, |c| floors.iter().any(|f| f.open.on[c]));
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
#[expect(clippy::too_many_arguments, reason = "one step of the plan, called once")]
pub(crate) fn in_space(
    problem: &FloorProblem,
    lenses: &[Vec3],
    present: &[Vec3],
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
        let stations: Vec<Vec3> = present.iter().copied().chain(chosen.stations.iter().map(|c| lenses[*c])).collect();
        let missed = missed(surface, &stations, reach);
        let lost: f64 = missed.iter().map(|p| surface.areas[*p]).sum();
        if lost <= (1.0 - plan.target_coverage) * all || chosen.stations.len() >= most {
            return;
        }
        let mut back = missed;
        back.sort_by(|a, b| surface.areas[*b].total_cmp(&surface.areas[*a]).then(a.cmp(b)));
        back.truncate(MISSED);
        let seen: Vec<Vec<u32>> = lenses
            .par_iter()
            .map(|lens| (0..back.len()).filter(|i| surface.sees(*lens, back[*i]).is_some()).map(|i| i as u32).collect())
            .collect();
        // those that stand for the rest carry its weight
        let part: f64 = back.iter().map(|p| surface.areas[*p]).sum();
        let each = |p: usize| surface.areas[p] * scale * lost / part.max(f64::MIN_POSITIVE);
        let weights: Vec<f64> = weights.iter().copied().chain(back.iter().map(|p| each(*p))).collect();
        let offset = problem.witnesses.len() as u32;
        let mut sights = sights(problem);
        for (sight, more) in sights.iter_mut().zip(&seen) {
            sight.extend(more.iter().map(|i| offset + i));
        }
        let coverage = Coverage::new(weights, sights);
        let allowed = (1.0 - plan.target_coverage) * 2.0 * flat;
        let goal = Goal {
            target: (1.0 - allowed / coverage.coverable().max(f64::MIN_POSITIVE)).max(0.0),
            at_most: Some(most + problem.present.len()),
            fixed: first(problem, 0).into_iter().chain(chosen.stations.iter().copied()).collect(),
        };
        let next = select(&coverage, &goal);
        let gain = |k: usize| next.curve[k] - if k == 0 { 0.0 } else { next.curve[k - 1] };
        let before = goal.fixed.len();
        let kept = (before..next.chosen.len()).take_while(|k| gain(*k) >= WORTH * 2.0 * flat).count();
        let next = next.chosen.into_iter().take(before + kept);
        let next: Vec<usize> = next.filter(|c| *c < problem.candidates.len()).collect();
        if next.len() == chosen.stations.len() {
            return;
        }
        chosen.stations = next;
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
        let sights: Vec<&[u32]> = problem
            .present
            .iter()
            .map(|(_, s)| s.as_slice())
            .chain(chosen.stations.iter().map(|c| problem.sights[*c].as_slice()))
            .collect();
        chosen.groups = overlap.groups(&sights).into_iter().max().map_or(0, |g| g as usize + 1);
        if chosen.groups < 2 || left == 0 {
            return;
        }
        let Some(link) = overlap.link(&sights, &problem.sights) else { return };
        chosen.stations.push(link);
        left -= 1;
    }
}
