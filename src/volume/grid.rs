//! A uniform grid of cubic cells over the scene.

use glam::{IVec3, Vec3};

/// Cubic cells over a box; every cell has an index, x fastest.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    low: Vec3,
    /// Side of a cell, metres.
    pub cell_m: f32,
    /// Number of cells along each axis, at least one.
    pub size: IVec3,
}

impl Grid {
    /// `along` cells along the longest side of the box from `low` to `high`.
    pub fn over(low: Vec3, high: Vec3, along: u32) -> Self {
        let extent = (high - low).max(Vec3::splat(1e-6));
        let cell_m = extent.max_element() / along as f32;
        // a hair less: rounding must not add a cell
        let size = (extent / cell_m - 1e-4).ceil().as_ivec3().max(IVec3::ONE);
        // centred, so that a scene a whole number of cells wide is not cut at its rim
        let low = low - 0.5 * (size.as_vec3() * cell_m - extent);
        Self { low, cell_m, size }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        (self.size.x * self.size.y * self.size.z) as usize
    }

    /// Never true.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A point in cells from the grid's lowest corner.
    pub fn place(&self, point: Vec3) -> Vec3 {
        (point - self.low) / self.cell_m
    }

    /// The cell that holds a point, the nearest one for a point outside.
    pub fn cell(&self, point: Vec3) -> IVec3 {
        self.place(point).floor().as_ivec3().clamp(IVec3::ZERO, self.size - 1)
    }

    /// The middle of a cell.
    pub fn centre(&self, cell: IVec3) -> Vec3 {
        self.low + (cell.as_vec3() + 0.5) * self.cell_m
    }

    /// A cell's index; `None` outside the grid.
    pub fn index(&self, cell: IVec3) -> Option<usize> {
        (cell.cmpge(IVec3::ZERO).all() && cell.cmplt(self.size).all())
            .then(|| (cell.x + self.size.x * (cell.y + self.size.y * cell.z)) as usize)
    }
}
