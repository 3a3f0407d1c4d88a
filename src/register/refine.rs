//! Refines a pose: Gauss–Newton on the difference between the picture and what the model says it should be.
//!
//! The template moves, not the picture (inverse composition: Baker and Matthews, *Lucas-Kanade 20 years on*, 2004), so that
//! what only the picture shows, such as a shadow's edge, pulls nowhere. Robust weights (Geman and McClure) keep
//! what is wrong in the model from pulling.

use glam::{Mat3, Quat, Vec3};
use rayon::prelude::*;

use super::model::{GeometryBuffer, LocalPose, Template};
use super::picture::Level;
use crate::cholesky::{inverse, solve};
use crate::statistics::robust_deviation;

/// Shift (right, forward, up; metres) and turn about the same axes (radians), in the picture's own axes.
pub(super) type Twist = [f64; 6];

/// A symmetric 6 × 6 matrix in full.
pub(super) type Matrix = [[f64; 6]; 6];

/// Sums over cells of the equations that a change of pose must solve.
pub(super) struct Equations {
    /// The lower half of the normal equations' matrix.
    normal: Matrix,
    right: Twist,
    /// The right-hand side block by block of the picture, for the spread of what they say.
    blocks: Vec<Twist>,
}

/// How far an edge may lie from where a cell's middle says, in cells: the light of both sides mixes before its logarithm is
/// taken, and surfaces are sampled in one place a cell.
const SLACK: f32 = 0.3;

/// Residuals this many variances large are half believed (Geman and McClure).
const ROBUST: f32 = 16.0;

/// Blocks along the window's sides: what lies in one is not independent.
pub(super) const BLOCKS: [usize; 2] = [12, 8];

/// How a residual relates to a change of pose: J = [−∇T/r, −d × ∇T] for a cell that looks along d at a surface r metres away
/// and whose template has the gradient ∇T per radian.
fn jacobian(d: Vec3, gradient: Vec3, distance: f32) -> [f32; 6] {
    let shift = -gradient / distance;
    let turn = -d.cross(gradient);
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}

/// Residuals of one template at one pose.
pub(super) struct Residuals {
    /// Picture less template; NaN where there is none.
    value: Vec<f32>,
    /// The template's gradient over the sphere, per radian.
    gradient: Vec<Vec3>,
    /// Standard deviation of residuals where the template changes, robustly.
    scale: f32,
}

impl Residuals {
    /// Compares a level with what it should be.
    pub(super) fn new(level: &Level, template: &Template) -> Self {
        let raster = &level.raster;
        let told = |i: usize| level.weight[i] > 0.0 && template.value[i].is_finite();
        let value: Vec<f32> =
            (0..raster.len()).map(|i| if told(i) { level.log[i] - template.value[i] } else { f32::NAN }).collect();
        let gradient: Vec<Vec3> = (0..raster.len())
            .map(|i| {
                let around = raster.around(i);
                if told(i) && around.iter().all(|&j| told(j)) {
                    raster.gradient(i, template.slope[0][i], template.slope[1][i])
                } else {
                    Vec3::ZERO
                }
            })
            .collect();
        let changing = value
            .iter()
            .zip(&gradient)
            .filter(|(v, g)| v.is_finite() && g.length() * raster.cell_angle() > 0.02)
            .map(|(v, _)| *v);
        let scale = robust_deviation(changing).unwrap_or(1.0) as f32;
        Self { value, gradient, scale: scale.max(0.01) }
    }

    /// The equations of these residuals, as heavy as their own spread says.
    pub(super) fn equations(&self, level: &Level, buffer: &GeometryBuffer) -> Equations {
        let raster = &level.raster;
        let (w, h) = (raster.width, raster.height);
        let rows: Vec<(Equations, usize)> = (0..h)
            .into_par_iter()
            .map(|y| {
                let mut sums = Equations::none(BLOCKS[0]);
                for x in 0..w {
                    let i = y * w + x;
                    let r = self.value[i];
                    if r.is_nan() || self.gradient[i] == Vec3::ZERO {
                        continue;
                    }
                    let slack = SLACK * self.gradient[i].length() * raster.cell_angle();
                    let variance = self.scale * self.scale + slack * slack;
                    // Geman and McClure's loss: r² / (1 + r² / kσ²)
                    let robust = 1.0 / (1.0 + r * r / (variance * ROBUST));
                    let heavy = f64::from(level.weight[i]) / f64::from(variance);
                    let front = buffer.front(raster, i);
                    let j = jacobian(raster.directions[i], self.gradient[i], front).map(f64::from);
                    let k = heavy * f64::from(robust * robust);
                    let block = &mut sums.blocks[x * BLOCKS[0] / w];
                    for p in 0..6 {
                        sums.right[p] -= k * j[p] * f64::from(r);
                        block[p] -= k * j[p] * f64::from(r);
                        for (sum, q) in sums.normal[p][..=p].iter_mut().zip(j) {
                            *sum += k * j[p] * q;
                        }
                    }
                }
                (sums, y * BLOCKS[1] / h)
            })
            .collect();
        let mut all = Equations::none(BLOCKS[0] * BLOCKS[1]);
        for (sums, band) in rows {
            all.add(&sums, band * BLOCKS[0]);
        }
        all
    }
}

