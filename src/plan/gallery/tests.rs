//! The candidates against whole numbers: at every crossing of two lines of sight, what is truly seen there is seen from
//! a candidate. Halls lie on a lattice, so that lines run along each other and many meet in one point.

use super::arrangement::Candidates;
use super::witness_region::WitnessRegion;
use crate::plan::cover::reduce::within;
use crate::plan::free_space::open_space::OpenSpace;
use crate::plan::free_space::polygon::Polygon;
use glam::DVec2;
use std::collections::BTreeSet;

type Point = [i128; 2];

/// Rings about the open space, which lies left of each.
struct Hall(Vec<Vec<Point>>);

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn cross(a: Point, b: Point) -> i128 {
    a[0] * b[1] - a[1] * b[0]
}

impl Hall {
    /// A hall of 44 by 36, a pillar in most of its squares of 8 by 9; turned by an angle whose tangent is 3/4 on demand.
    fn new(mut dice: u64, turned: bool) -> Self {
        let mut roll = |n: u64| {
            dice = dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            i128::from((dice >> 33) % n)
        };
        let place = |x: i128, y: i128| if turned { [4 * x - 3 * y, 3 * x + 4 * y] } else { [x, y] };
        let mut rings = vec![vec![place(0, 0), place(44, 0), place(44, 36), place(0, 36)]];
        for k in 0..20 {
            let [x, y] = [2 + k % 5 * 8, k / 5 * 9];
            if roll(4) > 0 {
                let [a, b] = [x + roll(4), y + 1 + roll(4)];
                let [c, d] = [a + 1 + roll(4), b + 1 + roll(4)];
                rings.push(vec![place(a, b), place(a, d), place(c, d), place(c, b)]);
            }
        }
        Self(rings)
    }

    fn open_space(&self) -> OpenSpace {
        let ring = |r: &Vec<Point>| r.iter().map(|&p| float(p)).collect();
        let mut rings = self.0.iter().map(ring);
        let outer = rings.next().unwrap();
        OpenSpace::new(&[Polygon { outer, holes: rings.collect() }]).unwrap()
    }

    /// Whether a direction from the corner between two edges leads nowhere into a pillar or out of the hall.
    fn open_at([before, corner, after]: [Point; 3], along: Point) -> bool {
        let [to_before, to_after] = [minus(before, corner), minus(after, corner)];
        if cross(to_after, to_before) > 0 {
            cross(to_after, along) >= 0 && cross(along, to_before) >= 0
        } else {
            !(cross(to_before, along) > 0 && cross(along, to_after) > 0)
        }
    }

    /// Whether a point (over the divisor) and a witness see each other, walls and corners being open.
    fn sees(&self, p: Point, divisor: i128, w: Point) -> bool {
        let scaled = |v: Point| [v[0] * divisor, v[1] * divisor];
        let w = scaled(w);
        let along = minus(w, p);
        let back = minus(p, w);
        self.0.iter().all(|ring| {
            let n = ring.len();
            (0..n).all(|i| {
                let corners = [ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]].map(scaled);
                let [_, a, b] = corners;
                let [from_p, from_w] = [p, w].map(|q| cross(minus(b, a), minus(q, a)));
                let [to_a, to_b] = [a, b].map(|q| cross(along, minus(q, p)));
                let parted = (from_p < 0 && from_w > 0) || (from_p > 0 && from_w < 0);
                if parted && ((to_a < 0 && to_b > 0) || (to_a > 0 && to_b < 0)) {
                    return false;
                }
                let on_wall = |q: Point, side: i128| {
                    let t = minus(q, a);
                    let edge = minus(b, a);
                    let at = t[0] * edge[0] + t[1] * edge[1];
                    side == 0 && at > 0 && at < edge[0] * edge[0] + edge[1] * edge[1]
                };
                if (on_wall(p, from_p) && from_w < 0) || (on_wall(w, from_w) && from_p < 0) {
                    return false;
                }
                if a == p || a == w {
                    return Self::open_at(corners, if a == p { along } else { back });
                }
                let past = minus(a, p);
                let at = past[0] * along[0] + past[1] * along[1];
                let between = to_a == 0 && at > 0 && at < along[0] * along[0] + along[1] * along[1];
                !between || (Self::open_at(corners, along) && Self::open_at(corners, back))
            })
        })
    }
}

fn float(p: Point) -> DVec2 {
    DVec2::new(p[0] as f64, p[1] as f64)
}

/// Where two lines cross, over a positive divisor.
fn crossing([a, b]: [Point; 2], [c, d]: [Point; 2]) -> Option<(Point, i128)> {
    let (u, v) = (minus(b, a), minus(d, c));
    let divisor = cross(u, v);
    let t = cross(minus(c, a), v);
    let p = [a[0] * divisor + u[0] * t, a[1] * divisor + u[1] * t];
    (divisor != 0).then(|| if divisor > 0 { (p, divisor) } else { ([-p[0], -p[1]], -divisor) })
}

fn reduced((p, divisor): (Point, i128)) -> (Point, i128) {
    let gcd = |mut a: i128, mut b: i128| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a.abs()
    };
    let by = gcd(gcd(p[0], p[1]), divisor);
    ([p[0] / by, p[1] / by], divisor / by)
}

#[test]
fn at_no_crossing_is_more_seen_than_from_some_candidate() {
    for (dice, turned) in [(2, false), (4, true)] {
        let hall = Hall::new(dice, turned);
        let open = hall.open_space();
        let lattice = (0..6).map(|k: i128| {
            let [x, y] = [1 + k % 3 * 17 + k / 3, 4 + k / 3 * 20 + k % 3];
            if turned { [4 * x - 3 * y, 3 * x + 4 * y] } else { [x, y] }
        });
        let corners: Vec<Point> = hall.0.concat();
        // some on walls and corners, where sight runs along walls
        let witnesses: Vec<Point> =
            lattice.chain(corners.iter().copied().step_by(13)).filter(|&w| open.contains(float(w))).collect();
        let tolerance = open.extent() * 1e-10;
        let regions: Vec<WitnessRegion> =
            witnesses.iter().map(|&w| WitnessRegion::new(&open, float(w), tolerance)).collect();
        let mut candidates = Candidates::new(&open);
        assert!(candidates.arrange(&open, &regions, None));

        let mut lines = Vec::new();
        for &w in &witnesses {
            lines.extend(corners.iter().filter(|&&c| c != w && hall.sees(c, 1, w)).map(|&c| [w, c]));
        }
        let mut places = BTreeSet::new();
        for (i, &a) in lines.iter().enumerate() {
            places.extend(lines[..i].iter().filter_map(|&b| crossing(a, b)).map(reduced));
        }
        let mut tried = 0;
        for &(p, divisor) in &places {
            let sees: Vec<u32> =
                (0..).zip(&witnesses).filter(|(_, w)| hall.sees(p, divisor, **w)).map(|(k, _)| k).collect();
            tried += usize::from(!sees.is_empty());
            let matched = candidates.sees.iter().any(|c| within(&sees, c));
            assert!(matched, "hall {dice}: {} sees {sees:?}", float(p) / divisor as f64);
        }
        assert!(tried > 5 * candidates.points.len(), "{tried} places, {} kept", candidates.points.len());
    }
}
