//! How few stations can do at best, where a share of the weight is enough.
//!
//! The Lagrangian bound of partial set cover: with a price p ≥ 0 on “element e is counted, so some chosen candidate
//! covers it”, the least cost falls apart into choosing each candidate whose prices exceed 1, and buying the cheapest
//! elements that make up the wanted weight (a fractional knapsack). It holds for any prices; a subgradient search finds
//! good ones (Held and Karp 1971; Fisher, *The Lagrangian Relaxation Method*, 1981).

use super::cover::Coverage;

const ROUNDS: usize = 250;

/// A lower bound on the number of candidates that cover at least `wanted` weight; `upper` is a number that is known
/// to do.
pub(super) fn partial_bound(coverage: &Coverage, wanted: f64, upper: usize) -> usize {
    let elements: Vec<usize> = (0..coverage.elements()).filter(|e| !coverage.covered_by(*e).is_empty()).collect();
    let total: f64 = elements.iter().map(|e| coverage.weight(*e)).sum();
    if wanted <= 0.0 || upper == 0 || elements.is_empty() {
        return 0;
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
    // rounding up is allowed, since the number is whole; a little slack keeps rounding errors out
    ((best - 1e-6).ceil().max(1.0) as usize).min(upper)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fewest(coverage: &Coverage, wanted: f64) -> usize {
        let n = coverage.candidates();
        let weight = |set: usize| {
            let covered = |e: &usize| coverage.covered_by(*e).iter().any(|c| set >> c & 1 == 1);
            (0..coverage.elements()).filter(covered).map(|e| coverage.weight(e)).sum::<f64>()
        };
        (0usize..1 << n).filter(|s| weight(*s) >= wanted - 1e-9).map(|s| s.count_ones() as usize).min().unwrap()
    }

    #[test]
    fn the_bound_is_never_above_the_fewest_and_mostly_equal() {
        let (mut equal, mut all) = (0, 0);
        let mut state = 7u64;
        let mut random = move |n: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % n
        };
        for _ in 0..60 {
            let weights: Vec<f64> = (0..30).map(|_| 0.5 + random(10) as f64 / 4.0).collect();
            let sets: Vec<Vec<u32>> = (0..11).map(|_| (0..30).filter(|_| random(4) == 0).collect()).collect();
            let coverage = Coverage::new(weights, sets).unwrap();
            let wanted = coverage.coverable() * (0.5 + random(50) as f64 / 100.0);
            let truth = fewest(&coverage, wanted);
            let bound = partial_bound(&coverage, wanted, truth);
            assert!(bound <= truth, "{bound} > {truth}");
            assert!(partial_bound(&coverage, wanted, truth + 2) <= truth);
            all += 1;
            equal += usize::from(bound == truth);
        }
        assert!(2 * equal > all, "{equal} of {all}");
    }
}
