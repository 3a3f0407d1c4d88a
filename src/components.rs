//! Connected components.

/// The number of no component.
pub(crate) const NONE: u32 = u32::MAX;

/// For each of `count` things the number of its component, from 0 in the order of their first things; [`NONE`] for what
/// is no `member`. `neighbours` gives what a thing is connected with, which must hold both ways.
pub(crate) fn components<I: IntoIterator<Item = usize>>(
    count: usize,
    member: impl Fn(usize) -> bool,
    neighbours: impl Fn(usize) -> I,
) -> Vec<u32> {
    let mut labels = vec![NONE; count];
    let (mut next, mut stack) = (0, Vec::new());
    for start in 0..count {
        if labels[start] != NONE || !member(start) {
            continue;
        }
        labels[start] = next;
        stack.push(start);
        while let Some(at) = stack.pop() {
            for other in neighbours(at) {
                if labels[other] == NONE && member(other) {
                    labels[other] = next;
                    stack.push(other);
                }
            }
        }
        next += 1;
    }
    labels
}

/// The things of each component, in rising order.
pub(crate) fn members(labels: &[u32]) -> Vec<Vec<usize>> {
    let count = labels.iter().filter(|l| **l != NONE).max().map_or(0, |l| *l as usize + 1);
    let mut members = vec![Vec::new(); count];
    for (thing, label) in labels.iter().enumerate().filter(|(_, l)| **l != NONE) {
        members[*label as usize].push(thing);
    }
    members
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_connected_has_one_number() {
        // 0 – 2 – 4 in a chain, 3 alone, 1 no member though it would link 3
        let links = [vec![2], vec![0, 3], vec![0, 4], vec![1], vec![2]];
        let labels = components(5, |i| i != 1, |i| links[i].clone());
        assert_eq!(labels, [0, NONE, 0, 1, 0]);
        assert_eq!(members(&labels), [vec![0, 2, 4], vec![3]]);
    }
}
