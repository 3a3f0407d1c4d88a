//! Corners of the arrangement of rays, without those that no guard needs.
//!
//! Along a ray, other regions are entered and left. A corner is a guard's place for one of the four cells about it, that
//! in both its regions. Where the walk from it along a side of that cell first enters another region, the corner there
//! sees all that this one does and more: it is left out. What remains are the corners of light cells, and of each only
//! the lowest is kept. Wherever crossings coincide, or touch a ray's end, nothing is left out: there, cells may be
//! edges or points.

use super::arrangement::bucketed;
use super::star::{Ray, Star};
use glam::DVec2;
use std::time::Instant;

/// A direction that is hardly a wall's: of a cell's corners the one lowest along it stands for all.
const UP: DVec2 = DVec2::new(0.754_877_666_246_692_8, 0.656_047_932_198_273_4);

/// The rays of all witnesses.
pub(super) struct Rays {
    /// The witness and the ray.
    pub(super) list: Vec<(u32, Ray)>,
    /// Crossings nearer than this count as one.
    tolerance: f64,
}

/// How a ray meets another.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// How far along the ray, in units of length.
    at: f64,
    other: u32,
    pass: Pass,
}

/// What a ray does to another's region where they meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pass {
    Enters,
    Leaves,
    /// Touches an end, runs along, coincides with a third, or the region lies on no one side.
    Unclear,
}

impl Rays {
    pub(super) fn of(stars: &[Star], extent: f64) -> Self {
        let rays = |(w, star): (usize, &Star)| star.rays.iter().map(move |&r| (w as u32, r)).collect::<Vec<_>>();
        Self { list: stars.iter().enumerate().flat_map(rays).collect(), tolerance: extent * 2e-9 }
    }

    /// Gives every corner that some guard may need; false if time ran out.
    pub(super) fn corners(&self, buckets: &Buckets, until: Option<Instant>, mut give: impl FnMut(DVec2)) -> bool {
        // for each ray, the others that it meets at corners worth keeping, in rising order
        let mut kept: Vec<Vec<u32>> = vec![Vec::new(); self.list.len()];
        let mut stamps = vec![u32::MAX; self.list.len()];
        let mut crossings = Vec::new();
        for a in 0..self.list.len() {
            if a % 64 == 0 && until.is_some_and(|t| Instant::now() >= t) {
                return false;
            }
            self.along(a as u32, buckets, &mut stamps, &mut crossings);
            for i in 0..crossings.len() {
                let Crossing { at, other, pass } = crossings[i];
                let [from, to] = self.list[a].1.ends;
                let place = || from + (to - from).normalize_or_zero() * at;
                if pass == Pass::Unclear {
                    give(place());
                } else if !self.worth(a, &crossings, i) {
                } else if other as usize > a {
                    // it is asked when its turn comes
                    kept[a].push(other);
                } else if kept[other as usize].binary_search(&(a as u32)).is_ok() {
                    give(place());
                }
            }
            kept[a].sort_unstable();
        }
        true
    }

    /// Whether, as far as ray `a` can tell, a clear crossing on it is a corner to keep.
    fn worth(&self, a: usize, crossings: &[Crossing], i: usize) -> bool {
        let Crossing { at, pass, .. } = crossings[i];
        let forth = pass == Pass::Enters;
        let [from, to] = self.list[a].1.ends;
        // lowest of its cell: the cell's side along this ray rises
        if ((to - from).dot(UP) > 0.0) != forth {
            return false;
        }
        let beyond = |c: &&Crossing| (c.at - at).abs() > self.tolerance;
        let next =
            if forth { crossings[i + 1..].iter().find(beyond) } else { crossings[..i].iter().rev().find(beyond) };
        // seen from the other way, what leaves enters
        let gains = if forth { Pass::Enters } else { Pass::Leaves };
        next.is_none_or(|c| c.pass != gains)
    }

