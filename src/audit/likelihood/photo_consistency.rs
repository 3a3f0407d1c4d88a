//! The geometry test: what the photograph shows against what each probe saw of the same surface. No albedo takes part.
//!
//! If the surface is where the model has it, the probe's light, carried to the camera over that surface, is the
//! photograph. If it is not, there is parallax between them. Every pixel's plane is swept along its normal and the
//! places are compared by how well photograph and probes agree over a window, but for what they differ by all over the surface.

use glam::Vec3;
use rayon::prelude::*;
use std::cmp::Ordering;

use crate::audit::likelihood::noise::{EVERY, Noise, Parts, Sample};
use crate::audit::observe::geometry_buffer::GeometryBuffer;
use crate::audit::observe::gloss::{Gloss, Pair, bounds};
use crate::audit::observe::probe_view::{ProbeView, Sight};
use crate::audit::observe::radiometry::{Radiometry, Sights};
use crate::edge_aware::EdgeAware;
use crate::panorama::luminance;
use crate::statistics::median;

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

/// Standard deviation of the window that smooth differences are means over, pixels: wider than those that places are compared over.
const SMOOTH: f32 = 24.0;

/// Smooth differences count as light up to so many standard deviations of those in the pair: what differs more may be another surface.
const USUAL: f32 = 2.0;

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

/// What a logarithm is with some light added to it: differences of what is darker than that, which a photograph's steps hide, are small,
/// those of what is brighter as they were (a generalised logarithm; Durbin, Hardin, Hawkins and Rocke, *A variance-stabilizing
/// transformation for gene-expression microarray data*, 2002).
pub(crate) fn damped(log: Vec3, dark: Vec3) -> Vec3 {
    if dark == Vec3::ZERO { log } else { (log.map(f32::exp) + dark).map(f32::ln) }
}

fn limited(squared: f32) -> f32 {
    if squared.is_finite() { squared.min(MOST) } else { MOST }
}

/// What a probe shows of a pixel's surface at the model's place, beside the photograph.
struct Carried {
    pixel: u32,
    level: u8,
    /// Logarithms; the photograph as soft as the probe and in its light.
    photo: Vec3,
    here: Vec3,
    /// What they differ by all over the surface around.
    smooth: Vec3,
    /// What the parts of the variance are to be multiplied by.
    by: Parts,
}

impl Carried {
    fn difference(&self) -> Vec3 {
        self.photo - self.here
    }

    /// The difference without what is smooth.
    fn detail(&self) -> Vec3 {
        self.difference() - self.smooth
    }
}

/// Carries a probe's light over the model into the view: all pixels that it sees, in order. `soft` is the photograph as soft as the
/// probe and in its light, damped by `dark` as that is.
fn carried(
    surfaces: &GeometryBuffer,
    sights: &[Option<Sight>],
    probe: &ProbeView,
    soft: &[Vec3],
    dark: Vec3,
) -> Vec<Carried> {
    let n = soft.len();
    let w = surfaces.width;
    let level = |i: usize| sights[i].as_ref().map_or(0, |x| Sights::level(surfaces, i, x));
    let here: Vec<Vec3> = (0..n)
        .into_par_iter()
        .map(|i| match &sights[i] {
            Some(_) => damped(probe.log_radiance(surfaces.position[i], level(i)), dark),
            None => Vec3::NAN,
        })
        .collect();
    let seen = |i: usize| soft[i].is_finite() && here[i].is_finite();
    // mean squared slope to the four neighbours
    let slope = |values: &[Vec3], i: usize| -> f32 {
        let d = |j: usize| {
            let d = (values[j] - values[i]).length_squared() / 3.0;
            if d.is_finite() { d } else { 0.0 }
        };
        let (x, y) = (i % w, i / w);
        if x > 0 && x + 1 < w && y > 0 && i + w < n { 0.5 * (d(i - 1) + d(i + 1) + d(i - w) + d(i + w)) } else { 0.0 }
    };
    let weight: Vec<f32> = (0..n).map(|i| if seen(i) { 1.0 } else { 0.0 }).collect();
    let smoothed = surfaces.shape.smoothed(&weight, WINDOW);
    let contrast = |values: &[Vec3]| -> Vec<f32> {
        let bright: Vec<f32> =
            values.iter().map(|v| v.element_sum() / 3.0).map(|b| if b.is_finite() { b } else { 0.0 }).collect();
        let square: Vec<f32> = bright.iter().map(|v| v * v).collect();
        let mean = surfaces.shape.mean_with(&bright, &weight, &smoothed, WINDOW);
        let square = surfaces.shape.mean_with(&square, &weight, &smoothed, WINDOW);
        square.iter().zip(&mean).map(|(s, m)| (s - m * m).max(0.0)).collect()
    };
    let (in_photo, in_probe) = (contrast(soft), contrast(&here));
    let carry = |i: usize| {
        let sight = sights[i].as_ref().filter(|_| seen(i))?;
        // registration is off by as much in pixels of either picture
        let ratio = (sight.footprint / surfaces.footprint(i)).max(1.0);
        let slopes = 0.5 * (slope(soft, i) + slope(&here, i)) * (1.0 + ratio * ratio);
        let by = [1.0, slopes, 0.5 * (in_photo[i] + in_probe[i])];
        Some(Carried { pixel: i as u32, level: level(i) as u8, photo: soft[i], here: here[i], smooth: Vec3::ZERO, by })
    };
    let mut all: Vec<Carried> = (0..n).into_par_iter().filter_map(carry).collect();
    let smooth = smooth_differences(&surfaces.shape, &all);
    all.iter_mut().zip(smooth).for_each(|(c, smooth)| c.smooth = smooth);
    all
}

