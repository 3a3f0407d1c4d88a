//! Rows about single pieces: the path tracer, the paper's fill, searches, sampling and metrics.

use clerestory::panorama::{EnvironmentSampler, Exposure, Panorama, Picture, Projection};
use clerestory::paper;
use clerestory::reference::{Lights, ReferenceSettings, Sky, irradiance};
use clerestory::shoot::KdTree;
use clerestory::study::{flip, relmse, rmse, ssim};
use clerestory::volume::Grid;
use glam::{DMat3, DVec3, Vec3};
use std::f64::consts::PI;

use super::support::scene_of;
use super::ulp::{change, nudge};
use super::{Row, worst};

pub(crate) fn rows() -> Vec<Row> {
    let mut rows = vec![closed_room(), long_gap(), micrometres(), long_sum()];
    rows.extend(one_bright_sky_pixel());
    rows.push(metrics_of_extremes());
    rows
}

/// The series Σ ρⁿ of a closed room converges so slowly that a thousand bounces hold two thirds of it.
fn closed_room() -> Row {
    let (x, y, z) = (Vec3::X * 4.0, Vec3::Y * 3.0, Vec3::Z * 2.5);
    let o = Vec3::ZERO;
    let quads = [[o, x, y], [z, x, y], [o, x, z], [y, x, z], [o, y, z], [x, y, z]];
    let of = |albedo: f32| {
        let scene = scene_of(&quads.map(|[corner, u, v]| (corner, u, v, albedo, 1.0)));
        let lights = Lights::new(&scene, None, None);
        let settings = ReferenceSettings { samples: 1024, max_bounces: 1 << 14, ..ReferenceSettings::default() };
        let (e, _) = irradiance(&scene, &lights, Vec3::new(1.3, 1.1, 0.0), Vec3::Z, &settings);
        f64::from(e.x)
    };
    let albedo = 0.999f32;
    let expected = |albedo: f32| PI / (1.0 - f64::from(albedo));
    // the closed form's own condition is ρ/(1 − ρ) = 999: the same paths with another albedo
    let other = 0.998f32;
    let amplification = (of(albedo) / of(other)).ln() / (f64::from(albedo) / f64::from(other)).ln();
    let error = (of(albedo) / expected(albedo) - 1.0).abs();
    Row::new("closed room of albedo 0.999", "irradiance by path tracing, 16 384 bounces, 1024 samples", "π/(1 − ρ)")
        .off(error, 0.03)
        .amplified(amplification)
}

/// The paper's fill across 500 empty cells between 4 and 8: each half takes its own end's value.
fn long_gap() -> Row {
    let grid = Grid::over(Vec3::ZERO, Vec3::new(502.0, 3.0, 3.0), 502);
    let ends = [(0.5, 4.0), (501.5, 8.0)];
    // the result relative to what is expected, with records as they are or moved
    let filled = |factor: fn(usize) -> f32| -> Vec<f32> {
        let records = ends.iter().flat_map(|&(x, e)| {
            let place = move |k: usize| Vec3::new(x, (k % 3) as f32 + 0.5, (k / 3) as f32 + 0.5);
            (0..9).map(move |k| (place(k), Vec3::splat(e * factor(k))))
        });
        let volume = paper::Volume::build(grid, records);
        let at = |x: usize| volume.irradiance(Vec3::new(x as f32 + 0.5, 1.5, 1.5)).unwrap_or(Vec3::NAN).x;
        let away = (0..502usize).filter(|x| x.abs_diff(251) > 4);
        away.map(|x| at(x) / if x < 251 { 4.0 } else { 8.0 }).collect()
    };
    let values = filled(|_| 1.0);
    let amplification = change(&values, &filled(nudge));
    Row::new("the paper's fill over a 500-cell gap", "irradiance away from the seam", "the nearer end's value")
        .off(worst(values, 1.0), 1e-6)
        .amplified(amplification)
}

/// A lattice of records 1 µm apart at 3 m from the origin, where single precision has steps of 0.24 µm.
fn micrometres() -> Row {
    let at = |i: usize| Vec3::new(3.0 + 1e-6 * (i % 40) as f32, 1.0 + 1e-6 * (i / 40 % 40) as f32, 2.0);
    let entries: Vec<(Vec3, u32)> = (0..1600).map(|i| (at(i), i as u32)).collect();
    let tree = KdTree::new(entries.clone());
    let mut wrong = 0;
    for (i, &(p, _)) in entries.iter().enumerate() {
        let radius = 1e-6 * (1 + i % 9) as f32;
        let mut found = Vec::new();
        tree.within(p, radius, |v, _| found.push(*v));
        found.sort_unstable();
        // coordinates and their differences are exact in double precision
        let near = |q: Vec3| (q.as_dvec3() - p.as_dvec3()).length_squared() < f64::from(radius).powi(2);
        let truth: Vec<u32> = entries.iter().filter(|e| near(e.0)).map(|e| e.1).collect();
        wrong += usize::from(found != truth);
    }
    // exact but where a record lies on the sphere itself, to within rounding
    Row::new(
        "records at 1 µm spacing",
        "share of 1600 radius searches that differ",
        "brute force in double precision (absolute)",
    )
    .off(wrong as f64 / 1600.0, 0.02)
    .counted()
}

