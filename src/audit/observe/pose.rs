//! Refines a camera's pose by a few pixels: the picture that the model makes is laid over the photograph.
//!
//! Gauss–Newton on the difference of their logarithms, coarse to fine (Lucas and Kanade, 1981; Baker and Matthews,
//! *Lucas-Kanade 20 years on*, 2004), robustly weighted (Geman and McClure), so that what is wrong with the model does
//! not pull the camera along.

use glam::{DMat3, DQuat, DVec2, DVec3};
use rayon::prelude::*;

use crate::audit::finding::PoseCorrection;
use crate::audit::observe::geometry_buffer::{GeometryBuffer, NONE};
use crate::cholesky::{inverse, solve};
use crate::edge_aware::EdgeAware;
use crate::scene::Scene;
use crate::site::{Camera, Lens};
use crate::statistics::{median, robust_deviation};

/// Unknowns: shift of the camera (right, forward, up; metres), turn about the same axes (radians), radial distortion.
const UNKNOWNS: usize = 7;

/// Blurs from coarse to fine, pixels.
const BLURS: [f32; 4] = [6.0, 3.0, 1.5, 0.8];

/// Steps at each.
const STEPS: usize = 8;

/// A correction of more than this share of the picture's width, and of more than 8 pixels, is not believed.
const MOST: f64 = 0.04;

/// Standard deviation of what is believed of a camera's place before looking, metres per metre of median distance.
const LOOSE: f64 = 0.05;

/// What the fit found.
pub(crate) struct Aligned {
    pub(crate) camera: Camera,
    pub(crate) correction: PoseCorrection,
}

/// Lays `render` (brightness per pixel; what `surfaces` shows) over `photo` (the same size), and moves the camera
/// accordingly. `start` is the camera that `surfaces` was seen by, `first` the site's own, from which the correction
/// counts.
pub(crate) fn align(
    scene: &Scene,
    surfaces: &GeometryBuffer,
    start: &Camera,
    first: &Camera,
    render: &[f32],
    photo: &[f32],
    usable: &[f32],
) -> Aligned {
    let kept = Aligned { camera: *start, correction: shift(scene, surfaces, first, start, false, 0.0) };
    if start.lens != Lens::Perspective {
        return kept;
    }
    let mut camera = *start;
    let mut residual = f64::INFINITY;
    for blur in BLURS {
        let Some((a, b)) = bands(surfaces, render, photo, usable, blur) else { return kept };
        for _ in 0..STEPS {
            let Some(step) = step(scene, surfaces, &camera, &a, &b, blur) else { return kept };
            camera = moved(&camera, &step.change);
            residual = step.residual_px;
            if step.pixels < 0.01 {
                break;
            }
        }
    }
    let correction = shift(scene, surfaces, first, &camera, true, residual);
    let most = (MOST * f64::from(camera.width.max(camera.height))).max(8.0);
    if correction.max_px.is_finite() && correction.mean_px < most && residual < 0.5 {
        Aligned { camera, correction }
    } else {
        kept
    }
}

/// A picture without what is smooth: only its structure is laid over.
struct Band {
    values: Vec<f32>,
    weight: Vec<f32>,
}

fn bands(surfaces: &GeometryBuffer, render: &[f32], photo: &[f32], usable: &[f32], blur: f32) -> Option<(Band, Band)> {
    let open = EdgeAware::open(surfaces.width, surfaces.height);
    // black is as dark as a hundredth of the mean: its logarithm must not run away
    let log = |v: &[f32]| -> Vec<f32> {
        let floor = 0.01 * v.iter().map(|v| f64::from(*v)).sum::<f64>() as f32 / v.len().max(1) as f32;
        v.iter().map(|v| v.max(floor.max(1e-30)).ln()).collect()
    };
    let band = |values: &[f32], weight: &[f32]| {
        let values = log(values);
        let fine = open.mean(&values, weight, blur);
        let coarse = open.mean(&values, weight, 6.0 * blur + 6.0);
        // what is as strong as a black edge should not outweigh the rest
        fine.iter().zip(&coarse).map(|(f, c)| (f - c).clamp(-1.0, 1.0)).collect::<Vec<f32>>()
    };
    let shown: Vec<f32> = surfaces.triangle.iter().map(|t| if *t != NONE { 1.0 } else { 0.0 }).collect();
    let enough = |w: &[f32]| w.iter().filter(|w| **w > 0.0).count() > 1000;
    if !enough(&shown) || !enough(usable) {
        return None;
    }
    let solid = |w: &[f32]| -> Vec<f32> {
        let near = open.smoothed(w, 1.0 + blur);
        w.iter().zip(&near).map(|(w, n)| if *w > 0.0 && *n > 0.9 { 1.0 } else { 0.0 }).collect()
    };
    let a = Band { values: band(render, &shown), weight: solid(&shown) };
    let b = Band { values: band(photo, usable), weight: solid(usable) };
    Some((a, b))
}

