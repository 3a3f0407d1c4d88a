//! Polygons with holes, as they come in.

use glam::DVec2;

/// A closed ring of points; the last is joined to the first. Either winding will do.
pub type Ring = Vec<DVec2>;

/// A region with holes, in any unit of length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Polygon {
    /// The region's border.
    pub outer: Ring,
    /// What is taken out of it.
    pub holes: Vec<Ring>,
}

impl Polygon {
    /// All rings: the border first, then the holes.
    pub fn rings(&self) -> impl Iterator<Item = &Ring> {
        std::iter::once(&self.outer).chain(&self.holes)
    }

    /// All rings, each with whether the region lies left of it.
    pub(crate) fn sided_rings(&self) -> impl Iterator<Item = (&Ring, bool)> {
        self.rings().enumerate().map(|(k, ring)| (ring, (ring_area(ring) > 0.0) == (k == 0)))
    }

    /// The border's area less the holes', each without sign; right for rings that do not cross.
    pub fn area(&self) -> f64 {
        ring_area(&self.outer).abs() - self.holes.iter().map(|h| ring_area(h).abs()).sum::<f64>()
    }
}

/// A ring's area by the shoelace formula about its first point, positive when it turns left.
pub fn ring_area(ring: &[DVec2]) -> f64 {
    let Some(&o) = ring.first() else { return 0.0 };
    ring.windows(2).map(|w| (w[0] - o).perp_dot(w[1] - o)).sum::<f64>() / 2.0
}

/// Why polygons are no open space.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PolygonError {
    /// No ring at all.
    #[error("there is no polygon: give at least one outer ring")]
    Empty,
    /// A ring of fewer than three different points.
    #[error("{ring} has {points} different points: a ring takes at least three")]
    TooFewPoints {
        /// Which ring.
        ring: String,
        /// So many different points it has.
        points: usize,
    },
    /// A coordinate that is no number, infinite or beyond 10¹² units.
    #[error("{ring}, point {point}: ({x}, {y}) is not a place: coordinates are finite and within ±1e12")]
    NotAPlace {
        /// Which ring.
        ring: String,
        /// Which point of it, from 0.
        point: usize,
        /// Its first coordinate.
        x: f64,
        /// Its second coordinate.
        y: f64,
    },
    /// Nothing is left inside the outer rings once holes are taken out.
    #[error("the polygon has no inside: its outer ring encloses nothing, or its holes fill it")]
    NoInside,
    /// Edges cross even after they were cut at their crossings; hardly ever seen.
    #[error("edges near ({x}, {y}) cross: draw that corner without the crossing")]
    Crossing {
        /// First coordinate.
        x: f64,
        /// Second coordinate.
        y: f64,
    },
}

/// Refuses what is no place and rings that are no rings; returns the rings without points repeated in a row.
pub(crate) fn checked(polygons: &[Polygon]) -> Result<Vec<Polygon>, PolygonError> {
    if polygons.is_empty() {
        return Err(PolygonError::Empty);
    }
    let checked = polygons.iter().enumerate().map(|(i, p)| {
        let which = |k: usize| match (polygons.len(), k) {
            (1, 0) => "the outer ring".to_owned(),
            (1, k) => format!("hole {k}"),
            (_, 0) => format!("polygon {}, outer ring", i + 1),
            (_, k) => format!("polygon {}, hole {k}", i + 1),
        };
        let outer = checked_ring(&p.outer, || which(0))?;
        let holes = p.holes.iter().enumerate().map(|(k, h)| checked_ring(h, || which(k + 1)));
        // a hole of one or two points takes nothing out
        let holes = holes.filter(|h| !matches!(h, Err(PolygonError::TooFewPoints { .. })));
        Ok(Polygon { outer, holes: holes.collect::<Result<_, _>>()? })
    });
    checked.collect()
}

fn checked_ring(ring: &[DVec2], which: impl Fn() -> String) -> Result<Ring, PolygonError> {
    const FAR: f64 = 1e12;
    // keeps products of differences away from underflow
    const NOTHING: f64 = 1e-100;
    if let Some(point) = ring.iter().position(|p| !(p.x.abs() <= FAR && p.y.abs() <= FAR)) {
        return Err(PolygonError::NotAPlace { ring: which(), point, x: ring[point].x, y: ring[point].y });
    }
    let plain = |v: f64| if v.abs() < NOTHING { 0.0 } else { v };
    let mut points: Ring = ring.iter().map(|p| DVec2::new(plain(p.x), plain(p.y))).collect();
    points.dedup();
    while points.len() > 1 && points.first() == points.last() {
        points.pop();
    }
    if points.len() < 3 {
        return Err(PolygonError::TooFewPoints { ring: which(), points: points.len() });
    }
    Ok(points)
}
