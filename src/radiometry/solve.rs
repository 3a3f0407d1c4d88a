//! The joint fit: robust least squares on logarithms, where gains, vignetting and response add up.
//!
//! For a point that pictures i and j see, a channel's residual is
//! r = ln xᵢ + αᵢ + V(vᵢ, rᵢ²) + R(xᵢ) − (the same of j), with V = v r² + w r⁴ and R = b (x² − k x) for a given k:
//! linear in all unknowns. It is weighed by Geman and McClure's function (1 + (r/s)²)⁻², whose scale s follows the median residual
//! down, so that gains stops apart are found first and gloss is forgotten then.

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::collections::BTreeMap;

use super::overlap::Comparison;
use super::shot::{Shot, Stored};
use super::{Fit, FitSettings, Fitted};
use crate::cholesky::Cholesky;
use crate::components::{components, members};
use crate::panorama::{Coding, response_rises};
use crate::statistics::robust_deviation;

/// Two pictures with fewer common patches do not tie each other.
const FEWEST: usize = 24;

/// Vignetting and response are kept where they lower the spread to less than this share.
pub(super) const VIGNETTING_PAYS: f64 = 0.98;
const RESPONSE_PAYS: f64 = 0.95;

/// Rounds of reweighting, and the change of a logarithm that counts as none.
const ROUNDS: usize = 40;
const SETTLED: f64 = 1e-5;

/// Geman and McClure's scale in standard deviations of what is left, and the least one.
const SCALE: f64 = 2.5;
const LEAST_SCALE: f64 = 0.01;

/// The first scale: two stops and a half.
const FIRST_SCALE: f64 = 1.7;

/// What vignetting, response and the first guess's error of white balance are expected to be where pictures tell nothing:
/// zero, give or take this.
const EXPECTED: f64 = 0.3;

/// Comparisons whose sums are made together; fixed, so that results do not hang on threads.
const CHUNK: usize = 4096;

/// Where the unknowns stand: three logarithms of gains for each picture, then vignetting, then responses.
struct Unknowns {
    count: usize,
    vignetting: Vec<Option<usize>>,
    /// b, and k of R = b (x² − k x).
    response: Vec<Option<(usize, f64)>>,
}

/// A solution, and how far comparisons are off it.
pub(super) struct Solution {
    pub(super) theta: Vec<f64>,
    pub(super) spread: f64,
}

/// One channel of a comparison as an equation.
pub(super) struct Row {
    /// Residual with all unknowns zero.
    residual: f64,
    /// Unknowns and their factors.
    terms: SmallVec<[(usize, f64); 8]>,
    weight: f64,
    /// The pictures.
    of: [usize; 2],
    /// Counts only if above zero (1), below zero (−1), or always (0): clipped on one side.
    bound: i8,
}

impl Row {
    /// An equation that counts fully; `bound` as in the field.
    pub(super) fn new(residual: f64, terms: &[(usize, f64)], bound: i8) -> Self {
        Self { residual, terms: terms.into(), weight: 1.0, of: [0, 0], bound }
    }

    fn value(&self, theta: &[f64]) -> f64 {
        self.terms.iter().fold(self.residual, |sum, (k, factor)| sum + factor * theta[*k])
    }

    fn counts(&self, value: f64) -> bool {
        self.bound == 0 || f64::from(self.bound) * value > 0.0
    }
}

/// Fits all pictures that are tied together to each other. Vignetting and response are kept where they pay.
pub(super) fn fit(shots: &[Shot], overlap: &[Comparison], settings: &FitSettings) -> Fit {
    let tied = tied(shots.len(), overlap);
    let of_tied: Vec<&Comparison> = overlap.iter().filter(|c| c.of.iter().all(|(i, _)| tied[*i as usize])).collect();
    let gains = 3 * shots.len();
    let mut layout = Unknowns::of(shots, &tied, &[], [false, false]);
    let mut chosen = rows(shots, &of_tied, &layout);
    let before = spread(&chosen, &vec![0.0; layout.count], |_| true);
    let mut best = Solution { theta: vec![0.0; gains], spread: before };
    if !chosen.is_empty() {
        best = solve(&chosen, gains, gains, &tied);
        let mut with = [false, false];
        for (k, pays) in [(0, VIGNETTING_PAYS), (1, RESPONSE_PAYS)] {
            let mut try_with = with;
            try_with[k] = [true, settings.response][k];
            let more = Unknowns::of(shots, &tied, &of_tied, try_with);
            if more.count == layout.count {
                continue;
            }
            let rows = rows(shots, &of_tied, &more);
            let found = solve(&rows, more.count, gains, &tied);
            let rises = (0..shots.len()).all(|i| more.response_of(i, &found.theta).is_none_or(response_rises));
            if rises && found.spread < pays * best.spread {
                (layout, best, chosen, with) = (more, found, rows, try_with);
            }
        }
    }
    let pictures = shots.iter().enumerate().map(|(i, shot)| {
        let theta = &best.theta;
        let logs = Vec3::from([0, 1, 2].map(|c| theta[3 * i + c] as f32));
        let gain = shot.guess.gain * logs.map(f32::exp);
        let bend = |k: usize| Vec2::new(theta[k] as f32, theta[k + 1] as f32);
        let vignetting = layout.vignetting[i].map_or(shot.guess.vignetting, bend);
        Fitted {
            name: shot.name.clone(),
            tied: tied[i],
            comparisons: chosen.iter().filter(|r| r.of.contains(&i)).count(),
            spread: spread(&chosen, theta, |r| r.of.contains(&i)),
            gain: gain.to_array(),
            vignetting: vignetting.to_array(),
            response: layout.response_of(i, theta).unwrap_or(shot.guess.response).to_array(),
        }
    });
    Fit { pictures: pictures.collect(), comparisons: chosen.len(), spread_before: before, spread: best.spread }
}