/// Ten million values whose running sum in single precision would stall at 2²⁴.
fn long_sum() -> Row {
    let n = 20_000_000;
    let t = Picture { width: 5000, height: n / 5000, pixels: vec![Vec3::ONE; n] };
    let mut x: Vec<Vec3> = vec![Vec3::splat(1.0 + 1.0 / 1024.0); n];
    let found = rmse(&x, &t.pixels);
    x.iter_mut().enumerate().for_each(|(i, x)| *x *= nudge(i));
    let amplification = (rmse(&x, &t.pixels) / found - 1.0).abs() / f64::from(f32::EPSILON);
    Row::new("20 million equal errors", "RMSE", "1/1024 exactly")
        .off((found * 1024.0 - 1.0).abs(), 1e-12)
        .amplified(amplification)
}

/// A sky with 99 % of its energy in one pixel, by the sampler's weights and by path tracing onto a floor.
fn one_bright_sky_pixel() -> Vec<Row> {
    let (w, h) = (128usize, 64usize);
    let mut picture = Picture::new(w, h);
    picture.pixels.fill(Vec3::ONE);
    let omega = |y: usize| Projection::LatLong.solid_angle(w, h, 0, y);
    let total: f64 = (0..h).map(|y| w as f64 * omega(y)).sum();
    let (bx, by) = (40, 12);
    let bright = 99.0 * (total - omega(by)) / omega(by);
    picture.pixels[by * w + bx] = Vec3::splat(bright as f32);
    let mut moved = picture.clone();
    moved.pixels.iter_mut().enumerate().for_each(|(i, p)| *p *= nudge(i));
    let panorama = |picture| Panorama::new(picture, Projection::LatLong, DMat3::IDENTITY);
    let (panorama, moved) = (panorama(picture), panorama(moved));
    // the floor's irradiance by quadrature of the very panorama, bilinear as it is looked up
    let steps = 16;
    let mut expected = 0.0;
    for i in 0..w * h / 2 * steps * steps {
        let (row, column) = (i / (w * steps), i % (w * steps));
        let theta = PI * (row as f64 + 0.5) / (h * steps) as f64;
        let phi = 2.0 * PI * ((column as f64 + 0.5) / (w * steps) as f64 - 0.5);
        let d = DVec3::new(theta.sin() * phi.sin(), theta.sin() * phi.cos(), theta.cos());
        let cell = theta.sin() * (PI / (h * steps) as f64) * (2.0 * PI / (w * steps) as f64);
        expected += f64::from(panorama.radiance(d.as_vec3()).x) * d.z * cell;
    }
    let scene = scene_of(&[(Vec3::new(-0.5, -0.5, -1.0), Vec3::X, Vec3::Y, 0.5, 0.0)]);
    let settings = ReferenceSettings { samples: 1 << 14, ..ReferenceSettings::default() };
    let under = |panorama| {
        let sky = Sky::Image(Box::new(EnvironmentSampler::new(panorama)));
        let lights = Lights::new(&scene, Some(sky), None);
        irradiance(&scene, &lights, Vec3::new(0.1, 0.1, -1.0), Vec3::Z, &settings)
    };
    let ((e, noise), (e_moved, noise_moved)) = (under(panorama), under(moved));
    let error = f64::from(e.x) / expected - 1.0;
    vec![
        Row::new(
            "a sky with 99 % of its energy in one pixel",
            "irradiance of a floor, 16 384 samples",
            "quadrature in double precision",
        )
        .off(error.abs(), 0.01)
        .amplified(change(&[e.x], &[e_moved.x])),
        Row::new("the same sky", "its standard error", "0")
            .off(noise.x / e.x, 0.01)
            .amplified(change(&[noise.x], &[noise_moved.x])),
    ]
}

/// Metrics of pictures that hold everything a float can hold: never NaN, never without bound.
fn metrics_of_extremes() -> Row {
    let values = [0.0, 1.0, -1.0, f32::MIN_POSITIVE, 1e-45, 1e-6, 1e9, f32::MAX, f32::INFINITY, f32::NAN];
    let picture = |shift: usize| {
        let mut p = Picture::new(30, 20);
        p.pixels.iter_mut().enumerate().for_each(|(i, p)| {
            *p = Vec3::new(values[(i + shift) % 10], values[(i / 3 + shift) % 10], values[(i / 7) % 10]);
        });
        p
    };
    let nothing = Picture { width: 30, height: 20, pixels: vec![Vec3::NAN; 600] };
    let black = Picture::new(30, 20);
    let all = [picture(0), picture(3), nothing, black, Picture::new(0, 0), Picture::new(3, 2)];
    let mut bad = 0;
    for x in &all {
        for t in &all {
            let figures = [rmse(&x.pixels, &t.pixels), relmse(&x.pixels, &t.pixels), flip(x, t), ssim(x, t)];
            bad += figures.iter().filter(|f| f.is_nan()).count();
            bad += usize::from(Exposure::of(t).0.is_nan());
            let shown = t.pixels.iter().flat_map(|p| [Exposure::of(x).show(*p), Exposure::of(x).clip(*p)]);
            bad += shown.filter(|p| !p.is_finite() || p.min_element() < 0.0 || p.max_element() > 1.0).count();
        }
    }
    Row::new("pictures of NaN, ∞, denormals and nothing", "NaN among metrics and screen values", "0 (absolute)")
        .off(bad as f64, 0.0)
        .counted()
}
