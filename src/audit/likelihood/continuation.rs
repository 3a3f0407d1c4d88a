//! Openings of the model that the photograph does not have: what it shows there goes on as the surface around them does.
//!
//! The sweep along a surface's normal needs a surface. Where the model has a hole it sees far past the real one, or
//! nothing at all. So every surface is continued past its edge, along rows and columns, over what the model has behind
//! it, and asked whether the probes saw there what the photograph shows.

use glam::Vec3;
use rayon::prelude::*;

use crate::audit::observe::geometry_buffer::{GeometryBuffer, NONE};
use crate::audit::observe::photo::Blurred;
use crate::audit::observe::probe_view::ProbeView;
use crate::audit::observe::radiometry::Radiometry;

/// Standard deviation of the windows, pixels.
const WINDOW: f32 = 4.0;

/// Difference of logarithms that a right surface may have: the root of its mean square.
const RIGHT: f32 = 0.12;

/// And in units of the photograph's own contrast.
const LOST: f32 = 0.4;

/// Where the model's own surface can be compared, it must fit this many times worse.
const WORSE: f32 = 3.0;

/// Else the photograph must be as bright as beside the opening, within this difference of logarithms or what the
/// surface's own pattern differs by.
const ALIKE: f32 = 0.5;

/// A surface is continued over at most this share of the picture's width.
const REACH: f32 = 0.35;

/// The photograph must fit what the probes saw on the continued surface so many times better than at these distances,
/// in units of the surface's, and than what the model has there, must not fit there, and must show something: what fits anywhere, as the sky does, says nothing
/// of a surface.
const DISTINCT: f32 = 2.0;
const ELSEWHERE: [f32; 3] = [0.95, 1.05, 1e3];

/// A second side must go on at least so surely: floors are not so flat that all sides' planes fit alike.
const SECOND: f32 = 0.5;

/// Surfaces seen flatter than this are not continued.
const FLATTEST: f32 = 0.2;

/// One surface continued along rows or columns: per pixel the pixel it starts from, or `usize::MAX`.
fn sources(surfaces: &GeometryBuffer, along: (isize, isize)) -> Vec<usize> {
    let (w, h) = (surfaces.width, surfaces.height);
    let reach = REACH * w as f32;
    let mut from = vec![usize::MAX; w * h];
    let lines = if along.0 != 0 { h } else { w };
    let steps = if along.0 != 0 { w } else { h };
    let pixel = |line: usize, step: usize| {
        let step = if along.0 + along.1 > 0 { step } else { steps - 1 - step };
        if along.0 != 0 { line * w + step } else { step * w + line }
    };
    for line in 0..lines {
        for step in 1..steps {
            let (last, i) = (pixel(line, step - 1), pixel(line, step));
            let fits = |s: usize| {
                s != usize::MAX && continued(surfaces, s, i).is_some_and(|t| t < 0.97 * surfaces.distance[i])
            };
            let old = from[last];
            let near = old != usize::MAX && pixels_apart(old, i, w) < reach;
            from[i] = if near && fits(old) {
                old
            } else if surfaces.triangle[last] != NONE && fits(last) {
                last
            } else {
                usize::MAX
            };
        }
    }
    from
}

fn pixels_apart(a: usize, b: usize, w: usize) -> f32 {
    (a % w).abs_diff(b % w).max((a / w).abs_diff(b / w)) as f32
}

/// Distance along a pixel's ray to the plane of another pixel's surface.
fn continued(surfaces: &GeometryBuffer, source: usize, i: usize) -> Option<f32> {
    let normal = surfaces.normal[source];
    let along = normal.dot(surfaces.ray[i]);
    let t = normal.dot(surfaces.position[source] - surfaces.origin) / along;
    (along < -FLATTEST && t.is_finite() && t > 0.05).then_some(t)
}

/// What the test says of each pixel.
pub(crate) struct Continuation {
    /// How surely (1 is the threshold) a surface of the model goes on over what the model has there.
    pub(crate) score: Vec<f32>,
}

