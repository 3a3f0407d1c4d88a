//! The geometry test: what the photograph shows against what each probe saw of the same surface. No albedo takes part.
//!
//! If the surface is where the model has it, the probe's light, carried to the camera over that surface, is the
//! photograph. If it is not, there is parallax between them. Every pixel's plane is swept along its normal and the
//! places are compared by how well photograph and probes agree over a window.

use glam::Vec3;
use rayon::prelude::*;
use std::cmp::Ordering;

use super::gloss::Gloss;
use super::photo::Reduced;
use super::probe_view::ProbeView;
use super::radiometry::{Radiometry, Sights};
use super::surfaces::Surfaces;

/// How far a surface may be off its place on either side, metres: each step a quarter of the way, since pictures part in
/// proportion to it.
const STEPS_M: [f32; 17] =
    [0.01, 0.015, 0.02, 0.027, 0.035, 0.045, 0.057, 0.072, 0.09, 0.112, 0.14, 0.175, 0.22, 0.275, 0.345, 0.43, 0.54];

/// Number of places that are tried.
pub(super) const PLACES: usize = 2 * STEPS_M.len() + 1;

/// Index of the model's own place.
pub(super) const HERE: usize = STEPS_M.len();

/// Steps that a surface must be off to be sure that it would be noticed: 9 and 11 cm.
const NOTICED: [usize; 2] = [9, 10];

/// Metres along the normal, from behind the model's surface to before it.
pub(super) fn place(k: usize) -> f32 {
    match k.cmp(&HERE) {
        Ordering::Less => -STEPS_M[HERE - 1 - k],
        Ordering::Equal => 0.0,
        Ordering::Greater => STEPS_M[k - HERE - 1],
    }
}

/// Standard deviation of the windows, pixels.
const WINDOW: f32 = 4.0;

/// And of those that places are compared over.
const SWEEP_WINDOW: f32 = 6.0;

/// A squared difference counts at most this many times its variance: outliers do not outvote.
const MOST: f32 = 16.0;

/// Where a surface may be taken for a probe's error of registration: this share of its pixel.
const PROBE_SLACK: f32 = 0.25;

/// And this many pixels of the photograph.
const PHOTO_SLACK: f32 = 0.3;

/// Contrast, over that of the noise, from which on a surface's place can be told.
const TELLING: f32 = 1.5;

/// And this share of the contrast may be lost.
const LOST: f32 = 0.3;

/// A probe must move by so many of its pixels (or the photograph's, if greater) when the surface moves by 10 cm, or it
/// cannot tell.
const LEAST_PARALLAX: f32 = 0.3;

/// What the geometry test says of each pixel.
pub(super) struct Geometry {
    /// Mean squared difference over the window at the model's own place in the probe that agrees best, in units of the
    /// variance that a right model has.
    pub(super) mismatch: Vec<f32>,
    /// Mean squared difference of logarithms at the model's own place in the probe that agrees best; `None` where none
    /// sees it.
    pub(super) rest: Vec<Option<f32>>,
    /// How much less the sum over all probes becomes at the best place.
    pub(super) gain: Vec<f32>,
    /// The same over what is left there.
    pub(super) ratio: Vec<f32>,
    /// The best place, metres along the normal.
    pub(super) best_m: Vec<f32>,
    /// How much more it would be 10 cm off on either side, the lesser: whether a moved surface would be noticed.
    pub(super) sensitivity: Vec<f32>,
    /// Number of probes that see the pixel well, and those of them with parallax.
    pub(super) seen: Vec<u8>,
    pub(super) able: Vec<u8>,
    /// By how many pixels, of the probe that tells best, the pictures part when the surface moves by a metre.
    pub(super) parallax: Vec<f32>,
    /// What each probe needs to compare places with.
    of: Vec<OfProbe>,
}

impl Geometry {
    /// Squared difference between the photograph in a pixel and what the probes that can tell saw at a place on its ray,
    /// where the ray meets the surface moved by so many metres along its normal: in units of the variance that a right
    /// model has, summed over the probes.
    pub(super) fn cost(&self, surfaces: &Surfaces, probes: &[ProbeView], i: usize, metres: f32) -> f32 {
        let (normal, ray) = (surfaces.normal[i], surfaces.ray[i]);
        let point = surfaces.position[i] + ray * (metres / normal.dot(ray).min(-0.1));
        self.of.iter().zip(probes).map(|(of, probe)| of.cost(probe, i, point)).sum()
    }

