//! The geometry test: what the photograph shows against what each probe saw of the same surface. No albedo takes part.
//!
//! If the surface is where the model has it, the probe's light, carried to the camera over that surface, is the
//! photograph. If it is not, there is parallax between them. Every pixel's plane is swept along its normal and the
//! places are compared by how well photograph and probes agree over a window, but for what they differ by all over the surface.

use glam::Vec3;
use rayon::prelude::*;
use std::cmp::Ordering;

use crate::audit::likelihood::noise::Noise;
use crate::audit::likelihood::warped::{Compared, WINDOW, Warped, damped};
use crate::audit::observe::geometry_buffer::GeometryBuffer;
use crate::audit::observe::gloss::{Gloss, bounds};
use crate::audit::observe::probe_view::{ProbeView, Sight};
use crate::audit::observe::radiometry::Sights;

/// How far a surface may be off its place on either side, metres: each step a quarter of the way, since pictures part in
/// proportion to it.
const STEPS_M: [f32; 17] =
    [0.01, 0.015, 0.02, 0.027, 0.035, 0.045, 0.057, 0.072, 0.09, 0.112, 0.14, 0.175, 0.22, 0.275, 0.345, 0.43, 0.54];

/// Number of places that are tried.
pub(crate) const PLACES: usize = 2 * STEPS_M.len() + 1;

/// Index of the model's own place.
pub(crate) const HERE: usize = STEPS_M.len();

/// What a surface must be off, metres, to be sure that it would be noticed.
const NOTICED_M: f32 = 0.1;

/// Metres along the normal, from behind the model's surface to before it.
pub(crate) fn place(k: usize) -> f32 {
    match k.cmp(&HERE) {
        Ordering::Less => -STEPS_M[HERE - 1 - k],
        Ordering::Equal => 0.0,
        Ordering::Greater => STEPS_M[k - HERE - 1],
    }
}

/// Standard deviation of the windows that places are compared over, pixels.
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
    /// How much less the sum over all probes becomes at the best place, over what is left there.
    pub(crate) ratio: Vec<f32>,
    /// The best place, metres along the normal.
    pub(crate) best_m: Vec<f32>,
    /// How much more it would be 10 cm off on either side, the lesser: whether a moved surface would be noticed.
    pub(crate) sensitivity: Vec<f32>,
    /// Number of probes that see the pixel well, and those of them with parallax; 255 for more.
    pub(crate) seen: Vec<u8>,
    pub(crate) able: Vec<u8>,
    /// By how many pixels, of the probe that tells best, the pictures part when the surface moves by a metre.
    pub(crate) parallax: Vec<f32>,
    /// Per pixel, the first of its looks; one more than there are pixels.
    first: Vec<u32>,
    looks: Vec<Look>,
    noise: Noise,
    dark: Vec<Vec3>,
}

impl Geometry {
    /// Squared difference between the photograph in a pixel and what the probes that can tell saw at a place on its ray,
    /// where the ray meets the surface moved by so many metres along its normal: in units of the variance that a right
    /// model has, summed over the probes.
    pub(crate) fn cost(&self, surfaces: &GeometryBuffer, probes: &[ProbeView], i: usize, metres: f32) -> f32 {
        let (normal, ray) = (surfaces.normal[i], surfaces.ray[i]);
        let point = surfaces.position[i] + ray * (metres / normal.dot(ray).min(-0.1));
        self.looks(i).iter().map(|look| look.cost(&self.noise, probes, &self.dark, point)).sum()
    }

    /// How the probes that can tell a pixel's place see it, in the probes' order.
    fn looks(&self, i: usize) -> &[Look] {
        &self.looks[self.first[i] as usize..self.first[i + 1] as usize]
    }

    /// Whether some probe sees enough in a pixel for its place to be told.
    pub(crate) fn tells(&self, i: usize) -> bool {
        self.looks(i).iter().any(|look| look.plain.is_none())
    }
}

/// How a probe sees a pixel's surface, well and with parallax.
struct Look {
    pixel: u32,
    /// The probe's number, and the level of its picture that is no sharper than the photograph.
    probe: u16,
    level: u8,
    /// The photograph as soft as the probe and in its light, without what both differ by all over the surface; logarithm.
    photo: Vec3,
    /// Variance of the difference where the model is right.
    variance: f32,
    /// Cost at the model's own place, where nothing else can be told.
    plain: Option<f32>,
    /// Mean squared difference over the window.
    mismatch: f32,
    /// By how many pixels the pictures part when the surface moves 10 cm.
    parallax: f32,
}

impl Look {
    fn cost(&self, noise: &Noise, probes: &[ProbeView], dark: &[Vec3], point: Vec3) -> f32 {
        let k = usize::from(self.probe);
        let at = || damped(probes[k].log_radiance(point, usize::from(self.level)), dark[k]);
        self.plain.unwrap_or_else(|| limited(noise.squared(self.photo - at(), self.variance)))
    }
}

fn limited(squared: f32) -> f32 {
    if squared.is_finite() { squared.min(MOST) } else { MOST }
}

