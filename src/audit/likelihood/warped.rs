//! What each probe saw, brought into the photograph over the model's surfaces: the two pictures that are compared.

use glam::Vec3;
use rayon::prelude::*;

use crate::audit::likelihood::noise::{EVERY, Noise, Parts, Sample};
use crate::audit::observe::geometry_buffer::GeometryBuffer;
use crate::audit::observe::gloss::Pair;
use crate::audit::observe::probe_view::{ProbeView, Sight};
use crate::audit::observe::radiometry::{Radiometry, Sights};
use crate::edge_aware::EdgeAware;
use crate::panorama::luminance;
use crate::statistics::robust_deviation;

/// Standard deviation of the windows that photograph and probe are compared over, pixels.
pub(crate) const WINDOW: f32 = 3.0;

/// Standard deviation of the window that smooth differences are means over, pixels: wider than those that places are compared over.
const SMOOTH: f32 = 24.0;

/// Smooth differences count as light up to so many standard deviations of those in the pair: what differs more may be another surface.
const USUAL: f32 = 2.0;

/// What a logarithm is with some light added to it: differences of what is darker than that, which a photograph's steps hide, are small,
/// those of what is brighter as they were (a generalised logarithm; Durbin, Hardin, Hawkins and Rocke, *A variance-stabilizing
/// transformation for gene-expression microarray data*, 2002).
pub(crate) fn damped(log: Vec3, dark: Vec3) -> Vec3 {
    if dark == Vec3::ZERO { log } else { (log.map(f32::exp) + dark).map(f32::ln) }
}

/// What a probe shows of a pixel's surface at the model's place, beside the photograph.
pub(crate) struct Warped {
    pub(crate) pixel: u32,
    pub(crate) level: u8,
    /// Logarithms; the photograph as soft as the probe and in its light.
    pub(crate) photo: Vec3,
    pub(crate) here: Vec3,
    /// What they differ by all over the surface around.
    pub(crate) smooth: Vec3,
    /// What the parts of the variance are to be multiplied by.
    pub(crate) by: Parts,
}

impl Warped {
    pub(crate) fn difference(&self) -> Vec3 {
        self.photo - self.here
    }

    /// The difference without what is smooth.
    pub(crate) fn detail(&self) -> Vec3 {
        self.difference() - self.smooth
    }
}

/// Warps a probe's picture into the view over the model's surfaces: all pixels that it sees, in order. `soft` is the photograph as soft as the
/// probe and in its light, damped by `dark` as that is.
fn warped(
    surfaces: &GeometryBuffer,
    sights: &[Option<Sight>],
    probe: &ProbeView,
    soft: &[Vec3],
    dark: Vec3,
) -> Vec<Warped> {
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
    let warp = |i: usize| {
        let sight = sights[i].as_ref().filter(|_| seen(i))?;
        // registration is off by as much in pixels of either picture
        let ratio = (sight.footprint / surfaces.footprint(i)).max(1.0);
        let slopes = 0.5 * (slope(soft, i) + slope(&here, i)) * (1.0 + ratio * ratio);
        let by = [1.0, slopes, 0.5 * (in_photo[i] + in_probe[i])];
        Some(Warped { pixel: i as u32, level: level(i) as u8, photo: soft[i], here: here[i], smooth: Vec3::ZERO, by })
    };
    let mut all: Vec<Warped> = (0..n).into_par_iter().filter_map(warp).collect();
    let smooth = smooth_differences(&surfaces.shape, &all);
    all.iter_mut().zip(smooth).for_each(|(c, smooth)| c.smooth = smooth);
    all
}

/// What a photograph and a probe differ by all over the surface around each pixel: gloss, haze and the cameras' responses make it, and none
/// moves with a surface (background subtraction: Hirschmüller and Scharstein, *Evaluation of stereo matching costs on images with
/// radiometric differences*, 2009).
fn smooth_differences(shape: &EdgeAware, all: &[Warped]) -> Vec<Vec3> {
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
    let deviation = |channel: usize| robust_deviation(smooth.iter().map(|s| s[channel])).unwrap_or(0.0) as f32;
    let most = USUAL * Vec3::new(deviation(0), deviation(1), deviation(2));
    smooth.into_iter().map(|s| s.clamp(-most, most)).collect()
}

/// What all probes show of a view's surfaces beside the photograph, and what it differs by where the model is right.
pub(crate) struct Compared {
    /// Per probe.
    pub(crate) of: Vec<Vec<Warped>>,
    /// Of differences, and of these without what is smooth.
    pub(crate) noise: Noise,
    pub(crate) detail: Noise,
    /// Per probe, the darkest light that the photograph tells, in the probe's.
    pub(crate) dark: Vec<Vec3>,
}

impl Compared {
    /// Warps all probes' pictures into the view. `soft` is the photograph as soft as each probe, `dark` the darkest light that it
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
        let of: Vec<Vec<Warped>> = soft
            .into_iter()
            .enumerate()
            .map(|(k, mut soft)| {
                // in the probe's light
                let lit = |(i, p): (usize, &mut Vec3)| {
                    *p = damped(*p + radiometry.at(surfaces.radius2(i)) - radiometry.gains[k], dark[k]);
                };
                soft.par_iter_mut().enumerate().for_each(lit);
                warped(surfaces, &sights.of[k], &probes[k], &soft, dark[k])
            })
            .collect();
        let noise_of = |difference: fn(&Warped) -> Vec3| {
            let sampled = |all: &Vec<Warped>| -> Vec<Sample> {
                let chosen = all.iter().filter(|c| (c.pixel as usize).is_multiple_of(EVERY));
                chosen.map(|c| Sample { difference: difference(c), by: c.by }).collect()
            };
            Noise::fit(&of.iter().map(sampled).collect::<Vec<_>>())
        };
        let (noise, detail) = (noise_of(Warped::difference), noise_of(Warped::detail));
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
            let warped = |i: usize| Warped {
                pixel: i as u32,
                level: 0,
                photo: Vec3::splat(with(i)),
                here: Vec3::ZERO,
                smooth: Vec3::ZERO,
                by: [1.0, 0.0, 0.0],
            };
            smooth_differences(&shape, &(0..SIDE * SIDE).map(warped).collect::<Vec<_>>())
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
