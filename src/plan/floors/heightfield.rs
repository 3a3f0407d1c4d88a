//! The model as columns of solid spans, as Recast voxelises it (M. Mononen, *Recast & Detour*, 2009), but with true
//! heights instead of rounded ones.
//!
//! A triangle fills every cell it touches in plan, from its lowest to its highest point over that cell. Cracks narrower
//! than a cell are closed that way, a missing triangle leaves a hole, and doubled walls melt into one.

use glam::Vec3;
use rayon::prelude::*;

use super::raster::Grid;
use crate::lists::Lists;
use crate::scene::Mesh;

/// Spans of one column nearer than this are one, metres.
const JOIN_M: f32 = 0.02;
/// A span's top can be walked on if a triangle so flat lies within this of it, metres.
const TOP_M: f32 = 0.05;
/// Triangles in one task.
const CHUNK: usize = 512;

/// Solid heights in one column.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Span {
    /// Lowest point, local metres.
    pub(crate) low: f32,
    /// Highest point, local metres.
    pub(crate) high: f32,
    /// What the steepest thing at its top allows.
    pub(crate) top: Top,
}

/// How steep a surface is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Top {
    /// Steeper than 45°.
    #[default]
    Steep,
    /// A ramp.
    Sloped,
    /// Within 10° of level.
    Level,
}

impl Top {
    fn of([a, b, c]: [Vec3; 3]) -> Self {
        match (b - a).cross(c - a).normalize_or_zero().z.abs() {
            n if n >= 0.985 => Self::Level,
            n if n >= 0.707 => Self::Sloped,
            _ => Self::Steep,
        }
    }
}

/// All columns.
pub(crate) struct Heightfield {
    pub(crate) grid: Grid,
    columns: Lists<Span>,
}

impl Heightfield {
    /// Fills the columns with a mesh's triangles.
    pub(crate) fn new(mesh: &Mesh, grid: Grid) -> Self {
        let triangles: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let pieces: Vec<Vec<(u32, Span)>> = triangles
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut out = Vec::new();
                chunk.iter().for_each(|t| fill(mesh.corners(*t), &grid, &mut out));
                out
            })
            .collect();
        let all = Lists::of(grid.len(), || pieces.iter().flatten().copied());
        let merged: Vec<Vec<Span>> = (0..grid.len()).into_par_iter().map(|cell| merge(all.get(cell))).collect();
        let mut columns = Lists::default();
        merged.iter().for_each(|column| columns.push(column));
        Self { grid, columns }
    }

    /// A column's spans from below, apart from each other.
    pub(crate) fn column(&self, cell: usize) -> &[Span] {
        self.columns.get(cell)
    }

    /// Whether anything solid lies between two heights of a column.
    pub(crate) fn solid(&self, cell: usize, low: f32, high: f32) -> bool {
        self.column(cell).iter().any(|s| s.low <= high && s.high >= low)
    }

    /// The highest solid point below a height.
    pub(crate) fn ground(&self, cell: usize, below: f32) -> Option<f32> {
        self.column(cell).iter().rev().map(|s| s.high).find(|h| *h < below)
    }
}

/// Spans in order, those that meet made one.
fn merge(column: &[Span]) -> Vec<Span> {
    let mut sorted = column.to_vec();
    sorted.sort_by(|a, b| a.low.total_cmp(&b.low).then(a.high.total_cmp(&b.high)).then(a.top.cmp(&b.top)));
    let mut out: Vec<Span> = Vec::new();
    for span in sorted {
        match out.last_mut() {
            Some(last) if span.low <= last.high + JOIN_M => {
                last.top = match span.high - last.high {
                    d if d > TOP_M => span.top,
                    d if d < -TOP_M => last.top,
                    _ => span.top.max(last.top),
                };
                last.high = last.high.max(span.high);
            }
            _ => out.push(span),
        }
    }
    out
}

