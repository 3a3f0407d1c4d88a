//! Stations that can be registered with each other: neighbours must see enough in common.

use crate::components::components;

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
    pub(crate) fn link(&self, sights: &[&[u32]], candidates: &[Vec<u32>]) -> Option<usize> {
        let groups = self.groups(sights);
        let links = |candidate: &[u32]| {
            let mut linked: Vec<u32> =
                (0..sights.len()).filter(|i| self.of(sights[*i], candidate) >= self.share).map(|i| groups[i]).collect();
            linked.sort_unstable();
            linked.dedup();
            linked.len()
        };
        let mut best: Option<(usize, f64, usize)> = None;
        for (i, candidate) in candidates.iter().enumerate() {
            let (linked, weight) = (links(candidate), self.weight(candidate));
            if linked >= 2
                && best.is_none_or(|(most, heaviest, _)| linked > most || linked == most && weight > heaviest)
            {
                best = Some((linked, weight, i));
            }
        }
        best.map(|(_, _, i)| i)
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
        let candidates = vec![vec![3, 4, 5], vec![3, 4, 5, 6, 7], vec![2, 3, 4, 5, 6, 7, 8]];
        assert_eq!(overlap.link(&[&a, &b], &candidates), Some(2));
        assert_eq!(overlap.groups(&[&a, &b, &candidates[2]]), [0, 0, 0]);
        assert_eq!(overlap.link(&[&a, &b], &candidates[..1]), None);
    }
}
