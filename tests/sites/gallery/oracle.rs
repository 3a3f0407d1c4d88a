//! The area seen from a point, in rational numbers: slow, and obviously right.

use clerestory::plan::free_space::polygon::Polygon;
use glam::DVec2;
use num_rational::BigRational as Q;
use std::cmp::Ordering;

type P = [Q; 2];

fn exact(v: f64) -> Q {
    Q::from_float(v).expect("is finite")
}

fn zero() -> Q {
    exact(0.0)
}

fn cross(a: &P, b: &P) -> Q {
    &a[0] * &b[1] - &a[1] * &b[0]
}

fn minus(a: &P, b: &P) -> P {
    [&a[0] - &b[0], &a[1] - &b[1]]
}

fn turning(a: &P, b: &P) -> Ordering {
    let lower = |p: &P| p[1] < zero() || (p[1] == zero() && p[0] < zero());
    lower(a).cmp(&lower(b)).then_with(|| zero().cmp(&cross(a, b)))
}

/// How far along the direction the line through `a b` lies, in lengths of the direction.
fn distance(d: &P, a: &P, b: &P) -> Q {
    let along = minus(b, a);
    cross(a, &along) / cross(d, &along)
}

/// Cuts the full turn at every corner's direction; in each sector, the nearest edge ends the view.
pub(crate) fn visible_area(polygon: &Polygon, q: DVec2) -> f64 {
    let place = [exact(q.x), exact(q.y)];
    let rings: Vec<Vec<P>> =
        polygon.rings().map(|r| r.iter().map(|p| minus(&[exact(p.x), exact(p.y)], &place)).collect()).collect();
    let edges: Vec<(&P, &P)> = rings.iter().flat_map(|r| r.iter().zip(r.iter().cycle().skip(1))).collect();
    let nothing = [zero(), zero()];
    let mut directions: Vec<P> = rings.iter().flatten().filter(|p| **p != nothing).cloned().collect();
    // sectors stay below half a turn
    directions.extend([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]].map(|d| d.map(exact)));
    directions.sort_by(turning);
    directions.dedup_by(|a, b| turning(a, b) == Ordering::Equal);
    let mut area = zero();
    for (d, e) in directions.iter().zip(directions.iter().cycle().skip(1)) {
        let middle = [&d[0] + &e[0], &d[1] + &e[1]];
        let crossed = edges.iter().filter(|(a, b)| {
            let (ca, cb) = (cross(&middle, a), cross(&middle, b));
            ((ca > zero()) != (cb > zero())) && distance(&middle, a, b) > zero()
        });
        let mut crossed: Vec<_> = crossed.collect();
        if crossed.len() % 2 == 0 {
            continue;
        }
        crossed.sort_by_key(|(a, b)| distance(&middle, a, b));
        let (a, b) = crossed[0];
        area += distance(d, a, b) * distance(e, a, b) * cross(d, e);
    }
    let half = area / exact(2.0);
    let (n, d) = (half.numer().to_string(), half.denom().to_string());
    ratio(&n, &d)
}

/// The quotient of two long decimal numbers.
fn ratio(n: &str, d: &str) -> f64 {
    // 30 leading digits are more than a double holds
    let lead = |s: &str| (s.chars().take(30).collect::<String>().parse::<f64>().expect("digits"), s.len().max(30) - 30);
    let ((n, en), (d, ed)) = (lead(n), lead(d));
    n / d * 10f64.powi(en as i32 - ed as i32)
}
