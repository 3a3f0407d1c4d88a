//! Exposure, white balance, vignetting and the probes' gains.

use glam::Vec3;
use rayon::prelude::*;

use crate::audit::observe::geometry_buffer::{GeometryBuffer, NONE};
use crate::audit::observe::probe_view::{ProbeView, Sight};
use crate::statistics::{median, robust_deviation};

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
    /// Per probe, the robust standard deviation of what is left; `None` where it sees too little.
    pub(crate) spread: Vec<Option<f32>>,
}

impl Radiometry {
    /// Added to the photograph's logarithm at a squared distance from the centre (1 in the corners).
    pub(crate) fn at(&self, radius2: f32) -> Vec3 {
        self.offset + Vec3::splat(self.vignetting * radius2)
    }

    /// The darkest value that the photograph tells, in the probes' light.
    pub(crate) fn dark(&self, value: f32) -> Vec3 {
        value * self.offset.map(f32::exp)
    }
}

/// So many pixels must be seen for a probe's gain, or variance, to be told.
pub(crate) const FEWEST_SEEN: usize = 200;

/// Fits per-probe, per-channel offsets and a common vignetting by medians, which half the picture may contradict.
/// `soft` is the photograph as soft as each probe.
pub(crate) fn fit(surfaces: &GeometryBuffer, sights: &Sights, probes: &[ProbeView], soft: &[Vec<Vec3>]) -> Radiometry {
    // (squared radius, difference of logarithms) of every fourth pixel
    let differences: Vec<Vec<(f32, Vec3)>> = probes
        .par_iter()
        .zip(&sights.of)
        .zip(soft)
        .map(|((probe, sights), soft)| {
            (0..sights.len())
                .step_by(4)
                .filter_map(|i| {
                    let sight = sights[i]?;
                    let level = Sights::level(surfaces, i, &sight);
                    let d = probe.log_radiance(surfaces.position[i], level) - soft[i];
                    d.is_finite().then(|| (surfaces.radius2(i), d))
                })
                .collect()
        })
        .collect();
    let mut vignetting = 0.0f32;
    let mut offsets = vec![None; probes.len()];
    for _ in 0..8 {
        for (offset, samples) in offsets.iter_mut().zip(&differences) {
            *offset = (samples.len() >= FEWEST_SEEN).then(|| {
                let channel = |c: usize| median(samples.iter().map(|(r, d)| d[c] - vignetting * r)).unwrap_or(0.0);
                Vec3::new(channel(0), channel(1), channel(2))
            });
        }
        // robust least squares of what is left on the squared radius
        let (mut xy, mut xx) = (0.0f64, 0.0f64);
        for (offset, samples) in offsets.iter().zip(&differences) {
            let Some(offset) = offset else { continue };
            for (r, d) in samples {
                let rest = (*d - *offset).element_sum() / 3.0 - vignetting * r;
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
    let spread = offsets
        .iter()
        .zip(&differences)
        .map(|(o, samples)| {
            let o = (*o)?;
            let rest = samples.iter().map(|(r, d)| (*d - o).element_sum() / 3.0 - vignetting * r);
            Some(robust_deviation(rest).unwrap_or(0.0) as f32)
        })
        .collect();
    Radiometry { offset, vignetting, gains, spread }
}
