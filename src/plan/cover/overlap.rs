//! Stations that can be registered with each other: neighbours must see enough in common.

use crate::components::components;
use std::collections::BTreeSet;

/// What stations see, as rising lists of witnesses with their weights.
pub(crate) struct Overlap<'a> {
    /// Weight of each witness.
    pub(crate) weights: &'a [f64],
    /// The least share of the lesser sight that two neighbours have in common.
    pub(crate) share: f64,
}

impl Overlap<'_> {
    fn weight(&self, sight: &[u32]) -> f64 {
        sight.iter().map(|w| self.weights[*w as usize]).sum()
    }

    /// The share of the lesser of two sights that both see.
    pub(crate) fn of(&self, a: &[u32], b: &[u32]) -> f64 {
        let (mut i, mut j, mut common) = (0, 0, 0.0);
        while let (Some(x), Some(y)) = (a.get(i), b.get(j)) {
            match x.cmp(y) {
                std::cmp::Ordering::Less => i += 1,
                std::cmp::Ordering::Greater => j += 1,
                std::cmp::Ordering::Equal => {
                    common += self.weights[*x as usize];
                    (i, j) = (i + 1, j + 1);
                }
            }
        }
        common / self.weight(a).min(self.weight(b)).max(f64::MIN_POSITIVE)
    }

    /// For each sight the number of the group it is linked with, groups numbered by their first.
    pub(crate) fn groups(&self, sights: &[&[u32]]) -> Vec<u32> {
        let linked =
            |at: usize| (0..sights.len()).filter(move |other| self.of(sights[at], sights[*other]) >= self.share);
        components(sights.len(), |_| true, linked)
    }

    /// The candidate that links most groups of `sights`, at least two; the one that sees most among equals.
    pub(crate) fn link<'a>(
        &self,
        sights: &[&[u32]],
        groups: &[u32],
        candidates: impl Iterator<Item = &'a [u32]>,
    ) -> Option<usize> {
        let links = |candidate: &[u32]| {
            let linked = sights.iter().zip(groups).filter(|(sight, _)| self.of(sight, candidate) >= self.share);
            linked.map(|(_, group)| group).collect::<BTreeSet<_>>().len()
        };
        let all = candidates.enumerate().map(|(i, candidate)| (links(candidate), self.weight(candidate), i));
        let best = all.filter(|(linked, _, _)| *linked >= 2);
        best.max_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(b.2.cmp(&a.2))).map(|(_, _, i)| i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_joins_what_does_not_overlap() {
        let weights = [1.0; 12];
        let overlap = Overlap { weights: &weights, share: 0.3 };
        let (a, b): (Vec<u32>, Vec<u32>) = ((0..5).collect(), (6..11).collect());
        assert_eq!(overlap.groups(&[&a, &b]), [0, 1]);
        assert_eq!(overlap.of(&a, &[3, 4, 5, 6]), 0.5);
        let candidates: [&[u32]; 3] = [&[3, 4, 5], &[3, 4, 5, 6, 7], &[2, 3, 4, 5, 6, 7, 8]];
        assert_eq!(overlap.link(&[&a, &b], &[0, 1], candidates.into_iter()), Some(2));
        assert_eq!(overlap.groups(&[&a, &b, candidates[2]]), [0, 0, 0]);
        assert_eq!(overlap.link(&[&a, &b], &[0, 1], candidates.into_iter().take(1)), None);
    }
}
