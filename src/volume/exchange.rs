//! How unseen places light each other until it settles.

use glam::Vec3A;
use rayon::prelude::*;

use super::cache_points::CachePoints;
use super::gathered::{Gathered, Link};
use crate::lists::Lists;

/// What gathered places receive from each other, as a sparse matrix K by rows: of irradiance alone, since what a place sends on
/// is its irradiance × albedo/π. A product of it reads less than half of what the [links](Gathered::links) hold.
#[derive(Default)]
pub(super) struct Exchange {
    /// Per gathered place the others that light it.
    terms: Lists<Term>,
}

/// Irradiance of one place per irradiance of another, a channel each.
#[derive(Clone, Copy, Default)]
struct Term {
    other: u32,
    weight: [f32; 3],
}

/// Places exchange light at most so often. The series converges like (albedo × share of unseen surfaces)ⁿ.
const BOUNCES: usize = 100;

/// An exchange that changes the light by less than this share is the last.
const SETTLED: f64 = 1e-4;

impl Exchange {
    /// The matrix of places that are linked.
    pub(super) fn new(cache_points: &CachePoints, gathered: &[Gathered]) -> Self {
        let mut terms = Lists::default();
        for g in gathered {
            let normal = cache_points.list[g.cache_point as usize].normal;
            let term = |l: &Link| Term { other: l.other, weight: l.weights.map(|w| w.dot(normal)) };
            terms.push(&g.links.iter().map(term).collect::<Vec<_>>());
        }
        Self { terms }
    }

    /// Irradiance E = `first` + K E by Jacobi steps, each of which reads only the last one's values.
    pub(super) fn settled(&self, first: Vec<Vec3A>) -> Vec<Vec3A> {
        /// Sums of differences are taken by so many places, whatever the number of threads.
        const LOT: usize = 4096;
        let row = |(place, first): (usize, &Vec3A), last: &[Vec3A]| {
            let add = |sum: Vec3A, term: &Term| sum + Vec3A::from(term.weight) * last[term.other as usize];
            self.terms.get(place).iter().fold(*first, add).max(Vec3A::ZERO)
        };
        let mut last = first.clone();
        for _ in 0..BOUNCES {
            let next: Vec<Vec3A> = first.par_iter().enumerate().map(|r| row(r, &last)).collect();
            let sums = |(next, last): (&[Vec3A], &[Vec3A])| {
                let both = next.iter().zip(last);
                both.fold([0.0; 2], |[change, all], (n, l)| {
                    [change + f64::from((*n - *l).abs().element_sum()), all + f64::from(n.element_sum())]
                })
            };
            let lots: Vec<[f64; 2]> = next.par_chunks(LOT).zip(last.par_chunks(LOT)).map(sums).collect();
            let [change, all] = [0, 1].map(|k| lots.iter().map(|lot| lot[k]).sum::<f64>());
            last = next;
            if change <= SETTLED * all {
                break;
            }
        }
        last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three places in a ring, each of which gets a half, a quarter or nothing of the next one's light: E by hand.
    #[test]
    fn light_settles_to_the_sum_of_all_bounces() {
        let weight = [0.5, 0.25, 0.0];
        let ring = Exchange { terms: Lists::of(3, || (0..).zip([1, 2, 0].map(|other| Term { other, weight }))) };
        let settled = ring.settled(vec![Vec3A::ONE, Vec3A::ZERO, Vec3A::ZERO]);
        for (c, k) in weight.into_iter().enumerate() {
            let round = 1.0 / (1.0 - k * k * k);
            for (place, known) in [round, k * k * round, k * round].into_iter().enumerate() {
                assert!((settled[place][c] - known).abs() < 1e-3, "place {place}, channel {c}");
            }
        }
    }
}
