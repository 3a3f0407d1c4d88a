//! Resection: a camera's pose from points of the model and where its photograph shows them.
//!
//! Triples of pairs give poses in closed form but for one angle that is searched (the three-point problem of Grunert,
//! 1841); the best are refined on all pairs by Levenberg and Marquardt's method. Where the focal length is wanted too,
//! it is searched over what lenses there are and refined with the pose.

pub(super) mod result;
mod solve;
mod three_points;

use glam::{DMat3, DVec2, DVec3};

use super::Camera;
pub use result::{Match, Resection, ResectionError};
use solve::{Fit, refine};
use three_points::poses;

/// The error of a picked pixel that is reckoned with at least, pixels along an axis.
const PICKING_PX: f64 = 0.5;

/// Focal lengths that are tried, as the tangent of half the picture's diagonal: 10° to 140°.
const FOCAL_TRIES: usize = 24;

impl Resection {
    /// Solves for the pose of a camera whose other parameters are those of `lens` (its pose is not looked at); with
    /// `focal`, for its focal length in pixels too (one for both axes). Needs four pairs, six with `focal`.
    ///
    /// # Errors
    ///
    /// See [`ResectionError`]: too few or degenerate pairs, no fit, two fits, or a pose that the pairs leave loose.
    pub fn of(lens: &Camera, matches: &[Match], focal: bool) -> Result<Self, ResectionError> {
        let needed = if focal { 6 } else { 4 };
        if matches.len() < needed {
            return Err(ResectionError::TooFew { found: matches.len(), needed, focal });
        }
        distinct(matches)?;
        let centroid = matches.iter().map(|m| m.point).sum::<DVec3>() / matches.len() as f64;
        // national grids lose digits: solve about the centroid
        let local: Vec<Match> = matches.iter().map(|m| Match { pixel: m.pixel, point: m.point - centroid }).collect();
        let size = not_collinear(&local)?;
        let fits = fits(lens, &local, focal)?;
        let Some(best) = fits.first() else {
            return Err(ResectionError::NoFit { rms_px: f64::INFINITY, worst: 1, worst_px: f64::INFINITY });
        };
        let diagonal = f64::from(lens.width).hypot(f64::from(lens.height));
        let rms = best.rms();
        if !rms.is_finite() || rms > (0.02 * diagonal).max(5.0) {
            let worst = (0..matches.len()).max_by(|a, b| best.miss(*a).total_cmp(&best.miss(*b))).unwrap_or(0);
            return Err(ResectionError::NoFit { rms_px: rms, worst: worst + 1, worst_px: best.miss(worst) });
        }
        unambiguous(&fits, size)?;
        let mut found = best.resection(PICKING_PX, focal)?;
        found.suspect = suspect(lens, &local, focal, best);
        found.camera.pose.position += centroid;
        Ok(found)
    }
}

fn distinct(matches: &[Match]) -> Result<(), ResectionError> {
    for (j, b) in matches.iter().enumerate() {
        let same = |a: &Match| a.point.distance(b.point) <= 1e-9 * (1.0 + b.point.length()) || a.pixel == b.pixel;
        if let Some(i) = matches[..j].iter().position(same) {
            return Err(ResectionError::Coincident { first: i + 1, second: j + 1 });
        }
    }
    Ok(())
}

/// The points' extent in metres; the points are centred.
fn not_collinear(matches: &[Match]) -> Result<f64, ResectionError> {
    let far = matches.iter().map(|m| m.point).max_by(|a, b| a.length().total_cmp(&b.length())).unwrap_or_default();
    let axis = far.normalize_or_zero();
    // the direction to the farthest is the line's where there is one
    let off_m = matches.iter().map(|m| m.point.reject_from(axis).length()).fold(0.0, f64::max);
    if off_m < 5e-3 * far.length() { Err(ResectionError::Collinear { off_m }) } else { Ok(far.length()) }
}

