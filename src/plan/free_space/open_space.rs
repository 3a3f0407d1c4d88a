//! The region that sight can cross: triangulated once, then asked where a point lies and what it sees.

use super::cells::Cells;
use super::noding;
use super::polygon::{Polygon, PolygonError, checked};
use super::predicates::orient;
use super::triangulation::{Triangle, WALL, triangulate};
use crate::lists::Lists;
use glam::DVec2;
use smallvec::SmallVec;

/// Open space: polygons with holes, cut into triangles. Its border belongs to it.
///
/// ```
/// use clerestory::plan::free_space::open_space::OpenSpace;
/// use clerestory::plan::free_space::polygon::Polygon;
/// use glam::dvec2;
///
/// let square = vec![dvec2(0.0, 0.0), dvec2(2.0, 0.0), dvec2(2.0, 2.0), dvec2(0.0, 2.0)];
/// let open = OpenSpace::new(&[Polygon { outer: square, holes: vec![] }])?;
/// let seen = open.visibility(dvec2(0.5, 0.5)).expect("is inside");
/// assert_eq!(seen.area(), 4.0);
/// assert!(open.sees(dvec2(0.0, 0.0), dvec2(2.0, 2.0)));
/// # Ok::<(), clerestory::plan::free_space::polygon::PolygonError>(())
/// ```
#[derive(Clone, Debug)]
pub struct OpenSpace {
    pub(crate) corners: Vec<DVec2>,
    pub(crate) triangles: Vec<Triangle>,
    /// Triangles around each corner.
    around: Lists,
    bounds: [DVec2; 2],
    cells: Cells,
    polygons: Vec<Polygon>,
    area: f64,
    altered: bool,
}

/// Where in the triangulation a point lies, exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Location {
    /// Strictly inside a triangle.
    Inside(u32),
    /// Inside the edge opposite a triangle's corner of that number.
    Edge(u32, usize),
    /// On a corner.
    Corner(u32),
}

impl OpenSpace {
    /// Cuts the union of the polygons, each less its holes, into triangles.
    ///
    /// Rings that neither cross nor overlap are taken as they are, to the last bit; else all rings are cut at their
    /// crossings on a grid of about 2⁻²¹ of the extent ([`OpenSpace::altered`] then says so). Errors: no polygon, a
    /// ring of fewer than three points, a coordinate that is not finite or beyond ±10¹², nothing inside.
    pub fn new(polygons: &[Polygon]) -> Result<Self, PolygonError> {
        let given = checked(polygons)?;
        if let Ok(triangulation) = triangulate(&given) {
            return Ok(Self::from_triangles(triangulation, given, false));
        }
        let clean = checked(&noding::resolve(&given)).map_err(|_| PolygonError::NoInside)?;
        Ok(Self::from_triangles(triangulate(&clean)?, clean, true))
    }

