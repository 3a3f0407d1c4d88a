//! Outlines of pixel regions, in shares of a picture's width and height.

use glam::DVec2;

use crate::plan::floors::raster::{Grid, Map};
use crate::plan::free_space::contour::polygons;
use crate::plan::free_space::polygon::Polygon;
use crate::report::Point;

/// An outline is off by no more than this, cells: with more, a mark of one cell would lose a corner.
const SLACK: f64 = 0.7;

/// A mask brought to fewer cells, rows from the top, with a border of cells outside the picture.
pub(super) struct Cells(Map);

impl Cells {
    /// At most `most` cells along a picture's longer side: a cell is inside where at least half of its pixels are.
    pub(super) fn of(size: [u32; 2], most: usize, inside: impl Fn(usize) -> bool) -> Self {
        let [width, height] = size.map(|side| side as usize);
        let step = width.max(height).div_ceil(most).max(1);
        let (w, h) = (width.div_ceil(step), height.div_ceil(step));
        let cell = |x: usize, y: usize| {
            let (x0, y0) = (x * step, y * step);
            let (x1, y1) = ((x0 + step).min(width), (y0 + step).min(height));
            let pixels = (y0..y1).flat_map(|y| (x0..x1).map(move |x| y * width + x));
            2 * pixels.filter(|i| inside(*i)).count() >= (x1 - x0) * (y1 - y0)
        };
        let grid = Grid { low: DVec2::NEG_ONE, cell_m: 1.0, width: w + 2, height: h + 2 };
        Self(Map::of(grid, |i| {
            let (x, y) = (i % (w + 2), i / (w + 2));
            (1..=w).contains(&x) && (1..=h).contains(&y) && cell(x - 1, y - 1)
        }))
    }

    fn share(&self, at: DVec2) -> Point {
        let Grid { width, height, .. } = self.0.grid;
        [at.x / (width - 2) as f64, at.y / (height - 2) as f64]
    }

    /// Rings that enclose what is inside, by the even-odd rule.
    pub(super) fn rings(&self) -> Vec<Vec<Point>> {
        let outlines = polygons(&self.0, SLACK);
        let rings = outlines.iter().flat_map(Polygon::rings);
        rings.map(|ring| ring.iter().map(|at| self.share(*at)).collect()).collect()
    }

    /// A place well inside the region: the middle of the cell that is farthest from the outside.
    pub(super) fn middle(&self) -> Option<Point> {
        let depth = self.0.inverted().distance();
        let deepest = self.0.cells().max_by(|a, b| depth[*a].total_cmp(&depth[*b]).then(b.cmp(a)))?;
        Some(self.share(self.0.grid.middle(deepest)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area by the even-odd rule of rings that do not cross, holes after what they are holes of.
    fn area(rings: &[Vec<Point>]) -> f64 {
        let ring = |r: &Vec<Point>| {
            (0..r.len()).map(|i| (r[i], r[(i + 1) % r.len()])).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
                / 2.0
        };
        rings.iter().map(ring).sum()
    }

    #[test]
    fn rings_enclose_what_is_inside() {
        // a frame with a hole, cells that touch at a corner, and one alone
        let picture = ["######....", "#....#..#.", "#....#.#..", "######....", "..........", "##########"];
        let inside: Vec<bool> = picture.concat().chars().map(|c| c == '#').collect();
        let cells = Cells::of([10, 6], 100, |i| inside[i]);
        let count = inside.iter().filter(|i| **i).count() as f64;
        assert!((area(&cells.rings()) * 60.0 - count).abs() < 1e-9);
        let disc = Cells::of([400, 300], 100, |i| {
            let (x, y) = ((i % 400) as f64 - 200.0, (i / 400) as f64 - 150.0);
            x.hypot(y) < 100.0
        });
        let rings = disc.rings();
        assert!(rings.len() == 1 && rings[0].len() < 60, "{} rings, {} corners", rings.len(), rings[0].len());
        let expected = std::f64::consts::PI * 1e4 / 12e4;
        assert!((area(&rings) / expected - 1.0).abs() < 0.05);
        let [x, y] = disc.middle().unwrap();
        assert!((x - 0.5).abs() < 0.03 && (y - 0.5).abs() < 0.03);
        let none = Cells::of([4, 4], 4, |_| false);
        assert!(none.rings().is_empty() && none.middle().is_none());
        // the frame is the picture's end: a region along it is deepest half a cell from there at most
        assert_eq!(Cells::of([3, 3], 3, |_| true).middle(), Some([0.5, 0.5]));
    }
}
