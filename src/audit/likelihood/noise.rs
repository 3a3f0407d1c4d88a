//! How far photograph and probes differ where the model is right, estimated from the picture at hand.
//!
//! The variance of a difference of logarithms is a floor (noise, coding, gains), a share of the pictures' squared slopes (what is
//! left of registration) and a share of their contrast (footprints, softness); its colours are correlated. Most of a picture is
//! right, so all of this is fitted to it, without the differences that are too great to be of a right model.

use glam::{Mat3, Vec3};

use crate::audit::observe::radiometry::FEWEST_SEEN;
use crate::statistics::median;

/// What a difference's variance is made of: floor, per squared slope, per squared contrast.
pub(crate) type Parts = [f32; 3];

/// Differences of squared length (in variances, a channel) above this are left out of the fit: one of twenty where all is right.
const CUT: f32 = 2.6;

/// Mean squared length of those that are left, if all are of a right model.
const KEPT: f32 = 0.89;

/// No photograph and probe agree closer than this, as a relative standard deviation: gains, lenses, hours.
const CLOSEST: f32 = 0.03;

/// Every how many pixels samples of a picture are taken that something is fitted to.
pub(crate) const EVERY: usize = 5;

/// A probe's differences in a view.
pub(crate) struct Sample {
    pub(crate) difference: Vec3,
    /// What the parts of the variance are to be multiplied by.
    pub(crate) by: Parts,
}

/// The variance of differences.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    /// Makes the channels independent and alike; its inverse square has trace 3.
    white: Mat3,
    /// Per probe.
    of: Vec<Parts>,
}

impl Noise {
    /// Fits it to samples of each probe.
    pub(crate) fn fit(samples: &[Vec<Sample>]) -> Self {
        const ROUNDS: usize = 3;
        let mut this = Self { white: Mat3::IDENTITY, of: samples.iter().map(|s| first(s)).collect() };
        for _ in 0..ROUNDS {
            this.white = whitening(
                samples
                    .iter()
                    .zip(&this.of)
                    .flat_map(|(s, parts)| s.iter().map(|s| s.difference / variance(*parts, s.by).sqrt())),
            );
            for (parts, samples) in this.of.iter_mut().zip(samples) {
                if samples.len() >= FEWEST_SEEN {
                    *parts = fitted(*parts, samples, this.white);
                }
            }
        }
        this
    }

    /// Variance of a difference with this probe, a channel.
    pub(crate) fn variance(&self, probe: usize, by: Parts) -> f32 {
        variance(self.of[probe], by)
    }

    /// Standard deviation where nothing has edges.
    pub(crate) fn floor(&self, probe: usize) -> f32 {
        self.of[probe][0].sqrt()
    }

    /// Mean over the channels of a squared difference in units of its variance.
    pub(crate) fn squared(&self, difference: Vec3, variance: f32) -> f32 {
        (self.white * difference).length_squared() / (3.0 * variance)
    }
}

fn variance(parts: Parts, by: Parts) -> f32 {
    parts[0] * by[0] + parts[1] * by[1] + parts[2] * by[2]
}

/// Where the fit starts from.
fn first(samples: &[Sample]) -> Parts {
    let middle = median(samples.iter().map(|s| s.difference.length_squared() / 3.0)).unwrap_or(0.01);
    [middle.max(CLOSEST * CLOSEST), 0.3, 0.1]
}

/// The parts of largest likelihood, by multiplicative steps that keep them positive (expectation-maximisation of a sum of
/// Gaussian variances), over what is not cut.
fn fitted(start: Parts, samples: &[Sample], white: Mat3) -> Parts {
    const STEPS: usize = 40;
    let squares: Vec<f32> = samples.iter().map(|s| (white * s.difference).length_squared() / 3.0).collect();
    let mut parts = start;
    for _ in 0..STEPS {
        let (mut up, mut down) = ([0.0f64; 3], [0.0f64; 3]);
        for (s, square) in samples.iter().zip(&squares) {
            let v = variance(parts, s.by);
            let q = square / v;
            if q <= CUT {
                for k in 0..3 {
                    up[k] += f64::from(q / KEPT / v * s.by[k]);
                    down[k] += f64::from(s.by[k] / v);
                }
            }
        }
        for k in 0..3 {
            if down[k] > 0.0 {
                let least = if k == 0 { CLOSEST * CLOSEST } else { 1e-7 };
                parts[k] = (parts[k] * ((up[k] / down[k]) as f32).clamp(0.1, 10.0).sqrt()).max(least);
            }
        }
    }
    parts
}

/// The inverse root of the covariance of those differences that are not far out, with trace 3 before.
pub(crate) fn whitening(differences: impl Iterator<Item = Vec3>) -> Mat3 {
    let all: Vec<Vec3> = differences.filter(|d| d.is_finite()).collect();
    let middle = median(all.iter().map(|d| d.length_squared())).unwrap_or(0.0);
    let sum = |rows: &mut dyn Iterator<Item = &Vec3>| {
        rows.fold(Mat3::ZERO, |m, d| m + Mat3::from_cols(*d * d.x, *d * d.y, *d * d.z))
    };
    let covariance = sum(&mut all.iter().filter(|d| d.length_squared() <= 2.0 * middle));
    let trace = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
    if trace.is_nan() || trace <= 0.0 {
        return Mat3::IDENTITY;
    }
    inverse_root(covariance * (3.0 / trace) + Mat3::from_diagonal(Vec3::splat(1e-3)))
}

/// Denman and Beavers, *The matrix sign function and computations in systems*, 1976.
fn inverse_root(of: Mat3) -> Mat3 {
    const STEPS: usize = 20;
    let (mut y, mut z) = (of, Mat3::IDENTITY);
    for _ in 0..STEPS {
        (y, z) = ((y + z.inverse()) * 0.5, (z + y.inverse()) * 0.5);
    }
    z
}