impl Equations {
    fn none(blocks: usize) -> Self {
        Self { normal: [[0.0; 6]; 6], right: [0.0; 6], blocks: vec![[0.0; 6]; blocks] }
    }

    /// Adds others, whose first block is this one's block `first`.
    pub(super) fn add(&mut self, other: &Self, first: usize) {
        for p in 0..6 {
            self.right[p] += other.right[p];
            for q in 0..=p {
                self.normal[p][q] += other.normal[p][q];
            }
            for (mine, theirs) in self.blocks[first..].iter_mut().zip(&other.blocks) {
                mine[p] += theirs[p];
            }
        }
    }

    /// The change of pose that solves the equations, a little damped; `None` where they leave a direction open.
    pub(super) fn solve(&self, damping: f64) -> Option<Twist> {
        let mut damped = self.normal;
        for (p, row) in damped.iter_mut().enumerate() {
            row[p] += damping * row[p] + 1e-12;
        }
        solve(&damped, &self.right)
    }

    /// The covariance of the pose: H⁻¹ (Σ g gᵀ) H⁻¹ over the blocks' gradients g, which asks no model of how residuals hang
    /// together within a block (White, *A heteroskedasticity-consistent covariance matrix estimator*, 1980, by clusters).
    pub(super) fn covariance(&self) -> Option<Matrix> {
        let mut meat = [[0.0; 6]; 6];
        let told = self.blocks.iter().filter(|b| b.iter().any(|v| *v != 0.0)).count() as f64;
        for b in &self.blocks {
            for p in 0..6 {
                for q in 0..6 {
                    meat[p][q] += b[p] * b[q];
                }
            }
        }
        let inverse = inverse(&self.normal)?;
        let few = told / (told - 6.0).max(1.0);
        let mut out = [[0.0; 6]; 6];
        for p in 0..6 {
            for q in 0..6 {
                for i in 0..6 {
                    for j in 0..6 {
                        out[p][q] += few * inverse[p][i] * meat[i][j] * inverse[j][q];
                    }
                }
            }
        }
        Some(out)
    }
}

/// The pose after a change in the picture's own axes.
pub(super) fn moved(pose: &LocalPose, change: &Twist) -> LocalPose {
    let [x, y, z, a, b, c] = change.map(|v| v as f32);
    let turned = Quat::from_mat3(&pose.rotation) * Quat::from_scaled_axis(Vec3::new(a, b, c));
    LocalPose {
        origin: pose.origin + pose.rotation * Vec3::new(x, y, z),
        rotation: Mat3::from_quat(turned.normalize()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point's direction moves by the Jacobian's prediction when the pose does.
    #[test]
    fn the_jacobian_is_the_derivative_of_what_a_moving_template_shows() {
        let pose = LocalPose { origin: Vec3::new(1.0, 2.0, 0.5), rotation: Mat3::from_rotation_z(0.4) };
        let d = Vec3::new(0.3, 0.8, -0.52).normalize();
        let (distance, gradient) = (3.0, Vec3::new(0.7, 0.1, 0.4));
        let gradient = gradient - d * gradient.dot(d);
        let point = pose.origin + pose.rotation * d * distance;
        let j = jacobian(d, gradient, distance);
        for (k, j) in j.into_iter().enumerate() {
            let step = 1e-3;
            let change: Twist = std::array::from_fn(|i| if i == k { step } else { 0.0 });
            let after = moved(&pose, &change);
            let seen = (after.rotation.transpose() * (point - after.origin)).normalize();
            // the template's value rides on the direction: the residual grows by ∇T · ḋ
            let grown = f64::from(gradient.dot(seen - d)) / step;
            assert!((grown - f64::from(j)).abs() < 2e-3, "{k}: {grown} {j}");
        }
    }
}
