//! A square grid over the model in plan, and yes/no maps on it.

use glam::{DVec2, Vec2};

use crate::components::{components, members};

/// Square cells over the model in plan: local metres, x east, y north.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The south-west corner.
    pub low: DVec2,
    /// A cell's side in metres.
    pub cell_m: f64,
    /// Cells eastwards.
    pub width: usize,
    /// Cells northwards.
    pub height: usize,
}

impl Grid {
    /// A grid that covers `low..high` with a rim of two cells. Cells are as near to `cell_m` as `most` cells in all
    /// allow.
    pub fn covering(low: DVec2, high: DVec2, cell_m: f64, most: usize) -> Self {
        let size = (high - low).max(DVec2::splat(cell_m));
        let cell_m = cell_m.max((size.x * size.y / most as f64).sqrt()).max(size.max_element() / most as f64);
        let count = |length: f64| (length / cell_m).ceil() as usize + 4;
        Self { low: low - 2.0 * cell_m, cell_m, width: count(size.x), height: count(size.y) }
    }

    /// How many cells there are.
    pub(crate) fn len(&self) -> usize {
        self.width * self.height
    }

    /// A cell's area in square metres.
    pub fn cell_area(&self) -> f64 {
        self.cell_m * self.cell_m
    }

    /// The middle of a cell.
    pub fn middle(&self, cell: usize) -> DVec2 {
        let (x, y) = (cell % self.width, cell / self.width);
        self.low + (DVec2::new(x as f64, y as f64) + 0.5) * self.cell_m
    }

    /// The cell that holds a point, if it is on the grid.
    pub fn cell(&self, point: DVec2) -> Option<usize> {
        let p = (point - self.low) / self.cell_m;
        let inside = p.x >= 0.0 && p.y >= 0.0 && p.x < self.width as f64 && p.y < self.height as f64;
        inside.then(|| p.y as usize * self.width + p.x as usize)
    }

    /// The cell `(dx, dy)` away, if it is on the grid.
    pub fn beside(&self, cell: usize, dx: isize, dy: isize) -> Option<usize> {
        let x = (cell % self.width).checked_add_signed(dx).filter(|x| *x < self.width)?;
        let y = (cell / self.width).checked_add_signed(dy).filter(|y| *y < self.height)?;
        Some(y * self.width + x)
    }

    /// The cells that share a side with this one.
    pub fn neighbours(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let grid = *self;
        [(1, 0), (0, 1), (-1, 0), (0, -1)].into_iter().filter_map(move |(dx, dy)| grid.beside(cell, dx, dy))
    }

    /// The range of columns or rows that `low..=high` metres touch along an axis, cut at the grid's edge.
    pub(crate) fn range(&self, low: f32, high: f32, axis: usize) -> std::ops::Range<usize> {
        let (start, count) = if axis == 0 { (self.low.x, self.width) } else { (self.low.y, self.height) };
        let at = |v: f32| ((f64::from(v) - start) / self.cell_m).floor().clamp(-1.0, count as f64);
        let from = at(low).max(0.0) as usize;
        let to = (at(high) + 1.0).clamp(0.0, count as f64) as usize;
        from.min(to)..to
    }

    /// The least and greatest corner of a column's footprint.
    pub(crate) fn corners(&self, x: usize, y: usize) -> (Vec2, Vec2) {
        let low = self.low + DVec2::new(x as f64, y as f64) * self.cell_m;
        (low.as_vec2(), (low + self.cell_m).as_vec2())
    }

    /// A map with every cell off.
    pub fn none(&self) -> Map {
        Map { grid: *self, on: vec![false; self.len()] }
    }
}

/// Which cells of a grid are on.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// The grid.
    pub grid: Grid,
    /// A value a cell, row by row from the south.
    pub on: Vec<bool>,
}

impl Map {
    /// The map of the cells for which `f` holds.
    pub fn of(grid: Grid, f: impl Fn(usize) -> bool) -> Self {
        Self { grid, on: (0..grid.len()).map(f).collect() }
    }

