//! Least squares by Levenberg and Marquardt's method.

use glam::{DMat3, DVec3};

use super::result::{Resection, ResectionError};
use crate::cholesky;
use crate::site::{Camera, Match};

/// Turn (3), move (3), logarithm of the focal length.
const PARAMETERS: usize = 7;

type Vector = [f64; PARAMETERS];
type Matrix = [[f64; PARAMETERS]; PARAMETERS];

/// How many are to be found: the focal length, the last, perhaps not.
fn free_parameters(focal: bool) -> usize {
    if focal { PARAMETERS } else { PARAMETERS - 1 }
}

/// A refined camera and what it leaves.
pub(super) struct Fit {
    pub(super) camera: Camera,
    /// For each pair the pixel shown less the pixel picked.
    residuals: Vec<[f64; 2]>,
    /// JᵀJ.
    normal: Matrix,
    /// Mean distance of the points, metres.
    pub(super) distance: f64,
}

/// Refines pose, and focal length where asked; `None` where a point leaves the picture's domain at the very start.
pub(super) fn refine(start: &Camera, matches: &[Match], focal: bool) -> Option<Fit> {
    // positions in units of the distance to the points: all parameters are then about pixels per radian
    let distance = matches.iter().map(|m| m.point.distance(start.pose.position)).sum::<f64>() / matches.len() as f64;
    let distance = if distance > 0.0 { distance } else { 1.0 };
    let mut camera = *start;
    let mut residuals = misses(&camera, matches)?;
    let mut lambda = 1e-3;
    for _ in 0..200 {
        let jacobian = jacobian(&camera, matches, distance, focal)?;
        let (normal, gradient) = normal_equations(&jacobian, &residuals, focal);
        let before = sum(&residuals);
        let mut stepped = false;
        while lambda < 1e12 {
            let mut damped = normal;
            for (i, row) in damped.iter_mut().enumerate() {
                row[i] += lambda * row[i].max(1e-12);
            }
            let step = cholesky::solve(&damped, &gradient.map(|v| -v));
            let next = step.map(|s| moved(&camera, &s, distance));
            if let Some(next) = next
                && let Some(after) = misses(&next, matches)
                && sum(&after) < before
            {
                (camera, residuals, stepped) = (next, after, true);
                lambda = (lambda * 0.2).max(1e-15);
                break;
            }
            lambda *= 6.0;
        }
        if !stepped || before - sum(&residuals) <= 1e-14 * before {
            break;
        }
    }
    let (normal, _) = normal_equations(&jacobian(&camera, matches, distance, focal)?, &residuals, focal);
    Some(Fit { camera, residuals, normal, distance })
}

impl Fit {
    /// Root of the mean squared distance in pixels.
    pub(super) fn rms(&self) -> f64 {
        (sum(&self.residuals) / self.residuals.len() as f64).sqrt()
    }

    /// Distance in pixels of a pair.
    pub(super) fn miss(&self, pair: usize) -> f64 {
        let [x, y] = self.residuals[pair];
        x.hypot(y)
    }

    /// The result with its uncertainty: σ² (JᵀJ)⁻¹, where σ is what the residuals tell, but at least `picking_px`.
    ///
    /// # Errors
    ///
    /// [`ResectionError::Loose`] where the position is uncertain by more than a tenth of the distance, or the focal
    /// length by more than a tenth.
    pub(super) fn resection(&self, picking_px: f64, focal: bool) -> Result<Resection, ResectionError> {
        let n = self.residuals.len();
        let free = (2 * n).saturating_sub(free_parameters(focal)).max(1);
        let sigma = (sum(&self.residuals) / free as f64).sqrt().max(picking_px);
        let loose = |what, uncertainty: String| ResectionError::Loose { what, uncertainty };
        let Some(covariance) = cholesky::inverse(&self.normal) else {
            return Err(loose("the camera", "any amount".to_owned()));
        };
        let worst = |from: usize| sigma * largest_eigenvalue(&covariance, from).sqrt();
        let (turn, shift) = (worst(0), worst(3) * self.distance);
        let focal_sd = focal.then(|| sigma * covariance[6][6].max(0.0).sqrt());
        if let Some(sd) = focal_sd.filter(|sd| sd.is_nan() || *sd > 0.1) {
            return Err(loose("the focal length", format!("{:.0} %", 100.0 * sd)));
        }
        if shift.is_nan() || shift > 0.1 * self.distance {
            return Err(loose("the camera's position", format!("{shift:.2} m")));
        }
        Ok(Resection {
            camera: self.camera,
            residuals_px: (0..n).map(|i| self.miss(i)).collect(),
            rms_px: self.rms(),
            position_sd_m: shift,
            direction_sd_deg: turn.to_degrees(),
            focal_sd_px: focal_sd.map(|sd| sd * self.camera.focal.y),
            suspect: None,
        })
    }
}

