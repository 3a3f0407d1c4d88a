//! In which order to walk: a short open tour.

/// Beyond so many stations the tour is improved step by step instead of found exactly.
const EXACT: usize = 11;

/// The order in which to visit places, given the (finite) length of the way between any two. The shortest open tour for up to
/// eleven (Held and Karp, *A Dynamic Programming Approach to Sequencing Problems*, 1962), a good one for more (nearest
/// neighbour, then 2-opt). It starts at the end with the lower number.
pub(crate) fn shortest(way: &[Vec<f64>]) -> Vec<usize> {
    let n = way.len();
    let mut tour = if n <= EXACT { exact(way) } else { improved(way, nearest(way)) };
    if tour.first() > tour.last() {
        tour.reverse();
    }
    tour
}

/// The length of a tour.
pub(crate) fn length(way: &[Vec<f64>], tour: &[usize]) -> f64 {
    tour.windows(2).map(|w| way[w[0]][w[1]]).sum()
}

fn exact(way: &[Vec<f64>]) -> Vec<usize> {
    let n = way.len();
    if n < 2 {
        return (0..n).collect();
    }
    // best[set][last]: the shortest way through a set that ends at its member `last`, and what came before that
    let mut best = vec![vec![(f64::INFINITY, n); n]; 1 << n];
    for i in 0..n {
        best[1 << i][i].0 = 0.0;
    }
    for set in 1usize..1 << n {
        for last in (0..n).filter(|l| set >> l & 1 == 1) {
            let (so_far, _) = best[set][last];
            for next in (0..n).filter(|x| set >> x & 1 == 0) {
                let there = so_far + way[last][next];
                let slot = &mut best[set | 1 << next][next];
                if there < slot.0 {
                    *slot = (there, last);
                }
            }
        }
    }
    let mut set = (1 << n) - 1;
    let mut at = (0..n).min_by(|a, b| best[set][*a].0.total_cmp(&best[set][*b].0)).unwrap_or(0);
    let mut tour = vec![at];
    while tour.len() < n {
        let before = best[set][at].1;
        set &= !(1 << at);
        at = before;
        tour.push(at);
    }
    tour
}

fn nearest(way: &[Vec<f64>]) -> Vec<usize> {
    let mut tour = vec![0];
    loop {
        let at = tour[tour.len() - 1];
        let rest = (0..way.len()).filter(|i| !tour.contains(i));
        match rest.min_by(|a, b| way[at][*a].total_cmp(&way[at][*b])) {
            Some(next) => tour.push(next),
            None => return tour,
        }
    }
}

fn improved(way: &[Vec<f64>], mut tour: Vec<usize>) -> Vec<usize> {
    loop {
        let before = length(way, &tour);
        for i in 0..tour.len() {
            for j in i + 1..tour.len() {
                let mut other = tour.clone();
                other[i..=j].reverse();
                if length(way, &other) < length(way, &tour) - 1e-9 {
                    tour = other;
                }
            }
        }
        if length(way, &tour) >= before - 1e-9 {
            return tour;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ways(at: &[(f64, f64)]) -> Vec<Vec<f64>> {
        at.iter().map(|a| at.iter().map(|b| (a.0 - b.0).hypot(a.1 - b.1)).collect()).collect()
    }

    #[test]
    fn places_on_a_line_are_visited_along_it() {
        let way = ways(&[(3.0, 0.0), (0.0, 0.0), (4.0, 0.0), (1.0, 0.0)]);
        assert_eq!(shortest(&way), [1, 3, 0, 2]);
        assert_eq!((shortest(&[]), shortest(&ways(&[(1.0, 1.0)]))), (vec![], vec![0]));
    }

    #[test]
    fn a_long_tour_is_near_the_best() {
        let ring: Vec<(f64, f64)> =
            (0..20).map(|i| f64::from(i * 7 % 20) * 0.3).map(|a: f64| (a.cos(), a.sin())).collect();
        let way = ways(&ring);
        let tour = shortest(&way);
        let mut all = tour.clone();
        all.sort_unstable();
        assert_eq!(all, (0..20).collect::<Vec<_>>());
        assert!(length(&way, &tour) < 19.0 * 2.0 * 0.15f64.sin() + 0.3);
    }
}