/// Continues the surfaces of a view past their edges.
pub(crate) fn test(
    surfaces: &GeometryBuffer,
    probes: &[ProbeView],
    photo: &Blurred,
    log_photo: &[Vec3],
    usable: &[f32],
    radiometry: &Radiometry,
    mismatch: &[Option<f32>],
) -> Continuation {
    let n = usable.len();
    let mean = |values: &[f32], weight: &[f32]| surfaces.shape.mean(values, weight, WINDOW);
    let bright: Vec<f32> = log_photo.iter().map(|p| p.element_sum() / 3.0).collect();
    let known: Vec<f32> = (0..n).map(|i| if usable[i] > 0.0 && bright[i].is_finite() { 1.0 } else { 0.0 }).collect();
    let level = mean(&bright, &known);
    let square = mean(&bright.iter().map(|b| b * b).collect::<Vec<_>>(), &known);
    let own: Vec<f32> = mismatch.iter().map(|m| m.unwrap_or(0.0)).collect();
    let has_own: Vec<f32> = mismatch.iter().map(|m| if m.is_some() { 1.0 } else { 0.0 }).collect();
    let (own, owned) = (mean(&own, &has_own), surfaces.shape.smoothed(&has_own, WINDOW));
    let mut score = vec![0.0f32; n];
    let mut sides = vec![0u8; n];
    for along in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
        let from = sources(surfaces, along);
        // on the continued surface, and elsewhere on the same rays
        let squares: Vec<[Option<f32>; 4]> = (0..n)
            .into_par_iter()
            .map(|i| {
                let source = from[i];
                let distance =
                    if source == usize::MAX || known[i] == 0.0 { None } else { continued(surfaces, source, i) };
                let Some(distance) = distance else { return [None; 4] };
                let at = |times: f32| {
                    let point = surfaces.origin + surfaces.ray[i] * (distance * times);
                    let normal = (times == 1.0).then_some(surfaces.normal[source]);
                    difference(surfaces, probes, photo, log_photo, radiometry, point, normal, i)
                };
                let here = at(1.0);
                let [a, b, c] = ELSEWHERE.map(|t| here.and_then(|_| at(t)));
                [here, a, b, c]
            })
            .collect();
        let averaged = |k: usize| {
            let seen: Vec<f32> = squares.iter().map(|s| if s[k].is_some() { 1.0 } else { 0.0 }).collect();
            let values: Vec<f32> = squares.iter().map(|s| s[k].unwrap_or(0.0)).collect();
            (mean(&values, &seen), surfaces.shape.smoothed(&seen, WINDOW))
        };
        let [(rest, share), a, b, c] = [0, 1, 2, 3].map(averaged);
        for i in 0..n {
            if squares[i][0].is_none() || share[i] < 0.5 {
                continue;
            }
            let contrast = (square[i] - level[i] * level[i]).max(0.0);
            let right = RIGHT * RIGHT + LOST * LOST * contrast;
            let fits = right / rest[i].max(1e-6);
            let apart = (level[i] - level[from[i]]).abs();
            let others = [&a, &b, &c].into_iter().filter(|o| o.1[i] > 0.5).map(|o| o.0[i]);
            let least = others.chain((owned[i] > 0.3).then_some(own[i])).reduce(f32::min);
            let least = if contrast > RIGHT * RIGHT { least } else { None };
            let elsewhere = least.map_or(0.0, |e| e / (DISTINCT * rest[i]).max(right).max(1e-6));
            let better = if owned[i] > 0.3 {
                own[i] / (WORSE * rest[i].max(1e-4))
            } else {
                ALIKE.max(contrast.sqrt()) / apart.max(1e-3)
            };
            let s = fits.min(better.max(elsewhere)).min(2.0);
            sides[i] += u8::from(s >= SECOND);
            score[i] = score[i].max(s);
        }
    }
    // a hole has a rim all around, the open space beside a pillar has not
    for (s, sides) in score.iter_mut().zip(sides) {
        *s = if sides >= 2 { *s } else { s.min(0.7) };
    }
    Continuation { score }
}

/// Mean squared difference of logarithms between the photograph and the probes that see a point, if any does; without a
/// normal it is a direction that is asked, whatever may be in the way.
#[expect(clippy::too_many_arguments, reason = "all of it is read-only and per view")]
fn difference(
    surfaces: &GeometryBuffer,
    probes: &[ProbeView],
    photo: &Blurred,
    log_photo: &[Vec3],
    radiometry: &Radiometry,
    point: Vec3,
    normal: Option<Vec3>,
    i: usize,
) -> Option<f32> {
    let distance = point.distance(surfaces.origin);
    let (mut sum, mut count) = (0.0, 0u8);
    for (k, probe) in probes.iter().enumerate() {
        let to = probe.origin - point;
        // from the camera's own place anything fits
        let across = to.normalize_or_zero().cross(surfaces.ray[i]).length();
        if across < 0.1 || normal.is_some_and(|n| n.dot(to) < FLATTEST * to.length() || !probe.open(point)) {
            continue;
        }
        let ratio = to.length() * probe.pixel_angle() / (distance / surfaces.focal);
        let soft = log_photo[i] + photo.at(i, 0.4 * ratio) - photo.at(i, 0.0);
        let d = probe.log_radiance(point, 0) + radiometry.gains[k] - soft;
        let square = d.length_squared() / 3.0;
        if square.is_finite() {
            sum += square.min(1.0);
            count += 1;
        }
    }
    (count > 0).then(|| sum / f32::from(count))
}
