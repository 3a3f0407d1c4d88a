//! Lens distortion: Brown's polynomial, on the ideal coordinates of a perspective or an equidistant lens.

use glam::{DMat2, DVec2};

/// How ideal coordinates follow from directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lens {
    /// tan θ from the axis: straight lines stay straight.
    #[default]
    Perspective,
    /// Equidistant fisheye: θ from the axis, up to π.
    Fisheye,
}

/// Brown–Conrady distortion of ideal coordinates (Brown, *Decentering Distortion of Lenses*, 1966); all zero is none.
///
/// With x right, y down and r² = x² + y² it takes (x, y) to (x, y)·N/D + tangential part, where
/// N = 1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸ and D = 1 + d1 r² + d2 r⁴ + d3 r⁶, and the tangential part is that of OpenCV:
/// 2 p1 x y + p2 (r² + 2 x²), p1 (r² + 2 y²) + 2 p2 x y. Here as everywhere in the program y is given upwards.
///
/// A polynomial folds back at some radius. Coordinates beyond that radius, the first at which the distorted radius
/// stops to grow, belong to no place of the picture and the other way round: the distortion has a [domain](Self::limit).
/// That radius is of the radial terms alone. Where it hardly grows, the tangential part may fold before it in some
/// directions: two places share one distorted coordinate there, and [`undo`](Self::undo) gives one of them or none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    k: [f64; 4],
    d: [f64; 3],
    p: [f64; 2],
    /// Largest ideal radius, and the distorted one there: both infinite where all is zero, and only there.
    limit: [f64; 2],
}

impl Default for Distortion {
    fn default() -> Self {
        Self { k: [0.0; 4], d: [0.0; 3], p: [0.0; 2], limit: [f64::INFINITY; 2] }
    }
}

/// Ideal radii are followed this far: tan 87.1°, more than any lens without fisheye shows.
const FARTHEST: f64 = 20.0;

/// Steps by which the radius is followed to where the polynomial folds.
const STEPS: usize = 8000;

impl Distortion {
    /// Brown's polynomial with the radial terms k1, k2, k3, k4 and the tangential terms p1, p2 in OpenCV's order.
    pub fn brown(k: [f64; 4], p: [f64; 2]) -> Self {
        Self::rational(k, [0.0; 3], p)
    }

    /// The same over a denominator, as OpenCV's rational model has it.
    pub fn rational(k: [f64; 4], d: [f64; 3], p: [f64; 2]) -> Self {
        let mut made = Self { k, d, p, ..Self::default() };
        if made != Self::default() {
            made.limit = made.domain();
        }
        made
    }

    /// The same with another first radial term: k1 greater by `k1`.
    pub fn bent(&self, k1: f64) -> Self {
        let [first, rest @ ..] = self.k;
        Self::rational([first + k1, rest[0], rest[1], rest[2]], self.d, self.p)
    }

    /// The radial terms.
    pub fn k(&self) -> [f64; 4] {
        self.k
    }

    /// The tangential terms.
    pub fn p(&self) -> [f64; 2] {
        self.p
    }

    /// Whether it changes nothing.
    pub fn is_none(&self) -> bool {
        self.limit[0].is_infinite()
    }

    /// The largest ideal radius at which the distortion can be undone.
    pub fn limit(&self) -> f64 {
        self.limit[0]
    }

    /// The same distortion of a picture turned by quarter turns clockwise: the tangential terms are a vector.
    pub(crate) fn turned(&self, quarters: u32) -> Self {
        let [mut p1, mut p2] = self.p;
        for _ in 0..quarters % 4 {
            // in axes x right, y down a clockwise quarter turn takes (x, y) to (−y, x); the vector is (p2, p1)
            (p2, p1) = (-p1, p2);
        }
        Self { p: [p1, p2], ..*self }
    }

