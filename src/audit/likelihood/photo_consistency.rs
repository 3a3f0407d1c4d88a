//! The geometry test: what the photograph shows against what each probe saw of the same surface. No albedo takes part.
//!
//! If the surface is where the model has it, the probe's light, carried to the camera over that surface, is the
//! photograph. If it is not, there is parallax between them. Every pixel's plane is swept along its normal and the
//! places are compared by how well photograph and probes agree over a window.

use glam::Vec3;
use rayon::prelude::*;
use std::cmp::Ordering;

use crate::audit::likelihood::noise::{Noise, Parts, Sample};
use crate::audit::observe::geometry_buffer::GeometryBuffer;
use crate::audit::observe::gloss::{Gloss, bounds};
use crate::audit::observe::probe_view::ProbeView;
use crate::audit::observe::radiometry::{Radiometry, Sights};

/// How far a surface may be off its place on either side, metres: each step a quarter of the way, since pictures part in
/// proportion to it.
const STEPS_M: [f32; 17] =
    [0.01, 0.015, 0.02, 0.027, 0.035, 0.045, 0.057, 0.072, 0.09, 0.112, 0.14, 0.175, 0.22, 0.275, 0.345, 0.43, 0.54];

/// Number of places that are tried.
pub(crate) const PLACES: usize = 2 * STEPS_M.len() + 1;

/// Index of the model's own place.
pub(crate) const HERE: usize = STEPS_M.len();

/// Steps that a surface must be off to be sure that it would be noticed: 9 and 11 cm.
const NOTICED: [usize; 2] = [9, 10];

/// Metres along the normal, from behind the model's surface to before it.
pub(crate) fn place(k: usize) -> f32 {
    match k.cmp(&HERE) {
        Ordering::Less => -STEPS_M[HERE - 1 - k],
        Ordering::Equal => 0.0,
        Ordering::Greater => STEPS_M[k - HERE - 1],
    }
}

/// Standard deviation of the windows, pixels.
const WINDOW: f32 = 3.0;

/// And of those that places are compared over.
const SWEEP_WINDOW: f32 = 6.0;

/// A squared difference counts at most this many times its variance: outliers do not outvote.
const MOST: f32 = 16.0;

/// Over windows, this much: most of one must be off, and not an edge in it.
const MOST_IN_WINDOW: f32 = 6.0;

/// Contrast, over that of the noise, from which on a surface's place can be told.
const TELLING: f32 = 1.5;

/// A probe must move by so many of its pixels (or the photograph's, if greater) when the surface moves by 10 cm, or it
/// cannot tell.
const LEAST_PARALLAX: f32 = 0.3;

/// What the geometry test says of each pixel.
pub(crate) struct Geometry {
    /// Mean squared difference over the window at the model's own place in the probe that agrees best, in units of the
    /// variance that a right model has.
    pub(crate) mismatch: Vec<f32>,
    /// How much less the sum over all probes becomes at the best place.
    pub(crate) gain: Vec<f32>,
    /// The same over what is left there.
    pub(crate) ratio: Vec<f32>,
    /// The best place, metres along the normal.
    pub(crate) best_m: Vec<f32>,
    /// How much more it would be 10 cm off on either side, the lesser: whether a moved surface would be noticed.
    pub(crate) sensitivity: Vec<f32>,
    /// Number of probes that see the pixel well, and those of them with parallax.
    pub(crate) seen: Vec<u8>,
    pub(crate) able: Vec<u8>,
    /// By how many pixels, of the probe that tells best, the pictures part when the surface moves by a metre.
    pub(crate) parallax: Vec<f32>,
    /// What each probe needs to compare places with.
    of: Vec<OfProbe>,
    noise: Noise,
}

impl Geometry {
    /// Squared difference between the photograph in a pixel and what the probes that can tell saw at a place on its ray,
    /// where the ray meets the surface moved by so many metres along its normal: in units of the variance that a right
    /// model has, summed over the probes.
    pub(crate) fn cost(&self, surfaces: &GeometryBuffer, probes: &[ProbeView], i: usize, metres: f32) -> f32 {
        let (normal, ray) = (surfaces.normal[i], surfaces.ray[i]);
        let point = surfaces.position[i] + ray * (metres / normal.dot(ray).min(-0.1));
        self.of.iter().zip(probes).map(|(of, probe)| of.cost(&self.noise, probe, i, point)).sum()
    }

    /// The probes that see a pixel well and with parallax.
    fn telling(&self, i: usize) -> impl Iterator<Item = usize> {
        (0..self.of.len()).filter(move |k| self.of[*k].weight[i] > 0.0)
    }

    /// Logarithm of how much brighter the photograph is than what the probe saw that agrees best.
    pub(crate) fn brighter(&self, surfaces: &GeometryBuffer, probes: &[ProbeView], i: usize) -> Option<f32> {
        let best = self.telling(i).min_by(|a, b| self.of[*a].mismatch[i].total_cmp(&self.of[*b].mismatch[i]))?;
        let of = &self.of[best];
        let probe = probes[best].log_radiance(surfaces.position[i], usize::from(of.level[i]));
        Some((of.soft[i] - probe).element_sum() / 3.0).filter(|d| d.is_finite())
    }