    /// The same at the model's own place, without what gloss would do.
    pub(super) fn dull_cost(&self, surfaces: &Surfaces, probes: &[ProbeView], i: usize) -> f32 {
        let seen = self.of.iter().zip(probes).filter(|(of, _)| of.weight[i] > 0.0);
        seen.map(|(of, probe)| of.dull_cost(probe, i, surfaces.position[i])).sum()
    }

    /// The photograph's logarithm in a pixel, as soft as a probe and in its light; NaN where they cannot be compared.
    pub(super) fn soft(&self, probe: usize, i: usize) -> Vec3 {
        self.of[probe].soft[i]
    }

    /// Whether some probe sees enough in a pixel for its place to be told.
    pub(super) fn tells(&self, i: usize) -> bool {
        self.of.iter().any(|of| of.weight[i] > 0.0 && of.plain[i].is_none())
    }
}

struct OfProbe {
    /// The photograph as soft as the probe and in its light.
    soft: Vec<Vec3>,
    level: Vec<u8>,
    /// What gloss may add to the difference of logarithms.
    bounds: Vec<[Vec3; 2]>,
    /// Variance of the difference where the model is right.
    variance: Vec<f32>,
    /// Cost at the model's own place, where nothing else can be told.
    plain: Vec<Option<f32>>,
    weight: Vec<f32>,
    mismatch: Vec<f32>,
    rest: Vec<f32>,
    seen: Vec<bool>,
    parallax: Vec<f32>,
}

impl OfProbe {
    fn cost(&self, probe: &ProbeView, i: usize, point: Vec3) -> f32 {
        if self.weight[i] == 0.0 {
            return 0.0;
        }
        self.plain[i].unwrap_or_else(|| self.of_difference(i, self.difference(probe, i, point)))
    }

    /// The cost without what gloss would do.
    fn dull_cost(&self, probe: &ProbeView, i: usize, point: Vec3) -> f32 {
        let [below, above] = self.bounds[i];
        let d = self.difference(probe, i, point);
        self.of_difference(i, d - d.clamp(below, above))
    }

    /// The photograph over what the probe saw of a point, as logarithms.
    fn difference(&self, probe: &ProbeView, i: usize, point: Vec3) -> Vec3 {
        self.soft[i] - probe.log_radiance(point, usize::from(self.level[i]))
    }

    fn of_difference(&self, i: usize, difference: Vec3) -> f32 {
        let e = difference.length_squared() / (3.0 * self.variance[i]);
        if e.is_finite() { e.min(MOST) } else { MOST }
    }
}