    /// All crossings on a ray, in order.
    fn along(&self, a: u32, buckets: &Buckets, stamps: &mut [u32], crossings: &mut Vec<Crossing>) {
        crossings.clear();
        let (wa, ra) = self.list[a as usize];
        buckets.touched(ra.ends, |cell| {
            for &b in buckets.cell(cell) {
                let (wb, rb) = self.list[b as usize];
                if wb == wa || stamps[b as usize] == a {
                    continue;
                }
                stamps[b as usize] = a;
                if ra.corner != rb.corner {
                    self.meet(&ra, &rb, b, crossings);
                }
            }
        });
        crossings.sort_by(|x, y| x.at.total_cmp(&y.at).then(x.other.cmp(&y.other)));
        for i in 1..crossings.len() {
            if crossings[i].at - crossings[i - 1].at <= self.tolerance {
                crossings[i].pass = Pass::Unclear;
                crossings[i - 1].pass = Pass::Unclear;
            }
        }
    }

    /// Where ray `a` meets ray `b`; where they run along each other, the ends of `b` on `a`.
    fn meet(&self, ra: &Ray, rb: &Ray, b: u32, crossings: &mut Vec<Crossing>) {
        let tolerance = self.tolerance;
        let (u, v) = (ra.ends[1] - ra.ends[0], rb.ends[1] - rb.ends[0]);
        let (length, other_length) = (u.length(), v.length());
        let between = rb.ends[0] - ra.ends[0];
        let det = u.perp_dot(v);
        let unclear = |at: f64| Crossing { at, other: b, pass: Pass::Unclear };
        if det.abs() <= 1e-9 * length * other_length {
            for end in rb.ends {
                let (along, off) = ((end - ra.ends[0]).dot(u) / length, (end - ra.ends[0]).perp_dot(u) / length);
                if off.abs() <= tolerance && (-tolerance..=length + tolerance).contains(&along) {
                    crossings.push(unclear(along.clamp(0.0, length)));
                }
            }
            if det.abs() <= 1e-12 * length * other_length {
                return;
            }
        }
        // in units of length along each
        let at = between.perp_dot(v) / det * length;
        let on_other = between.perp_dot(u) / det * other_length;
        let on = |at: f64, length: f64| (-tolerance..=length + tolerance).contains(&at);
        if !(on(at, length) && on(on_other, other_length)) {
            return;
        }
        let near_end = |at: f64, length: f64| at <= tolerance || at >= length - tolerance;
        let at_once = at.clamp(0.0, length);
        if ra.side == 0.0 || rb.side == 0.0 || near_end(at, length) || near_end(on_other, other_length) {
            crossings.push(unclear(at_once));
        } else {
            // `v` turned left is where the region lies, if it lies left of its ray
            let pass = if (v.perp_dot(u) > 0.0) == (rb.side > 0.0) { Pass::Enters } else { Pass::Leaves };
            crossings.push(Crossing { at: at_once, other: b, pass });
        }
    }
}

/// Rays by the cells they may touch.
pub(super) struct Buckets {
    low: DVec2,
    per_unit: DVec2,
    across: usize,
    starts: Vec<usize>,
    rays: Vec<u32>,
}

impl Buckets {
    pub(super) fn new((low, high): (DVec2, DVec2), rays: &[(u32, Ray)]) -> Self {
        let across = ((rays.len() as f64).sqrt() * 1.5).clamp(1.0, 1024.0).ceil();
        let per_unit = DVec2::splat(across) / (high - low);
        let mut new = Self { low, per_unit, across: across as usize, starts: vec![], rays: vec![] };
        let mut entries = Vec::new();
        for (k, (_, ray)) in rays.iter().enumerate() {
            new.touched(ray.ends, |cell| entries.push((cell, k as u32)));
        }
        (new.starts, new.rays) = bucketed(entries, new.across * new.across);
        new
    }

    fn xy(&self, p: DVec2) -> [usize; 2] {
        let at = ((p - self.low) * self.per_unit).max(DVec2::ZERO);
        [(at.x as usize).min(self.across - 1), (at.y as usize).min(self.across - 1)]
    }

    fn cell(&self, cell: usize) -> &[u32] {
        &self.rays[self.starts[cell]..self.starts[cell + 1]]
    }

