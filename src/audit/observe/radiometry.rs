//! Exposure, white balance, vignetting and the probes' gains.

use glam::Vec3;
use rayon::prelude::*;

use crate::audit::observe::geometry_buffer::{GeometryBuffer, NONE};
use crate::audit::observe::probe_view::{ProbeView, Sight};
use crate::statistics::median;

/// How each probe sees each pixel of a view.
pub(crate) struct Sights {
    /// Per probe and pixel.
    pub(crate) of: Vec<Vec<Option<Sight>>>,
}

impl Sights {
    pub(crate) fn look(surfaces: &GeometryBuffer, probes: &[ProbeView], usable: &[f32]) -> Self {
        let look = |probe: &ProbeView| {
            (0..surfaces.triangle.len())
                .into_par_iter()
                .map(|i| {
                    if surfaces.triangle[i] == NONE || usable[i] == 0.0 {
                        return None;
                    }
                    let lift = surfaces.normal[i] * 1e-4;
                    probe.sight(surfaces.position[i] + lift, surfaces.normal[i])
                })
                .collect()
        };
        Self { of: probes.iter().map(look).collect() }
    }

    /// The probe's level that is no sharper than the photograph.
    pub(crate) fn level(surfaces: &GeometryBuffer, i: usize, sight: &Sight) -> usize {
        let ratio = sight.footprint / surfaces.footprint(i);
        if ratio < 0.7 { (1.0 / ratio).log2().round() as usize } else { 0 }
    }
}

/// What a photograph's logarithm needs to be compared with the probes'.
#[derive(Clone, Debug, Default)]
pub(crate) struct Radiometry {
    /// Added per channel.
    pub(crate) offset: Vec3,
    /// Added × squared distance from the centre (1 in the corners).
    pub(crate) vignetting: f32,
    /// Per probe, added to its logarithm.
    pub(crate) gains: Vec<Vec3>,
    /// Per probe, what it shows of what the photograph shows.
    pub(crate) responses: Vec<Response>,
    /// Per probe, the robust standard deviation of what is left; `None` where it sees too little.
    pub(crate) spread: Vec<Option<f32>>,
}

/// What one camera shows of what another shows, of logarithms, channel by channel: rising curves through quantiles of the surfaces that
/// both see. Between pictures of one exposure each they are straight and steep as the diagonal; haze in a lens, automatic contrast and
/// colours, and what a file's coding is off by, bend them. (Histogram specification; Gonzalez and Woods, *Digital Image Processing*, §3.3.)
#[derive(Clone, Debug, Default)]
pub(crate) struct Response {
    /// Per channel, values of the one and of the other, rising.
    knots: [Vec<[f32; 2]>; 3],
}

