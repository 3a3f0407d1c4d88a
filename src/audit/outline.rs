//! Parts of the model that stand beside their place: their outlines are in the photograph, but shifted.
//!
//! Near an outline no probe can be asked, since it sees past it, and a sideways move leaves the surface in its own plane.
//! But the outline itself is an edge of render and photograph alike. So each part's outline is laid over the photograph at
//! small shifts, and compared by correlation where it is with the place where it fits best.

use glam::Vec3;
use rayon::prelude::*;

use super::regions::dilated;
use super::surfaces::NONE;
use super::view::{Maps, Prepared};
use super::{Joins, Shift, correlation};
use crate::panorama::luminance;

/// The test works on pictures of about this size.
const SIDE: usize = 256;

/// Furthest shift along each side, pixels of that size.
const REACH: isize = 10;

/// A pose is trusted to so many pixels: less is no shift.
const LEAST_PX: f32 = 1.25;

/// Structure is what is finer than the second of these standard deviations and coarser than the first, pixels.
const BAND: [f32; 2] = [0.7, 6.0];

/// An outline steps back by at least this share of its distance.
const STEP: f32 = 0.03;

/// Fewer pixels along an outline tell nothing.
const FEWEST: usize = 24;

/// A part larger than this share of the picture is its room.
const LARGEST: f32 = 0.35;

/// Neighbouring pixels along an outline are alike: so many tell as much as one.
const ALIKE_PX: f32 = 8.0;

/// Structure of less variance than this is none.
const LEAST_VARIANCE: f64 = 1e-6;

/// Correlation from which on an outline counts as found.
const FOUND: f32 = 0.6;

/// And what it must gain over the outline's own place.
const GAINED: f32 = 0.15;

/// Logarithm of the odds that it takes, after all the shifts that are tried.
pub(super) const ODDS: f32 = 8.0;

/// A part whose outline the photograph shows elsewhere.
pub(super) struct Shifted {
    /// The part's pixels and those that it is shifted to, in order.
    pub(super) pixels: Vec<usize>,
    /// Pixels of the audit's size, to the right and down.
    pub(super) by_px: [f32; 2],
    /// The same on the part, metres.
    pub(super) metres: f32,
    /// Logarithm of the odds against the model's place.
    pub(super) odds: f32,
}

impl Shifted {
    /// Where the part really stands.
    pub(super) fn shift(&self) -> Shift {
        let [right, down] = self.by_px.map(|px| f64::from(px * self.metres / self.by_px[0].hypot(self.by_px[1])));
        Shift { right_m: right, down_m: down }
    }
}

/// Looks for parts whose outlines are shifted.
pub(super) fn shifted(prepared: &Prepared, maps: &Maps) -> Vec<Shifted> {
    let small = Small::new(prepared, maps);
    let (w, h) = (small.width, small.height);
    let mut members: Vec<Vec<usize>> = vec![];
    for (i, part) in small.part.iter().enumerate() {
        if *part != NONE {
            let k = *part as usize;
            members.resize(members.len().max(k + 1), vec![]);
            members[k].push(i);
        }
    }
    let largest = (LARGEST * (w * h) as f32) as usize;
    members
        .par_iter()
        .filter(|m| m.len() >= FEWEST && m.len() <= largest)
        .filter_map(|m| small.best(m))
        .map(|(members, shift, odds)| small.whole(maps, members, shift, odds))
        .collect()
}

/// The pictures at the test's size.
struct Small {
    by: usize,
    width: usize,
    height: usize,
    part: Vec<u32>,
    distance: Vec<f32>,
    model: Vec<f32>,
    photo: Vec<f32>,
    /// 1 where the photograph can be used.
    usable: Vec<f32>,
}

impl Small {
    fn new(prepared: &Prepared, maps: &Maps) -> Self {
        let s = &maps.surfaces;
        let by = s.width.max(s.height).div_ceil(SIDE);
        let (width, height) = (s.width / by, s.height / by);
        let middle = |i: usize| (i / width * by + by / 2) * s.width + i % width * by + by / 2;
        let mean = |f: &(dyn Fn(usize) -> f32 + Sync)| -> Vec<f32> {
            let of = |i: usize| {
                let first = i / width * by * s.width + i % width * by;
                let all = (0..by * by).map(|k| f(first + k / by * s.width + k % by));
                all.sum::<f32>() / (by * by) as f32
            };
            (0..width * height).into_par_iter().map(of).collect()
        };
        let usable: Vec<f32> = mean(&|i| maps.usable[i]).iter().map(|u| if *u > 0.99 { 1.0 } else { 0.0 }).collect();
        let open = Joins::open(width, height);
        let band = |values: &[f32], weights: &[f32]| -> Vec<f32> {
            let [fine, coarse] = BAND.map(|sigma| open.mean(values, weights, sigma));
            fine.iter().zip(&coarse).map(|(f, c)| (f - c).clamp(-1.0, 1.0)).collect()
        };
        let ln = |v: f32| v.max(1e-6).ln();
        let photo =
            mean(&|i| if maps.log_photo[i].is_finite() { ln(luminance(maps.log_photo[i].map(f32::exp))) } else { 0.0 });
        let model = mean(&|i| ln(luminance(maps.render.pixels[i].max(Vec3::ZERO))));
        let all = vec![1.0; width * height];
        Self {
            by,
            width,
            height,
            part: (0..width * height)
                .map(|i| s.triangle[middle(i)])
                .map(|t| if t == NONE { NONE } else { prepared.parts[t as usize] })
                .collect(),
            distance: (0..width * height).map(|i| s.distance[middle(i)]).collect(),
            model: band(&model, &all),
            photo: band(&photo, &usable),
            usable,
        }
    }