/// Runs the test.
pub(super) fn test(
    surfaces: &Surfaces,
    sights: &Sights,
    probes: &[ProbeView],
    photo: &Reduced,
    soft: &[Vec<Vec3>],
    radiometry: &Radiometry,
    gloss: &Gloss,
) -> Geometry {
    let n = surfaces.triangle.len();
    let each: Vec<OfProbe> = probes
        .iter()
        .enumerate()
        .map(|(k, probe)| {
            // most of the picture is right: the spread over all of it is what a right model has
            let base = radiometry.spread[k].unwrap_or(0.1).clamp(0.03, 0.2).max(photo.noise);
            let shift = radiometry.offset - radiometry.gains[k];
            // in the probe's light
            let lit = |i: usize| soft[k][i] + shift + Vec3::splat(radiometry.vignetting * surfaces.radius2(i));
            of_probe(surfaces, &sights.of[k], probe, (0..n).map(lit).collect(), base, |i, light| {
                gloss.bounds(Some(k), i, light)
            })
        })
        .collect();
    let mut seen = vec![0u8; n];
    let mut able = vec![0u8; n];
    let mut mismatch = vec![f32::INFINITY; n];
    let mut most = vec![0.0f32; n];
    let mut rest: Vec<Option<f32>> = vec![None; n];
    for p in &each {
        for i in 0..n {
            seen[i] += u8::from(p.seen[i]);
            able[i] += u8::from(p.weight[i] > 0.0);
            if p.weight[i] > 0.0 {
                mismatch[i] = mismatch[i].min(p.mismatch[i]);
                rest[i] = Some(rest[i].map_or(p.rest[i], |r| r.min(p.rest[i])));
                most[i] = most[i].max(10.0 * p.parallax[i]);
            }
        }
    }
    for m in &mut mismatch {
        *m = if m.is_finite() { *m } else { 0.0 };
    }
    let mut geometry = Geometry {
        mismatch,
        rest,
        gain: vec![],
        ratio: vec![],
        best_m: vec![0.0; n],
        sensitivity: vec![],
        seen,
        able,
        parallax: most,
        of: each,
    };
    let windowed = |k: usize| {
        let costs: Vec<f32> = (0..n).into_par_iter().map(|i| geometry.cost(surfaces, probes, i, place(k))).collect();
        surfaces.shape.smoothed(&costs, SWEEP_WINDOW)
    };
    let here = windowed(HERE);
    let mut least = here.clone();
    let mut best_m = vec![0.0; n];
    let [mut back, mut front] = [0, 1].map(|_| vec![0.0f32; n]);
    // a few places at a time: each is as large as the picture
    let others: Vec<usize> = (0..PLACES).filter(|k| *k != HERE).collect();
    for few in others.chunks(4) {
        let all: Vec<Vec<f32>> = few.par_iter().map(|k| windowed(*k)).collect();
        for (&k, costs) in few.iter().zip(&all) {
            for i in 0..n {
                if costs[i] < least[i] {
                    (least[i], best_m[i]) = (costs[i], place(k));
                }
            }
            if NOTICED.contains(&k.abs_diff(HERE)) {
                let side = if k < HERE { &mut back } else { &mut front };
                side.iter_mut().zip(costs).for_each(|(s, c)| *s = s.max(*c));
            }
        }
    }
    let window_area = 4.0 * std::f32::consts::PI * SWEEP_WINDOW * SWEEP_WINDOW;
    geometry.gain = (0..n).map(|i| (here[i] - least[i]) * window_area).collect();
    geometry.ratio =
        (0..n).map(|i| (here[i] - least[i]) / (least[i] + 0.3 * f32::from(geometry.able[i].max(1)))).collect();
    geometry.sensitivity = (0..n).map(|i| (back[i].min(front[i]) - least[i]) * window_area).collect();
    geometry.best_m = best_m;
    geometry
}