/// Runs the test.
pub(crate) fn test(
    surfaces: &GeometryBuffer,
    sights: &Sights,
    probes: &[ProbeView],
    compared: Compared,
    gloss: &Gloss,
) -> Geometry {
    let n = surfaces.triangle.len();
    let Compared { of: all, noise, detail, dark } = compared;
    let mut seen = vec![0u8; n];
    for c in all.iter().flatten() {
        let seen = &mut seen[c.pixel as usize];
        *seen = seen.saturating_add(1);
    }
    let mut looks: Vec<Look> = Vec::with_capacity(all.iter().map(Vec::len).sum());
    for (k, warped) in all.into_iter().enumerate() {
        looks.extend(looks_of(k, &probes[k], warped, surfaces, &sights.of[k], [&noise, &detail], gloss));
    }
    // those of one pixel stay in the probes' order
    looks.sort_by_key(|look| look.pixel);
    let mut first = vec![0u32; n + 1];
    looks.iter().for_each(|look| first[look.pixel as usize + 1] += 1);
    (0..n).for_each(|i| first[i + 1] += first[i]);
    let mut geometry = Geometry {
        mismatch: vec![0.0; n],
        ratio: vec![],
        best_m: vec![],
        sensitivity: vec![],
        seen,
        able: vec![0; n],
        parallax: vec![0.0; n],
        first,
        looks,
        noise: detail,
        dark,
    };
    for i in 0..n {
        let looks = geometry.looks(i);
        let mismatch = looks.iter().map(|l| l.mismatch).fold(f32::INFINITY, f32::min);
        let parallax = looks.iter().map(|l| 10.0 * l.parallax).fold(0.0, f32::max);
        (geometry.able[i], geometry.parallax[i]) = (looks.len().min(u8::MAX.into()) as u8, parallax);
        geometry.mismatch[i] = if mismatch.is_finite() { mismatch } else { 0.0 };
    }
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
            // the places a step about it
            if (0.8..1.25).contains(&(place(k).abs() / NOTICED_M)) {
                let side = if k < HERE { &mut back } else { &mut front };
                side.iter_mut().zip(costs).for_each(|(s, c)| *s = s.max(*c));
            }
        }
    }
    let window_area = 4.0 * std::f32::consts::PI * SWEEP_WINDOW * SWEEP_WINDOW;
    geometry.ratio =
        (0..n).map(|i| (here[i] - least[i]) / (least[i] + 0.3 * f32::from(geometry.able[i].max(1)))).collect();
    geometry.sensitivity = (0..n).map(|i| (back[i].min(front[i]) - least[i]) * window_area).collect();
    geometry.best_m = best_m;
    geometry
}

/// How the `k`th probe sees what it can tell the place of, by pixel, in order.
fn looks_of(
    k: usize,
    probe: &ProbeView,
    warped: Vec<Warped>,
    surfaces: &GeometryBuffer,
    sights: &[Option<Sight>],
    [noise, detail]: [&Noise; 2],
    gloss: &Gloss,
) -> impl Iterator<Item = Look> {
    let n = sights.len();
    let parallax = |c: Warped| {
        let parallax = parallax(surfaces, probe, sights[c.pixel as usize].as_ref(), c.pixel as usize);
        (parallax >= LEAST_PARALLAX).then_some((c, parallax))
    };
    let able: Vec<(Warped, f32)> = warped.into_par_iter().filter_map(parallax).collect();
    let variance = |c: &Warped| noise.variance(k, c.by);
    let squared = |c: &Warped| noise.squared(c.difference(), variance(c));
    let (mut weight, mut glossy) = (vec![0.0; n], vec![false; n]);
    for (c, _) in &able {
        weight[c.pixel as usize] = 1.0;
        // what noise explains needs no gloss, and what is brighter in the photograph none of the probe's
        glossy[c.pixel as usize] = squared(c) > 1.0 && c.difference().min_element() < 0.0;
    }
    let to_probe = gloss.towards(surfaces, probe.origin, &|i| glossy[i]);
    let mut capped = vec![0.0; n];
    for (c, _) in &able {
        let (i, squared) = (c.pixel as usize, squared(c));
        let dull = if squared <= 1.0 {
            squared
        } else {
            let [below, above] = bounds(gloss.to_camera[i], to_probe[i], c.here.map(f32::exp));
            let difference = c.difference();
            limited(noise.squared(difference - difference.clamp(below, above), variance(c)))
        };
        capped[i] = dull.min(MOST_IN_WINDOW);
    }
    let mismatch = surfaces.shape.mean(&capped, &weight, WINDOW);
    // contrast that the noise alone would give says nothing of a surface's place
    let telling = (TELLING * detail.floor(k)).powi(2);
    able.into_iter().map(move |(c, parallax)| {
        let variance = detail.variance(k, c.by);
        Look {
            pixel: c.pixel,
            probe: k as u16,
            level: c.level,
            photo: c.photo - c.smooth,
            variance,
            plain: (2.0 * c.by[2] < telling).then(|| limited(detail.squared(c.detail(), variance))),
            mismatch: mismatch[c.pixel as usize],
            parallax,
        }
    })
}

/// By how many pixels (of the probe or the photograph, whichever are the coarser) the two pictures of a surface part
/// when it moves 10 cm along its normal.
fn parallax(surfaces: &GeometryBuffer, probe: &ProbeView, sight: Option<&Sight>, i: usize) -> f32 {
    let Some(sight) = sight else { return 0.0 };
    let (position, ray) = (surfaces.position[i], surfaces.ray[i]);
    let cos = surfaces.normal[i].dot(ray).min(-0.1);
    let moved = position + ray * (NOTICED_M / cos);
    let (a, b) = ((position - probe.origin).normalize(), (moved - probe.origin).normalize());
    // the angle at the probe, as a length on the surface
    let angle = a.cross(b).length();
    let coarser = probe.pixel_angle().max(surfaces.footprint(i) / sight.footprint * probe.pixel_angle());
    angle / coarser
}
