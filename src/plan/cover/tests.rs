use super::coverage::Coverage;
use super::exact::{SearchLimits, minimum};
use super::greedy::{Goal, select};
use proptest::prelude::*;

/// By looking at every subset.
fn fewest(coverage: &Coverage) -> usize {
    let all: Vec<u32> =
        (0..coverage.elements()).filter(|&e| !coverage.covered_by(e).is_empty()).map(|e| e as u32).collect();
    let covers = |set: u32| {
        let has = |e: &u32| coverage.covered_by(*e as usize).iter().any(|&c| set >> c & 1 == 1);
        all.iter().all(has)
    };
    (0..1_u32 << coverage.candidates()).filter(|&s| covers(s)).map(u32::count_ones).min().unwrap() as usize
}

fn covers_all(coverage: &Coverage, chosen: &[usize]) -> bool {
    (0..coverage.elements()).all(|e| {
        let by = coverage.covered_by(e);
        by.is_empty() || by.iter().any(|&c| chosen.contains(&(c as usize)))
    })
}

proptest! {
    #[test]
    fn small_covers_are_the_fewest_and_bounds_hold(
        columns in prop::collection::vec(prop::collection::vec(0_u32..14, 1..6), 1..12),
    ) {
        let coverage = Coverage::new(vec![1.0; 14], columns);
        let best = fewest(&coverage);
        let minimum = minimum(&coverage, SearchLimits::default());
        prop_assert!(covers_all(&coverage, &minimum.chosen));
        prop_assert_eq!(minimum.chosen.len(), best);
        prop_assert_eq!(minimum.at_least, best);
        let selection = select(&coverage, &Goal::default());
        prop_assert!(covers_all(&coverage, &selection.chosen));
        prop_assert!(selection.chosen.len() >= best);
        prop_assert!(selection.curve.windows(2).all(|w| w[0] <= w[1]));
    }
}

#[test]
fn swaps_mend_the_greedy_choice() {
    // greedy takes the six in the middle first and then needs both halves
    let columns = [vec![0, 1, 2, 6, 7, 8], vec![0, 1, 2, 3, 4], vec![5, 6, 7, 8, 9], vec![3, 4], vec![5, 9]];
    let coverage = Coverage::new(vec![1.0; 10], columns);
    assert_eq!(select(&coverage, &Goal::default()).chosen, [1, 2]);
}

#[test]
fn goals_are_kept() {
    let coverage = Coverage::new(vec![5.0, 3.0, 1.0, 1.0], [vec![0], vec![1], vec![2], vec![3]]);
    let most = select(&coverage, &Goal { target: 0.8, ..Goal::default() });
    assert_eq!((most.chosen, most.curve), (vec![0, 1], vec![5.0, 8.0]));
    let two = select(&coverage, &Goal { at_most: Some(2), fixed: vec![3], ..Goal::default() });
    assert_eq!((two.chosen, two.curve), (vec![3, 0], vec![1.0, 6.0]));
    let nothing = select(&Coverage::default(), &Goal::default());
    assert_eq!(nothing.chosen, Vec::<usize>::new());
}

#[test]
fn weights_that_are_none_count_for_nothing_and_unknown_elements_are_dropped() {
    let weights = vec![f64::NAN, 2.0, -1.0, f64::INFINITY];
    let coverage = Coverage::new(weights, [vec![4, 3, 2, 1, 0], vec![7]]);
    assert_eq!((coverage.covers(0), coverage.covers(1)), (&[0, 1, 2, 3][..], &[][..]));
    assert_eq!([0, 1, 2, 3].map(|e| coverage.weight(e)), [0.0, 2.0, 0.0, 0.0]);
    assert_eq!(coverage.coverable(), 2.0);
}