/// One probe's part: `soft` is the photograph as soft as the probe and in its light, `base` the standard deviation of their
/// difference where the model is right and nothing has edges, `bounds` what gloss may add to it in a pixel of this light.
fn of_probe(
    surfaces: &Surfaces,
    sights: &[Option<super::probe_view::Sight>],
    probe: &ProbeView,
    soft: Vec<Vec3>,
    base: f32,
    bounds: impl Fn(usize, Vec3) -> [Vec3; 2],
) -> OfProbe {
    let n = sights.len();
    let w = surfaces.width;
    let here: Vec<Vec3> = (0..n)
        .into_par_iter()
        .map(|i| match &sights[i] {
            Some(sight) => probe.log_radiance(surfaces.position[i], Sights::level(surfaces, i, sight)),
            None => Vec3::NAN,
        })
        .collect();
    // variance of a difference: the view's own spread, and both pictures' slopes times how far they may be off
    let slope = |values: &[Vec3], i: usize| -> f32 {
        let d = |j: usize| {
            let d = (values[j] - values[i]).length_squared() / 3.0;
            if d.is_finite() { d } else { 0.0 }
        };
        let (x, y) = (i % w, i / w);
        let mut sum = 0.0;
        if x > 0 && x + 1 < w && y > 0 && i + w < n {
            sum = 0.5 * (d(i - 1) + d(i + 1) + d(i - w) + d(i + w));
        }
        sum
    };
    // a probe's picture may be softer or noisier than it should be: part of the contrast may be missing in either
    let usable: Vec<f32> = (0..n).map(|i| if soft[i].is_finite() && here[i].is_finite() { 1.0 } else { 0.0 }).collect();
    let smoothed = surfaces.shape.smoothed(&usable, WINDOW);
    let contrast = |values: &[Vec3]| -> Vec<f32> {
        let bright: Vec<f32> = values.iter().map(|v| v.element_sum() / 3.0).collect();
        let square: Vec<f32> = bright.iter().map(|v| v * v).collect();
        let mean = surfaces.shape.mean_with(&bright, &usable, &smoothed, WINDOW);
        let square = surfaces.shape.mean_with(&square, &usable, &smoothed, WINDOW);
        square.iter().zip(&mean).map(|(s, m)| (s - m * m).max(0.0)).collect()
    };
    let (in_photo, in_probe) = (contrast(&soft), contrast(&here));
    let variance: Vec<f32> = (0..n)
        .into_par_iter()
        .map(|i| {
            let Some(sight) = &sights[i] else { return 1.0 };
            let ratio = sight.footprint / surfaces.footprint(i);
            let slack = PROBE_SLACK * ratio.max(1.0) + PHOTO_SLACK;
            base * base
                + 0.5 * (slope(&soft, i) + slope(&here, i)) * slack * slack
                + 0.5 * (in_photo[i] + in_probe[i]) * LOST * LOST
        })
        .collect();
    let seen: Vec<bool> = (0..n).map(|i| soft[i].is_finite() && here[i].is_finite()).collect();
    let parallax: Vec<f32> = (0..n).into_par_iter().map(|i| parallax(surfaces, probe, sights[i].as_ref(), i)).collect();
    let able = |i: usize| seen[i] && parallax[i] >= LEAST_PARALLAX;
    let weight: Vec<f32> = (0..n).map(|i| if able(i) { 1.0 } else { 0.0 }).collect();
    let level = |i: usize| sights[i].as_ref().map_or(0, |s| Sights::level(surfaces, i, s));
    let mut of = OfProbe {
        soft,
        level: (0..n).map(|i| level(i) as u8).collect(),
        bounds: (0..n)
            .map(|i| if here[i].is_finite() { bounds(i, here[i].map(f32::exp)) } else { [Vec3::ZERO; 2] })
            .collect(),
        variance,
        plain: vec![None; n],
        weight,
        mismatch: vec![],
        rest: vec![],
        seen,
        parallax,
    };
    let here: Vec<f32> = (0..n).into_par_iter().map(|i| of.cost(probe, i, surfaces.position[i])).collect();
    let dull: Vec<f32> = (0..n)
        .into_par_iter()
        .map(|i| if of.weight[i] > 0.0 { of.dull_cost(probe, i, surfaces.position[i]) } else { 0.0 })
        .collect();
    of.mismatch = surfaces.shape.mean(&dull, &of.weight, WINDOW);
    of.rest = dull.iter().zip(&of.variance).map(|(c, v)| c * v).collect();
    // contrast that the noise alone would give says nothing of a surface's place
    of.plain = (0..n).map(|i| (in_photo[i].max(in_probe[i]) < (TELLING * base).powi(2)).then_some(here[i])).collect();
    of
}

/// By how many pixels (of the probe or the photograph, whichever are the coarser) the two pictures of a surface part
/// when it moves 10 cm along its normal.
fn parallax(surfaces: &Surfaces, probe: &ProbeView, sight: Option<&super::probe_view::Sight>, i: usize) -> f32 {
    const STEP_M: f32 = 0.1;
    let Some(sight) = sight else { return 0.0 };
    let (position, ray) = (surfaces.position[i], surfaces.ray[i]);
    let cos = surfaces.normal[i].dot(ray).min(-0.1);
    let moved = position + ray * (STEP_M / cos);
    let (a, b) = ((position - probe.origin).normalize(), (moved - probe.origin).normalize());
    // the angle at the probe, as a length on the surface
    let angle = a.cross(b).length();
    let coarser = probe.pixel_angle().max(surfaces.footprint(i) / sight.footprint * probe.pixel_angle());
    angle / coarser
}