    /// From ideal to distorted coordinates (x right, y up); right inside the [domain](Self::limit) only.
    pub fn apply(&self, u: DVec2) -> DVec2 {
        if self.is_none() {
            return u;
        }
        let (x, y) = (u.x, -u.y);
        let r2 = x * x + y * y;
        let radial = self.radial(r2).0;
        let [p1, p2] = self.p;
        DVec2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            -(y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y),
        )
    }

    /// From distorted to ideal coordinates by Newton's method; `None` outside the picture of the domain. The result is
    /// right to 10⁻¹² or a relative 10⁻¹².
    pub fn undo(&self, d: DVec2) -> Option<DVec2> {
        if self.is_none() {
            return Some(d);
        }
        let rd = d.length();
        if rd == 0.0 && self.p == [0.0; 2] {
            return Some(d);
        }
        let radius = self.undo_radius(rd);
        let mut u = if rd > 0.0 { d * (radius / rd) } else { d };
        if self.p == [0.0; 2] {
            return (rd <= self.limit[1]).then_some(u);
        }
        let mut left = f64::INFINITY;
        for _ in 0..20 {
            let residual = d - self.apply(u);
            left = residual.length();
            if left <= 1e-14 * (1.0 + rd) {
                break;
            }
            let step = self.jacobian(u).inverse() * residual;
            if !step.is_finite() {
                return None;
            }
            // half a radius at most: a wild first step must not leap over the fold
            u += step.clamp_length_max(0.5 * u.length().max(0.1));
        }
        (left <= 1e-12 * (1.0 + rd) && u.length() <= self.limit[0]).then_some(u)
    }

    /// The ideal coordinates within the domain that come nearest: those of [`undo`](Self::undo) where it has some, else
    /// on the rim.
    pub(crate) fn undo_or_rim(&self, d: DVec2) -> DVec2 {
        self.undo(d).unwrap_or_else(|| d.normalize_or(DVec2::Y) * self.undo_radius(d.length()))
    }

    /// The ideal radius of a distorted one by Newton's method between bounds; the domain's rim beyond it.
    fn undo_radius(&self, rd: f64) -> f64 {
        let [limit, limit_d] = self.limit;
        if rd >= limit_d {
            return limit;
        }
        let (mut low, mut high) = (0.0, limit);
        let mut r = rd.min(limit);
        for _ in 0..60 {
            let (f, slope) = self.radius(r);
            let miss = f - rd;
            if miss.abs() <= 1e-15 * (1.0 + rd) {
                break;
            }
            if miss > 0.0 {
                high = r
            } else {
                low = r
            }
            let next = r - miss / slope;
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if next == r {
                break;
            }
            r = next;
        }
        r
    }

    /// N/D and its derivative by r².
    fn radial(&self, r2: f64) -> (f64, f64) {
        let [k1, k2, k3, k4] = self.k;
        let n = 1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)));
        let n1 = k1 + r2 * (2.0 * k2 + r2 * (3.0 * k3 + r2 * 4.0 * k4));
        if self.d == [0.0; 3] {
            return (n, n1);
        }
        let [d1, d2, d3] = self.d;
        let d = 1.0 + r2 * (d1 + r2 * (d2 + r2 * d3));
        let dd = d1 + r2 * (2.0 * d2 + r2 * 3.0 * d3);
        (n / d, (n1 * d - n * dd) / (d * d))
    }

    /// The distorted radius and its derivative by the ideal radius, without the tangential part.
    fn radius(&self, r: f64) -> (f64, f64) {
        let (radial, by_r2) = self.radial(r * r);
        (r * radial, radial + 2.0 * r * r * by_r2)
    }

    /// Follows the radius to where it stops to grow.
    fn domain(&self) -> [f64; 2] {
        let rises = |r: f64| {
            let (f, slope) = self.radius(r);
            slope > 1e-6 && f.is_finite() && self.denominator(r * r) > 1e-6
        };
        let step = FARTHEST / STEPS as f64;
        let first = (1..=STEPS).map(|i| i as f64 * step).find(|&r| !rises(r));
        let limit = match first {
            None => FARTHEST,
            Some(r) => {
                let (mut low, mut high) = (r - step, r);
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    if rises(middle) { low = middle } else { high = middle }
                }
                low
            }
        };
        [limit, self.radius(limit).0]
    }

    fn denominator(&self, r2: f64) -> f64 {
        1.0 + r2 * (self.d[0] + r2 * (self.d[1] + r2 * self.d[2]))
    }

    /// Derivatives of [`apply`](Self::apply).
    fn jacobian(&self, u: DVec2) -> DMat2 {
        let (x, y) = (u.x, -u.y);
        let (radial, by_r2) = self.radial(x * x + y * y);
        let [p1, p2] = self.p;
        let xx = radial + 2.0 * x * x * by_r2 + 2.0 * p1 * y + 6.0 * p2 * x;
        let xy = 2.0 * x * y * by_r2 + 2.0 * p1 * x + 2.0 * p2 * y;
        let yy = radial + 2.0 * y * y * by_r2 + 6.0 * p1 * y + 2.0 * p2 * x;
        // the mixed derivatives are equal, and change sign where y points up
        DMat2::from_cols(DVec2::new(xx, -xy), DVec2::new(-xy, yy))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_fold_of_a_barrel_is_where_calculus_puts_it() {
        // r (1 + k r²) turns at r = 1/√(−3k)
        let lens = Distortion::brown([-0.3, 0.0, 0.0, 0.0], [0.0; 2]);
        let fold = 1.0 / 0.9f64.sqrt();
        assert!((lens.limit() - fold).abs() < 1e-5, "{}", lens.limit());
        let rim = fold * (1.0 - 0.3 * fold * fold);
        assert!(lens.undo(DVec2::new(0.999 * rim, 0.0)).is_some());
        assert!(lens.undo(DVec2::new(0.0, 1.001 * rim)).is_none());
        assert!((lens.undo_or_rim(DVec2::new(0.0, 9.0)).length() - lens.limit()).abs() < 1e-9);
        // a pincushion never folds
        assert_eq!(Distortion::brown([0.2, 0.0, 0.0, 0.0], [0.0; 2]).limit(), FARTHEST);
    }

    #[test]
    fn turning_the_picture_turns_the_distortion() {
        let lens = Distortion::brown([-0.1, 0.02, 0.0, 0.0], [0.01, -0.02]);
        let clockwise = |v: DVec2| DVec2::new(v.y, -v.x); // y up
        for quarters in 0..4 {
            let mut u = DVec2::new(0.3, 0.2);
            let mut d = lens.apply(u);
            for _ in 0..quarters {
                (u, d) = (clockwise(u), clockwise(d));
            }
            assert!(lens.turned(quarters).apply(u).distance(d) < 1e-14, "{quarters}");
        }
    }

    proptest! {
        #[test]
        fn undo_undoes_apply_in_the_domain(
            k1 in -0.5..0.5f64, k2 in -0.3..0.3f64, k3 in -0.1..0.1f64, k4 in -0.02..0.02f64,
            p1 in -0.01..0.01f64, p2 in -0.01..0.01f64, d1 in -0.1..0.3f64, share in 0.0..0.9f64, angle in 0.0..6.3f64,
        ) {
            let lens = Distortion::rational([k1, k2, k3, k4], [d1, 0.0, 0.0], [p1, p2]);
            let u = DVec2::from_angle(angle) * share * lens.limit().min(1.5);
            // the tangential part may fold earlier than the radial one, and the picture unfold again further out
            prop_assume!((1..=32).all(|i| lens.jacobian(u * (f64::from(i) / 32.0)).determinant() > 0.05));
            let back = lens.undo(lens.apply(u));
            prop_assert!(back.is_some_and(|b| b.distance(u) < 1e-9), "{lens:?} {u}: {back:?}");
        }

        #[test]
        fn what_undo_gives_is_right(
            k1 in -1.0..1.0f64, k2 in -1.0..1.0f64, p1 in -0.1..0.1f64, p2 in -0.1..0.1f64,
            x in -3.0..3.0f64, y in -3.0..3.0f64,
        ) {
            let lens = Distortion::brown([k1, k2, 0.0, 0.0], [p1, p2]);
            let d = DVec2::new(x, y);
            if let Some(u) = lens.undo(d) {
                prop_assert!(lens.apply(u).distance(d) < 1e-10 && u.length() <= lens.limit());
            }
            prop_assert!(lens.undo_or_rim(d).is_finite());
        }
    }
}
