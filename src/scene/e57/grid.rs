//! A setup's points by row and column, and the mesh over them, broken where the scanner looked past an edge.
//!
//! Neighbours on one surface differ little in range, unless the surface is seen at a glancing angle; then the inverse of the
//! range still changes evenly from point to point, as it does along any plane. Where neither holds there is a jump.

use glam::{DMat3, DVec3, Vec3};

use super::raster::Extent;

/// A point in the scanner's own axes, metres, and the row and column that it was taken in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) place: [i32; 2],
    pub(super) local: Vec3,
}

/// A raster of points.
#[derive(Debug)]
pub(super) struct Grid {
    rows: usize,
    /// Of a scan all round one more than it has: the last is the first again.
    columns: usize,
    /// Index into the points by row and column; [`NONE`] where there is no point.
    index: Vec<u32>,
    /// In the scanner's own axes.
    points: Vec<Vec3>,
    /// The scan's row and column of each point.
    places: Vec<[i32; 2]>,
}

const NONE: u32 = u32::MAX;

/// Tangents of the angles of incidence up to which neighbours belong together by range alone, and by even change.
const PLAIN: f32 = 1.5;
const GLANCING: f32 = 28.6;

/// Jumps up to this depth, metres, are closed: a frame's side or a step's edge rather than a gap before something else.
const SHALLOW: f32 = 0.03;

impl Grid {
    /// Sorts points of every `step`th row and column into a raster; of several in one place the nearest stays. A whole turn
    /// has `turn` of the scan's columns.
    ///
    /// # Errors
    ///
    /// As [`Extent::of`].
    pub(super) fn of(cells: &[Cell], step: i64, turn: i64) -> Result<Self, String> {
        let extent = Extent::of(cells.iter().map(|c| c.place), step)?;
        let [rows, columns] = extent.size;
        let mut grid =
            Self { rows, columns, index: vec![NONE; rows * columns], points: Vec::new(), places: Vec::new() };
        for cell in cells {
            let index = &mut grid.index[extent.index(cell.place)];
            if *index == NONE {
                *index = grid.points.len() as u32;
                grid.points.push(cell.local);
                grid.places.push(cell.place);
            } else if cell.local.length_squared() < grid.points[*index as usize].length_squared() {
                grid.points[*index as usize] = cell.local;
            }
        }
        if grid.closes() {
            grid.close(turn);
        }
        Ok(grid)
    }

    /// Adds the first column once more after the last.
    fn close(&mut self, turn: i64) {
        let mut index = Vec::with_capacity(self.rows * (self.columns + 1));
        for row in self.index.chunks(self.columns) {
            index.extend_from_slice(row);
            index.push(if row[0] == NONE { NONE } else { self.points.len() as u32 });
            if row[0] != NONE {
                let [scan_row, column] = self.places[row[0] as usize];
                self.points.push(self.points[row[0] as usize]);
                self.places.push([scan_row, column.saturating_add(turn as i32)]);
            }
        }
        self.columns += 1;
        self.index = index;
    }

    /// All points, in the scanner's own axes.
    pub(super) fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// The scan's row and column of a point.
    pub(super) fn place(&self, index: u32) -> [i64; 2] {
        self.places[index as usize].map(i64::from)
    }

    /// Triangles over the points, in their order.
    pub(super) fn triangles(&self) -> Vec<[u32; 3]> {
        let mut all = Vec::with_capacity(2 * self.points.len());
        for row in 0..self.rows as isize - 1 {
            for column in 0..self.columns as isize - 1 {
                let corners = [[row, column], [row, column + 1], [row + 1, column + 1], [row + 1, column]];
                let [a, b, c, d] = corners.map(|place| self.at(place));
                // the quad's sides
                let (above, below) = (self.joined(corners[0], [0, 1]), self.joined(corners[3], [0, 1]));
                let (left, right) = (self.joined(corners[0], [1, 0]), self.joined(corners[1], [1, 0]));
                let mut add = |corners: [Option<u32>; 3]| {
                    if let [Some(i), Some(j), Some(k)] = corners {
                        all.push([i, j, k]);
                    }
                };
                if (above && left) || (right && below) {
                    if above && left {
                        add([a, d, b]);
                    }
                    if right && below {
                        add([b, d, c]);
                    }
                } else if above && right {
                    add([a, c, b]);
                } else if left && below {
                    add([a, d, c]);
                }
            }
        }
        all
    }

    fn at(&self, [row, column]: [isize; 2]) -> Option<u32> {
        if !(0..self.rows as isize).contains(&row) || !(0..self.columns as isize).contains(&column) {
            return None;
        }
        Some(self.index[row as usize * self.columns + column as usize]).filter(|i| *i != NONE)
    }

    fn range(&self, index: u32) -> f32 {
        self.points[index as usize].length()
    }

