//! What covers what: the table that set covers are solved on.

use crate::lists::Lists;

/// Which candidate covers which elements, and what each element weighs.
#[derive(Clone, Debug, Default)]
pub struct Coverage {
    weights: Vec<f64>,
    columns: Lists,
    rows: Lists,
}

impl Coverage {
    /// Takes each element's weight and each candidate's elements (in any order, repeats allowed). A weight that is negative or not
    /// finite counts as 0, and elements without a weight are left out.
    pub fn new<C>(mut weights: Vec<f64>, candidates: impl IntoIterator<Item = C>) -> Self
    where
        C: IntoIterator<Item = u32>,
    {
        weights.iter_mut().filter(|w| !(w.is_finite() && **w >= 0.0)).for_each(|w| *w = 0.0);
        let mut columns = Lists::default();
        let mut list = Vec::new();
        for elements in candidates {
            list.clear();
            list.extend(elements.into_iter().filter(|e| (*e as usize) < weights.len()));
            list.sort_unstable();
            list.dedup();
            columns.push(&list);
        }
        let rows = columns.transposed(weights.len());
        Self { weights, columns, rows }
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