    /// Whether a point lies in a cell that is on.
    pub fn at(&self, point: DVec2) -> bool {
        self.grid.cell(point).is_some_and(|c| self.on[c])
    }

    /// How many cells are on.
    pub fn count(&self) -> usize {
        self.on.iter().filter(|on| **on).count()
    }

    /// The area of the cells that are on, in square metres.
    pub fn area(&self) -> f64 {
        self.count() as f64 * self.grid.cell_area()
    }

    /// The cells that are on, in order.
    pub fn cells(&self) -> impl Iterator<Item = usize> + '_ {
        self.on.iter().enumerate().filter(|(_, on)| **on).map(|(cell, _)| cell)
    }

    /// The cells that are on here and off in another map of the same grid.
    pub fn without(&self, other: &Self) -> Self {
        Self::of(self.grid, |c| self.on[c] && !other.on[c])
    }

    /// The cells that are off here.
    pub fn inverted(&self) -> Self {
        Self { grid: self.grid, on: self.on.iter().map(|on| !on).collect() }
    }

    /// For each cell the distance in metres from its middle to the middle of the nearest cell that is on; infinite
    /// where none is. Exact, in linear time: Felzenszwalb and Huttenlocher, *Distance Transforms of Sampled
    /// Functions*, 2012.
    pub fn distance(&self) -> Vec<f32> {
        let (w, h) = (self.grid.width, self.grid.height);
        let far = ((w + h) * (w + h)) as f32;
        let mut squared: Vec<f32> = self.on.iter().map(|on| if *on { 0.0 } else { far }).collect();
        for row in squared.chunks_mut(w) {
            envelope(row, far);
        }
        let mut column = vec![0.0; h];
        for x in 0..w {
            for y in 0..h {
                column[y] = squared[y * w + x];
            }
            envelope(&mut column, far);
            for y in 0..h {
                squared[y * w + x] = column[y];
            }
        }
        let to_metres = |d: f32| if d >= far { f32::INFINITY } else { d.sqrt() * self.grid.cell_m as f32 };
        squared.into_iter().map(to_metres).collect()
    }

    /// The cells within `radius_m` of one that is on.
    pub fn grown(&self, radius_m: f64) -> Self {
        let reach = (radius_m + 1e-6) as f32;
        Self { grid: self.grid, on: self.distance().into_iter().map(|d| d <= reach).collect() }
    }

    /// Gaps of at most `gap_m` closed: cells that are off in a run so short, along an axis or a diagonal, between two that
    /// are on. (Growing and shrinking by a disc would not do: it leaves gaps in walls of one cell as they are.)
    pub fn closed(&self, gap_m: f64) -> Self {
        let mut closed = self.clone();
        for (dx, dy, step) in
            [(1, 0, 1.0), (0, 1, 1.0), (1, 1, std::f64::consts::SQRT_2), (1, -1, std::f64::consts::SQRT_2)]
        {
            let longest = ((gap_m + 1e-9) / (step * self.grid.cell_m)).floor() as isize;
            for start in self.cells() {
                let on = |k: isize| self.grid.beside(start, k * dx, k * dy).map(|c| self.on[c]);
                // the run of cells that are off after this one
                let Some(end) = (1..=longest + 1).find(|k| on(*k) != Some(false)) else { continue };
                if on(end) == Some(true) {
                    for k in 1..end {
                        if let Some(cell) = self.grid.beside(start, k * dx, k * dy) {
                            closed.on[cell] = true;
                        }
                    }
                }
            }
        }
        closed
    }

    /// The cells that are on, in rising order, by squares of about `side_m` that hold any, row by row.
    pub(crate) fn blocks(&self, side_m: f64) -> Vec<Vec<usize>> {
        let block = (side_m / self.grid.cell_m).round().max(1.0) as usize;
        let wide = self.grid.width.div_ceil(block);
        let mut blocks = vec![Vec::new(); wide * self.grid.height.div_ceil(block)];
        for cell in self.cells() {
            blocks[cell / self.grid.width / block * wide + cell % self.grid.width / block].push(cell);
        }
        blocks.retain(|cells| !cells.is_empty());
        blocks
    }

    /// For each cell that is on the number of its connected part (cells that share a side), from 0 in the order of their
    /// first cells.
    pub(crate) fn labels(&self) -> Vec<u32> {
        components(self.on.len(), |c| self.on[c], |c| self.grid.neighbours(c))
    }

    /// The connected parts, each as a rising list of cells, in the order of their first cells.
    pub fn parts(&self) -> Vec<Vec<usize>> {
        members(&self.labels())
    }

    /// The parts of this map that hold a cell of `seeds`.
    pub fn flooded_from(&self, seeds: &Map) -> Self {
        let mut flooded = self.grid.none();
        for part in self.parts() {
            if part.iter().any(|c| seeds.on[*c]) {
                part.into_iter().for_each(|c| flooded.on[c] = true);
            }
        }
        flooded
    }

    /// Switches off parts smaller than `least_m2`.
    pub fn without_specks(mut self, least_m2: f64) -> Self {
        let least = least_m2 / self.grid.cell_area();
        for part in self.parts().into_iter().filter(|p| (p.len() as f64) < least) {
            part.into_iter().for_each(|c| self.on[c] = false);
        }
        self
    }
}

