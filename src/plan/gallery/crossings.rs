//! Corners of the arrangement of rays, without those that no guard needs.
//!
//! Along a ray, other regions are entered and left. At a corner of the arrangement, a ray borders the cell that lies in
//! all regions about the corner if, one way, it leaves none of them. The next corner that way lies in all of them too:
//! this one is left out if the next lies in a further region, or lower. Such steps gain regions, or lose height, so they
//! end, at a corner that is kept and lies in every region that the one left out lies in. What remains are the lowest
//! corners of cells that no such step widens: the light cells (Tozoni, de Rezende and de Souza 2016) and some more.
//! Where a ray ends in another, or what they do is unclear, corners are kept: there, cells may be edges or points.

use super::witness_region::{Ray, WitnessRegion};
use crate::plan::free_space::cells::Cells;
use glam::DVec2;
use std::collections::HashSet;
use std::time::Instant;

/// A direction that is hardly a wall's: of a cell's corners the one lowest along it stands for all.
const UP: DVec2 = DVec2::new(0.754_877_666_246_692_8, 0.656_047_932_198_273_4);

/// The rays of all witnesses.
pub(crate) struct Rays {
    /// The witness and the ray.
    pub(crate) list: Vec<(u32, Ray)>,
    extent: f64,
    /// Crossings nearer than this count as one.
    tolerance: f64,
}

/// The same for points that differ by rounding only, but for a few.
pub(crate) fn place_key(p: DVec2, extent: f64) -> [i64; 2] {
    (p / (extent * 1e-10)).round().to_array().map(|v| v as i64)
}

/// How a ray meets another.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// How far along the ray, in units of length.
    at: f64,
    /// How far along the other.
    at_other: f64,
    other: u32,
    pass: Pass,
}

/// What a ray does to another's region where they meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pass {
    Enters,
    Leaves,
    /// Touches an end, runs along, or a region lies on no one side.
    Unclear,
}

/// Corners that are still kept, ray by ray.
#[derive(Default)]
struct Kept {
    /// For each ray, those later ones that it meets at corners it would keep, in rising order.
    pairs: Vec<Vec<u32>>,
    /// Corners of three rays and more that all pairs would keep, and those that some ray leaves out.
    shared: Vec<(DVec2, [u32; 2])>,
    dropped: HashSet<[i64; 2]>,
}

impl Rays {
    pub(crate) fn of(regions: &[WitnessRegion], extent: f64) -> Self {
        let list = (0..).zip(regions).flat_map(|(w, region)| region.rays.iter().map(move |&ray| (w, ray))).collect();
        Self { list, extent, tolerance: extent * 2e-9 }
    }

    /// Gives every corner that some guard may need, but the open space's own, with witnesses whose regions meet there;
    /// false if time ran out.
    pub(crate) fn corners(&self, cells: &Cells, until: Option<Instant>, mut give: impl FnMut(DVec2, &[u32])) -> bool {
        let mut kept = Kept { pairs: vec![Vec::new(); self.list.len()], ..Kept::default() };
        let mut stamps = vec![u32::MAX; self.list.len()];
        let mut crossings = Vec::new();
        for (a, (w, ray)) in self.list.iter().enumerate() {
            if a % 64 == 0 && until.is_some_and(|t| Instant::now() >= t) {
                return false;
            }
            self.along(a as u32, cells, &mut stamps, &mut crossings);
            // those that count as one place
            let groups: Vec<&[Crossing]> = crossings.chunk_by(|x, y| y.at - x.at <= self.tolerance).collect();
            if self.needs_end(ray, &groups) {
                give(ray.ends[1], &[*w]);
            }
            for (k, group) in groups.iter().enumerate() {
                let dropped = widens(ray, &groups, k);
                for crossing in *group {
                    self.judge(a, crossing, dropped, group.len() > 1, &mut kept, &mut give);
                }
            }
            kept.pairs[a].sort_unstable();
        }
        for (place, of) in kept.shared {
            if !kept.dropped.contains(&self.key(place)) {
                give(place, &of);
            }
        }
        true
    }

    /// Notes what ray `a` says about a corner, and gives it once both of its rays keep it.
    fn judge(
        &self,
        a: usize,
        crossing: &Crossing,
        dropped: bool,
        shared: bool,
        kept: &mut Kept,
        give: &mut impl FnMut(DVec2, &[u32]),
    ) {
        let &Crossing { at, at_other, other, pass } = crossing;
        let b = other as usize;
        let of = [self.list[a].0, self.list[b].0];
        // the same place, whichever ray tells
        let place = if a < b || pass == Pass::Unclear { self.place(a, at) } else { self.place(b, at_other) };
        if pass == Pass::Unclear {
            give(place, &of);
        } else if dropped {
            if shared {
                kept.dropped.insert(self.key(place));
            }
        } else if a < b {
            kept.pairs[a].push(other);
        } else if kept.pairs[b].binary_search(&(a as u32)).is_ok() {
            if shared {
                kept.shared.push((place, of));
            } else {
                give(place, &of);
            }
        }
    }

    fn place(&self, ray: usize, at: f64) -> DVec2 {
        let [from, to] = self.list[ray].1.ends;
        from + (to - from).normalize_or_zero() * at
    }

    fn key(&self, p: DVec2) -> [i64; 2] {
        place_key(p, self.extent)
    }

