//! The fewest candidates, proved: branch and bound on what [`super::reduce`] leaves.

use super::bound::{Dual, Free, round_up};
use super::coverage::Coverage;
use super::greedy::{Goal, select};
use super::reduce::reduce;
use std::time::Instant;

/// A cover and a bound on all covers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Minimum {
    /// Covers everything that can be covered, in rising order.
    pub chosen: Vec<usize>,
    /// No cover has fewer; equal to `chosen.len()` when proved.
    pub at_least: usize,
}

/// When to stop an exact search.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SearchLimits {
    /// At this time.
    pub until: Option<Instant>,
    /// After so many nodes of the search tree in each independent part: the same result on any machine.
    pub nodes: Option<usize>,
}

impl SearchLimits {
    fn reached(&self, nodes: usize) -> bool {
        self.nodes.is_some_and(|most| nodes > most)
            || nodes.is_multiple_of(16) && self.until.is_some_and(|t| Instant::now() >= t)
    }
}

/// The fewest candidates that cover everything coverable. Stopped by a limit it returns the best cover found and a
/// bound that still holds.
pub fn minimum(coverage: &Coverage, limits: SearchLimits) -> Minimum {
    let reduced = reduce(coverage);
    let mut result = Minimum { at_least: reduced.forced.len(), chosen: reduced.forced };
    for (part, names) in &reduced.parts {
        let (chosen, at_least) = solve(part, limits);
        result.at_least += at_least;
        result.chosen.extend(chosen.into_iter().map(|c| names[c]));
    }
    result.chosen.sort_unstable();
    result
}

struct Search<'a> {
    part: &'a Coverage,
    best: Vec<usize>,
    limits: SearchLimits,
    nodes: usize,
    stopped: bool,
}

/// A part's best cover, and a bound.
fn solve(part: &Coverage, limits: SearchLimits) -> (Vec<usize>, usize) {
    let best = select(part, &Goal::default()).chosen;
    let mut search = Search { part, best, limits, nodes: 0, stopped: false };
    let free = Free { rows: vec![true; part.elements()], columns: vec![true; part.candidates()] };
    let mut dual = Dual::new(part);
    let root = round_up(dual.climb(part, &free, 600, search.best.len() as f64 - 1.0 + 1e-5));
    if root >= search.best.len() {
        return (search.best, root);
    }
    search.branch(free, Vec::new(), dual);
    let at_least = if search.stopped { root } else { search.best.len() };
    let at_least = at_least.min(search.best.len());
    (search.best, at_least)
}

impl Search<'_> {
    fn branch(&mut self, mut free: Free, mut taken: Vec<usize>, mut dual: Dual) {
        self.nodes += 1;
        if self.stopped || self.limits.reached(self.nodes) {
            self.stopped = true;
            return;
        }
        loop {
            if !self.force(&mut free, &mut taken) {
                return;
            }
            if free.rows.iter().all(|r| !r) {
                if taken.len() < self.best.len() {
                    self.best = taken;
                }
                return;
            }
            // a cover that helps has at most this many more
            let Some(most) = (self.best.len() - 1).checked_sub(taken.len()).filter(|&m| m > 0) else { return };
            let steps = if self.nodes == 1 { 400 } else { 60 };
            let bound = dual.climb(self.part, &free, steps, most as f64 + 1e-5);
            if round_up(bound) > most {
                return;
            }
            self.greedy(&free, &taken, &dual);
            if taken.len() + round_up(bound) >= self.best.len() {
                return;
            }
            let Some(most) = (self.best.len() - 1).checked_sub(taken.len()) else { return };
            if !fix(&mut free, &dual, bound, most, self.part) {
                break;
            }
        }
        let open = |r: usize| self.part.covered_by(r).iter().filter(|&&c| free.columns[c as usize]).count();
        let row = (0..free.rows.len())
            .filter(|&r| free.rows[r])
            .min_by(|&a, &b| open(a).cmp(&open(b)).then_with(|| dual.prices[b].total_cmp(&dual.prices[a])));
        let Some(row) = row else { return };
        let mut columns: Vec<usize> =
            self.part.covered_by(row).iter().map(|&c| c as usize).filter(|&c| free.columns[c]).collect();
        columns.sort_by(|&a, &b| dual.costs[a].total_cmp(&dual.costs[b]));
        for c in columns {
            let (mut next, mut with) = (free.clone(), taken.clone());
            self.take(c, &mut next, &mut with);
            self.branch(next, with, dual.clone());
            // all covers with it are known
            free.columns[c] = false;
        }
    }

    fn take(&self, c: usize, free: &mut Free, taken: &mut Vec<usize>) {
        taken.push(c);
        free.columns[c] = false;
        for &r in self.part.covers(c) {
            free.rows[r as usize] = false;
        }
    }

    /// Takes the only candidate of each row that has but one; false when a row has none.
    fn force(&self, free: &mut Free, taken: &mut Vec<usize>) -> bool {
        loop {
            let mut changed = false;
            for r in 0..free.rows.len() {
                if !free.rows[r] {
                    continue;
                }
                let mut open = self.part.covered_by(r).iter().map(|&c| c as usize).filter(|&c| free.columns[c]);
                let Some(first) = open.next() else { return false };
                if open.next().is_none() {
                    self.take(first, free, taken);
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        for c in 0..free.columns.len() {
            if free.columns[c] && self.part.covers(c).iter().all(|&r| !free.rows[r as usize]) {
                free.columns[c] = false;
            }
        }
        true
    }

    /// A cover by the prices: cheapest columns first, by cost over what they add.
    fn greedy(&mut self, free: &Free, taken: &[usize], dual: &Dual) {
        let mut free = free.clone();
        let mut cover = taken.to_vec();
        while let Some(row) = (0..free.rows.len())
            .filter(|&r| free.rows[r])
            .max_by(|&a, &b| dual.prices[a].total_cmp(&dual.prices[b]).then(b.cmp(&a)))
        {
            if cover.len() + 1 >= self.best.len() {
                return;
            }
            let adds = |c: usize| self.part.covers(c).iter().filter(|&&r| free.rows[r as usize]).count() as f64;
            let columns = self.part.covered_by(row).iter().map(|&c| c as usize).filter(|&c| free.columns[c]);
            let score = |c: usize| dual.costs[c] - 0.05 * adds(c);
            let Some(c) = columns.min_by(|&a, &b| score(a).total_cmp(&score(b))) else { return };
            self.take(c, &mut free, &mut cover);
        }
        self.best = cover;
    }
}

/// Leaves out columns whose cost lifts the bound over `most`; whether any was.
fn fix(free: &mut Free, dual: &Dual, bound: f64, most: usize, part: &Coverage) -> bool {
    let mut changed = false;
    for c in 0..free.columns.len() {
        if free.columns[c] && dual.costs[c] > 0.0 && bound + dual.costs[c] > most as f64 + 1e-6 {
            free.columns[c] = false;
            changed |= !part.covers(c).is_empty();
        }
    }
    changed
}
