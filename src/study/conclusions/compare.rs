//! How close a relit view is to its photograph.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::panorama::Picture;
use crate::render::{Frame, PrimaryRays, Source};
use crate::scene::{Ray, Scene};
use crate::site::Camera;
use crate::study::metrics::relative_errors;
use crate::study::{flip_map, mean_where, median_relative_error, relmse_where};
use glam::Vec3;

/// Errors of a view against its photograph, whole and in parts.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Comparison {
    /// All pixels but those left out.
    pub all: Errors,
    /// Pixels lit by records, and the sky.
    pub records: Errors,
    /// Pixels lit by the volume, or by neighbouring records.
    pub volume: Errors,
    /// Pixels whose middle no probe has in its line of sight.
    pub unseen: Errors,
    /// Pixels that show a surface which reflects and has no light at all.
    #[serde(default)]
    pub unlit_pixels: usize,
    /// The relative errors of pixels whose middle no probe has in its line of sight, to take a median over several views.
    #[serde(skip)]
    pub unseen_errors: Vec<f64>,
    /// The same of pixels that no record lights.
    #[serde(skip)]
    pub filled_errors: Vec<f64>,
}

/// Errors over some pixels.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Errors {
    /// Share of all pixels.
    pub share: f64,
    /// Mean FLIP at the photograph's exposure.
    pub flip: f64,
    /// Relative mean squared error, the worst 0.1 % of these pixels left out.
    pub relmse: f64,
    /// Median relative error.
    pub median: f64,
}

/// Compares a frame with a photograph of the same size, taken by the same camera, given for each pixel whether it is
/// [`hidden`] from all probes. Pixels set in `left_out` take no part, nor do those where the lens shows nothing. `None`
/// where the sizes differ.
pub fn compare(
    hidden: &[bool],
    camera: &Camera,
    frame: &Frame,
    photo: &Picture,
    left_out: Option<&[bool]>,
) -> Option<Comparison> {
    let (width, height) = (frame.radiance.width, frame.radiance.height);
    if (photo.width, photo.height) != (width, height)
        || left_out.is_some_and(|m| m.len() != width * height)
        || hidden.len() != width * height
    {
        return None;
    }
    let shown = |i: usize| camera.shows((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
    let counts: Vec<bool> =
        (0..width * height).into_par_iter().map(|i| left_out.is_none_or(|m| !m[i]) && shown(i)).collect();
    // what is left out is no light, for the truth's mean and exposure; and it must not show beside its edge either
    let none = Vec3::splat(f32::NAN);
    let truth: Vec<Vec3> = photo.pixels.iter().zip(&counts).map(|(t, c)| if *c { *t } else { none }).collect();
    let filled: Vec<Vec3> = photo
        .pixels
        .iter()
        .zip(&frame.radiance.pixels)
        .zip(&counts)
        .map(|((t, x), c)| if *c { *t } else { *x })
        .collect();
    let (x, t) = (&frame.radiance.pixels, &truth);
    let flip = flip_map(&frame.radiance, &Picture { width, height, pixels: filled });
    let over = |chosen: &dyn Fn(usize) -> bool| {
        let chosen = |i: usize| counts[i] && chosen(i);
        Errors {
            share: (0..t.len()).filter(|&i| chosen(i)).count() as f64 / t.len() as f64,
            flip: mean_where(&flip, chosen),
            relmse: relmse_where(x, t, chosen),
            median: median_relative_error(x, t, chosen),
        }
    };
    let filled = |i: usize| matches!(frame.source[i], Source::Volume | Source::Neighbour);
    let lit = |i: usize| frame.radiance.pixels[i] != Vec3::ZERO || frame.albedo.pixels[i] == Vec3::ZERO;
    let unlit = |i: &usize| counts[*i] && frame.depth[*i].is_finite() && !lit(*i);
    Some(Comparison {
        all: over(&|_| true),
        records: over(&|i| !filled(i)),
        volume: over(&|i| filled(i)),
        unseen: over(&|i| hidden[i]),
        unlit_pixels: (0..t.len()).filter(unlit).count(),
        filled_errors: relative_errors(x, t, |i| counts[i] && filled(i)),
        unseen_errors: relative_errors(x, t, |i| counts[i] && hidden[i]),
    })
}

/// Whether no probe (places in local metres) has the surface in the middle of each pixel in its line of sight.
pub fn hidden(scene: &Scene, probes: &[Vec3], camera: &Camera) -> Vec<bool> {
    let rays = PrimaryRays::new(camera, 1);
    let origin = scene.local(camera.pose.position);
    let width = camera.width as usize;
    (0..width * camera.height as usize)
        .into_par_iter()
        .map(|i| {
            let ray = Ray { origin, direction: rays.direction(i % width, i / width, 0) };
            let Some(hit) = scene.tracer.closest(&ray, 1e-3) else { return false };
            let s = scene.surface(&ray, &hit);
            probes.iter().all(|probe| {
                let from = s.position + s.normal * 1e-3;
                let d = *probe - from;
                let length = d.length();
                s.normal.dot(d) <= 0.0
                    || scene.tracer.occluded(&Ray { origin: from, direction: d / length }, 0.0, length)
            })
        })
        .collect()
}
