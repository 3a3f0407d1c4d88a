//! Where guards may stand: every corner of the arrangement that the witnesses' regions make.
//!
//! A guard sees the witnesses in whose regions it stands. Regions are closed, so that a corner of a cell of their
//! arrangement lies in all regions that the cell lies in, whether the cell is a face, an edge or a point: the corners
//! are guards enough for a lower bound (Couto, de Rezende and de Souza, *An exact algorithm for minimizing vertex
//! guards on art galleries*, 2011; Tozoni, de Rezende and de Souza, *Algorithm 966*, 2016).

use super::star::{Ray, Star};
use crate::plan::open_space::OpenSpace;
use glam::DVec2;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::time::Instant;

/// Candidate guards, and for each the witnesses it sees.
#[derive(Default)]
pub(crate) struct Candidates {
    pub(crate) points: Vec<DVec2>,
    pub(crate) sees: Vec<Vec<u32>>,
    rays: Vec<(u32, Ray)>,
    /// Witnesses whose rays are in.
    arranged: usize,
    /// Witnesses that candidates have been asked about.
    asked: usize,
    /// The candidate at a place, or one that sees the same.
    known: HashMap<[i64; 2], u32>,
    /// Of candidates that see the same witnesses, keep one.
    merge: bool,
    same: HashMap<Vec<u32>, u32>,
}

impl Candidates {
    /// The corners of the open space. With `merge`, of candidates that see the same witnesses when they are found only
    /// the first is kept: enough for one bound, too few when witnesses are added.
    pub(crate) fn new(open: &OpenSpace, merge: bool) -> Self {
        let mut new = Self { merge, ..Self::default() };
        new.points.extend_from_slice(open.corners());
        new.sees.resize(new.points.len(), Vec::new());
        new
    }

    /// Asks all candidates about witnesses that were added since.
    pub(crate) fn ask(&mut self, open: &OpenSpace, stars: &[Star]) {
        let index = Index::new(open, stars, self.asked, self.points.len());
        for (p, sees) in self.points.iter().zip(&mut self.sees) {
            sees.extend(index.seen_by(stars, *p));
        }
        self.asked = stars.len();
    }

    /// Adds the corners that the rays of the first `upto` witnesses make, and asks; false if time ran out.
    pub(crate) fn arrange(&mut self, open: &OpenSpace, stars: &[Star], upto: usize, until: Option<Instant>) -> bool {
        let first = self.rays.len();
        for (w, star) in stars.iter().enumerate().take(upto).skip(self.arranged) {
            self.rays.extend(star.rays.iter().map(|&r| (w as u32, r)));
        }
        self.arranged = upto.max(self.arranged);
        self.ask(open, stars);
        let index = Index::new(open, stars, 0, self.rays.len() * 4);
        let extent = (index.high - index.low).max_element();
        for k in first..self.rays.len() {
            let (w, ray) = self.rays[k];
            self.add(ray.ends[1], &[w], extent, &index, stars);
        }
        let buckets = Buckets::new(&index, &self.rays);
        for cell in 0..buckets.starts.len() - 1 {
            if cell % 64 == 0 && until.is_some_and(|t| Instant::now() >= t) {
                return false;
            }
            let list = &buckets.rays[buckets.starts[cell]..buckets.starts[cell + 1]];
            for (i, &a) in list.iter().enumerate().rev() {
                // each pair once, and only pairs with a new ray; lists rise
                if (a as usize) < first {
                    break;
                }
                for &b in &list[..i] {
                    let ((wa, ra), (wb, rb)) = (self.rays[a as usize], self.rays[b as usize]);
                    if wa == wb || ra.corner == rb.corner {
                        continue;
                    }
                    let Some(p) = meet(ra.ends, rb.ends) else { continue };
                    if buckets.cell_of(p) == cell {
                        self.add(p, &[wa, wb], extent, &index, stars);
                    }
                }
            }
        }
        true
    }