struct Step {
    change: [f64; UNKNOWNS],
    /// Mean shift of the picture by this step.
    pixels: f64,
    /// Mean standard deviation of the picture's shift that the fit leaves.
    residual_px: f64,
}

/// One Gauss–Newton step.
fn step(scene: &Scene, surfaces: &GeometryBuffer, camera: &Camera, a: &Band, b: &Band, blur: f32) -> Option<Step> {
    let (w, h) = (surfaces.width, surfaces.height);
    let stride = (blur / 1.5).clamp(1.0, 4.0) as usize;
    let rows: Vec<usize> = (2..h.saturating_sub(2)).step_by(stride).collect();
    let origin = scene.origin;
    let observations: Vec<Vec<(f64, [f64; UNKNOWNS], DVec2)>> = rows
        .par_iter()
        .map(|&y| {
            (2..w.saturating_sub(2))
                .step_by(stride)
                .filter_map(|x| {
                    let i = y * w + x;
                    if a.weight[i] == 0.0 {
                        return None;
                    }
                    let point = surfaces.position[i].as_dvec3() + origin;
                    let pixel = camera.project(point)?;
                    let (value, slope) = sample(&b.values, &b.weight, w, h, pixel)?;
                    let d = derivatives(camera, point)?;
                    let j = std::array::from_fn(|k| slope.dot(d[k]));
                    Some((f64::from(value - a.values[i]), j, slope))
                })
                .collect()
        })
        .collect();
    let count: usize = observations.iter().map(Vec::len).sum();
    if count < 300 {
        return None;
    }
    let scale = robust_deviation(observations.iter().flatten().map(|o| o.0)).unwrap_or(0.0).max(1e-3);
    let mut normal = [[0.0f64; UNKNOWNS]; UNKNOWNS];
    let mut right = [0.0f64; UNKNOWNS];
    let mut variance = (0.0, 0.0);
    for (rest, j, _) in observations.iter().flatten() {
        let t = rest / (2.0 * scale);
        let weight = 1.0 / (1.0 + t * t).powi(2);
        variance.0 += weight * rest * rest;
        variance.1 += weight;
        for p in 0..UNKNOWNS {
            right[p] -= weight * j[p] * rest;
            for q in 0..UNKNOWNS {
                normal[p][q] += weight * j[p] * j[q];
            }
        }
    }
    // pixels within a blur are not independent
    let correlated = (4.0 * std::f64::consts::PI * f64::from(blur * blur)).max(4.0) / (stride * stride) as f64;
    let noise = variance.0 / variance.1.max(1e-9) * correlated.max(1.0);
    let depths = surfaces.distance.iter().copied().filter(|d| d.is_finite());
    let depth = f64::from(median(depths).unwrap_or(0.0)).max(0.1);
    for (p, row) in normal.iter_mut().enumerate() {
        let believed: f64 = match p {
            0..=2 => LOOSE * depth,
            3..=5 => 0.05,
            _ => 0.02,
        };
        row[p] += noise / (believed * believed) + 1e-12;
    }
    let change = solve(&normal, &right)?;
    let spread = mean_shift_spread(surfaces, camera, scene, &normal, noise);
    let pixels = mean_shift(surfaces, camera, scene, &change);
    Some(Step { change, pixels, residual_px: spread })
}

/// Derivatives of a point's pixel by the unknowns.
fn derivatives(camera: &Camera, point: DVec3) -> Option<[DVec2; UNKNOWNS]> {
    let c = camera.pose.rotation.transpose() * (point - camera.pose.position);
    if c.y < 1e-3 {
        return None;
    }
    let (f, inv) = (camera.focal, 1.0 / c.y);
    // u = fx x/y, v = −fz z/y (lens distortion changes these by little)
    let by =
        |d: DVec3| DVec2::new(f.x * (d.x * inv - c.x * d.y * inv * inv), -f.y * (d.z * inv - c.z * d.y * inv * inv));
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut all = [DVec2::ZERO; UNKNOWNS];
    for (k, axis) in axes.iter().enumerate() {
        all[k] = by(-*axis);
        all[3 + k] = by(-axis.cross(c));
    }
    let at = DVec2::new(c.x * inv, c.z * inv);
    all[6] = DVec2::new(f.x * at.x, -f.y * at.y) * at.length_squared();
    Some(all)
}

