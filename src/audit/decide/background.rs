//! How often regions that are no faults turn up in the photographs at hand.
//!
//! Most of a model is right, so that regions of one kind that turn up all over it are no faults: poses and scans are off by a little
//! everywhere, photographs are blurred. The weights of the cues hold for rooms where such regions come at a usual rate; where they come
//! more often, the odds of each are less by as much (Bayes' rule). The rate is estimated from the audit's own photographs (empirical
//! Bayes: Efron, Tibshirani, Storey and Tusher, *Empirical Bayes analysis of a microarray experiment*, 2001).

use crate::audit::decide::odds::probability;
use crate::audit::finding::Evidence;

/// How often regions like one turn up beside it that are no faults.
#[derive(Clone, Copy)]
pub(crate) struct Background {
    /// Regions a photograph.
    rate: f64,
    /// Where the cues' weights hold.
    usual: f64,
}

impl Background {
    /// Estimates it for each region of one kind that some photographs show, from the logarithms of their odds, by
    /// expectation-maximisation: each of the others counts by how unlikely it is a fault. Of less than a probability of `least` none counts.
    pub(crate) fn estimated(log_odds: &[f32], photographs: usize, usual: f64, least: f64) -> Vec<Self> {
        const ROUNDS: usize = 60;
        let mut all = vec![Self { rate: usual, usual }; log_odds.len()];
        for _ in 0..ROUNDS {
            let right =
                |(b, z): (&Self, &f32)| if probability(*z) < least { 0.0 } else { 1.0 - probability(z + b.log_odds()) };
            let right: Vec<f64> = all.iter().zip(log_odds).map(right).collect();
            let sum: f64 = right.iter().sum();
            for (background, own) in all.iter_mut().zip(&right) {
                // what is usual counts as much as what one photograph shows
                let rate = (usual + sum - own) / (1.0 + photographs as f64);
                // half of the way in logarithms, lest it swings
                background.rate = (background.rate * rate).sqrt();
            }
        }
        all
    }

    /// What it adds to the logarithm of the region's odds, of which a share counts, and the same in words.
    pub(crate) fn says(&self, share: f32) -> (f32, Evidence) {
        let says = share * self.log_odds();
        let (rate, usual) = (self.rate as f32, self.usual as f32);
        (says, Evidence::new("regions like it elsewhere", rate, usual, "a photograph", says))
    }

    /// What is to be added to the logarithm of the region's odds; where less than usual turns up, nothing.
    fn log_odds(&self) -> f32 {
        -(self.rate / self.usual).max(1.0).ln() as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_turns_up_all_over_is_no_fault_and_what_stands_alone_may_be() {
        let of = |log_odds: &[f32]| Background::estimated(log_odds, 4, 0.1, 0.1)[0].log_odds();
        // a region says nothing against itself
        assert_eq!(of(&[0.5]), 0.0);
        let many = of(&[0.5; 12]);
        let rate: f32 = 11.1 / 5.0;
        assert!((many + (rate / 0.1).ln()).abs() < 0.2, "eleven others in five photographs: {many}");
        assert!(of(&[0.5; 6]) > many);
        // sure faults are none of it, and what is not told counts for nothing
        assert_eq!(of(&[9.0; 12]), 0.0);
        assert_eq!(of(&[0.5, -5.0, -5.0, -5.0, -5.0]), 0.0);
    }
}
