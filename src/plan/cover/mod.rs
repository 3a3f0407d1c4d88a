//! The fewest candidates that cover what must be covered: set cover, with proof of how good the answer is.
//!
//! [`choose()`] is fast: lazy greedy, redundant candidates dropped, two replaced by one and three by two. [`minimum`] is
//! exact: it reduces, splits into parts and branches, and stopped early still gives a valid lower bound.
//! [`lower_bound`] is the bound alone.

mod bound;
mod choose;
mod exact;
mod reduce;
mod swaps;
#[cfg(test)]
mod tests;

pub use bound::{Bound, disjoint, lower_bound};
pub use choose::{Choice, Goal, choose};
pub use exact::{Limits, Minimum, minimum};
pub use reduce::maximal;

/// Which candidate covers which elements, and what each element weighs.
#[derive(Clone, Debug, Default)]
pub struct Coverage {
    weights: Vec<f64>,
    columns: Lists,
    rows: Lists,
}

/// Why a coverage table is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CoverageError {
    /// A candidate covers an element that does not exist.
    #[error("candidate {candidate} covers element {element}, but there are only {elements}")]
    NoSuchElement {
        /// Which candidate.
        candidate: usize,
        /// What it covers.
        element: u32,
        /// So many there are.
        elements: usize,
    },
    /// A weight that is negative or no number.
    #[error("element {element} weighs {weight}: weights are finite and not negative")]
    Weight {
        /// Which element.
        element: usize,
        /// Its weight.
        weight: f64,
    },
}

impl Coverage {
    /// Takes each element's weight and each candidate's elements (in any order, repeats allowed).
    pub fn new<C>(weights: Vec<f64>, candidates: impl IntoIterator<Item = C>) -> Result<Self, CoverageError>
    where
        C: IntoIterator<Item = u32>,
    {
        if let Some(element) = weights.iter().position(|w| !(w.is_finite() && *w >= 0.0)) {
            return Err(CoverageError::Weight { element, weight: weights[element] });
        }
        let mut columns = Lists::default();
        let mut list = Vec::new();
        for (candidate, elements) in candidates.into_iter().enumerate() {
            list.clear();
            list.extend(elements);
            list.sort_unstable();
            list.dedup();
            if let Some(&element) = list.last().filter(|&&e| e as usize >= weights.len()) {
                return Err(CoverageError::NoSuchElement { candidate, element, elements: weights.len() });
            }
            columns.push(&list);
        }
        let rows = columns.transposed(weights.len());
        Ok(Self { weights, columns, rows })
    }

    /// How many elements there are.
    pub fn elements(&self) -> usize {
        self.weights.len()
    }

    /// How many candidates there are.
    pub fn candidates(&self) -> usize {
        self.columns.len()
    }

    /// What a candidate covers, in rising order.
    pub fn covers(&self, candidate: usize) -> &[u32] {
        self.columns.get(candidate)
    }

    /// Which candidates cover an element, in rising order.
    pub fn covered_by(&self, element: usize) -> &[u32] {
        self.rows.get(element)
    }

    /// An element's weight.
    pub fn weight(&self, element: usize) -> f64 {
        self.weights[element]
    }

    /// The weight of all elements that some candidate covers.
    pub fn coverable(&self) -> f64 {
        (0..self.elements()).filter(|&e| !self.covered_by(e).is_empty()).map(|e| self.weights[e]).sum()
    }
}

/// Many short lists in one array.
#[derive(Clone, Debug)]
pub(crate) struct Lists {
    starts: Vec<usize>,
    items: Vec<u32>,
}

impl Default for Lists {
    fn default() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }
}

impl Lists {
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    pub(crate) fn get(&self, i: usize) -> &[u32] {
        &self.items[self.starts[i]..self.starts[i + 1]]
    }

    pub(crate) fn push(&mut self, list: &[u32]) {
        self.items.extend_from_slice(list);
        self.starts.push(self.items.len());
    }

    /// For each of `n` items the lists that hold it.
    pub(crate) fn transposed(&self, n: usize) -> Self {
        let mut starts = vec![0; n + 1];
        for &item in &self.items {
            starts[item as usize + 1] += 1;
        }
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let mut fill = starts.clone();
        let mut items = vec![0; self.items.len()];
        for i in 0..self.len() {
            for &item in self.get(i) {
                items[fill[item as usize]] = i as u32;
                fill[item as usize] += 1;
            }
        }
        Self { starts, items }
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