/// The camera after a change in its own axes.
fn moved(camera: &Camera, change: &[f64; UNKNOWNS]) -> Camera {
    let mut out = *camera;
    let shift = DVec3::new(change[0], change[1], change[2]);
    let turn = DVec3::new(change[3], change[4], change[5]);
    out.pose.position += camera.pose.rotation * shift;
    let r = camera.pose.rotation * DMat3::from_quat(DQuat::from_scaled_axis(turn));
    // stay a rotation
    let x = r.x_axis.normalize();
    let y = (r.y_axis - x * x.dot(r.y_axis)).normalize();
    out.pose.rotation = DMat3::from_cols(x, y, x.cross(y));
    // a hundredth of a pixel is no distortion: keep a pinhole a pinhole
    if change[6].abs() * camera.focal.x > 0.01 {
        out.distortion = camera.distortion.bent(change[6]);
    }
    out
}

fn sample(values: &[f32], weight: &[f32], w: usize, h: usize, at: DVec2) -> Option<(f32, DVec2)> {
    let (x, y) = (at.x - 0.5, at.y - 0.5);
    if x.is_nan() || y.is_nan() || x < 1.0 || y < 1.0 || x >= (w - 2) as f64 || y >= (h - 2) as f64 {
        return None;
    }
    let (x0, y0) = (x as usize, y as usize);
    let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
    let i = y0 * w + x0;
    if [i, i + 1, i + w, i + w + 1].iter().any(|j| weight[*j] == 0.0) {
        return None;
    }
    let bilinear = |i: usize| {
        let top = values[i] + (values[i + 1] - values[i]) * fx;
        let bottom = values[i + w] + (values[i + w + 1] - values[i + w]) * fx;
        top + (bottom - top) * fy
    };
    let slope = DVec2::new(
        f64::from(bilinear(i + 1) - bilinear(i - 1)) * 0.5,
        f64::from(bilinear(i + w) - bilinear(i - w)) * 0.5,
    );
    Some((bilinear(i), slope))
}

/// Every so many pixels, the mean of something over those that show a surface.
fn mean_over(surfaces: &GeometryBuffer, scene: &Scene, f: impl Fn(DVec3) -> Option<f64>) -> (f64, f64) {
    let (mut sum, mut count, mut most) = (0.0, 0.0, 0.0f64);
    for i in (0..surfaces.triangle.len()).step_by(97) {
        if surfaces.triangle[i] == NONE {
            continue;
        }
        if let Some(v) = f(surfaces.position[i].as_dvec3() + scene.origin) {
            sum += v;
            count += 1.0;
            most = most.max(v);
        }
    }
    (if count > 0.0 { sum / count } else { f64::INFINITY }, most)
}

fn mean_shift(surfaces: &GeometryBuffer, camera: &Camera, scene: &Scene, change: &[f64; UNKNOWNS]) -> f64 {
    mean_over(surfaces, scene, |p| {
        let d = derivatives(camera, p)?;
        let sum: DVec2 = d.iter().zip(change).map(|(d, c)| *d * *c).sum();
        Some(sum.length())
    })
    .0
}

fn mean_shift_spread(
    surfaces: &GeometryBuffer,
    camera: &Camera,
    scene: &Scene,
    normal: &[[f64; UNKNOWNS]; UNKNOWNS],
    noise: f64,
) -> f64 {
    let Some(covariance) = inverse(normal) else { return 0.0 };
    mean_over(surfaces, scene, |p| {
        let d = derivatives(camera, p)?;
        // the variances of the shift along x and along y, summed: d C dᵀ
        let of_pair = |(i, j): (usize, usize)| covariance[i][j] * d[i].dot(d[j]);
        let pairs = (0..UNKNOWNS).flat_map(|i| (0..UNKNOWNS).map(move |j| (i, j)));
        Some((pairs.map(of_pair).sum::<f64>() * noise).max(0.0).sqrt())
    })
    .0
}

/// How two cameras' pictures of the surfaces differ.
fn shift(
    scene: &Scene,
    surfaces: &GeometryBuffer,
    first: &Camera,
    camera: &Camera,
    refined: bool,
    residual: f64,
) -> PoseCorrection {
    let (mean_px, max_px) = mean_over(surfaces, scene, |p| Some((camera.project(p)? - first.project(p)?).length()));
    let turn = DQuat::from_mat3(&(first.pose.rotation.transpose() * camera.pose.rotation));
    PoseCorrection {
        refined,
        mean_px: if mean_px.is_finite() { mean_px } else { 0.0 },
        max_px,
        residual_px: residual,
        rotation_deg: turn.normalize().to_axis_angle().1.to_degrees(),
        translation_m: camera.pose.position.distance(first.pose.position),
    }
}
