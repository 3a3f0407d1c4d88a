//! Section 4.2: the irradiance volume, one value a cell whatever its surfaces face, filled across walls.

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use super::mean::Mean;
use crate::volume::Grid;

/// Irradiance in the middle of every cell of a uniform grid.
pub struct Volume {
    grid: Grid,
    /// Per channel one value a cell; none where no record knows the channel.
    channels: [Option<Vec<f32>>; 3],
}

impl Volume {
    /// The paper's three steps, on each channel by itself: inject and average, fill, filter.
    pub fn build(grid: Grid, records: impl Iterator<Item = (Vec3, Vec3)>) -> Self {
        let averages = inject(&grid, records);
        let channels = [0, 1, 2].map(|c| {
            let mut cells: Vec<Option<f32>> = averages.iter().map(|mean| mean.channel(c)).collect();
            fill(&grid, &mut cells);
            let full: Option<Vec<f32>> = cells.into_iter().collect();
            full.map(|full| filter(&grid, &full))
        });
        Self { grid, channels }
    }

    /// Irradiance at a point (local metres), interpolated between the middles of the eight cells around it; 0 in a
    /// channel that no record knows, and `None` where that is all.
    pub fn irradiance(&self, point: Vec3) -> Option<Vec3> {
        let corners = self.corners(point);
        let value = |cells: &Option<Vec<f32>>| {
            cells.as_ref().map_or(0.0, |cells| corners.iter().map(|&(i, weight)| cells[i] * weight).sum())
        };
        let known = self.channels.iter().any(Option::is_some);
        known.then(|| Vec3::from_array(self.channels.each_ref().map(value)))
    }

    /// The eight cells whose middles surround a point, with trilinear weights; the rim's cell in place of one outside.
    fn corners(&self, point: Vec3) -> [(usize, f32); 8] {
        let place = self.grid.place(point) - 0.5;
        let (low, f) = (place.floor().as_ivec3(), place - place.floor());
        std::array::from_fn(|i| {
            let step = IVec3::new(i as i32 & 1, i as i32 >> 1 & 1, i as i32 >> 2);
            let cell = (low + step).clamp(IVec3::ZERO, self.grid.size - 1);
            let w = Vec3::select(step.cmpeq(IVec3::ONE), f, 1.0 - f);
            (self.grid.index(cell).unwrap_or(0), w.x * w.y * w.z)
        })
    }
}

/// Step 1: the irradiance of the records in each cell, to be averaged. In the records' order, so that sums are always
/// the same.
fn inject(grid: &Grid, records: impl Iterator<Item = (Vec3, Vec3)>) -> Vec<Mean> {
    let mut cells = vec![Mean::default(); grid.len()];
    for (position, irradiance) in records {
        if let Some(i) = grid.index(grid.cell(position)) {
            cells[i].add(irradiance);
        }
    }
    cells
}

/// Step 2: fills empty cells with the average of the full ones among their 26 neighbours, iteration by iteration. An
/// iteration reads only what the last one left, and visits only the front: the empty neighbours of cells that the last
/// one filled. Every cell is in the front once, so the cost grows with the number of cells, not with cells × iterations.
/// Cells stay empty only where all are.
fn fill(grid: &Grid, cells: &mut [Option<f32>]) {
    let mut queued: Vec<bool> = cells.iter().map(Option::is_some).collect();
    let full: Vec<usize> = (0..cells.len()).filter(|&i| queued[i]).collect();
    let mut front = front_of(grid, &full, &mut queued);
    while !front.is_empty() {
        let values: Vec<Option<f32>> = front.par_iter().map(|&i| neighbour_average(grid, cells, i)).collect();
        for (&i, value) in front.iter().zip(values) {
            cells[i] = value;
        }
        front = front_of(grid, &front, &mut queued);
    }
}

/// The neighbours of some cells that were never queued; queues them.
fn front_of(grid: &Grid, cells: &[usize], queued: &mut [bool]) -> Vec<usize> {
    let mut front = Vec::new();
    for j in cells.iter().flat_map(|&i| neighbours(grid, i)) {
        if !std::mem::replace(&mut queued[j], true) {
            front.push(j);
        }
    }
    front
}

fn neighbour_average(grid: &Grid, cells: &[Option<f32>], i: usize) -> Option<f32> {
    let (sum, count) =
        neighbours(grid, i).filter_map(|j| cells[j]).fold((0.0, 0u32), |(s, n), v| (s + f64::from(v), n + 1));
    (count > 0).then(|| (sum / f64::from(count)) as f32)
}

/// Step 3: each cell becomes the weighted mean of itself and its 26 neighbours. The paper weighs by “distance from each
/// cell's centre” and leaves the kernel open: here it falls linearly to zero two cell sides away (1 for the cell itself,
/// 0.5 across a face, 0.29 across an edge, 0.13 across a corner), which is nothing beyond those 26.
fn filter(grid: &Grid, cells: &[f32]) -> Vec<f32> {
    (0..cells.len())
        .into_par_iter()
        .map(|i| {
            let here = cell_of(grid, i);
            let mut sum = f64::from(cells[i]);
            let mut total = 1.0;
            for j in neighbours(grid, i) {
                let weight = f64::from(1.0 - 0.5 * (cell_of(grid, j) - here).as_vec3().length());
                sum += weight * f64::from(cells[j]);
                total += weight;
            }
            (sum / total) as f32
        })
        .collect()
}

