//! Choosing stations: enough in plan, then in space, then linked.

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use super::cover::{Choice, Coverage, Goal, choose};
use super::floors::Floor;
use super::grid::Map;
use super::model::Model;
use super::overlap::Overlap;
use super::partial_bound::partial_bound;
use super::surface::Surface;
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
pub(super) struct Chosen {
    /// Numbers of the model's candidates; the fixed ones first.
    pub(super) stations: Vec<usize>,
    /// How many of them are fixed.
    pub(super) fixed: usize,
    /// How many reach the target in plan.
    pub(super) needed: usize,
    /// So many are needed at least for that.
    pub(super) lower_bound: usize,
    /// Groups that are not linked by overlap.
    pub(super) groups: usize,
}

/// Chooses enough stations on each floor to see the wanted share in plan, and shares `max_probes` out among the floors
/// where that is too many: to those that gain most.
pub(super) fn in_plan(models: &[Model], fixed: &[Vec<DVec2>], plan: &Plan) -> Vec<Chosen> {
    let mut all: Vec<(Chosen, Choice)> =
        models.iter().zip(fixed).map(|(m, f)| on_floor(m, f.len(), None, plan)).collect();
    let total: usize = all.iter().map(|(c, _)| c.stations.len()).sum();
    if total > plan.max_probes as usize {
        let shares = shared(&all, models, plan.max_probes as usize);
        for (i, model) in models.iter().enumerate() {
            let before = (all[i].0.needed, all[i].0.lower_bound);
            all[i] = on_floor(model, fixed[i].len(), Some(shares[i]), plan);
            (all[i].0.needed, all[i].0.lower_bound) = before;
        }
    }
    all.into_iter().map(|(chosen, _)| chosen).collect()
}

/// How many stations may still be added.
pub(super) fn left(chosen: &[Chosen], plan: &Plan) -> usize {
    (plan.max_probes as usize).saturating_sub(chosen.iter().map(|c| c.stations.len()).sum())
}

/// The candidates' sights and, after them, those of the probes that are there already.
fn sights(model: &Model) -> Vec<Vec<u32>> {
    model.sights.iter().chain(model.present.iter().map(|(_, s)| s)).cloned().collect()
}

/// Fixed in the table's numbering: probes that are there first, then the site file's places.
fn first(model: &Model, fixed: usize) -> Vec<usize> {
    (model.candidates.len()..model.candidates.len() + model.present.len()).chain(0..fixed).collect()
}

fn on_floor(model: &Model, fixed: usize, at_most: Option<usize>, plan: &Plan) -> (Chosen, Choice) {
    let Ok(coverage) = Coverage::new(model.witnesses.weights(), sights(model)) else { return Default::default() };
    let there = model.present.len();
    let goal = Goal {
        target: plan.target_coverage,
        at_most: at_most.map(|n| n + there),
        fixed: first(model, fixed),
        improve: true,
    };
    let new = |choice: &Choice| -> Vec<usize> {
        choice.chosen.iter().copied().filter(|c| *c < model.candidates.len()).collect()
    };
    let mut choice = choose(&coverage, &goal);
    let (lower_bound, fewer) = bound(model, &coverage, plan, new(&choice).len());
    if !fewer.is_empty() && fixed == 0 && at_most.is_none() {
        choice = choose(&coverage, &Goal { fixed: first(model, 0).into_iter().chain(fewer).collect(), ..goal });
    }
    let stations = new(&choice);
    let chosen = Chosen { needed: stations.len(), lower_bound, fixed, stations, groups: 1 };
    (chosen, choice)
}