    /// Adds a corner of the regions of `of`: it lies in these whatever rounding says, which is much where their borders
    /// are nearly parallel.
    fn add(&mut self, p: DVec2, of: &[u32], extent: f64, index: &Index, stars: &[Star]) {
        let key = (p / (extent * 1e-10)).round();
        let key = [key.x as i64, key.y as i64];
        if self.known.get(&key).is_some_and(|&k| of.iter().all(|w| self.sees[k as usize].contains(w))) {
            return;
        }
        let mut sees: Vec<u32> = index.seen_by(stars, p).collect();
        for &w in of {
            if let Err(place) = sees.binary_search(&w) {
                sees.insert(place, w);
            }
        }
        if self.merge {
            match self.same.entry(sees.clone()) {
                Entry::Occupied(same) => {
                    self.known.insert(key, *same.get());
                    return;
                }
                Entry::Vacant(new) => new.insert(self.points.len() as u32),
            };
        }
        self.known.insert(key, self.points.len() as u32);
        self.points.push(p);
        self.sees.push(sees);
    }
}

/// Where two segments meet; `None` when they miss each other or run alike.
fn meet([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> Option<DVec2> {
    let (u, v) = (b - a, d - c);
    let det = u.perp_dot(v);
    if det.abs() <= 1e-12 * u.length() * v.length() {
        return None;
    }
    let (s, t) = ((c - a).perp_dot(v) / det, (c - a).perp_dot(u) / det);
    let on = |t: f64| (-1e-9..=1.0 + 1e-9).contains(&t);
    (on(s) && on(t)).then(|| a + u * s.clamp(0.0, 1.0))
}

/// Witnesses by the cells that their regions' boxes touch.
struct Index {
    low: DVec2,
    high: DVec2,
    per_unit: DVec2,
    size: [usize; 2],
    starts: Vec<usize>,
    witnesses: Vec<u32>,
}

impl Index {
    fn new(open: &OpenSpace, stars: &[Star], first: usize, cells: usize) -> Self {
        let (low, high) = open.bounds();
        let across = (cells as f64 / 4.0).sqrt().clamp(1.0, 256.0).ceil();
        let per_unit = DVec2::splat(across) / (high - low);
        let size = [across as usize; 2];
        let mut index = Self { low, high, per_unit, size, starts: vec![], witnesses: vec![] };
        let reach = (high - low).max_element() * 1e-9;
        let mut entries = Vec::new();
        for (w, star) in stars.iter().enumerate().skip(first) {
            let ([x0, y0], [x1, y1]) = (index.xy(star.low - reach), index.xy(star.high + reach));
            for y in y0..=y1 {
                entries.extend((x0..=x1).map(|x| (y * index.size[0] + x, w as u32)));
            }
        }
        (index.starts, index.witnesses) = bucketed(entries, index.size[0] * index.size[1]);
        index
    }

    fn xy(&self, p: DVec2) -> [usize; 2] {
        let at = ((p - self.low) * self.per_unit).max(DVec2::ZERO);
        [(at.x as usize).min(self.size[0] - 1), (at.y as usize).min(self.size[1] - 1)]
    }

    /// The witnesses that see a point, in rising order.
    fn seen_by(&self, stars: &[Star], p: DVec2) -> impl Iterator<Item = u32> {
        let [x, y] = self.xy(p);
        let cell = y * self.size[0] + x;
        let list = &self.witnesses[self.starts[cell]..self.starts[cell + 1]];
        list.iter().copied().filter(move |&w| stars[w as usize].holds(p))
    }
}

/// Rays by the cells they may touch.
struct Buckets {
    low: DVec2,
    per_unit: DVec2,
    across: usize,
    starts: Vec<usize>,
    rays: Vec<u32>,
}

impl Buckets {
    fn new(index: &Index, rays: &[(u32, Ray)]) -> Self {
        let across = ((rays.len() as f64).sqrt() * 1.5).clamp(1.0, 1024.0).ceil();
        let per_unit = DVec2::splat(across) / (index.high - index.low);
        let mut new = Self { low: index.low, per_unit, across: across as usize, starts: vec![], rays: vec![] };
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

    fn cell_of(&self, p: DVec2) -> usize {
        let [x, y] = self.xy(p);
        y * self.across + x
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

/// Sorts (cell, item) pairs into cells; items of a cell rise if they came in rising order.
fn bucketed(entries: Vec<(usize, u32)>, cells: usize) -> (Vec<usize>, Vec<u32>) {
    let mut starts = vec![0; cells + 1];
    for (cell, _) in &entries {
        starts[cell + 1] += 1;
    }
    for cell in 0..cells {
        starts[cell + 1] += starts[cell];
    }
    let mut fill = starts.clone();
    let mut items = vec![0; entries.len()];
    for (cell, item) in entries {
        items[fill[cell]] = item;
        fill[cell] += 1;
    }
    (starts, items)
}
