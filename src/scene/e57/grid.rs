//! A setup's points by row and column, and the mesh over them, broken where the scanner looked past an edge.
//!
//! Neighbours on one surface differ little in range, unless the surface is seen at a glancing angle; then the inverse of the
//! range still changes evenly from point to point, as it does along any plane. Where neither holds there is a jump.

use glam::{DMat3, DVec3, Vec3};

use crate::memory;

/// A point in the scanner's own axes, metres, and where in its raster it was taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) row: i64,
    pub(super) column: i64,
    pub(super) local: Vec3,
    /// 0 to 1.
    pub(super) colour: Vec3,
}

/// A raster of points.
#[derive(Debug)]
pub(super) struct Grid {
    rows: usize,
    columns: usize,
    /// Index into `points` by row and column; [`NONE`] where there is no point.
    index: Vec<u32>,
    /// In the scanner's own axes.
    points: Vec<Vec3>,
    /// In 65,535ths, to need little memory.
    colours: Vec<[u16; 3]>,
}

const NONE: u32 = u32::MAX;

/// Tangents of the angles of incidence up to which neighbours belong together by range alone, and by even change.
const PLAIN: f32 = 1.5;
const GLANCING: f32 = 28.6;

/// Jumps up to this depth, metres, are closed: a frame's side or a step's edge rather than a gap before something else.
const SHALLOW: f32 = 0.03;

impl Grid {
    /// Sorts points into a raster; of several in one place the nearest stays.
    ///
    /// # Errors
    ///
    /// Rows and columns so far apart that the raster is all but empty.
    pub(super) fn of(cells: Vec<Cell>) -> Result<Self, String> {
        let range = |of: fn(&Cell) -> i64| {
            let low = cells.iter().map(of).min().unwrap_or(0);
            let high = cells.iter().map(of).max().unwrap_or(-1);
            (low, (high as i128 - low as i128 + 1) as usize)
        };
        let ((row, rows), (column, columns)) = (range(|c| c.row), range(|c| c.column));
        let room = cells.len().saturating_mul(64).saturating_add(1 << 16);
        if rows.checked_mul(columns).is_none_or(|all| all > room) || cells.len() >= NONE as usize {
            return Err(format!(
                "a scan of {} points has {rows} rows and {columns} columns: they are numbered wrongly. Export it again",
                cells.len()
            ));
        }
        memory::check(4 * (rows * columns) as u64).map_err(|over| over.to_string())?;
        let index = vec![NONE; rows * columns];
        let mut grid = Self { rows, columns, index, points: Vec::new(), colours: Vec::new() };
        for cell in cells {
            let place = &mut grid.index[(cell.row - row) as usize * columns + (cell.column - column) as usize];
            let colour = (65_535.0 * cell.colour).round().as_u16vec3().to_array();
            if *place == NONE {
                *place = grid.points.len() as u32;
                grid.points.push(cell.local);
                grid.colours.push(colour);
            } else if cell.local.length_squared() < grid.points[*place as usize].length_squared() {
                grid.points[*place as usize] = cell.local;
                grid.colours[*place as usize] = colour;
            }
        }
        Ok(grid)
    }

    /// All points, in the scanner's own axes.
    pub(super) fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// A point's colour, 0 to 1.
    pub(super) fn colour(&self, index: u32) -> Vec3 {
        Vec3::from_array(self.colours[index as usize].map(f32::from)) / 65_535.0
    }

    /// Triangles over the points, in their order.
    pub(super) fn triangles(&self) -> Vec<[u32; 3]> {
        let closed = self.closes();
        let last = if closed { self.columns } else { self.columns.saturating_sub(1) };
        let mut all = Vec::with_capacity(2 * self.points.len());
        for row in 0..self.rows.saturating_sub(1) {
            for column in 0..last {
                let next = column + 1;
                let at = |r: usize, c: usize| self.at(r as isize, c as isize, closed);
                let [a, b, c, d] = [at(row, column), at(row, next), at(row + 1, next), at(row + 1, column)];
                // the quad's sides: above, right, below, left
                let joined = |one: Option<u32>, other: Option<u32>, step: [isize; 2], from: [usize; 2]| {
                    one.zip(other).is_some_and(|(i, j)| self.joined(i, j, from, step, closed))
                };
                let above = joined(a, b, [0, 1], [row, column]);
                let right = joined(b, c, [1, 0], [row, next]);
                let below = joined(d, c, [0, 1], [row + 1, column]);
                let left = joined(a, d, [1, 0], [row, column]);
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

    fn at(&self, row: isize, column: isize, closed: bool) -> Option<u32> {
        let columns = self.columns as isize;
        let column = if closed { column.rem_euclid(columns) } else { column };
        if !(0..self.rows as isize).contains(&row) || !(0..columns).contains(&column) {
            return None;
        }
        Some(self.index[row as usize * self.columns + column as usize]).filter(|i| *i != NONE)
    }

    fn range(&self, index: u32) -> f32 {
        self.points[index as usize].length()
    }

    /// Whether two neighbours lie on one surface: `from` is the first one's row and column, `step` leads to the second.
    fn joined(&self, i: u32, j: u32, from: [usize; 2], step: [isize; 2], closed: bool) -> bool {
        /// Even change: at most so many times as much as from the neighbour before or to the one after.
        const EVEN: f32 = 1.6;
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
        let [row, column] = from.map(|v| v as isize);
        let before = self.at(row - step[0], column - step[1], closed).map(|k| inverse(i) - inverse(k));
        let after = self.at(row + 2 * step[0], column + 2 * step[1], closed).map(|k| inverse(k) - inverse(j));
        before.is_some_and(even) || after.is_some_and(even)
    }

    /// Whether the last column is the first one's neighbour, as of a scan all round.
    fn closes(&self) -> bool {
        let direction = |row: usize, column: usize| {
            let index = self.at(row as isize, column as isize, false)?;
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
                    let (row, column) = (row as i64, column as i64);
                    cells.push(Cell { row, column, local: direction * range, colour: Vec3::ONE });
                }
            }
        }
        Grid::of(cells).unwrap()
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
        assert!(grid.closes());
        assert_eq!(grid.triangles().len(), 2 * 59 * 180);
        // a part of a turn does not close
        assert!(!scan(60, 180, 6.0, |d| Some(to_walls(d, half))).closes());
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

    #[test]
    fn rows_and_columns_that_make_no_raster_are_refused() {
        let cell = |row, column| Cell { row, column, local: Vec3::X, colour: Vec3::ONE };
        assert!(Grid::of(vec![cell(0, 0), cell(i64::MAX, i64::MAX)]).is_err());
        assert!(Grid::of(Vec::new()).unwrap().triangles().is_empty());
    }
}