/// All local best fits, the best first.
fn fits(lens: &Camera, matches: &[Match], focal: bool) -> Result<Vec<Fit>, ResectionError> {
    let diagonal = f64::from(lens.width).hypot(f64::from(lens.height));
    let cameras: Vec<Camera> = if focal {
        let tries = (0..FOCAL_TRIES).map(|i| {
            let half = (5.0 + 65.0 * i as f64 / (FOCAL_TRIES - 1) as f64).to_radians();
            let mut camera = *lens;
            camera.focal = DVec2::splat(0.5 * diagonal / half.tan());
            camera
        });
        tries.collect()
    } else {
        vec![*lens]
    };
    let mut starts = Vec::new();
    for camera in cameras {
        let mut here = starting_poses(&camera, matches, focal)?;
        here.truncate(if focal { 2 } else { 8 });
        starts.extend(here);
    }
    let mut fits: Vec<Fit> = starts.into_iter().filter_map(|(_, c)| refine(&c, matches, focal)).collect();
    fits.sort_by(|a, b| a.rms().total_cmp(&b.rms()));
    Ok(fits)
}

/// Poses by triples of pairs with their squared misses over all pairs, the best first.
fn starting_poses(lens: &Camera, matches: &[Match], focal: bool) -> Result<Vec<(f64, Camera)>, ResectionError> {
    let mut still = *lens;
    still.pose.rotation = DMat3::IDENTITY;
    let mut bearings = Vec::new();
    for (i, m) in matches.iter().enumerate() {
        if !still.shows(m.pixel.x, m.pixel.y) {
            if focal {
                return Ok(Vec::new()); // another focal length may show it
            }
            return Err(ResectionError::Unshown { pair: i + 1 });
        }
        bearings.push(still.direction(m.pixel.x, m.pixel.y));
    }
    let mut starts = Vec::new();
    for triple in triples(matches) {
        let (b, p) = (triple.map(|i| bearings[i]), triple.map(|i| matches[i].point));
        for pose in poses(&b, &p) {
            let camera = Camera { pose, ..*lens };
            let miss = |m: &Match| camera.project(m.point).map_or(f64::INFINITY, |q| q.distance_squared(m.pixel));
            let sum: f64 = matches.iter().map(miss).sum();
            if sum.is_finite() {
                starts.push((sum, camera));
            }
        }
    }
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(starts)
}

/// Up to twelve triples of pairs, those that span the largest triangles in the picture first.
fn triples(matches: &[Match]) -> Vec<[usize; 3]> {
    // of many pairs an even choice will do
    let chosen: Vec<usize> = (0..matches.len().min(12)).map(|i| i * matches.len() / matches.len().min(12)).collect();
    let mut all = Vec::new();
    for (a, &i) in chosen.iter().enumerate() {
        for (b, &j) in chosen.iter().enumerate().skip(a + 1) {
            for &k in chosen.iter().skip(b + 1) {
                let (u, v) = (matches[j].pixel - matches[i].pixel, matches[k].pixel - matches[i].pixel);
                all.push((u.perp_dot(v).abs(), [i, j, k]));
            }
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.truncate(12);
    all.into_iter().map(|(_, t)| t).collect()
}

/// Refuses where another pose fits about as well as the best; `size` is the points' extent.
fn unambiguous(fits: &[Fit], size: f64) -> Result<(), ResectionError> {
    let best = &fits[0];
    let near = (2.0 * best.rms()).max(best.rms() + PICKING_PX);
    for other in fits[1..].iter().take_while(|f| f.rms() <= near) {
        let apart_m = other.camera.pose.position.distance(best.camera.pose.position);
        let turned = (other.camera.pose.rotation.transpose() * best.camera.pose.rotation).y_axis.y < 0.999;
        if apart_m > 0.05 * size.max(best.distance) || turned {
            return Err(ResectionError::Ambiguous { apart_m, rms_px: best.rms(), other_px: other.rms() });
        }
    }
    Ok(())
}

/// The pair whose leaving makes the rest fit four times as well, where enough are left to tell.
fn suspect(lens: &Camera, matches: &[Match], focal: bool, best: &Fit) -> Option<usize> {
    let enough = if focal { 8 } else { 6 };
    if matches.len() < enough || best.rms() < 2.0 * PICKING_PX {
        return None;
    }
    let without = |i: usize| {
        let rest: Vec<Match> = matches.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, m)| *m).collect();
        Some((fits(lens, &rest, focal).ok()?.first()?.rms(), i))
    };
    let least = (0..matches.len()).filter_map(without).min_by(|a, b| a.0.total_cmp(&b.0))?;
    (least.0 < 0.25 * best.rms()).then_some(least.1)
}

#[cfg(test)]
mod tests;