/// Quantiles that responses go through.
const QUANTILES: [f32; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// Quantiles that are closer than this in logarithms may differ by noise alone, and are one.
const KNOTS_APART: f32 = 0.25;

/// Cameras show things otherwise where a curve leaves less than this share of the differences that a gain leaves.
const BENT: f32 = 0.85;

impl Response {
    /// That adds so much to each channel.
    fn adding(offset: Vec3) -> Self {
        Self { knots: offset.to_array().map(|o| vec![[0.0, o]]) }
    }

    /// Of one picture's values and another's of the same places.
    fn between(from: &[Vec3], to: &[Vec3]) -> Self {
        let sorted = |values: &[Vec3], c: usize| {
            let mut all: Vec<f32> = values.iter().map(|v| v[c]).collect();
            all.sort_unstable_by(f32::total_cmp);
            QUANTILES.map(|q| all[((all.len() - 1) as f32 * q) as usize])
        };
        let channel = |c: usize| {
            let (from, to) = (sorted(from, c), sorted(to, c));
            let middle = QUANTILES.len() / 2;
            let mut knots = vec![[from[middle], to[middle]]];
            let apart = |a: [f32; 2], b: [f32; 2]| (0..2).all(|k| (a[k] - b[k]).abs() >= KNOTS_APART);
            for k in (0..middle).rev().chain(middle + 1..QUANTILES.len()) {
                let nearest = if k < middle { knots[0] } else { knots[knots.len() - 1] };
                if apart([from[k], to[k]], nearest) {
                    knots.insert(if k < middle { 0 } else { knots.len() }, [from[k], to[k]]);
                }
            }
            knots
        };
        Self { knots: [0, 1, 2].map(channel) }
    }

    /// What the other shows of what the one shows.
    pub(crate) fn of(&self, value: Vec3) -> Vec3 {
        Vec3::from([0, 1, 2].map(|c| {
            let (v, knots) = (value[c], &self.knots[c]);
            let above = knots.iter().position(|k| k[0] >= v).unwrap_or(knots.len());
            match (above.checked_sub(1).map(|k| knots[k]), knots.get(above)) {
                (Some(a), Some(b)) => a[1] + (b[1] - a[1]) * (v - a[0]) / (b[0] - a[0]),
                (Some(end), None) | (None, Some(&end)) => v + end[1] - end[0],
                (None, None) => v,
            }
        }))
    }
}

/// So many pixels must be seen for a probe's gain, or variance, to be told.
pub(crate) const FEWEST_SEEN: usize = 200;

/// Fits per-probe, per-channel offsets and a common vignetting by medians, which half the picture may contradict.
/// `soft` is the photograph as soft as each probe.
pub(crate) fn fit(surfaces: &GeometryBuffer, sights: &Sights, probes: &[ProbeView], soft: &[Vec<Vec3>]) -> Radiometry {
    // of every fourth pixel: squared radius, logarithm in the photograph and in the probe
    let samples: Vec<Vec<(f32, Vec3, Vec3)>> = probes
        .par_iter()
        .zip(&sights.of)
        .zip(soft)
        .map(|((probe, sights), soft)| {
            (0..sights.len())
                .step_by(4)
                .filter_map(|i| {
                    let sight = sights[i]?;
                    let there = probe.log_radiance(surfaces.position[i], Sights::level(surfaces, i, &sight));
                    (there.is_finite() && soft[i].is_finite()).then(|| (surfaces.radius2(i), soft[i], there))
                })
                .collect()
        })
        .collect();
    let mut vignetting = 0.0f32;
    let mut offsets = vec![None; probes.len()];
    for _ in 0..8 {
        for (offset, samples) in offsets.iter_mut().zip(&samples) {
            *offset = (samples.len() >= FEWEST_SEEN).then(|| {
                let channel = |c: usize| median(samples.iter().map(|(r, a, b)| b[c] - a[c] - vignetting * r));
                Vec3::from([0, 1, 2].map(|c| channel(c).unwrap_or(0.0)))
            });
        }
        // robust least squares of what is left on the squared radius
        let (mut xy, mut xx) = (0.0f64, 0.0f64);
        for (offset, samples) in offsets.iter().zip(&samples) {
            let Some(offset) = offset else { continue };
            for (r, a, b) in samples {
                let rest = (*b - *a - *offset).element_sum() / 3.0 - vignetting * r;
                let weight = f64::from(1.0 / (1.0 + (rest / 0.1).powi(2)));
                let x = f64::from(r - 0.33);
                xy += weight * x * f64::from(rest);
                xx += weight * x * x;
            }
        }
        if xx > 0.0 {
            vignetting = (vignetting + 0.9 * (xy / xx) as f32).clamp(-0.5, 2.5);
        }
    }
    let known: Vec<Vec3> = offsets.iter().flatten().copied().collect();
    let offset = known.iter().sum::<Vec3>() / known.len().max(1) as f32;
    let gains = offsets.iter().map(|o| o.map_or(Vec3::ZERO, |o| offset - o)).collect();
    let (responses, spread) = offsets
        .par_iter()
        .zip(&samples)
        .map(|(known, samples)| {
            let Some(known) = known else { return (Response::adding(offset), None) };
            let (photo, probe): (Vec<Vec3>, Vec<Vec3>) =
                samples.iter().map(|(r, a, b)| (*a + Vec3::splat(vignetting * r), *b)).unzip();
            let left = |response: &Response| {
                let rest = photo.iter().zip(&probe).map(|(a, b)| ((*b - response.of(*a)).element_sum() / 3.0).abs());
                1.48 * median(rest).unwrap_or(0.0)
            };
            // a curve also fits two parts of one pattern somewhat, as where a wall is off its place
            let (straight, bent) = (Response::adding(*known), Response::between(&photo, &probe));
            let (without, with) = (left(&straight), left(&bent));
            if with < BENT * without { (bent, Some(with)) } else { (straight, Some(without)) }
        })
        .unzip();
    Radiometry { offset, vignetting, gains, responses, spread }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values from 1/50 to 1, in three channels.
    fn scene() -> Vec<Vec3> {
        (0..500).map(|k| Vec3::new(k as f32, (k * 7 % 500) as f32, (k * 13 % 500) as f32) / 510.0 + 0.02).collect()
    }

    #[test]
    fn haze_in_one_camera_is_no_difference() {
        let log = |haze: f32| scene().iter().map(|v| (*v + haze).map(f32::ln)).collect::<Vec<_>>();
        let (clear, hazy) = (log(0.0), log(0.1));
        for (from, to) in [(&clear, &hazy), (&hazy, &clear)] {
            let response = Response::between(from, to);
            let left = median(from.iter().zip(to).map(|(a, b)| (response.of(*a) - *b).x.abs()));
            let gain = Response::adding(Vec3::from(
                [0, 1, 2].map(|c| median(from.iter().zip(to).map(|(a, b)| b[c] - a[c])).unwrap_or(0.0)),
            ));
            let without = median(from.iter().zip(to).map(|(a, b)| (gain.of(*a) - *b).x.abs()));
            assert!(left.zip(without).is_some_and(|(l, w)| 3.0 * l < w), "{left:?} of {without:?}");
        }
    }

    #[test]
    fn a_plain_surface_bends_no_response() {
        let noisy = |by: f32| scene().iter().map(|v| v.map(|v| by * (v - 0.5))).collect::<Vec<_>>();
        let (quiet, loud) = (noisy(0.02), noisy(0.2));
        let response = Response::between(&quiet, &loud);
        let slope = response.of(Vec3::splat(0.01)) - response.of(Vec3::ZERO);
        assert!(slope.abs_diff_eq(Vec3::splat(0.01), 1e-5), "noise is no contrast: {slope}");
    }
}
