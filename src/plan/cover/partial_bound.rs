//! How few stations can do at best, where a share of the weight is enough.
//!
//! The Lagrangian bound of partial set cover: with a price p ≥ 0 on “element e is counted, so some chosen candidate
//! covers it”, the least cost falls apart into choosing each candidate whose prices exceed 1, and buying the cheapest
//! elements that make up the wanted weight (a fractional knapsack). It holds for any prices; a subgradient search finds
//! good ones (Held and Karp 1971; Fisher, *The Lagrangian Relaxation Method*, 1981).
//!
//! Then a search asks whether so many can do at all. What candidates add together is at most the sum of what each adds
//! alone (Nemhauser, Wolsey and Fisher, *An analysis of approximations for maximizing submodular set functions*, 1978),
//! so that of k candidates that make up what is lacking, one adds at least its k-th part.

use super::bound::round_up;
use super::coverage::Coverage;

const ROUNDS: usize = 250;
/// The search looks at so many pairs of a candidate and what it covers at most: about a second.
const WORK: usize = 1_000_000_000;

/// A lower bound on the number of candidates that cover at least `wanted` weight; `upper` is a number that is known
/// to do. Where so many can do and fewer are known than `upper`, they come too.
pub(crate) fn partial_bound(coverage: &Coverage, wanted: f64, upper: usize) -> (usize, Vec<usize>) {
    let elements: Vec<usize> = (0..coverage.elements()).filter(|e| !coverage.covered_by(*e).is_empty()).collect();
    let total: f64 = elements.iter().map(|e| coverage.weight(*e)).sum();
    if wanted <= 0.0 || upper == 0 || elements.is_empty() {
        return (0, Vec::new());
    }
    let wanted = wanted.min(total);
    // prices start where the widest candidate is just worth its cost
    let reach = |c: usize| coverage.covers(c).iter().map(|e| coverage.weight(*e as usize)).sum::<f64>();
    let widest = (0..coverage.candidates()).map(reach).fold(f64::MIN_POSITIVE, f64::max);
    let mut price: Vec<f64> = (0..coverage.elements()).map(|e| coverage.weight(e) / widest).collect();
    let mut order = elements;
    let (mut best, mut step, mut stale) = (0.0f64, 1.0, 0);
    for _ in 0..ROUNDS {
        let mut slope = vec![0.0; price.len()];
        let mut value = 0.0;
        for c in 0..coverage.candidates() {
            let worth: f64 = coverage.covers(c).iter().map(|e| price[*e as usize]).sum();
            if worth > 1.0 {
                value += 1.0 - worth;
                coverage.covers(c).iter().for_each(|e| slope[*e as usize] -= 1.0);
            }
        }
        let rate = |e: usize| price[e] / coverage.weight(e).max(f64::MIN_POSITIVE);
        order.sort_by(|a, b| rate(*a).total_cmp(&rate(*b)).then(a.cmp(b)));
        let mut left = wanted;
        for &e in &order {
            let part = (left / coverage.weight(e).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            value += part * price[e];
            slope[e] += part;
            left -= part * coverage.weight(e);
            if left <= 0.0 {
                break;
            }
        }
        if value > best + 1e-6 {
            (best, stale) = (value, 0);
        } else {
            stale += 1;
            if stale % 10 == 0 {
                step *= 0.7;
            }
        }
        let norm: f64 = slope.iter().map(|s| s * s).sum();
        if norm == 0.0 || best > upper as f64 - 1.0 + 1e-6 {
            break;
        }
        let length = step * (upper as f64 - value).max(0.1) / norm;
        price.iter_mut().zip(&slope).for_each(|(p, s)| *p = (*p + length * s).max(0.0));
    }
    let mut bound = round_up(best).max(1).min(upper);
    let mut search = Search {
        coverage,
        covered: vec![0; coverage.elements()],
        excluded: vec![false; coverage.candidates()],
        slack: 1e-9 * total,
        work: WORK,
        found: Vec::new(),
    };
    while bound < upper && search.can_do(wanted, bound) == Some(false) {
        bound += 1;
    }
    search.found.reverse();
    (bound, search.found)
}

struct Search<'a> {
    coverage: &'a Coverage,
    /// How many of the candidates taken cover each element.
    covered: Vec<u32>,
    excluded: Vec<bool>,
    /// What falls short by less still does.
    slack: f64,
    /// So much work is left.
    work: usize,
    /// Candidates that can do, the last taken first.
    found: Vec<usize>,
}

