//! A uniform grid over a box that lists what may touch each cell.

use crate::lists::Lists;
use glam::DVec2;

/// The grid and its lists.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    pub(crate) low: DVec2,
    /// Cells a unit of length.
    pub(crate) per_unit: DVec2,
    size: [usize; 2],
    lists: Lists,
}

impl Cells {
    /// So many cells over a box of an extent, each with the things that `touched` names for it, in that order.
    pub(crate) fn new(
        low: DVec2,
        extent: DVec2,
        size: [usize; 2],
        touched: impl FnOnce(&Self, &mut dyn FnMut([usize; 2], u32)),
    ) -> Self {
        let per_unit = DVec2::new(size[0] as f64, size[1] as f64) / extent;
        let mut cells = Self { low, per_unit, size, lists: Lists::default() };
        let mut entries: Vec<(u32, u32)> = Vec::new();
        touched(&cells, &mut |cell, thing| entries.push((cells.number(cell) as u32, thing)));
        cells.lists = Lists::of(size[0] * size[1], || entries.iter().copied());
        cells
    }

    /// The cell of a point; beyond the box, the nearest.
    #[inline]
    pub(crate) fn xy(&self, p: DVec2) -> [usize; 2] {
        // a negative number becomes 0
        let at = (p - self.low) * self.per_unit;
        [(at.x as usize).min(self.size[0] - 1), (at.y as usize).min(self.size[1] - 1)]
    }

    /// Cells of a box, row by row.
    pub(crate) fn within(&self, low: DVec2, high: DVec2) -> impl Iterator<Item = [usize; 2]> + use<> {
        let ([x0, y0], [x1, y1]) = (self.xy(low), self.xy(high));
        (y0..=y1).flat_map(move |y| (x0..=x1).map(move |x| [x, y]))
    }

    /// What may touch a cell, in rising order.
    #[inline]
    pub(crate) fn get(&self, cell: [usize; 2]) -> &[u32] {
        self.lists.get(self.number(cell))
    }

    fn number(&self, [x, y]: [usize; 2]) -> usize {
        y * self.size[0] + x
    }
}