    /// Whether some probe sees enough in a pixel for its place to be told.
    pub(crate) fn tells(&self, i: usize) -> bool {
        self.of.iter().any(|of| of.weight[i] > 0.0 && of.plain[i].is_none())
    }
}

struct OfProbe {
    /// The photograph as soft as the probe and in its light.
    soft: Vec<Vec3>,
    level: Vec<u8>,
    /// Variance of the difference where the model is right.
    variance: Vec<f32>,
    /// Cost at the model's own place, where nothing else can be told.
    plain: Vec<Option<f32>>,
    weight: Vec<f32>,
    mismatch: Vec<f32>,
    seen: Vec<bool>,
    parallax: Vec<f32>,
}

impl OfProbe {
    fn cost(&self, noise: &Noise, probe: &ProbeView, i: usize, point: Vec3) -> f32 {
        if self.weight[i] == 0.0 {
            return 0.0;
        }
        self.plain[i].unwrap_or_else(|| {
            let difference = self.soft[i] - probe.log_radiance(point, usize::from(self.level[i]));
            limited(noise.squared(difference, self.variance[i]))
        })
    }
}

fn limited(squared: f32) -> f32 {
    if squared.is_finite() { squared.min(MOST) } else { MOST }
}

/// What a probe shows of each pixel's surface at the model's place, beside the photograph.
struct Carried {
    soft: Vec<Vec3>,
    here: Vec<Vec3>,
    level: Vec<u8>,
    /// What the parts of the variance are to be multiplied by.
    by: Vec<Parts>,
    seen: Vec<bool>,
}

/// Carries a probe's light over the model into the view. `soft` is the photograph as soft as the probe and in its light.
fn carried(
    surfaces: &GeometryBuffer,
    sights: &[Option<crate::audit::observe::probe_view::Sight>],
    probe: &ProbeView,
    soft: Vec<Vec3>,
) -> Carried {
    let n = soft.len();
    let w = surfaces.width;
    let level: Vec<u8> =
        (0..n).map(|i| sights[i].as_ref().map_or(0, |x| Sights::level(surfaces, i, x) as u8)).collect();
    let here: Vec<Vec3> = (0..n)
        .into_par_iter()
        .map(|i| match &sights[i] {
            Some(_) => probe.log_radiance(surfaces.position[i], usize::from(level[i])),
            None => Vec3::NAN,
        })
        .collect();
    let seen: Vec<bool> = (0..n).map(|i| soft[i].is_finite() && here[i].is_finite()).collect();
    // mean squared slope to the four neighbours
    let slope = |values: &[Vec3], i: usize| -> f32 {
        let d = |j: usize| {
            let d = (values[j] - values[i]).length_squared() / 3.0;
            if d.is_finite() { d } else { 0.0 }
        };
        let (x, y) = (i % w, i / w);
        if x > 0 && x + 1 < w && y > 0 && i + w < n { 0.5 * (d(i - 1) + d(i + 1) + d(i - w) + d(i + w)) } else { 0.0 }
    };
    let weight: Vec<f32> = seen.iter().map(|s| if *s { 1.0 } else { 0.0 }).collect();
    let smoothed = surfaces.shape.smoothed(&weight, WINDOW);
    let contrast = |values: &[Vec3]| -> Vec<f32> {
        let bright: Vec<f32> =
            values.iter().map(|v| v.element_sum() / 3.0).map(|b| if b.is_finite() { b } else { 0.0 }).collect();
        let square: Vec<f32> = bright.iter().map(|v| v * v).collect();
        let mean = surfaces.shape.mean_with(&bright, &weight, &smoothed, WINDOW);
        let square = surfaces.shape.mean_with(&square, &weight, &smoothed, WINDOW);
        square.iter().zip(&mean).map(|(s, m)| (s - m * m).max(0.0)).collect()
    };
    let (in_photo, in_probe) = (contrast(&soft), contrast(&here));
    let by = (0..n)
        .into_par_iter()
        .map(|i| {
            let Some(sight) = &sights[i] else { return [1.0, 0.0, 0.0] };
            // registration is off by as much in pixels of either picture
            let ratio = (sight.footprint / surfaces.footprint(i)).max(1.0);
            let slopes = 0.5 * (slope(&soft, i) + slope(&here, i)) * (1.0 + ratio * ratio);
            [1.0, slopes, 0.5 * (in_photo[i] + in_probe[i])]
        })
        .collect();
    Carried { soft, here, level, by, seen }
}

/// Every how many pixels the variance is fitted to.
const EVERY: usize = 5;