/// What a photograph and a probe differ by all over the surface around each pixel: gloss, haze and the cameras' responses make it, and none
/// moves with a surface (background subtraction: Hirschmüller and Scharstein, *Evaluation of stereo matching costs on images with
/// radiometric differences*, 2009).
fn smooth_differences(shape: &EdgeAware, all: &[Carried]) -> Vec<Vec3> {
    let n = shape.width * shape.height;
    let (mut weight, mut difference) = (vec![0.0; n], vec![Vec3::ZERO; n]);
    for c in all {
        // a picture of something else is no light, and should not count as much
        let shown = c.difference().clamp(Vec3::NEG_ONE, Vec3::ONE);
        (weight[c.pixel as usize], difference[c.pixel as usize]) = (1.0, shown);
    }
    let smoothed = shape.smoothed(&weight, SMOOTH);
    let smooth = shape.mean_colour_with(&difference, &weight, &smoothed, SMOOTH);
    let smooth: Vec<Vec3> = all.iter().map(|c| smooth[c.pixel as usize]).collect();
    let deviation = |channel: usize| 1.48 * median(smooth.iter().map(|s| s[channel].abs())).unwrap_or(0.0);
    let most = USUAL * Vec3::new(deviation(0), deviation(1), deviation(2));
    smooth.into_iter().map(|s| s.clamp(-most, most)).collect()
}

/// What all probes show of a view's surfaces beside the photograph, and what it differs by where the model is right.
pub(crate) struct Compared {
    of: Vec<Vec<Carried>>,
    /// Of differences, and of these without what is smooth.
    noise: Noise,
    detail: Noise,
    /// Per probe, the darkest light that the photograph tells, in the probe's.
    dark: Vec<Vec3>,
}

impl Compared {
    /// Carries the light of all probes into the view. `soft` is the photograph as soft as each probe, `dark` the darkest light that it
    /// tells.
    pub(crate) fn new(
        surfaces: &GeometryBuffer,
        sights: &Sights,
        probes: &[ProbeView],
        soft: Vec<Vec<Vec3>>,
        radiometry: &Radiometry,
        dark: Vec3,
    ) -> Self {
        let dark: Vec<Vec3> = radiometry.gains.iter().map(|g| dark * (-*g).map(f32::exp)).collect();
        let of: Vec<Vec<Carried>> = soft
            .into_iter()
            .enumerate()
            .map(|(k, mut soft)| {
                // in the probe's light
                let lit = |(i, p): (usize, &mut Vec3)| {
                    *p = damped(*p + radiometry.at(surfaces.radius2(i)) - radiometry.gains[k], dark[k]);
                };
                soft.par_iter_mut().enumerate().for_each(lit);
                carried(surfaces, &sights.of[k], &probes[k], &soft, dark[k])
            })
            .collect();
        let noise_of = |difference: fn(&Carried) -> Vec3| {
            let sampled = |all: &Vec<Carried>| -> Vec<Sample> {
                let chosen = all.iter().filter(|c| (c.pixel as usize).is_multiple_of(EVERY));
                chosen.map(|c| Sample { difference: difference(c), by: c.by }).collect()
            };
            Noise::fit(&of.iter().map(sampled).collect::<Vec<_>>())
        };
        let (noise, detail) = (noise_of(Carried::difference), noise_of(Carried::detail));
        Self { of, noise, detail, dark }
    }