    /// Whether the end of a ray, where nothing else meets it, may be needed.
    fn needs_end(&self, ray: &Ray, groups: &[&[Crossing]]) -> bool {
        let Some(group @ [.., last]) = groups.last().copied() else { return false };
        let alone = ray.ends[0].distance(ray.ends[1]) - last.at > self.tolerance;
        let worse = climb(ray) > 0.0 || any(group, Pass::Leaves);
        !(alone && worse)
    }

    /// All crossings on a ray, in order.
    fn along(&self, a: u32, cells: &Cells, stamps: &mut [u32], crossings: &mut Vec<Crossing>) {
        crossings.clear();
        let (wa, ra) = self.list[a as usize];
        touched(cells, ra.ends, |cell| {
            for &b in cells.get(cell) {
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
        crossings.sort_unstable_by(|x, y| x.at.total_cmp(&y.at).then(x.other.cmp(&y.other)));
    }

    /// Where ray `a` meets ray `b`; where they run along each other, the ends of `b` on `a`.
    fn meet(&self, ra: &Ray, rb: &Ray, b: u32, crossings: &mut Vec<Crossing>) {
        let tolerance = self.tolerance;
        let (u, v) = (ra.ends[1] - ra.ends[0], rb.ends[1] - rb.ends[0]);
        let (length, other_length) = (u.length(), v.length());
        let between = rb.ends[0] - ra.ends[0];
        let det = u.perp_dot(v);
        let unclear = |at: f64| Crossing { at, at_other: f64::NAN, other: b, pass: Pass::Unclear };
        // less than this, and their crossing is less well known than crossings are told apart
        let nearly_alike = det.abs() <= 1e-6 * length * other_length;
        if nearly_alike {
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
        let at_ends = near_end(at, length) || near_end(on_other, other_length);
        if nearly_alike || at_ends || ra.side == 0.0 || rb.side == 0.0 {
            crossings.push(unclear(at_once));
        } else {
            // `v` turned left is where the region lies, if it lies left of its ray
            let pass = if (v.perp_dot(u) > 0.0) == (rb.side > 0.0) { Pass::Enters } else { Pass::Leaves };
            crossings.push(Crossing { at: at_once, at_other: on_other, other: b, pass });
        }
    }
}

/// Whether a ray leads from a corner, without leaving any region there, to one that is better.
fn widens(ray: &Ray, groups: &[&[Crossing]], k: usize) -> bool {
    let all = |pass| groups[k].iter().all(|c| c.pass == pass);
    if all(Pass::Enters) {
        climb(ray) < 0.0 || groups.get(k + 1).is_some_and(|next| any(next, Pass::Enters))
    } else if all(Pass::Leaves) {
        // going back, it enters them; at the ray's start is a corner of the open space, which stays
        climb(ray) > 0.0 || k == 0 || any(groups[k - 1], Pass::Leaves)
    } else {
        false
    }
}

fn any(group: &[Crossing], pass: Pass) -> bool {
    group.iter().any(|c| c.pass == pass)
}

/// How steeply a ray rises going out; 0 where that is not sure.
fn climb(ray: &Ray) -> f64 {
    let rise = (ray.ends[1] - ray.ends[0]).normalize_or_zero().dot(UP);
    if rise.abs() > 1e-6 { rise } else { 0.0 }
}

/// Rays by the cells that they may touch.
pub(crate) fn by_cell((low, high): (DVec2, DVec2), rays: &Rays) -> Cells {
    let across = ((rays.list.len() as f64).sqrt() * 1.5).clamp(1.0, 1024.0).ceil() as usize;
    Cells::new(low, high - low, [across; 2], |cells, add| {
        for (k, (_, ray)) in (0..).zip(&rays.list) {
            touched(cells, ray.ends, |cell| add(cell, k));
        }
    })
}

/// Cells of a segment, column by column, and those within a hair (a hundredth of a cell) of it: two segments that
/// meet, if only by rounding, share a cell.
fn touched(cells: &Cells, [a, b]: [DVec2; 2], mut cell: impl FnMut([usize; 2])) {
    let (a, b) = if a.x <= b.x { (a, b) } else { (b, a) };
    let hair = 0.01 / cells.per_unit;
    let slope = if b.x > a.x { (b.y - a.y) / (b.x - a.x) } else { 0.0 };
    let (low, high) = (a.min(b) - hair, a.max(b) + hair);
    let ([x0, y0], [x1, y1]) = (cells.xy(low), cells.xy(high));
    for x in x0..=x1 {
        let edge = |k: f64| cells.low.x + (x as f64 + k) / cells.per_unit.x;
        let ys = [-0.01, 1.01].map(|k| a.y + slope * (edge(k).clamp(a.x, b.x) - a.x));
        let (mut bottom, mut top) = (ys[0].min(ys[1]) - hair.y, ys[0].max(ys[1]) + hair.y);
        if b.x - a.x <= 2.0 * hair.x {
            // too steep for its slope to be trusted
            (bottom, top) = (low.y, high.y);
        }
        let ([_, bottom], [_, top]) = (cells.xy(DVec2::new(0.0, bottom)), cells.xy(DVec2::new(0.0, top)));
        (bottom.max(y0)..=top.min(y1)).for_each(|y| cell([x, y]));
    }
}