/// Runs the test.
pub(crate) fn test(
    surfaces: &GeometryBuffer,
    sights: &Sights,
    probes: &[ProbeView],
    soft: &[Vec<Vec3>],
    radiometry: &Radiometry,
    gloss: &Gloss,
) -> Geometry {
    let n = surfaces.triangle.len();
    let all: Vec<Carried> = probes
        .iter()
        .enumerate()
        .map(|(k, probe)| {
            let shift = radiometry.offset - radiometry.gains[k];
            // in the probe's light
            let lit = |i: usize| soft[k][i] + shift + Vec3::splat(radiometry.vignetting * surfaces.radius2(i));
            carried(surfaces, &sights.of[k], probe, (0..n).map(lit).collect())
        })
        .collect();
    let samples: Vec<Vec<Sample>> = all
        .iter()
        .map(|c| {
            let chosen = (0..n).step_by(EVERY).filter(|i| c.seen[*i]);
            chosen.map(|i| Sample { difference: c.soft[i] - c.here[i], by: c.by[i] }).collect()
        })
        .collect();
    let noise = Noise::fit(&samples);
    let each: Vec<OfProbe> = all
        .into_iter()
        .enumerate()
        .map(|(k, c)| of_probe(surfaces, &sights.of[k], &probes[k], c, k, &noise, gloss))
        .collect();
    let mut seen = vec![0u8; n];
    let mut able = vec![0u8; n];
    let mut mismatch = vec![f32::INFINITY; n];
    let mut most = vec![0.0f32; n];
    for p in &each {
        for i in 0..n {
            seen[i] += u8::from(p.seen[i]);
            able[i] += u8::from(p.weight[i] > 0.0);
            if p.weight[i] > 0.0 {
                mismatch[i] = mismatch[i].min(p.mismatch[i]);
                most[i] = most[i].max(10.0 * p.parallax[i]);
            }
        }
    }
    for m in &mut mismatch {
        *m = if m.is_finite() { *m } else { 0.0 };
    }
    let mut geometry = Geometry {
        mismatch,
        gain: vec![],
        ratio: vec![],
        best_m: vec![0.0; n],
        sensitivity: vec![],
        seen,
        able,
        parallax: most,
        of: each,
        noise,
    };
    // so wide a window needs no more than every other row and column
    let sampled = |i: usize| [i % surfaces.width, i / surfaces.width].iter().all(|k| k.is_multiple_of(2));
    let windowed = |k: usize| {
        let cost = |i| if sampled(i) { 4.0 * geometry.cost(surfaces, probes, i, place(k)) } else { 0.0 };
        surfaces.shape.smoothed(&(0..n).into_par_iter().map(cost).collect::<Vec<f32>>(), SWEEP_WINDOW)
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

/// One probe's part.
fn of_probe(
    surfaces: &GeometryBuffer,
    sights: &[Option<crate::audit::observe::probe_view::Sight>],
    probe: &ProbeView,
    carried: Carried,
    k: usize,
    noise: &Noise,
    gloss: &Gloss,
) -> OfProbe {
    let Carried { soft, here, level, by, seen } = carried;
    let n = soft.len();
    let variance: Vec<f32> = by.iter().map(|by| noise.variance(k, *by)).collect();
    let parallax: Vec<f32> = (0..n).into_par_iter().map(|i| parallax(surfaces, probe, sights[i].as_ref(), i)).collect();
    let able = |i: usize| seen[i] && parallax[i] >= LEAST_PARALLAX;
    let weight: Vec<f32> = (0..n).map(|i| if able(i) { 1.0 } else { 0.0 }).collect();
    let squared: Vec<f32> = (0..n).into_par_iter().map(|i| noise.squared(soft[i] - here[i], variance[i])).collect();
    // what noise explains needs no gloss, and what is brighter in the photograph none of the probe's
    let darker = |i: usize| (soft[i] - here[i]).min_element() < 0.0;
    let to_probe = gloss.towards(surfaces, probe.origin, &|i| weight[i] > 0.0 && squared[i] > 1.0 && darker(i));
    let dull: Vec<f32> = (0..n)
        .into_par_iter()
        .map(|i| {
            if weight[i] == 0.0 {
                return 0.0;
            }
            if squared[i] <= 1.0 {
                return squared[i];
            }
            let [below, above] = bounds(gloss.to_camera[i], to_probe[i], here[i].map(f32::exp));
            let difference = soft[i] - here[i];
            limited(noise.squared(difference - difference.clamp(below, above), variance[i]))
        })
        .collect();
    let capped: Vec<f32> = dull.iter().map(|d| d.min(MOST_IN_WINDOW)).collect();
    let mismatch = surfaces.shape.mean(&capped, &weight, WINDOW);
    // contrast that the noise alone would give says nothing of a surface's place
    let telling = (TELLING * noise.floor(k)).powi(2);
    let plain = (0..n).map(|i| (2.0 * by[i][2] < telling && seen[i]).then(|| limited(squared[i]))).collect();
    OfProbe { soft, level, variance, plain, weight, mismatch, seen, parallax }
}

/// By how many pixels (of the probe or the photograph, whichever are the coarser) the two pictures of a surface part
/// when it moves 10 cm along its normal.
fn parallax(
    surfaces: &GeometryBuffer,
    probe: &ProbeView,
    sight: Option<&crate::audit::observe::probe_view::Sight>,
    i: usize,
) -> f32 {
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