    /// Some places as photograph and probes see them, spread over the picture: so few that each tells by itself.
    pub(crate) fn pairs(&self) -> Vec<Pair> {
        // prime, so that no picture has them all in a few columns
        const APART: usize = 97;
        let light = |log: Vec3| luminance(log.map(f32::exp));
        let all = self.of.iter().enumerate().flat_map(|(probe, all)| all.iter().map(move |c| (probe, c)));
        all.filter(|(_, c)| (c.pixel as usize).is_multiple_of(APART))
            .map(|(probe, c)| {
                let variance = self.noise.variance(probe, c.by);
                Pair { pixel: c.pixel as usize, probe, photo: light(c.photo), here: light(c.here), variance }
            })
            .collect()
    }
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
    for (k, carried) in all.into_iter().enumerate() {
        looks.extend(looks_of(k, &probes[k], carried, surfaces, &sights.of[k], [&noise, &detail], gloss));
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
            if NOTICED.contains(&k.abs_diff(HERE)) {
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
    carried: Vec<Carried>,
    surfaces: &GeometryBuffer,
    sights: &[Option<Sight>],
    [noise, detail]: [&Noise; 2],
    gloss: &Gloss,
) -> impl Iterator<Item = Look> {
    let n = sights.len();
    let parallax = |c: Carried| {
        let parallax = parallax(surfaces, probe, sights[c.pixel as usize].as_ref(), c.pixel as usize);
        (parallax >= LEAST_PARALLAX).then_some((c, parallax))
    };
    let able: Vec<(Carried, f32)> = carried.into_par_iter().filter_map(parallax).collect();
    let variance = |c: &Carried| noise.variance(k, c.by);
    let squared = |c: &Carried| noise.squared(c.difference(), variance(c));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_differences_end_with_a_surface_and_are_no_greater_than_usual() {
        const SIDE: usize = 96;
        let right = |i: usize| i % SIDE >= SIDE / 2;
        let shape = EdgeAware::new(SIDE, SIDE, |i, j| right(i) == right(j));
        // a haze over each surface, fine structure that has moved, and a corner that shows something else
        let haze = |i: usize| if right(i) { 0.1 } else { -0.1 };
        let fine = |i: usize| if (i / SIDE + i % SIDE).is_multiple_of(2) { 0.1 } else { -0.1 };
        let other = |i: usize| if i / SIDE < 24 && i % SIDE < 24 { 2.0 } else { 0.0 };
        let smooth = |with: &dyn Fn(usize) -> f32| {
            let carried = |i: usize| Carried {
                pixel: i as u32,
                level: 0,
                photo: Vec3::splat(with(i)),
                here: Vec3::ZERO,
                smooth: Vec3::ZERO,
                by: [1.0, 0.0, 0.0],
            };
            smooth_differences(&shape, &(0..SIDE * SIDE).map(carried).collect::<Vec<_>>())
        };
        let all = smooth(&|i| haze(i) + fine(i));
        assert!((0..SIDE * SIDE).all(|i| (all[i].x - haze(i)).abs() < 0.02));
        let all = smooth(&|i| haze(i) + other(i));
        assert!(all[0].x > 0.2 && all[0].x < 0.35, "{}", all[0].x);
    }

    #[test]
    fn what_the_steps_of_a_file_hide_is_no_difference() {
        let dark = Vec3::splat(10.0);
        // red of 100 and 110 codes; green of 9 and 11; blue of none and 3
        let [photo, probe] =
            [[100.0, 9.0, 1e-6], [110.0, 11.0, 3.0]].map(|light| damped(Vec3::from(light).map(f32::ln), dark));
        let apart = (probe - photo).to_array();
        let expected = [120.0f32 / 110.0, 21.0 / 19.0, 13.0 / 10.0].map(f32::ln);
        assert!(apart.iter().zip(expected).all(|(a, e)| (a - e).abs() < 1e-5), "{apart:?}");
        let log = Vec3::new(-3.0, 0.5, 2.0);
        assert_eq!(damped(log, Vec3::ZERO), log);
    }
}
