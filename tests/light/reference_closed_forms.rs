//! The path tracer against cases whose answer is a formula. `-- --nocapture` prints the figures.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::{on_threads, scene_of};
use clerestory::reference::{Eye, Lights, ReferenceSettings, Sky, Strategy, irradiance, trace};
use clerestory::scene::Scene;
use clerestory::site::{Camera, Pose, Sun};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// A closed box of `size` around the origin whose walls all have this albedo and emission.
fn closed_box(size: Vec3, albedo: f32, emission: f32) -> Scene {
    let (x, y, z) = (Vec3::X * size, Vec3::Y * size, Vec3::Z * size);
    let low = -0.5 * size;
    let q = |corner, u, v| (corner, u, v, albedo, emission);
    scene_of(&[q(low, x, y), q(low + z, x, y), q(low, x, z), q(low + y, x, z), q(low, y, z), q(low + x, y, z)])
}

fn camera(position: [f64; 3], target: [f64; 3], size: u32) -> Camera {
    Camera::with_fov(Pose::look_at(position.into(), target.into()), size, size, 70.0)
}

fn samples(samples: u32) -> ReferenceSettings {
    ReferenceSettings { samples, ..ReferenceSettings::default() }
}

/// Mean red of a picture and its relative standard error.
fn mean(scene: &Scene, lights: &Lights, camera: &Camera, settings: &ReferenceSettings) -> (f64, f64) {
    let e = trace(scene, lights, &Eye::Camera(*camera), settings);
    let picture = e.mean();
    let sum: f64 = picture.pixels.iter().map(|p| f64::from(p.x)).sum();
    (sum / picture.pixels.len() as f64, e.noise().of_mean)
}

#[test]
fn furnace_rooms_glow_as_the_geometric_series_says() {
    for (albedo, n) in [(0.2, 64), (0.5, 64), (0.9, 256), (0.99, 64)] {
        for (size, at, to) in [
            (Vec3::new(4.0, 4.0, 4.0), [0.3, 0.2, 0.1], [2.0, 1.0, -1.5]),
            // from a corner, and long and low
            (Vec3::new(4.0, 3.0, 2.5), [-1.95, -1.45, -1.2], [2.0, 1.5, 1.2]),
            (Vec3::new(200.0, 2.0, 2.0), [-99.0, 0.1, 0.1], [99.0, 0.0, 0.0]),
        ] {
            let scene = closed_box(size, albedo, 1.0);
            let lights = Lights::new(&scene, None, None);
            let (radiance, noise) = mean(&scene, &lights, &camera(at, to, 16), &samples(n));
            let expected = 1.0 / (1.0 - f64::from(albedo));
            let error = radiance / expected - 1.0;
            println!(
                "furnace {size}, albedo {albedo}: {radiance:.4} for {expected:.4}, {:+.3} %, ± {:.3} %",
                100.0 * error,
                100.0 * noise
            );
            assert!(error.abs() < 0.005, "albedo {albedo}, size {size}: {radiance} for {expected}");
        }
    }
}

