//! Lower bounds on how many candidates a cover takes: the dual of its linear relaxation, climbed by subgradients (Held and
//! Karp 1971; Beasley 1987).

use super::coverage::Coverage;

/// The least whole number not below a bound, mindful of rounding in its sum.
pub(crate) fn round_up(bound: f64) -> usize {
    (bound - 1e-6).ceil().max(0.0) as usize
}

/// What of a part is still to be decided.
#[derive(Clone, Debug)]
pub(crate) struct Free {
    pub(crate) rows: Vec<bool>,
    pub(crate) columns: Vec<bool>,
}

/// Prices of the rows: Σ uᵢ + Σⱼ min(0, 1 − Σ_{i ∈ j} uᵢ) is a lower bound for any prices uᵢ ≥ 0.
#[derive(Clone, Debug)]
pub(crate) struct Dual {
    pub(crate) prices: Vec<f64>,
    /// 1 − Σ uᵢ for each column, at the best bound found.
    pub(crate) costs: Vec<f64>,
}

impl Dual {
    pub(crate) fn new(part: &Coverage) -> Self {
        let share = |r: usize| {
            let of = |c: &u32| 1.0 / part.covers(*c as usize).len().max(1) as f64;
            part.covered_by(r).iter().map(of).fold(1.0, f64::min)
        };
        Self { prices: (0..part.elements()).map(share).collect(), costs: vec![1.0; part.candidates()] }
    }

    /// Climbs for so many steps, or until the bound exceeds `enough`; keeps the best prices and returns their bound.
    pub(crate) fn climb(&mut self, part: &Coverage, free: &Free, steps: usize, enough: f64) -> f64 {
        let rows: Vec<usize> = (0..free.rows.len()).filter(|&r| free.rows[r]).collect();
        let columns: Vec<usize> = (0..free.columns.len()).filter(|&c| free.columns[c]).collect();
        let mut best = f64::NEG_INFINITY;
        let mut prices = self.prices.clone();
        let mut costs = vec![1.0; free.columns.len()];
        let (mut pace, mut stale) = (2.0, 0);
        let mut slope = vec![0.0; free.rows.len()];
        for _ in 0..steps {
            for &r in &rows {
                slope[r] = 1.0;
            }
            let mut bound: f64 = rows.iter().map(|&r| prices[r]).sum();
            for &c in &columns {
                let list = part.covers(c);
                let cost =
                    1.0 - list.iter().filter(|&&r| free.rows[r as usize]).map(|&r| prices[r as usize]).sum::<f64>();
                costs[c] = cost;
                if cost < 0.0 {
                    bound += cost;
                    for &r in list {
                        slope[r as usize] -= 1.0;
                    }
                }
            }
            if bound > best + 1e-9 {
                (best, stale) = (bound, 0);
                self.prices.clone_from(&prices);
                self.costs.clone_from(&costs);
            } else {
                stale += 1;
            }
            if best > enough {
                break;
            }
            if stale >= 15 {
                (pace, stale) = (pace / 2.0, 0);
                prices.clone_from(&self.prices);
                if pace < 0.003 {
                    break;
                }
                continue;
            }
            let norm: f64 = rows.iter().map(|&r| slope[r] * slope[r]).sum();
            if norm == 0.0 {
                break;
            }
            // aims a little above the bound: the true height is unknown
            let step = pace * (0.05 * best.max(1.0) + (best - bound).max(0.0)) / norm;
            for &r in &rows {
                prices[r] = (prices[r] + step * slope[r]).max(0.0);
            }
        }
        best.max(0.0)
    }
}
