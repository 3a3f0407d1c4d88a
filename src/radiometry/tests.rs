//! Planted exposures, white balance, vignetting, response, gloss and clipping come back.

use super::{Fit, FitSettings, Shot, fit_shots, fit_to_render};
use crate::panorama::{Coding, Picture, Projection, Radiometry, radius2};
use crate::scene::testing::{boxes, grey};
use crate::scene::{Ray, Scene, Surface};
use crate::site::Pose;
use glam::{DMat3, DVec3, Vec2, Vec3};

const FEW: FitSettings = FitSettings { samples: 800, response: false };

/// Rooms, boxes side by side.
fn rooms(all: &[(Vec3, Vec3)]) -> Scene {
    grey(boxes(all), 0.6)
}

fn room() -> Scene {
    rooms(&[(Vec3::ZERO, Vec3::new(5.0, 4.0, 3.0))])
}

/// A radiance that differs from place to place by a factor of ten, and in colour.
fn radiance(s: &Surface) -> Vec3 {
    let p = s.position;
    let wave = |f: f32| (f * (p.x + 0.7 * p.y - 0.4 * p.z)).sin();
    Vec3::new(wave(1.1), wave(1.3) + 0.1, wave(0.9) - 0.1).map(|v| (1.1 * v).exp()) * 0.2
}

/// A picture taken in a scene, stored by the inverse of its radiometry.
fn take(
    scene: &Scene,
    (pose, projection): (Pose, Projection),
    size: (usize, usize),
    truth: &Radiometry,
    sent: impl Fn(&Surface, Vec3) -> Vec3,
) -> Shot {
    let (width, height) = size;
    let mut picture = Picture::new(width, height);
    let origin = scene.local(pose.position);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        let Some(d) = projection.direction(width, height, x, y) else { continue };
        let ray = Ray { origin, direction: (pose.rotation * d).as_vec3() };
        let hit = scene.tracer.closest(&ray, 1e-3).expect("the room is closed");
        let s = scene.surface(&ray, &hit);
        let light = sent(&s, origin);
        // the stored value whose light this is, by bisection: light rises with it
        let r2 = radius2(width, height, x as f32, y as f32);
        for c in 0..3 {
            let (mut low, mut high) = (0.0f32, if truth.clipped.is_finite() { 1.0 } else { 1e3 });
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if truth.light(Vec3::splat(middle), r2)[c] < light[c] { low = middle } else { high = middle }
            }
            pixel[c] = low;
        }
    }
    let coding = if truth.clipped.is_finite() { Coding::Srgb8 } else { Coding::Linear };
    let guess = Radiometry { clipped: coding.clipped(), ..Radiometry::default() };
    Shot { name: String::new(), pose, projection, picture, coding, guess, camera: None }
}

fn panorama(x: f64, y: f64) -> (Pose, Projection) {
    (pose(x, y, 0.3), Projection::LatLong)
}

fn photograph(x: f64, y: f64, turn: f64) -> (Pose, Projection) {
    (pose(x, y, turn), Projection::Perspective { fov_y: 1.2 })
}

fn pose(x: f64, y: f64, turn: f64) -> Pose {
    Pose { position: DVec3::new(x, y, 1.6), rotation: DMat3::from_rotation_z(turn) }
}

fn stops(r: f32, g: f32, b: f32) -> Radiometry {
    Radiometry { gain: Vec3::new(r, g, b).map(f32::exp2), ..Radiometry::default() }
}

/// The worst ratio of fitted to planted gains, each channel up to its common factor, less one.
fn worst(fit: &Fit, truth: &[Radiometry]) -> f32 {
    let logs: Vec<Vec3> =
        fit.pictures.iter().zip(truth).map(|(f, t)| (Vec3::from(f.gain) / t.gain).map(f32::ln)).collect();
    let mean = logs.iter().sum::<Vec3>() / logs.len() as f32;
    logs.iter().map(|l| (*l - mean).abs().max_element()).fold(0.0, f32::max).exp() - 1.0
}

#[test]
fn exposures_and_white_balance_come_back_through_gloss() {
    let scene = room();
    let truth = [stops(1.5, 1.3, 1.6), stops(-1.5, -1.4, -1.7), stops(0.2, 0.0, -0.2)];
    // a window mirrored in the floor: from each place somewhere else
    let sent = |s: &Surface, eye: Vec3| {
        let mirrored = s.position + (s.position - eye) * Vec3::new(1.0, 1.0, -1.0);
        let gloss = s.normal.z > 0.9 && mirrored.x.rem_euclid(2.0) < 0.6;
        radiance(s) * if gloss { 3.0 } else { 1.0 }
    };
    let eyes = [panorama(1.0, 1.0), panorama(3.9, 1.2), panorama(2.4, 3.1)];
    let shots: Vec<Shot> = eyes.into_iter().zip(&truth).map(|(eye, t)| take(&scene, eye, (96, 48), t, sent)).collect();
    let fit = fit_shots(&scene, &shots, &FitSettings { samples: 600, ..FEW });
    assert!(fit.pictures.iter().all(|p| p.tied && p.vignetting == [0.0; 2]));
    assert!(worst(&fit, &truth) < 0.01, "{fit:?}");
    assert!(fit.spread < 0.1 * fit.spread_before);
    let product: f32 = fit.pictures.iter().map(|p| p.gain[1]).product();
    assert!((product - 1.0).abs() < 1e-3, "the geometric mean of what was fitted is 1");
}