    /// Whether there are two neighbours that lie on one surface: `from` is the first one's row and column, `step` leads to the
    /// second.
    fn joined(&self, from: [isize; 2], step: [isize; 2]) -> bool {
        /// Even change: at most so many times as much as from the neighbour before or to the one after.
        const EVEN: f32 = 1.6;
        let at = |steps: isize| self.at([0, 1].map(|axis| from[axis] + steps * step[axis]));
        let (Some(i), Some(j)) = (at(0), at(1)) else { return false };
        let (near, far) = (self.range(i).min(self.range(j)), self.range(i).max(self.range(j)));
        let [a, b] = [i, j].map(|i| self.points[i as usize].normalize());
        // what the angle between two rays makes of a plane at right angles to them
        let width = a.distance(b) * near;
        let slope = (far - near) / width.max(1e-9);
        if slope <= PLAIN || far - near <= SHALLOW {
            return true;
        }
        if slope > GLANCING {
            return false;
        }
        let inverse = |index: u32| 1.0 / self.range(index);
        let change = inverse(j) - inverse(i);
        let even = |other: f32| other * change > 0.0 && change.abs() <= EVEN * other.abs();
        let before = at(-1).map(|k| inverse(i) - inverse(k));
        let after = at(2).map(|k| inverse(k) - inverse(j));
        before.is_some_and(even) || after.is_some_and(even)
    }

    /// Whether the last column is the first one's neighbour, as of a scan all round.
    fn closes(&self) -> bool {
        let direction = |row: usize, column: usize| {
            let index = self.at([row as isize, column as isize])?;
            Some(self.points[index as usize].normalize())
        };
        let angle = |row: usize, a: usize, b: usize| Some(direction(row, a)?.distance(direction(row, b)?));
        if self.columns < 8 {
            return false;
        }
        let steps = (0..self.rows).flat_map(|row| {
            (0..self.columns - 1).step_by((self.columns / 16).max(1)).filter_map(move |c| angle(row, c, c + 1))
        });
        let gaps = (0..self.rows).filter_map(|row| angle(row, self.columns - 1, 0));
        match (crate::statistics::median(steps), crate::statistics::median(gaps)) {
            (Some(step), Some(gap)) => gap < 2.5 * step,
            _ => false,
        }
    }
}

/// Where a scanner or camera stood: from its own axes to the file's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    pub(super) position: DVec3,
    pub(super) rotation: DMat3,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scan of `rows` × `columns` over an elevation of ±60°, all round or over `width` radians, with ranges by direction.
    fn scan(rows: usize, columns: usize, width: f32, range: impl Fn(Vec3) -> Option<f32>) -> Grid {
        let mut cells = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let azimuth = width * (column as f32 + 0.5) / columns as f32;
                let elevation = 1.05 - 2.1 * (row as f32 + 0.5) / rows as f32;
                let direction =
                    Vec3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin());
                if let Some(range) = range(direction) {
                    cells.push(Cell { place: [row as i32, column as i32], local: direction * range });
                }
            }
        }
        Grid::of(&cells, 1, columns as i64).unwrap()
    }

    /// The range to the inside of a box around the scanner.
    fn to_walls(direction: Vec3, half: Vec3) -> f32 {
        (half / direction.abs()).min_element()
    }

    #[test]
    fn a_room_is_closed_all_round_and_its_floor_whole_to_the_walls() {
        // 20 m long, 1.5 m to the floor: seen at 8.5° above it at the far end
        let half = Vec3::new(10.0, 3.0, 1.5);
        let grid = scan(60, 180, 2.0 * std::f32::consts::PI, |d| Some(to_walls(d, half)));
        assert_eq!((grid.columns, grid.place(60 * 180)), (181, [0, 180]));
        assert_eq!(grid.triangles().len(), 2 * 59 * 180);
        // a part of a turn does not close
        assert_eq!(scan(60, 180, 6.0, |d| Some(to_walls(d, half))).columns, 180);
    }

    #[test]
    fn a_column_stands_free_of_the_wall_behind_it() {
        let half = Vec3::new(6.0, 5.0, 4.0);
        let column = |d: Vec3| if d.y.atan2(d.x).abs() < 0.1 { Some(2.0 / d.x.hypot(d.y)) } else { None };
        let grid = scan(60, 360, 2.0 * std::f32::consts::PI, |d| Some(column(d).unwrap_or(to_walls(d, half))));
        let local = |i: u32| grid.points[i as usize];
        let is_on_column = |i: u32| local(i).x.hypot(local(i).y) < 2.1;
        let triangles = grid.triangles();
        let bridges = triangles.iter().filter(|t| {
            let on = t.iter().filter(|i| is_on_column(**i)).count();
            on == 1 || on == 2
        });
        assert_eq!(bridges.count(), 0);
        // both are whole but for the seam
        assert!(triangles.len() > 2 * 59 * 360 - 4 * 60, "{}", triangles.len());
    }
}