/// Which pictures belong to the largest set that hangs together (the first of equals); none if that is of one.
fn tied(count: usize, overlap: &[Comparison]) -> Vec<bool> {
    let mut common = vec![0usize; count * count];
    for c in overlap {
        let [i, j] = c.of.map(|(i, _)| i as usize);
        common[i * count + j] += 1;
        common[j * count + i] += 1;
    }
    let common = &common;
    let near = |i: usize| (0..count).filter(move |j| common[i * count + j] >= FEWEST);
    let sets = members(&components(count, |_| true, near));
    let largest = sets.into_iter().rev().max_by_key(Vec::len).filter(|set| set.len() > 1).unwrap_or_default();
    (0..count).map(|i| largest.contains(&i)).collect()
}

impl Unknowns {
    /// With vignetting and response or without; `overlap` tells what values a response is held straight over.
    fn of(shots: &[Shot], tied: &[bool], overlap: &[&Comparison], [vignetting, response]: [bool; 2]) -> Self {
        let mut count = 3 * shots.len();
        // pictures of one camera and size share a lens; of one camera a sensor
        let (mut lenses, mut sensors) = (BTreeMap::new(), BTreeMap::new());
        let mut next = |size: usize| {
            count += size;
            count - size
        };
        let both = || shots.iter().zip(tied);
        let lens = both().map(|(shot, tied)| {
            // the corners of a panorama are no lens's
            let darkens = vignetting && *tied && shot.projection.is_photograph();
            let key = (&shot.camera, shot.picture.width, shot.picture.height);
            darkens.then(|| *lenses.entry(key).or_insert_with(|| next(2)))
        });
        let vignetting = lens.collect();
        let sensor = both().map(|(shot, tied)| {
            let bends = response && *tied && shot.coding != Coding::Linear;
            let at = bends.then(|| *sensors.entry(&shot.camera).or_insert_with(|| next(1)))?;
            Some((at, straightener(shots, overlap, &shot.camera)))
        });
        let response = sensor.collect();
        Self { count, vignetting, response }
    }

    /// The response of a picture, where one was fitted.
    fn response_of(&self, picture: usize, theta: &[f64]) -> Option<Vec2> {
        let (at, k) = self.response[picture]?;
        Some(Vec2::new((-k * theta[at]) as f32, theta[at] as f32))
    }
}

/// k for which b (x² − k x) leaves the slope of ln light over ln x at 1 on average over what a camera's pictures compare:
/// a response that is steeper or flatter as a whole is a power, which exposures cannot tell, and which would make pictures
/// agree by making everything alike.
fn straightener(shots: &[Shot], overlap: &[&Comparison], camera: &Option<String>) -> f64 {
    let (mut first, mut second) = (0.0, 0.0);
    let sides = overlap.iter().flat_map(|c| c.of).filter(|(i, _)| shots[*i as usize].camera == *camera);
    for x in sides.flat_map(|(_, stored)| stored.value.to_array()) {
        first += f64::from(x);
        second += f64::from(x * x);
    }
    if first > 0.0 { 2.0 * second / first } else { 0.0 }
}

/// The equations of all comparisons.
fn rows(shots: &[Shot], overlap: &[&Comparison], unknowns: &Unknowns) -> Vec<Row> {
    let mut rows = Vec::with_capacity(3 * overlap.len());
    for c in overlap {
        for channel in (0..3).filter(|&k| c.channels[k]) {
            let [i, j] = c.of.map(|(i, _)| i as usize);
            let bound = match c.of.map(|(_, stored)| stored.clipped[channel]) {
                [false, false] => 0,
                [true, false] => 1,
                [false, true] => -1,
                // both are at least something
                [true, true] => continue,
            };
            let mut row = Row { weight: f64::from(c.weight), of: [i, j], ..Row::new(0.0, &[], bound) };
            for ((i, stored), sign) in c.of.iter().zip([1.0, -1.0]) {
                row.add(&shots[*i as usize], *i as usize, stored, channel, sign, unknowns);
            }
            if row.residual.is_finite() {
                rows.push(row);
            }
        }
    }
    rows
}

