//! The fast way: greedy, then improved.

use super::coverage::Coverage;
use super::local_search::improve;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// What is asked of [`select()`].
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    /// The share of the coverable weight to reach, 0 to 1.
    pub target: f64,
    /// At most so many candidates, the fixed ones included.
    pub at_most: Option<usize>,
    /// Candidates that are chosen in any case, first and in this order.
    pub fixed: Vec<usize>,
}

impl Default for Goal {
    /// Everything, by any number of candidates.
    fn default() -> Self {
        Self { target: 1.0, at_most: None, fixed: Vec::new() }
    }
}

/// What was chosen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Candidates: the fixed ones, then each that adds most to those before it.
    pub chosen: Vec<usize>,
    /// The weight covered by the first 1, 2, … of them.
    pub curve: Vec<f64>,
    /// The weight covered by all of them.
    pub covered: f64,
}

/// A greedy selection that is improved (redundant candidates dropped, two replaced by one and three by two): within 1 + ln n
/// of the fewest in theory (Chvátal 1979), mostly much nearer.
///
/// Lazy (Minoux 1978): a candidate's gain only falls, so the top of a heap is looked at again until it stays on top.
/// Ties go to the lower number; the result depends on nothing but the input.
pub fn select(coverage: &Coverage, goal: &Goal) -> Selection {
    let needed = goal.target.clamp(0.0, 1.0) * coverage.coverable() * (1.0 - 1e-12);
    let first = greedy(coverage, goal, 0..coverage.candidates(), needed);
    let better = improve(coverage, &first.chosen, goal.fixed.len(), needed);
    // order by usefulness again
    greedy(coverage, goal, better, needed)
}

fn greedy(coverage: &Coverage, goal: &Goal, among: impl IntoIterator<Item = usize>, needed: f64) -> Selection {
    let mut covered = vec![false; coverage.elements()];
    let mut selection = Selection::default();
    let mut take = |c: usize, covered: &mut Vec<bool>| {
        selection.covered += gain(coverage, covered, c);
        for &e in coverage.covers(c) {
            covered[e as usize] = true;
        }
        selection.chosen.push(c);
        selection.curve.push(selection.covered);
        (selection.covered, selection.chosen.len())
    };
    let mut state = (0.0, 0);
    for &c in &goal.fixed {
        state = take(c, &mut covered);
    }
    let mut heap: BinaryHeap<Entry> = among.into_iter().map(|c| Entry(gain(coverage, &covered, c), c)).collect();
    while state.0 < needed && goal.at_most.is_none_or(|k| state.1 < k) {
        let Some(Entry(_, c)) = heap.pop() else { break };
        let entry = Entry(gain(coverage, &covered, c), c);
        if entry.0 <= 0.0 {
            continue;
        }
        if heap.peek().is_some_and(|top| *top > entry) {
            heap.push(entry);
        } else {
            state = take(c, &mut covered);
        }
    }
    selection
}

fn gain(coverage: &Coverage, covered: &[bool], candidate: usize) -> f64 {
    coverage.covers(candidate).iter().filter(|&&e| !covered[e as usize]).map(|&e| coverage.weight(e as usize)).sum()
}

/// A candidate and its gain; more gain is greater, then the lower number.
#[derive(PartialEq)]
struct Entry(f64, usize);

impl Eq for Entry {}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then_with(|| other.1.cmp(&self.1))
    }
}
