//! What covers what: the table that set covers are solved on.

use crate::lists::Lists;

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