    /// Cells of a segment, column by column, and those within a hair (a hundredth of a cell) of it: two segments that
    /// meet, if only by rounding, share a cell.
    fn touched(&self, [a, b]: [DVec2; 2], mut cell: impl FnMut(usize)) {
        let (a, b) = if a.x <= b.x { (a, b) } else { (b, a) };
        let hair = 0.01 / self.per_unit;
        let slope = if b.x > a.x { (b.y - a.y) / (b.x - a.x) } else { 0.0 };
        let (low, high) = (a.min(b) - hair, a.max(b) + hair);
        let ([x0, y0], [x1, y1]) = (self.xy(low), self.xy(high));
        for x in x0..=x1 {
            let edge = |k: f64| self.low.x + (x as f64 + k) / self.per_unit.x;
            let ys = [-0.01, 1.01].map(|k| a.y + slope * (edge(k).clamp(a.x, b.x) - a.x));
            let (mut bottom, mut top) = (ys[0].min(ys[1]) - hair.y, ys[0].max(ys[1]) + hair.y);
            if b.x - a.x <= 2.0 * hair.x {
                // too steep for its slope to be trusted
                (bottom, top) = (low.y, high.y);
            }
            let ([_, bottom], [_, top]) = (self.xy(DVec2::new(0.0, bottom)), self.xy(DVec2::new(0.0, top)));
            (bottom.max(y0)..=top.min(y1)).for_each(|y| cell(y * self.across + x));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::gallery::arrangement::Candidates;
    use crate::plan::open_space::OpenSpace;
    use crate::plan::polygon::Polygon;
    use glam::dvec2;

    /// A hall with rooms cut out of it, on a lattice, so that rays run along each other and meet in one point.
    fn hall(turn: f64) -> OpenSpace {
        let holes = [[1, 1, 3, 3], [5, 1, 6, 4], [1, 5, 4, 6], [5, 5, 8, 7], [9, 2, 10, 9], [2, 8, 7, 9]];
        let place = |x: i32, y: i32| DVec2::from_angle(turn).rotate(dvec2(f64::from(x), f64::from(y)));
        let ring = |[a, b, c, d]: [i32; 4]| vec![place(a, b), place(c, b), place(c, d), place(a, d)];
        OpenSpace::new(&[Polygon { outer: ring([0, 0, 11, 10]), holes: holes.map(ring).to_vec() }]).unwrap()
    }

    #[test]
    fn no_crossing_sees_what_no_kept_corner_sees() {
        for turn in [0.0, 0.3] {
            let open = hall(turn);
            let extent = (open.bounds().1 - open.bounds().0).max_element();
            let mut buffers = Default::default();
            let lattice = (0..30).map(|k| dvec2(f64::from(k % 6) * 2.0 + 0.5, f64::from(k / 6) * 2.2 + 0.4));
            let at = lattice.map(|p| DVec2::from_angle(turn).rotate(p)).filter(|p| open.contains(*p));
            let stars: Vec<Star> = at.map(|w| Star::new(&open, w, extent * 1e-10, &mut buffers)).collect();
            let mut candidates = Candidates::new(&open);
            assert!(candidates.arrange(&open, &stars, None));
            let rays = Rays::of(&stars, extent);
            let mut crossings = Vec::new();
            let mut tried = 0;
            for (i, (wa, ra)) in rays.list.iter().enumerate() {
                for (wb, rb) in rays.list[..i].iter().filter(|b| b.0 != *wa) {
                    crossings.clear();
                    rays.meet(ra, rb, 0, &mut crossings);
                    for crossing in &crossings {
                        let along = (ra.ends[1] - ra.ends[0]).normalize();
                        let p = ra.ends[0] + along * crossing.at;
                        let sees: Vec<u32> = (0..).zip(&stars).filter(|(_, s)| s.holds(p)).map(|(w, _)| w).collect();
                        assert!(sees.contains(wa) && sees.contains(wb));
                        let matched = candidates.sees.iter().any(|c| crate::plan::cover::within(&sees, c));
                        assert!(matched, "{p} sees {sees:?}");
                        tried += 1;
                    }
                }
            }
            assert!(tried > 5 * candidates.points.len(), "{tried} crossings, {} kept", candidates.points.len());
        }
    }
}