    /// The shift at which a part's outline fits the photograph, if that is not its place, and the odds.
    fn best<'a>(&self, members: &'a [usize]) -> Option<(&'a [usize], [f32; 2], f32)> {
        let (w, h) = (self.width, self.height);
        let part = self.part[members[0]];
        let mut outline = vec![false; w * h];
        let mut count = 0;
        for &i in members {
            let (x, y) = (i % w, i / w);
            let behind = |j: usize| self.part[j] != part && self.distance[j] > self.distance[i] * (1.0 + STEP);
            let step = (x > 0 && behind(i - 1))
                || (x + 1 < w && behind(i + 1))
                || (y > 0 && behind(i - w))
                || (y + 1 < h && behind(i + w));
            if step {
                outline[i] = true;
                count += 1;
            }
        }
        if count < FEWEST {
            return None;
        }
        let near = dilated(&outline, w, h, 2);
        let band: Vec<usize> = (0..w * h).filter(|i| near[*i]).collect();
        let mut best = (f32::NEG_INFINITY, [0, 0]);
        let own = self.correlation(&band, [0, 0]).0;
        let mut told = 0.0f32;
        for dy in -REACH..=REACH {
            for dx in -REACH..=REACH {
                let (c, n) = self.correlation(&band, [dx, dy]);
                if c > best.0 {
                    best = (c, [dx, dy]);
                    told = n;
                }
            }
        }
        let edge = best.1.iter().any(|d| d.abs() == REACH);
        if edge || best.1 == [0, 0] {
            return None;
        }
        // finer: the parabola through the best and its neighbours
        let at = |dx: isize, dy: isize| self.correlation(&band, [best.1[0] + dx, best.1[1] + dy]).0;
        let finer = |before: f32, after: f32| {
            let bend = before + after - 2.0 * best.0;
            if bend < -1e-6 && bend.is_finite() { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
        };
        let dx = best.1[0] as f32 + finer(at(-1, 0), at(1, 0));
        let dy = best.1[1] as f32 + finer(at(0, -1), at(0, 1));
        let gap = |c: f32| (1.0 - c.clamp(0.0, 0.99).powi(2)).ln();
        let shifts = ((2 * REACH + 1) as f32).powi(2).ln();
        let odds = 0.5 * told / ALIKE_PX * (gap(own) - gap(best.0)) - shifts;
        let found = best.0 >= FOUND && best.0 >= own + GAINED && dx.hypot(dy) > LEAST_PX;
        (found && odds >= ODDS).then_some((members, [dx, dy], odds))
    }

    /// Correlation of the model's structure with the photograph's at a shift, and over how many pixels.
    fn correlation(&self, band: &[usize], [dx, dy]: [isize; 2]) -> (f32, f32) {
        let (w, h) = (self.width as isize, self.height as isize);
        let pairs = band.iter().filter_map(|&i| {
            let (x, y) = (i as isize % w + dx, i as isize / w + dy);
            let inside = x >= 0 && y >= 0 && x < w && y < h;
            let j = inside.then(|| (y * w + x) as usize)?;
            (self.usable[j] != 0.0).then(|| (self.model[i], self.photo[j]))
        });
        let (c, n) = correlation(pairs, LEAST_VARIANCE);
        // what is mostly shifted out of the picture is not compared
        if n < 0.7 * band.len() as f64 { (f32::NEG_INFINITY, 0.0) } else { (c, n as f32) }
    }

    /// The part at the audit's size.
    fn whole(&self, maps: &Maps, members: &[usize], shift: [f32; 2], odds: f32) -> Shifted {
        let s = &maps.surfaces;
        let mut inside = vec![false; s.width * s.height];
        let mut distance = 0.0;
        for &i in members {
            distance += self.distance[i];
            for d in [[0, 0], shift.map(|d| d.round() as isize)] {
                let (x, y) = ((i % self.width) as isize + d[0], (i / self.width) as isize + d[1]);
                if x < 0 || y < 0 || x >= self.width as isize || y >= self.height as isize {
                    continue;
                }
                for k in 0..self.by * self.by {
                    let (x, y) = (x as usize * self.by + k % self.by, y as usize * self.by + k / self.by);
                    inside[y * s.width + x] = true;
                }
            }
        }
        let by_px = shift.map(|d| d * self.by as f32);
        Shifted {
            pixels: (0..inside.len()).filter(|i| inside[*i]).collect(),
            by_px,
            metres: by_px[0].hypot(by_px[1]) * distance / members.len() as f32 / s.focal,
            odds,
        }
    }
}