    fn from_triangles(
        (corners, triangles): (Vec<DVec2>, Vec<Triangle>),
        polygons: Vec<Polygon>,
        altered: bool,
    ) -> Self {
        let fans = || (0u32..).zip(&triangles).flat_map(|(t, triangle)| triangle.corners.map(|c| (c, t)));
        let around = Lists::of(corners.len(), fans);
        let low = corners.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let bounds = [low, corners.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max)];
        let cells = by_cell(&corners, &triangles, bounds);
        let twice = |t: &Triangle| {
            orient(corners[t.corners[0] as usize], corners[t.corners[1] as usize], corners[t.corners[2] as usize])
        };
        let area = triangles.iter().map(twice).sum::<f64>() / 2.0;
        Self { corners, triangles, around, bounds, cells, polygons, area, altered }
    }

    /// The area of all of it, in square units.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Whether rings had to be cut at crossings, so that corners may lie elsewhere than given (by 2⁻²¹ of the extent).
    pub fn altered(&self) -> bool {
        self.altered
    }

    /// The polygons in use: those given, or what noding made of them.
    pub fn polygons(&self) -> &[Polygon] {
        &self.polygons
    }

    /// All corners of the rings, each once.
    pub fn corners(&self) -> &[DVec2] {
        &self.corners
    }

    /// Whether a point lies inside or on the border: exact.
    pub fn contains(&self, p: DVec2) -> bool {
        self.locate(p).is_some()
    }

    /// Lowest and highest coordinates.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        self.bounds.into()
    }

    /// The longer side of its bounds.
    pub(crate) fn extent(&self) -> f64 {
        (self.bounds[1] - self.bounds[0]).max_element()
    }

    /// The point itself if it lies inside, else the nearest found a hair (10⁻¹² of the extent) inside a wall that is
    /// no further than 10⁻⁹ of the extent; for points that were constructed on a wall and rounded out of it.
    pub fn pulled_in(&self, p: DVec2) -> Option<DVec2> {
        if self.contains(p) {
            return Some(p);
        }
        let extent = self.extent();
        let near = |&[a, b, c]: &[DVec2; 3]| {
            [(a, b), (b, c), (c, a)].into_iter().all(|(a, b)| orient(a, b, p) >= -extent * 1e-9 * a.distance(b))
        };
        let triangles = self.cells.get(self.cells.xy(p)).iter().map(|&t| self.points(t)).filter(near);
        triangles
            .flat_map(|[a, b, c]| {
                let inwards = ((a + b + c) / 3.0 - p).normalize_or_zero();
                [1e-12, 1e-11].map(|hair| p + inwards * (extent * hair))
            })
            .find(|pulled| self.contains(*pulled))
    }

    /// Where a point lies, exactly; `None` outside.
    pub(crate) fn locate(&self, p: DVec2) -> Option<Location> {
        let [low, high] = self.bounds;
        if !(p.cmpge(low).all() && p.cmple(high).all()) {
            return None;
        }
        for &t in self.cells.get(self.cells.xy(p)) {
            let [a, b, c] = self.points(t);
            let sides = [orient(b, c, p), orient(c, a, p), orient(a, b, p)];
            if sides.iter().any(|&s| s < 0.0) {
                continue;
            }
            let on = sides.map(|s| s == 0.0);
            return Some(match on {
                [false, false, false] => Location::Inside(t),
                [true, false, false] => Location::Edge(t, 0),
                [false, true, false] => Location::Edge(t, 1),
                [false, false, true] => Location::Edge(t, 2),
                // the corner shared by the two edges it lies on
                [false, ..] => Location::Corner(self.triangles[t as usize].corners[0]),
                [_, false, _] => Location::Corner(self.triangles[t as usize].corners[1]),
                _ => Location::Corner(self.triangles[t as usize].corners[2]),
            });
        }
        None
    }

    #[inline]
    pub(crate) fn points(&self, t: u32) -> [DVec2; 3] {
        self.triangles[t as usize].corners.map(|c| self.corners[c as usize])
    }

    /// Triangles around a corner, in no order.
    pub(crate) fn fan(&self, corner: u32) -> &[u32] {
        self.around.get(corner as usize)
    }

    /// The triangles a place belongs to: one, two or a fan.
    pub(crate) fn triangles_at(&self, place: Location) -> SmallVec<[u32; 8]> {
        match place {
            Location::Inside(t) => SmallVec::from_iter([t]),
            Location::Edge(t, i) => {
                [t, self.triangles[t as usize].across[i]].into_iter().filter(|t| *t != WALL).collect()
            }
            Location::Corner(v) => SmallVec::from_slice(self.fan(v)),
        }
    }
}

/// Triangles by the cells that they may touch.
fn by_cell(corners: &[DVec2], triangles: &[Triangle], [low, high]: [DVec2; 2]) -> Cells {
    let extent = (high - low).max(DVec2::splat(f64::MIN_POSITIVE));
    // about two cells a triangle, as square as the extent allows
    let count = (2 * triangles.len()).clamp(1, 1 << 22) as f64;
    let wide = (count * extent.x / extent.y).sqrt().clamp(1.0, count).ceil();
    let size = [wide as usize, ((count / wide).ceil() as usize).max(1)];
    Cells::new(low, extent, size, |cells, add| {
        for (t, triangle) in (0..).zip(triangles) {
            let points @ [a, b, c] = triangle.corners.map(|c| corners[c as usize]);
            let touching = cells.within(a.min(b).min(c), a.max(b).max(c)).filter(|cell| touches(cells, *cell, points));
            touching.for_each(|cell| add(cell, t));
        }
    })
}

/// Whether a triangle may touch a cell: never a false no, since cells are grown a little.
fn touches(cells: &Cells, [x, y]: [usize; 2], [a, b, c]: [DVec2; 3]) -> bool {
    let half = 0.5 / cells.per_unit;
    let centre = cells.low + (DVec2::new(x as f64, y as f64) + 0.5) / cells.per_unit;
    let out = |a: DVec2, b: DVec2| {
        let normal = DVec2::new(a.y - b.y, b.x - a.x);
        normal.dot(centre - a) + 1.01 * half.dot(normal.abs()) < 0.0
    };
    !(out(a, b) || out(b, c) || out(c, a))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coordinate_too_small_for_the_triangulation_counts_as_nought() {
        let outer = [(0.0, 1e-60), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(DVec2::from).to_vec();
        let open = OpenSpace::new(&[Polygon { outer, holes: vec![] }]).unwrap();
        assert!((open.area() - 4.0).abs() < 1e-9, "{}", open.area());
    }
}
