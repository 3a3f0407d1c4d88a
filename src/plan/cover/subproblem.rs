//! An independent part of a covering problem.

use crate::lists::Lists;

/// An independent part of a problem, with its own numbers.
#[derive(Clone, Debug)]
pub(crate) struct Subproblem {
    pub(crate) columns: Lists,
    pub(crate) rows: Lists,
}

impl Subproblem {
    pub(crate) fn new(columns: Lists, rows: usize) -> Self {
        let rows = columns.transposed(rows);
        Self { columns, rows }
    }
}

/// Whether a rising list lies within another.
pub(crate) fn within(small: &[u32], large: &[u32]) -> bool {
    if small.len() > large.len() {
        return false;
    }
    let mut rest = large;
    small.iter().all(|s| match rest.iter().position(|l| l >= s) {
        Some(k) if rest[k] == *s => {
            rest = &rest[k + 1..];
            true
        }
        _ => false,
    })
}