/// The pieces of a triangle over each cell it touches.
fn fill(corners: [Vec3; 3], grid: &Grid, out: &mut Vec<(u32, Span)>) {
    let top = Top::of(corners);
    let bounds = |axis: usize, p: &[Vec3]| {
        p.iter().fold((f32::MAX, f32::MIN), |(low, high), v| (low.min(v[axis]), high.max(v[axis])))
    };
    let (south, north) = bounds(1, &corners);
    let (mut row, mut piece, mut spare) = (Vec::new(), Vec::new(), Vec::new());
    for y in grid.range(south, north, 1) {
        let (low, high) = grid.corners(0, y);
        cut(&corners, 1, low.y, high.y, &mut spare, &mut row);
        if row.is_empty() {
            continue;
        }
        let (west, east) = bounds(0, &row);
        for x in grid.range(west, east, 0) {
            let (low, high) = grid.corners(x, y);
            cut(&row, 0, low.x, high.x, &mut spare, &mut piece);
            if !piece.is_empty() {
                let (low, high) = bounds(2, &piece);
                out.push(((y * grid.width + x) as u32, Span { low, high, top }));
            }
        }
    }
}

/// The part of a convex polygon between two values of a coordinate (Sutherland and Hodgman), into `out`.
fn cut(polygon: &[Vec3], axis: usize, low: f32, high: f32, spare: &mut Vec<Vec3>, out: &mut Vec<Vec3>) {
    half(polygon, axis, low, 1.0, spare);
    half(spare, axis, high, -1.0, out);
}

fn half(polygon: &[Vec3], axis: usize, at: f32, sign: f32, out: &mut Vec<Vec3>) {
    out.clear();
    let Some(&last) = polygon.last() else { return };
    let mut from = last;
    let side = |p: Vec3| (p[axis] - at) * sign;
    for &to in polygon {
        let (a, b) = (side(from), side(to));
        if (a < 0.0) != (b < 0.0) {
            out.push(from + (to - from) * (a / (a - b)));
        }
        if b >= 0.0 {
            out.push(to);
        }
        from = to;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::triangles;
    use glam::DVec2;

    fn columns(all: &[[Vec3; 3]]) -> Heightfield {
        Heightfield::new(&triangles(all), Grid::covering(DVec2::ZERO, DVec2::splat(4.0), 0.5, 1000))
    }

    #[test]
    fn a_slope_has_its_own_heights_in_each_column_and_a_wall_is_one_span() {
        let p = Vec3::new;
        let ramp = [p(0.0, 0.0, 0.0), p(4.0, 0.0, 2.0), p(0.0, 4.0, 0.0)];
        let wall = [
            [p(2.1, 0.0, 0.0), p(2.1, 4.0, 0.0), p(2.1, 4.0, 3.0)],
            [p(2.1, 0.0, 0.0), p(2.1, 4.0, 3.0), p(2.1, 0.0, 3.0)],
        ];
        let c = columns(&[ramp]);
        let at = |x: f64, y: f64| c.grid.cell(DVec2::new(x, y)).unwrap();
        let [span] = c.column(at(1.25, 0.25)) else { panic!() };
        assert!((span.low - 0.5).abs() < 1e-5 && (span.high - 0.75).abs() < 1e-5 && span.top == Top::Sloped);
        assert!(c.column(at(3.75, 3.75)).is_empty());
        let c = columns(&[ramp, wall[0], wall[1]]);
        let [span] = c.column(at(2.1, 0.7)) else { panic!() };
        assert!(span.high == 3.0 && span.top == Top::Steep && c.solid(at(2.1, 0.7), 1.5, 1.6));
    }

    /// Every cell that the triangle touches is filled: no ray can slip between two walls that share an edge.
    #[test]
    fn area_is_that_of_the_triangle_and_its_rim() {
        let p = Vec3::new;
        let c = columns(&[[p(0.1, 0.1, 1.0), p(3.9, 0.2, 1.0), p(1.3, 3.8, 1.0)]]);
        let filled = (0..c.grid.len()).filter(|cell| !c.column(*cell).is_empty()).count() as f64 * 0.25;
        assert!(filled > 6.8 && filled < 6.8 + 11.0 * 0.5, "{filled}");
    }
}