impl Row {
    /// Adds one picture's side, or takes it off.
    fn add(&mut self, shot: &Shot, i: usize, stored: &Stored, channel: usize, sign: f64, unknowns: &Unknowns) {
        let (x, r2) = (f64::from(stored.value[channel]), f64::from(stored.radius2));
        let mut guess = shot.guess;
        self.terms.push((3 * i + channel, sign));
        if let Some(at) = unknowns.vignetting[i] {
            guess.vignetting = Vec2::ZERO;
            self.terms.extend([(at, sign * r2), (at + 1, sign * r2 * r2)]);
        }
        if let Some((at, k)) = unknowns.response[i] {
            guess.response = Vec2::ZERO;
            self.terms.push((at, sign * (x * x - k * x)));
        }
        self.residual += sign * f64::from(guess.light(stored.value, stored.radius2)[channel]).ln();
    }
}

/// The robust standard deviation of what is left.
fn spread(rows: &[Row], theta: &[f64], chosen: impl Fn(&Row) -> bool) -> f64 {
    let two_sided = rows.iter().filter(|r| r.bound == 0 && chosen(r));
    robust_deviation(two_sided.map(|r| r.value(theta))).unwrap_or(0.0)
}

/// Reweighted least squares over `n` unknowns, the first `gains` of which are logarithms of gains, three a picture. Of the
/// pictures in `tied` those that are have a sum of zero a channel, and the others stay; without any all gains are free.
pub(super) fn solve(rows: &[Row], n: usize, gains: usize, tied: &[bool]) -> Solution {
    let mut theta = vec![0.0; n];
    let mut scale = FIRST_SCALE;
    for _ in 0..ROUNDS {
        let sd = spread(rows, &theta, |_| true);
        // slowly: the few unclipped comparisons of an overexposed picture must not be taken for outliers on the way
        scale = (SCALE * sd).max(LEAST_SCALE).max(0.6 * scale);
        let (mut matrix, mut right) = normal_equations(rows, &theta, n, scale);
        // one factor a channel is free, and what is not tied stays
        for c in 0..3 {
            let pictures = || (0..tied.len()).filter(|&i| tied[i]);
            for i in pictures() {
                for j in pictures() {
                    matrix[(3 * i + c) * n + 3 * j + c] += rows.len() as f64;
                }
                right[3 * i + c] -= rows.len() as f64 * pictures().map(|j| theta[3 * j + c]).sum::<f64>();
            }
            for i in (0..tied.len()).filter(|&i| !tied[i]) {
                matrix[(3 * i + c) * n + 3 * i + c] += 1.0;
            }
        }
        // patches beside each other err alike: a prior counts like several
        let prior = 10.0 * (sd.max(1e-3) / EXPECTED).powi(2);
        for k in gains..n {
            matrix[k * n + k] += prior;
            right[k] -= prior * theta[k];
        }
        // so does white balance: a channel that is clipped all over goes with the others
        for picture in (0..gains).step_by(3) {
            for (a, b) in (0..9).map(|k| (k / 3, k % 3)) {
                let share = prior * if a == b { 2.0 / 3.0 } else { -1.0 / 3.0 };
                matrix[(picture + a) * n + picture + b] += share;
                right[picture + a] -= share * theta[picture + b];
            }
        }
        let Some(factor) = Cholesky::new(matrix, n) else { break };
        factor.solve(&mut right);
        let step = right;
        theta.iter_mut().zip(&step).for_each(|(t, s)| *t += s);
        if step.iter().all(|s| s.abs() < SETTLED) && scale <= (SCALE * sd).max(LEAST_SCALE) {
            break;
        }
    }
    let spread = spread(rows, &theta, |_| true);
    Solution { theta, spread }
}

/// JᵀWJ and −JᵀWr.
fn normal_equations(rows: &[Row], theta: &[f64], n: usize, scale: f64) -> (Vec<f64>, Vec<f64>) {
    let part = |rows: &[Row]| {
        let (mut matrix, mut right) = (vec![0.0; n * n], vec![0.0; n]);
        for row in rows {
            let r = row.value(theta);
            if !row.counts(r) {
                continue;
            }
            let weight = row.weight / (1.0 + (r / scale).powi(2)).powi(2);
            for &(a, fa) in &row.terms {
                right[a] -= weight * fa * r;
                for &(b, fb) in &row.terms {
                    matrix[a * n + b] += weight * fa * fb;
                }
            }
        }
        (matrix, right)
    };
    let parts: Vec<_> = rows.par_chunks(CHUNK).map(part).collect();
    parts.into_iter().fold((vec![0.0; n * n], vec![0.0; n]), |mut sum, part| {
        sum.0.iter_mut().zip(part.0).for_each(|(s, p)| *s += p);
        sum.1.iter_mut().zip(part.1).for_each(|(s, p)| *s += p);
        sum
    })
}