impl Search<'_> {
    /// Whether `k` more candidates can cover `lacking` more weight; `None` if that was too much work.
    fn can_do(&mut self, lacking: f64, k: usize) -> Option<bool> {
        let least = lacking - self.slack;
        if least <= 0.0 {
            return Some(true);
        }
        let gains = self.gains()?;
        let mut told = Some(false);
        let mut tried = 0;
        for first in 0..gains.len() {
            // without those tried before, which led nowhere
            let best: f64 = gains[first..].iter().take(k).map(|g| g.0).sum();
            if best < least {
                break;
            }
            let (gain, c) = gains[first];
            if k == 1 {
                self.found.push(c);
                told = Some(true);
                break;
            }
            self.coverage.covers(c).iter().for_each(|e| self.covered[*e as usize] += 1);
            self.excluded[c] = true;
            tried += 1;
            told = self.can_do(lacking - gain, k - 1);
            self.coverage.covers(c).iter().for_each(|e| self.covered[*e as usize] -= 1);
            if told == Some(true) {
                self.found.push(c);
            }
            if told != Some(false) {
                break;
            }
        }
        gains[..tried].iter().for_each(|(_, c)| self.excluded[*c] = false);
        told
    }

    /// What each candidate would add, most first; `None` if that was too much work.
    fn gains(&mut self) -> Option<Vec<(f64, usize)>> {
        let mut gains: Vec<(f64, usize)> = (0..self.coverage.candidates()).map(|c| (0.0, c)).collect();
        for e in (0..self.covered.len()).filter(|e| self.covered[*e] == 0) {
            let by = self.coverage.covered_by(e);
            self.work = self.work.checked_sub(by.len() + 1)?;
            by.iter().for_each(|c| gains[*c as usize].0 += self.coverage.weight(e));
        }
        gains.retain(|(_, c)| !self.excluded[*c]);
        gains.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        Some(gains)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weight(coverage: &Coverage, set: usize) -> f64 {
        let covered = |e: &usize| coverage.covered_by(*e).iter().any(|c| set >> c & 1 == 1);
        (0..coverage.elements()).filter(covered).map(|e| coverage.weight(e)).sum()
    }

    fn fewest(coverage: &Coverage, wanted: f64) -> usize {
        let enough = |s: &usize| weight(coverage, *s) >= wanted - 1e-9;
        (0usize..1 << coverage.candidates()).filter(enough).map(|s| s.count_ones() as usize).min().unwrap()
    }

    #[test]
    fn the_bound_is_the_fewest_where_all_can_be_tried() {
        let mut state = 7u64;
        let mut random = move |n: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % n
        };
        for _ in 0..60 {
            let weights: Vec<f64> = (0..30).map(|_| 0.5 + random(10) as f64 / 4.0).collect();
            let sets: Vec<Vec<u32>> = (0..11).map(|_| (0..30).filter(|_| random(4) == 0).collect()).collect();
            let coverage = Coverage::new(weights, sets);
            let wanted = coverage.coverable() * (0.5 + random(50) as f64 / 100.0);
            let truth = fewest(&coverage, wanted);
            for upper in [truth, truth + 2] {
                let (bound, found) = partial_bound(&coverage, wanted, upper);
                assert_eq!(bound, truth);
                let set = found.iter().fold(0, |set, c| set | 1 << c);
                assert!(
                    upper == truth && found.is_empty()
                        || found.len() == truth && weight(&coverage, set) >= wanted - 1e-6
                );
            }
        }
    }
}
