//! The fast way: greedy, then improved.

use super::coverage::Coverage;
use super::local_search::improve;
use std::cmp::Reverse;
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
}

impl Selection {
    /// The weight covered by all of them.
    fn covered(&self) -> f64 {
        self.curve.last().copied().unwrap_or(0.0)
    }
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
    let mut greedy = Greedy { coverage, covered: vec![false; coverage.elements()], selection: Selection::default() };
    goal.fixed.iter().for_each(|&c| greedy.take(c));
    // bits of numbers that are not negative are in the order of the numbers
    let entry = |gain: f64, c: usize| (gain.to_bits(), Reverse(c));
    let mut heap: BinaryHeap<_> = among.into_iter().map(|c| entry(greedy.gain(c), c)).collect();
    while greedy.selection.covered() < needed && goal.at_most.is_none_or(|k| greedy.selection.chosen.len() < k) {
        let Some((_, Reverse(c))) = heap.pop() else { break };
        let gain = greedy.gain(c);
        if gain <= 0.0 {
            continue;
        }
        if heap.peek().is_some_and(|top| *top > entry(gain, c)) {
            heap.push(entry(gain, c));
        } else {
            greedy.take(c);
        }
    }
    greedy.selection
}

struct Greedy<'a> {
    coverage: &'a Coverage,
    covered: Vec<bool>,
    selection: Selection,
}

impl Greedy<'_> {
    /// The weight that a candidate adds.
    fn gain(&self, candidate: usize) -> f64 {
        let new = self.coverage.covers(candidate).iter().map(|&e| e as usize).filter(|&e| !self.covered[e]);
        // an empty sum is −0
        0.0 + new.map(|e| self.coverage.weight(e)).sum::<f64>()
    }

    fn take(&mut self, candidate: usize) {
        let covered = self.selection.covered() + self.gain(candidate);
        self.coverage.covers(candidate).iter().for_each(|&e| self.covered[e as usize] = true);
        self.selection.chosen.push(candidate);
        self.selection.curve.push(covered);
    }
}