/// A white furnace: nothing that stands under a uniform sky of albedo 1 can be told from it.
#[test]
fn white_things_vanish_in_a_white_sky() {
    let quads = [
        (Vec3::new(-1.0, 2.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, 1.0, 0.0),
        (Vec3::new(-1.0, 1.0, -1.0), Vec3::X * 2.0, Vec3::Y, 1.0, 0.0),
        (Vec3::new(-1.0, 1.0, -1.0), Vec3::Z * 2.0, Vec3::Y, 1.0, 0.0),
    ];
    let scene = scene_of(&quads);
    let lights = Lights::new(&scene, Some(Sky::Uniform(Vec3::ONE)), None);
    let (radiance, _) = mean(&scene, &lights, &camera([0.0, -2.0, 0.0], [0.0, 2.0, 0.0], 16), &samples(64));
    assert!((radiance - 1.0).abs() < 0.003, "{radiance}");
}

/// Mean irradiance over a rectangle, over π times the emitter's radiance 1: the form factor.
fn form_factor(scene: &Scene, corner: Vec3, u: Vec3, v: Vec3, normal: Vec3) -> f64 {
    let lights = Lights::new(scene, None, None);
    let n = 48;
    let mut sum = 0.0;
    for i in 0..n * n {
        let (a, b) = (((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
        let settings = ReferenceSettings { samples: 64, seed: i as u64, ..ReferenceSettings::default() };
        sum += f64::from(irradiance(scene, &lights, corner + u * a + v * b, normal, &settings).0.x);
    }
    sum / (n * n) as f64 / PI
}

/// Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*, C-11.
#[test]
fn parallel_rectangles_have_their_form_factor() {
    for (a, b, c) in [(1.0_f64, 1.0_f64, 1.0_f64), (2.0, 3.0, 1.0), (1.0, 4.0, 0.1), (0.5, 0.5, 3.0)] {
        let (x, y) = (a / c, b / c);
        let (rx, ry) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        let logs = 0.5 * ((rx * rx) * (ry * ry) / (1.0 + x * x + y * y)).ln();
        let arcs = x * ry * (x / ry).atan() + y * rx * (y / rx).atan() - x * x.atan() - y * y.atan();
        let expected = 2.0 / (PI * x * y) * (logs + arcs);

        let (u, v) = (Vec3::X * a as f32, Vec3::Y * b as f32);
        let scene = scene_of(&[(Vec3::Z * c as f32, u, v, 0.0, 1.0)]);
        let f = form_factor(&scene, Vec3::ZERO, u, v, Vec3::Z);
        println!("parallel {a} × {b} at {c}: {f:.5} for {expected:.5}, {:+.3} %", 100.0 * (f / expected - 1.0));
        assert!((f / expected - 1.0).abs() < 0.01, "{f} for {expected}");
    }
}

/// The same, C-14: common edge of length l, receiver w × l, emitter h × l.
#[test]
fn perpendicular_rectangles_have_their_form_factor() {
    for (l, w, h) in [(1.0_f64, 1.0_f64, 1.0_f64), (4.0, 2.0, 3.0), (1.0, 0.3, 2.0)] {
        let (hh, ww) = ((h / l).powi(2), (w / l).powi(2));
        let s = hh + ww;
        let arcs = |x2: f64| x2.sqrt() * (1.0 / x2.sqrt()).atan();
        let product = (1.0 + ww) * (1.0 + hh) / (1.0 + s)
            * (ww * (1.0 + s) / ((1.0 + ww) * s)).powf(ww)
            * (hh * (1.0 + s) / ((1.0 + hh) * s)).powf(hh);
        let expected = (arcs(ww) + arcs(hh) - arcs(s) + 0.25 * product.ln()) / (PI * ww.sqrt());

        let (edge, across, up) = (Vec3::Y * l as f32, Vec3::X * w as f32, Vec3::Z * h as f32);
        let scene = scene_of(&[(Vec3::ZERO, edge, up, 0.0, 1.0)]);
        let f = form_factor(&scene, Vec3::ZERO, across, edge, Vec3::Z);
        println!("perpendicular l {l}, w {w}, h {h}: {f:.5} for {expected:.5}, {:+.3} %", 100.0 * (f / expected - 1.0));
        assert!((f / expected - 1.0).abs() < 0.01, "{f} for {expected}");
    }
}

#[test]
fn sun_on_a_plane_is_lambert_and_shadows_are_black() {
    let floor = (Vec3::new(-5.0, -5.0, 0.0), Vec3::X * 10.0, Vec3::Y * 10.0, 0.6, 0.0);
    let roof = (Vec3::new(-1.0, -1.0, 2.0), Vec3::X * 2.0, Vec3::Y * 2.0, 0.0, 0.0);
    let scene = scene_of(&[floor, roof]);
    let direction = Vec3::new(0.0, 0.6, 0.8);
    let sun = Sun { direction, irradiance: Vec3::new(10.0, 5.0, 1.0) };
    let lights = Lights::new(&scene, None, Some(sun));
    let at = |x, y| irradiance(&scene, &lights, Vec3::new(x, y, 0.0), Vec3::Z, &samples(4)).0;
    assert!((at(3.0, 0.0) - Vec3::new(8.0, 4.0, 0.8)).abs().max_element() < 1e-4, "{}", at(3.0, 0.0));
    // the roof's shadow falls 1.5 m to the south
    assert_eq!(at(0.0, -1.5), Vec3::ZERO);
    // as a picture: ρE/π
    let camera = camera([3.0, 3.0, 1.0], [3.0, 2.9, 0.0], 4);
    let e = trace(&scene, &lights, &Eye::Camera(camera), &samples(2));
    assert!(e.mean().pixels.iter().all(|p| (f64::from(p.x) - 0.6 * 8.0 / PI).abs() < 1e-4));
}

#[test]
fn emitters_shine_from_both_sides() {
    let scene = scene_of(&[(Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0, 0.0, 3.0)]);
    let lights = Lights::new(&scene, None, None);
    let above = irradiance(&scene, &lights, Vec3::new(0.1, 0.2, 1.0), -Vec3::Z, &samples(4096)).0.x;
    let below = irradiance(&scene, &lights, Vec3::new(0.1, 0.2, -1.0), Vec3::Z, &samples(4096)).0.x;
    assert!((above / below - 1.0).abs() < 0.01 && above > 1.0, "{above} {below}");
    for z in [1.0, -1.0] {
        let (radiance, _) = mean(&scene, &lights, &camera([0.0, 0.0, z], [0.0, 1e-3, 0.0], 2), &samples(2));
        assert!((radiance - 3.0).abs() < 1e-6);
    }
}

/// A room with a window, a lamp, a sky and a sun patch; every way to find the lights gives the same picture.
#[test]
fn all_ways_to_find_the_lights_agree() {
    let (x, y, z) = (Vec3::X * 4.0, Vec3::Y * 4.0, Vec3::Z * 3.0);
    let wall = |corner, u, v| (corner, u, v, 0.6, 0.0);
    let scene = scene_of(&[
        wall(Vec3::ZERO, x, y),
        wall(z, x, y * 0.4),
        wall(Vec3::ZERO, y, z),
        wall(x, y, z),
        wall(y, x, z),
        (Vec3::new(1.0, 3.0, 0.8), Vec3::X, Vec3::Z * 0.5, 0.3, 2.0),
    ]);
    let sun = Sun { direction: Vec3::new(0.1, 0.3, 1.0).normalize(), irradiance: Vec3::splat(5.0) };
    let eye = [2.0, 0.5, 1.5];
    let lights = Lights::seen_from(&scene, Some(Sky::Uniform(Vec3::splat(1.5))), Some(sun), &[Vec3::from(eye)]);
    let camera = camera(eye.map(f64::from), [2.0, 4.0, 1.0], 16);
    let run = |strategy| {
        let settings = ReferenceSettings { samples: 256, strategy, ..ReferenceSettings::default() };
        mean(&scene, &lights, &camera, &settings)
    };
    let [both, lights_only, chance] = [Strategy::Both, Strategy::Lights, Strategy::Chance].map(run);
    println!("both {both:?}, lights {lights_only:?}, chance {chance:?}");
    for other in [lights_only, chance] {
        let sigma = (both.0 * both.1).hypot(other.0 * other.1);
        assert!((both.0 - other.0).abs() < 4.0 * sigma, "{both:?} {other:?}");
        assert!(other.1 < 0.01);
    }
    assert!(both.1 < lights_only.1 && both.1 < chance.1, "weighting must lower the noise");
}

#[test]
fn albedo_zero_and_one_and_no_light_are_ordinary() {
    let size = Vec3::splat(3.0);
    let inside = camera([0.1, 0.2, 0.3], [1.0, 1.0, 0.0], 4);
    let black = closed_box(size, 0.0, 1.0);
    let (radiance, _) = mean(&black, &Lights::new(&black, None, None), &inside, &samples(4));
    assert_eq!(radiance, 1.0);
    // closed and white: light never ends, paths do, at their bound
    let white = closed_box(size, 1.0, 1.0);
    let settings = ReferenceSettings { max_bounces: 50, ..samples(16) };
    let (radiance, noise) = mean(&white, &Lights::new(&white, None, None), &inside, &settings);
    assert!((radiance / 51.0 - 1.0).abs() < 0.005_f64.max(4.0 * noise), "{radiance}");
    // no light
    let dark = closed_box(size, 0.5, 0.0);
    let lights = Lights::new(&dark, None, None);
    assert!(lights.is_dark());
    assert_eq!(mean(&dark, &lights, &inside, &samples(2)).0, 0.0);
}

#[test]
fn same_bytes_on_one_and_two_threads_and_when_samples_come_later() {
    let scene = closed_box(Vec3::splat(3.0), 0.7, 1.0);
    let lights = Lights::new(&scene, None, None);
    let pose = Pose::look_at(DVec3::new(0.2, 0.1, 0.0), DVec3::X);
    let eye = Eye::Panorama { pose, width: 40, height: 20 };
    let run = |threads| on_threads(threads, || trace(&scene, &lights, &eye, &samples(8)));
    let one = run(1);
    assert_eq!(one, run(2));
    let other = ReferenceSettings { seed: 1, ..samples(8) };
    let reseeded = trace(&scene, &lights, &eye, &other);
    assert_ne!(one, reseeded);
}

/// A panorama of a room whose six walls glow in six colours: every direction in its place.
#[test]
fn panoramas_look_where_they_should() {
    let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0);
    let q = |corner: Vec3, u, v, glow| (corner, u, v, 0.0, glow);
    let low = Vec3::splat(-1.0);
    // west, east, south, north, floor, ceiling
    let scene = scene_of(&[
        q(low, y, z, 1.0),
        q(low + x, y, z, 2.0),
        q(low, x, z, 3.0),
        q(low + y, x, z, 4.0),
        q(low, x, y, 5.0),
        q(low + z, x, y, 6.0),
    ]);
    let lights = Lights::new(&scene, None, None);
    let pose = Pose::look_at(DVec3::ZERO, DVec3::Y);
    let eye = Eye::Panorama { pose, width: 32, height: 16 };
    let picture = trace(&scene, &lights, &eye, &samples(2)).mean();
    let at = |x: usize, y: usize| picture.pixels[y * 32 + x].x;
    assert_eq!([at(16, 8), at(24, 8), at(0, 8), at(8, 8), at(16, 0), at(16, 15)], [4.0, 2.0, 3.0, 1.0, 6.0, 5.0]);
}
