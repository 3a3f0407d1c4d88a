//! On which side of a line a point lies: exact signs, and values good to the last few bits.

use glam::DVec2;
use robust::{Coord, orient2d};

/// Twice the signed area of the triangle `a b c`: positive when it turns left. The sign is exact.
///
/// Shewchuk, *Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates*, 1997: the rounded
/// determinant decides when it exceeds (3 + 16ε)ε times the sum of its products, else the adaptive one does. The first
/// test stands here, where it is inlined: behind a call, as `robust` has it, orientations take up to twice as long.
#[inline]
pub(crate) fn orient(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    const BOUND: f64 = 3.330_669_073_875_471_6e-16;
    let left = (a.x - c.x) * (b.y - c.y);
    let right = (a.y - c.y) * (b.x - c.x);
    let det = left - right;
    if det.abs() > BOUND * (left.abs() + right.abs()) { det } else { adaptive(a, b, c) }
}

#[cold]
fn adaptive(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// The same determinant in doubled precision, for constructing points: relative error a few ε even where the two
/// products nearly cancel.
fn orient_value(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let (ux, uy) = (difference(a.x, c.x), difference(a.y, c.y));
    let (vx, vy) = (difference(b.x, c.x), difference(b.y, c.y));
    let (p, q) = (product(ux, vy), product(uy, vx));
    let high = difference(p.0, q.0);
    high.0 + (high.1 + (p.1 - q.1))
}

/// a − b as a rounded value and its rounding error.
fn difference(a: f64, b: f64) -> (f64, f64) {
    let d = a - b;
    let bb = a - d;
    (d, (a - (d + bb)) + (bb - b))
}

/// The product of two doubled numbers, rounded, and most of its rounding error.
fn product(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    let p = a.0 * b.0;
    (p, a.0.mul_add(b.0, -p) + (a.0 * b.1 + a.1 * b.0))
}

/// Where the line through `from` and `through` meets the segment `a b`, whose ends lie on its two sides (or on it).
pub(crate) fn crossing(from: DVec2, through: DVec2, a: DVec2, b: DVec2) -> DVec2 {
    let (da, db) = (orient_value(from, through, a), orient_value(from, through, b));
    let span = da - db;
    if span == 0.0 {
        return b;
    }
    // measured from the nearer end, so that the ends themselves come out exact
    if da.abs() <= db.abs() { a + (b - a) * (da / span) } else { b + (a - b) * (-db / span) }
}