/// The camera after a small turn, move (in units of `distance`) and change of focal length.
fn moved(camera: &Camera, step: &Vector, distance: f64) -> Camera {
    let mut next = *camera;
    let turn = DVec3::new(step[0], step[1], step[2]);
    let angle = turn.length();
    if angle > 0.0 {
        next.pose.rotation = DMat3::from_axis_angle(turn / angle, angle) * camera.pose.rotation;
    }
    next.pose.position += DVec3::new(step[3], step[4], step[5]) * distance;
    next.focal *= step[6].exp();
    next
}

fn misses(camera: &Camera, matches: &[Match]) -> Option<Vec<[f64; 2]>> {
    matches.iter().map(|m| Some((camera.project(m.point)? - m.pixel).to_array())).collect()
}

fn sum(residuals: &[[f64; 2]]) -> f64 {
    residuals.iter().map(|[x, y]| x * x + y * y).sum()
}

/// Central differences, two rows a pair; zeros for the focal length where that is known.
fn jacobian(camera: &Camera, matches: &[Match], distance: f64, focal: bool) -> Option<Vec<[Vector; 2]>> {
    const STEP: f64 = 1e-6;
    let mut rows = vec![[[0.0; PARAMETERS]; 2]; matches.len()];
    for parameter in 0..free_parameters(focal) {
        let mut step = [0.0; PARAMETERS];
        step[parameter] = STEP;
        let ahead = misses(&moved(camera, &step, distance), matches)?;
        let behind = misses(&moved(camera, &step.map(|v| -v), distance), matches)?;
        for (row, (a, b)) in rows.iter_mut().zip(ahead.iter().zip(&behind)) {
            for axis in 0..2 {
                row[axis][parameter] = (a[axis] - b[axis]) / (2.0 * STEP);
            }
        }
    }
    Some(rows)
}

fn normal_equations(jacobian: &[[Vector; 2]], residuals: &[[f64; 2]], focal: bool) -> (Matrix, Vector) {
    let (mut normal, mut gradient) = ([[0.0; PARAMETERS]; PARAMETERS], [0.0; PARAMETERS]);
    for (rows, residual) in jacobian.iter().zip(residuals) {
        for (row, r) in rows.iter().zip(residual) {
            for i in 0..PARAMETERS {
                gradient[i] += row[i] * r;
                for j in 0..PARAMETERS {
                    normal[i][j] += row[i] * row[j];
                }
            }
        }
    }
    if !focal {
        // an equation of its own, by which a known focal length stays
        normal[6][6] = 1.0;
    }
    (normal, gradient)
}

/// Of the 3 × 3 block at `from`, by power iteration.
fn largest_eigenvalue(a: &Matrix, from: usize) -> f64 {
    let block = DMat3::from_cols_array_2d(&[0, 1, 2].map(|j| [0, 1, 2].map(|i| a[from + i][from + j])));
    let mut v = DVec3::new(1.0, 0.7, 0.4).normalize();
    for _ in 0..200 {
        v = (block * v).normalize_or_zero();
    }
    v.dot(block * v).max(0.0)
}