/// So many new stations are needed at least, given the probes that are there; and such, if fewer than `upper` can do.
fn bound(model: &Model, coverage: &Coverage, plan: &Plan, upper: usize) -> (usize, Vec<usize>) {
    let mut weights = model.witnesses.weights();
    let mut wanted = plan.target_coverage * coverage.coverable();
    for witness in model.present.iter().flat_map(|(_, s)| s) {
        wanted -= std::mem::take(&mut weights[*witness as usize]);
    }
    // a hair less, as the choice itself may stop there
    let wanted = wanted - 1e-9 * coverage.coverable();
    Coverage::new(weights, model.sights.iter().cloned()).map_or((0, Vec::new()), |c| partial_bound(&c, wanted, upper))
}

/// Each floor's number of stations when there are `most` in all: always the next best one.
fn shared(all: &[(Chosen, Choice)], models: &[Model], most: usize) -> Vec<usize> {
    let mut shares: Vec<usize> = all.iter().map(|(c, _)| c.fixed).collect();
    let gain = |floor: usize, station: usize| {
        let curve = &all[floor].1.curve;
        let k = models[floor].present.len() + station;
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
pub(super) fn reached(surface: &Surface<'_>, lenses: &[Vec3], house: &Map) -> Vec<bool> {
    let step = lenses.len().div_ceil(LOOKOUTS).max(1);
    let from: Vec<Vec3> = lenses.iter().copied().step_by(step).collect();
    surface.reached(&from, house, false)
}

/// Where surfaces count: above and below what is open on any floor, and a wall's thickness around. What rays meet
/// through a window or a crack beyond that is not the house.
pub(super) fn house(floors: &[Floor]) -> Option<Map> {
    let first = floors.first()?;
    let any = Map::of(first.open.grid, |c| floors.iter().any(|f| f.open.on[c]));
    Some(any.grown(WALL_M))
}

/// Points all over a floor's open space, at two heights.
pub(super) fn inside(floor: &Floor, plan: &Plan) -> Vec<Vec3> {
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
pub(super) fn in_space(
    model: &Model,
    lenses: &[Vec3],
    present: &[Vec3],
    surface: &Surface<'_>,
    reach: &[bool],
    plan: &Plan,
    left: usize,
    chosen: &mut Chosen,
) {
    let most = chosen.stations.len() + left;
    let weights = model.witnesses.weights();
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
        let offset = model.witnesses.len() as u32;
        let mut sights = sights(model);
        for (sight, more) in sights.iter_mut().zip(&seen) {
            sight.extend(more.iter().map(|i| offset + i));
        }
        let Ok(coverage) = Coverage::new(weights, sights) else { return };
        let allowed = (1.0 - plan.target_coverage) * 2.0 * flat;
        let goal = Goal {
            target: (1.0 - allowed / coverage.coverable().max(f64::MIN_POSITIVE)).max(0.0),
            at_most: Some(most + model.present.len()),
            fixed: first(model, 0).into_iter().chain(chosen.stations.iter().copied()).collect(),
            improve: true,
        };
        let next = choose(&coverage, &goal);
        let gain = |k: usize| next.curve[k] - if k == 0 { 0.0 } else { next.curve[k - 1] };
        let before = goal.fixed.len();
        let kept = (before..next.chosen.len()).take_while(|k| gain(*k) >= WORTH * 2.0 * flat).count();
        let next = next.chosen.into_iter().take(before + kept);
        let next: Vec<usize> = next.filter(|c| *c < model.candidates.len()).collect();
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
pub(super) fn link(model: &Model, plan: &Plan, mut left: usize, chosen: &mut Chosen) {
    let weights = model.witnesses.weights();
    let overlap = Overlap { weights: &weights, share: plan.overlap };
    loop {
        let sights: Vec<&[u32]> = model
            .present
            .iter()
            .map(|(_, s)| s.as_slice())
            .chain(chosen.stations.iter().map(|c| model.sights[*c].as_slice()))
            .collect();
        chosen.groups = overlap.groups(&sights).into_iter().max().map_or(0, |g| g + 1);
        if chosen.groups < 2 || left == 0 {
            return;
        }
        let Some(link) = overlap.link(&sights, &model.sights) else { return };
        chosen.stations.push(link);
        left -= 1;
    }
}