#[test]
fn a_picture_of_another_room_is_told_and_left_alone() {
    let scene = rooms(&[(Vec3::ZERO, Vec3::new(5.0, 4.0, 3.0)), (Vec3::new(6.0, 0.0, 0.0), Vec3::new(9.0, 4.0, 3.0))]);
    let truth = [stops(1.0, 1.0, 1.0), stops(-1.0, -1.0, -1.0), stops(3.0, 3.0, 3.0)];
    let eyes = [panorama(1.0, 1.0), panorama(3.9, 1.2), panorama(7.5, 2.0)];
    let mut shots: Vec<Shot> =
        eyes.into_iter().zip(&truth).map(|(eye, t)| take(&scene, eye, (64, 32), t, |s, _| radiance(s))).collect();
    shots[2].guess.gain = Vec3::splat(0.7);
    let fit = fit_shots(&scene, &shots, &FitSettings { samples: 400, ..FEW });
    assert_eq!(fit.pictures.iter().map(|p| p.tied).collect::<Vec<_>>(), [true, true, false]);
    assert_eq!(fit.pictures[2].gain, [0.7; 3]);
    assert!((fit.pictures[0].gain[0] / fit.pictures[1].gain[0] / 4.0 - 1.0).abs() < 0.01);
    let alone = fit_shots(&scene, &shots[..1], &FEW);
    assert!(!alone.pictures[0].tied && alone.pictures[0].gain == [1.0; 3] && alone.comparisons == 0);
}

/// Photographs that look across the room from five places.
fn photographs(truth: &[Radiometry]) -> (Scene, Vec<Shot>) {
    let scene = room();
    let eyes = [(1.0, 1.0, -0.8), (4.0, 1.0, 0.8), (2.5, 0.8, 0.2), (1.2, 2.2, -1.2), (3.9, 2.6, 1.4)];
    let take = |((x, y, turn), t): ((f64, f64, f64), &Radiometry)| {
        take(&scene, photograph(x, y, turn), (96, 72), t, |s, _| radiance(s))
    };
    let shots = eyes.into_iter().zip(truth).map(take).collect();
    (scene, shots)
}

#[test]
fn vignetting_comes_back() {
    let lens = Vec2::new(0.5, 0.3);
    let truth = [0.8, -0.8, 0.0, 0.5, -0.5].map(|s| Radiometry { vignetting: lens, ..stops(s, s, 0.5 * s) });
    let (scene, shots) = photographs(&truth);
    let fit = fit_shots(&scene, &shots, &FEW);
    assert!(worst(&fit, &truth) < 0.02, "{}: {fit:?}", worst(&fit, &truth));
    let [v, w] = fit.pictures[0].vignetting;
    // v and w are told apart less well than what they do
    for r2 in [0.25f32, 0.5, 0.8] {
        let (got, planted) = (r2 * (v + w * r2), r2 * (lens.x + lens.y * r2));
        assert!((got - planted).abs() < 0.03, "{r2}: {got} {planted}");
    }
}

#[test]
fn clipped_pixels_say_at_least_and_a_response_is_found_but_none_invented() {
    let plain =
        [0.6f32, -1.4, -0.4, -2.0, 0.2].map(|s| Radiometry { clipped: Coding::Srgb8.clipped(), ..stops(s, s, s) });
    let (scene, shots) = photographs(&plain);
    let clipped = |shot: &Shot| shot.picture.pixels.iter().filter(|p| shot.guess.is_clipped(**p)).count();
    assert!(shots.iter().map(clipped).max() > Some(96 * 72 / 8), "one is overexposed");
    let settings = FitSettings { response: true, ..FEW };
    let fit = fit_shots(&scene, &shots, &settings);
    assert!(worst(&fit, &plain) < 0.01, "{}: {fit:?}", worst(&fit, &plain));
    assert!(fit.pictures.iter().all(|p| p.response == [0.0; 2]), "{fit:?}");

    let bent = plain.map(|t| Radiometry { response: Vec2::new(-1.4, 1.4), ..t });
    let (scene, shots) = photographs(&bent);
    let without = fit_shots(&scene, &shots, &FitSettings { response: false, ..settings });
    let fit = fit_shots(&scene, &shots, &settings);
    assert!(
        fit.pictures[0].response[1] > 0.5 && worst(&fit, &bent) < 0.5 * worst(&without, &bent),
        "{fit:?} {without:?}"
    );
}

#[test]
fn a_photograph_is_fitted_to_its_render() {
    let (width, height) = (80, 60);
    let mut render = Picture::new(width, height);
    for (i, p) in render.pixels.iter_mut().enumerate() {
        *p = Vec3::splat(0.2) + Vec3::new(i as f32 * 0.618, i as f32 * 0.755, i as f32 * 0.57).fract();
    }
    let truth = Radiometry { gain: Vec3::new(2.0, 1.6, 1.1), vignetting: Vec2::new(0.4, 0.2), ..Radiometry::default() };
    let mut photo = render.clone();
    for (i, p) in photo.pixels.iter_mut().enumerate() {
        let r2 = radius2(width, height, (i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        // a tenth of it shows something else, and the brightest is clipped
        *p = if i % 10 == 3 { Vec3::splat(0.9) } else { (*p / truth.light(Vec3::ONE, r2)).min(Vec3::splat(0.5)) };
    }
    let fit = fit_to_render(&photo, &render, 0.499, |_| true).expect("pixels enough");
    let gain = Vec3::from(fit.gain) / truth.gain;
    assert!((gain - 1.0).abs().max_element() < 0.02, "{fit:?}");
    let developed = fit.develop(&photo);
    for i in (0..photo.pixels.len()).filter(|i| i % 10 != 3 && photo.pixels[*i].max_element() < 0.49) {
        let off = developed.pixels[i] / render.pixels[i] - 1.0;
        assert!(off.abs().max_element() < 0.02, "{off} {fit:?}");
    }
    assert!(fit_to_render(&photo, &render, 0.499, |i| i < 100).is_none(), "too few");
}