/// One line of the distance transform: each value becomes the least of `value[q] + (p − q)²`.
fn envelope(line: &mut [f32], far: f32) {
    let n = line.len();
    let f = |q: usize| f64::from(line[q]) + (q * q) as f64;
    let mut feet: Vec<usize> = Vec::with_capacity(n);
    let mut from: Vec<f64> = Vec::with_capacity(n);
    for q in (0..n).filter(|q| line[*q] < far) {
        let mut start = f64::NEG_INFINITY;
        while let (Some(&foot), Some(&begun)) = (feet.last(), from.last()) {
            start = (f(q) - f(foot)) / (2.0 * (q as f64 - foot as f64));
            if start > begun {
                break;
            }
            feet.pop();
            from.pop();
            start = f64::NEG_INFINITY;
        }
        feet.push(q);
        from.push(start);
    }
    if feet.is_empty() {
        return;
    }
    let mut k = 0;
    let out: Vec<f32> = (0..n)
        .map(|p| {
            while k + 1 < feet.len() && from[k + 1] < p as f64 {
                k += 1;
            }
            let d = p as f64 - feet[k] as f64;
            (d * d + f64::from(line[feet[k]])).min(f64::from(far)) as f32
        })
        .collect();
    line.copy_from_slice(&out);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(rows: &[&str]) -> Map {
        let grid = Grid { low: DVec2::ZERO, cell_m: 1.0, width: rows[0].len(), height: rows.len() };
        Map { grid, on: rows.iter().rev().flat_map(|r| r.bytes().map(|b| b == b'#')).collect() }
    }

    #[test]
    fn distance_is_that_of_brute_force() {
        let map = map(&["....#....", ".........", "#......#.", ".........", "........#"]);
        let distance = map.distance();
        for (c, found) in distance.iter().enumerate() {
            let brute = map.cells().map(|q| map.grid.middle(c).distance(map.grid.middle(q))).fold(f64::MAX, f64::min);
            assert!((f64::from(*found) - brute).abs() < 1e-5, "cell {c}: {found} for {brute}");
        }
        assert!(map.grid.none().distance().iter().all(|d| d.is_infinite()));
    }

    #[test]
    fn closing_shuts_a_narrow_gap_and_keeps_a_door() {
        let map = map(&["..................", "####..####.....###", ".................."]);
        let closed = map.closed(2.0);
        let text: String = (0..18).map(|x| if closed.on[18 + x] { '#' } else { '.' }).collect();
        assert_eq!(text, "##########.....###");
    }

    #[test]
    fn parts_share_sides_not_corners() {
        let map = map(&["##..", "..##", "...."]);
        assert_eq!(map.parts().len(), 2);
        assert_eq!(map.clone().without_specks(2.5).count(), 0);
        let mut seeds = map.grid.none();
        seeds.on[6] = true;
        assert_eq!(map.flooded_from(&seeds).count(), 2);
    }
}
