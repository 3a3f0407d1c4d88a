//! How often regions that are no faults turn up in the photographs at hand.
//!
//! Most of a model is right, so that regions of one kind that turn up all over it are no faults: poses and scans are off by a little
//! everywhere, photographs are blurred. The weights of the cues hold for rooms where such regions come at a usual rate; where they come
//! more often, the odds of each are less by as much (Bayes' rule). The rate is estimated from the audit's own photographs (empirical
//! Bayes: Efron, Tibshirani, Storey and Tusher, *Empirical Bayes analysis of a microarray experiment*, 2001).

use crate::audit::decide::odds::probability;

/// What is usual counts as much as what so many photographs show: half a photograph, since rooms differ by more than ten times.
const PRIOR_PHOTOGRAPHS: f64 = 0.5;

/// The rate is taken to be at least this share of the usual one: rooms with fewer were not met.
const LEAST: f64 = 0.25;

/// Regions of one kind that are no faults, a photograph.
#[derive(Clone, Copy)]
pub(crate) struct Background {
    pub(crate) rate: f64,
    /// Where the cues' weights hold.
    pub(crate) usual: f64,
}

impl Background {
    /// Estimates the rate in some photographs from the logarithms of the odds of all regions that they show, by
    /// expectation-maximisation: a region counts by how unlikely it is a fault at the rate.
    pub(crate) fn estimated(log_odds: &[f32], photographs: usize, usual: f64) -> Self {
        const ROUNDS: usize = 60;
        let mut this = Self { rate: usual, usual };
        for _ in 0..ROUNDS {
            let right: f64 = log_odds.iter().map(|z| 1.0 - probability(z + this.log_odds())).sum();
            let rate = (PRIOR_PHOTOGRAPHS * usual + right) / (PRIOR_PHOTOGRAPHS + photographs as f64);
            // half of the way in logarithms, lest it swings
            this.rate = (this.rate * rate).sqrt().max(LEAST * usual);
        }
        this
    }

    /// What is to be added to the logarithm of the odds of each region.
    pub(crate) fn log_odds(&self) -> f32 {
        (self.usual / self.rate).ln() as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_turns_up_all_over_is_no_fault_and_what_stands_alone_may_be() {
        let of = |log_odds: &[f32]| Background::estimated(log_odds, 4, 0.1).log_odds();
        // nothing else looks wrong
        assert!(of(&[0.5]) > 0.0 && of(&[]) > of(&[0.5]));
        assert!(of(&[]) <= -(LEAST.ln() as f32) + 1e-6);
        let many = of(&[0.5; 12]);
        assert!(
            (many + (12.05f32 / 4.5 / 0.1).ln()).abs() < 0.2,
            "twelve regions in four photographs and a half: {many}"
        );
        // sure faults are none of it
        assert!((of(&[9.0; 12]) - of(&[])).abs() < 0.01);
        assert!(of(&[0.5; 6]) > many);
    }
}