/// The up to 26 cells that share a face, an edge or a corner with a cell.
fn neighbours(grid: &Grid, i: usize) -> impl Iterator<Item = usize> {
    let here = cell_of(grid, i);
    (0..27).filter(|&k| k != 13).filter_map(move |k| grid.index(here + IVec3::new(k % 3, k / 3 % 3, k / 9) - 1))
}

/// The cell of an index.
fn cell_of(grid: &Grid, i: usize) -> IVec3 {
    let i = i as i32;
    let IVec3 { x, y, .. } = grid.size;
    IVec3::new(i % x, i / x % y, i / (x * y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid(size: Vec3, along: u32) -> Grid {
        Grid::over(Vec3::ZERO, size, along)
    }

    /// The paper's words: at each iteration, every empty cell with a full neighbour takes the average.
    fn naive_fill(grid: &Grid, cells: &mut [Option<f32>]) {
        while cells.iter().any(Option::is_none) && cells.iter().any(Option::is_some) {
            let last = cells.to_vec();
            for (i, cell) in cells.iter_mut().enumerate().filter(|(_, c)| c.is_none()) {
                *cell = neighbour_average(grid, &last, i);
            }
        }
    }

    proptest! {
        #[test]
        fn fill_visits_the_front_alone_and_means_the_same(
            size in (0.5f32..2.0, 0.5f32..2.0, 0.5f32..2.0),
            along in 1u32..8,
            seeds in prop::collection::vec((any::<prop::sample::Index>(), 0.0f32..9.0), 0..6),
        ) {
            let grid = grid(size.into(), along);
            let mut cells = vec![None; grid.len()];
            for (at, value) in &seeds {
                cells[at.index(grid.len())] = Some(*value);
            }
            let mut naive = cells.clone();
            naive_fill(&grid, &mut naive);
            fill(&grid, &mut cells);
            prop_assert_eq!(&cells, &naive);
            prop_assert!(seeds.is_empty() || cells.iter().all(Option::is_some));
        }
    }

    #[test]
    fn an_iteration_reads_only_the_last_one() {
        // a row of cells: 4 at one end, 8 at the other; both fronts meet in the middle cell at once
        let grid = grid(Vec3::new(5.0, 1.0, 1.0), 5);
        assert_eq!(grid.size, IVec3::new(5, 1, 1));
        let mut cells = vec![Some(4.0), None, None, None, Some(8.0)];
        fill(&grid, &mut cells);
        assert_eq!(cells, [4.0, 4.0, 6.0, 8.0, 8.0].map(Some));
    }

    #[test]
    fn filling_nothing_ends() {
        let grid = grid(Vec3::ONE, 3);
        let mut cells = vec![None; grid.len()];
        fill(&grid, &mut cells);
        assert!(cells.iter().all(Option::is_none));
        assert!(Volume::build(grid, std::iter::empty()).irradiance(Vec3::ZERO).is_none());
    }

    #[test]
    fn filter_keeps_a_constant_and_weighs_by_distance() {
        let grid = grid(Vec3::ONE, 3);
        assert!(filter(&grid, &[2.5; 27]).iter().all(|v| (v - 2.5).abs() < 1e-6));
        let mut cells = [0.0; 27];
        cells[13] = 1.0;
        let out = filter(&grid, &cells);
        // the middle of a face has 17 neighbours: 5 across a face, 8 across an edge, 4 across a corner
        let (edge, corner) = (1.0 - 0.5 * 2f32.sqrt(), 1.0 - 0.5 * 3f32.sqrt());
        assert!((out[4] - 0.5 / (1.0 + 2.5 + 8.0 * edge + 4.0 * corner)).abs() < 1e-6);
        assert!((out[13] - 1.0 / (1.0 + 3.0 + 12.0 * edge + 8.0 * corner)).abs() < 1e-6);
    }

    #[test]
    fn looks_up_linearly_between_cell_middles() {
        let grid = grid(Vec3::new(4.0, 1.0, 1.0), 4);
        let channel = Some(vec![0.0, 1.0, 2.0, 3.0]);
        let volume = Volume { grid, channels: [channel.clone(), None, channel] };
        for x in [-1.0f32, 0.0, 0.5, 1.2, 2.9, 3.5, 7.0] {
            let e = volume.irradiance(Vec3::new(x, 0.3, 0.9)).unwrap();
            let want = (x - 0.5).clamp(0.0, 3.0);
            assert!((e - Vec3::new(want, 0.0, want)).length() < 1e-5, "{x}: {e}");
        }
    }

    #[test]
    fn injection_averages_a_cell() {
        let grid = grid(Vec3::new(2.0, 1.0, 1.0), 2);
        let records = [(0.1, 1.0), (0.9, 3.0), (1.5, 7.0)].map(|(x, e)| (Vec3::new(x, 0.5, 0.5), Vec3::splat(e)));
        let cells = inject(&grid, records.into_iter());
        assert_eq!([0, 1].map(|i| cells[i].channel(0)), [Some(2.0), Some(7.0)]);
    }
}
