//! How well a pose fits, how sure it is, and how much worse the second-best is.

use super::model::{GeometryBuffer, LocalPose};
use super::picture::Level;
use super::raster::Raster;
use super::refine::{BLOCKS, Equations, Matrix};
use super::search::{self, Features};
use crate::scene::Scene;
use crate::statistics::median;

/// Below so many standard errors a second place is no worse.
pub(super) const CLEARLY: f64 = 3.0;

/// A pose that fits less than this is no fit.
pub(super) const LEAST_FIT: f64 = 0.25;

/// What remains of a registration's error whatever the residuals say, in cells of the finest level, since surfaces are sampled
/// once a cell.
const SYSTEMATIC: f64 = 0.15;

/// How far models are off where they are right, metres: a scan's noise, a modeller's rounding.
const MODEL_OFF_M: f64 = 0.004;

/// A level's own features, to be compared with the model's at many poses.
pub(super) struct Judge<'a> {
    level: &'a Level,
    picture: Features,
}

impl<'a> Judge<'a> {
    pub(super) fn new(level: &'a Level) -> Self {
        Self { level, picture: search::of_own(level) }
    }

    /// Pearson's correlation of what the picture and the model show at a pose, block by block of the picture's window: they sum
    /// up to the correlation, −1..=1.
    pub(super) fn fit(&self, scene: &Scene, pose: &LocalPose) -> Vec<f64> {
        let raster = &self.level.raster;
        correlation(raster, &self.picture, &search::of_model(scene, raster, pose))
    }
}

fn correlation(raster: &Raster, picture: &Features, model: &Features) -> Vec<f64> {
    let w = &picture.weight;
    let total: f64 = w.iter().map(|w| f64::from(*w)).sum::<f64>().max(1e-9);
    let mut blocks = vec![0.0; BLOCKS[0] * BLOCKS[1]];
    let (mut aa, mut bb) = (0.0, 0.0);
    for (a, b) in picture.channels.iter().zip(&model.channels) {
        let mean = |c: &[f32]| c.iter().zip(w).map(|(v, w)| f64::from(v * w)).sum::<f64>() / total;
        let (ma, mb) = (mean(a), mean(b));
        for i in 0..w.len() {
            let (x, y) = (i % raster.width, i / raster.width);
            let (p, q, w) = (f64::from(a[i]) - ma, f64::from(b[i]) - mb, f64::from(w[i]));
            blocks[y * BLOCKS[1] / raster.height * BLOCKS[0] + x * BLOCKS[0] / raster.width] += w * p * q;
            aa += w * p * p;
            bb += w * q * q;
        }
    }
    let norm = (aa * bb).sqrt().max(1e-12);
    blocks.iter_mut().for_each(|b| *b /= norm);
    blocks
}

/// By how many standard errors the first of two fits is better: their difference over its spread from block to block.
pub(super) fn better_by(first: &[f64], second: &[f64]) -> f64 {
    let difference: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
    let n = difference.iter().filter(|d| **d != 0.0).count() as f64;
    let sum: f64 = difference.iter().sum();
    let mean = sum / n.max(1.0);
    let variance: f64 = difference.iter().filter(|d| **d != 0.0).map(|d| (d - mean).powi(2)).sum();
    sum / (variance * n / (n - 1.0).max(1.0)).sqrt().max(1e-12)
}

/// The covariance of a pose: what the residuals say, and what remains whatever they say.
pub(super) fn covariance(equations: &Equations, level: &Level, buffer: &GeometryBuffer) -> Option<Matrix> {
    let mut c = equations.covariance()?;
    let distance = f64::from(median(buffer.distance.iter().copied().filter(|d| d.is_finite())).unwrap_or(1.0));
    let turn = (SYSTEMATIC * f64::from(level.raster.cell_angle())).hypot(MODEL_OFF_M / distance) / 3f64.sqrt();
    for (k, row) in c.iter_mut().enumerate() {
        row[k] += if k < 3 { (turn * distance).powi(2) } else { turn * turn };
    }
    Some(c)
}
