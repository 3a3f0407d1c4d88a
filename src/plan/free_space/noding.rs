//! Makes clean polygons of dirty ones: crossing, overlapping, touching and doubled rings. The only door to `i_overlay`.

use super::polygon::{Polygon, Ring};
use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;

type Contour = Vec<[f64; 2]>;
type Shape = Vec<Contour>;

const NOTHING: Vec<Shape> = Vec::new();

/// The union of the polygons, each less its holes, as polygons whose rings do not cross. A ring that crosses itself
/// holds what is enclosed an odd number of times.
///
/// Points are first rounded to a grid of about 2⁻²¹ of the extent (0.1 mm in a hall of 200 m): noding on a much
/// finer grid than the input's errors makes slivers, and takes for ever.
pub(crate) fn resolve(polygons: &[Polygon]) -> Vec<Polygon> {
    let grid = grid_of(polygons);
    let clean = |ring: &Ring| {
        vec![rounded(&contour(ring), grid)].overlay_as::<i64>(&NOTHING, OverlayRule::Subject, FillRule::EvenOdd)
    };
    let mut all: Vec<Shape> = Vec::new();
    for polygon in polygons {
        let holes = polygon.holes.iter().flat_map(clean).collect();
        let outer = clean(&polygon.outer);
        all.extend(outer.overlay_as::<i64>(&union(holes), OverlayRule::Difference, FillRule::EvenOdd));
    }
    // what comes out is rounded again, so that crossings lie on the grid too, and noded again, since that moves them
    let all = union(all).iter().map(|shape| shape.iter().map(|c| rounded(c, grid)).collect()).collect();
    union(all).into_iter().filter_map(polygon_of).collect()
}

/// What is left of polygons when others are taken away; its rings turn left, and right about holes.
pub(crate) fn less(polygons: &[Polygon], taken: &[Polygon]) -> Vec<Polygon> {
    let shapes = |polygons: &[Polygon]| polygons.iter().map(shape_of).collect::<Vec<Shape>>();
    let taken = union(shapes(taken));
    let left = shapes(polygons).overlay_as::<i64>(&taken, OverlayRule::Difference, FillRule::NonZero);
    left.into_iter().filter_map(polygon_of).collect()
}

/// The union of shapes whose outer contours turn left and whose holes turn right.
fn union(shapes: Vec<Shape>) -> Vec<Shape> {
    shapes.overlay_as::<i64>(&NOTHING, OverlayRule::Subject, FillRule::NonZero)
}

fn grid_of(polygons: &[Polygon]) -> f64 {
    let points = || polygons.iter().flat_map(Polygon::rings).flatten();
    let low = points().copied().fold(DVec2::INFINITY, DVec2::min);
    let high = points().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    let extent = (high - low).max_element().max(f64::MIN_POSITIVE);
    (extent.log2().ceil() - 21.0).exp2()
}

fn contour(ring: &[DVec2]) -> Contour {
    ring.iter().map(DVec2::to_array).collect()
}

fn rounded(contour: &[[f64; 2]], grid: f64) -> Contour {
    contour.iter().map(|p| p.map(|v| (v / grid).round() * grid)).collect()
}

/// A polygon's border turned left, its holes right.
fn shape_of(polygon: &Polygon) -> Shape {
    let turned = |(ring, inside_left): (&Ring, bool)| {
        let mut contour = contour(ring);
        if !inside_left {
            contour.reverse();
        }
        contour
    };
    polygon.sided_rings().map(turned).collect()
}

fn polygon_of(shape: Shape) -> Option<Polygon> {
    let mut rings = shape.into_iter().map(|c| c.into_iter().map(DVec2::from).collect::<Ring>());
    Some(Polygon { outer: rings.next()?, holes: rings.collect() })
}
