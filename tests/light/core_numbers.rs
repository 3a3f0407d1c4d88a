//! The numbers that relighting must survive, each as a small site from file to picture.
//!
//! In a closed room where every direction has the same radiance L, every relit surface shows L: a furnace.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::{
    Decades, Paint, Plan, Quad, assert_all, assert_finite, closed, gradient, grey, irradiance, long_low_room,
    on_threads, options, relative_rmse, room, room_with_panel, room_with_probe_at_wall, share_off_2, sunny_room, v,
};
use clerestory::panorama::{Picture, write_exr};
use clerestory::reference::{self, Eye, trace};
use clerestory::render::{Frame, Options, SetupError, Source, prepare};
use clerestory::study::relmse;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;
use std::fs;

#[test]
fn a_furnace_glows_everywhere() {
    for albedo in [1e-3, 0.2, 0.7, 1.0] {
        let plan = room(albedo);
        // records keep albedo in 65535 steps
        let tolerance = 1e-3 + 0.51 / (65535.0 * albedo as f32);
        assert_all(&plan.build().furnace(&plan, 3.0).picture(), 3.0, tolerance);
    }
}

/// White, so that unseen surfaces shine as much as seen ones: E = πL on all of them.
#[test]
fn a_white_furnace_glows_where_no_probe_sees() {
    let mut plan = room_with_panel(1.0);
    plan.views = vec![(v(3.8, 2.2, 1.3), v(2.8, 1.4, 1.2), 24)];
    let built = plan.build().furnace(&plan, 3.0);
    let frame = &built.frames(&options(32))[0];
    assert_finite(frame);
    let shown: Vec<(f32, Source)> =
        frame.radiance.pixels.iter().map(|p| p.x).zip(frame.source.iter().copied()).collect();
    let of = |source| shown.iter().filter(|s| s.1 == source).map(|s| s.0).collect::<Vec<f32>>();
    let (records, volume) = (of(Source::Record), of(Source::Volume));
    assert!(records.len() > 50 && volume.len() > 100, "{} {}", records.len(), volume.len());
    assert_all(&records, 3.0, 0.01);
    println!("volume: {:?} … {:?}", volume.iter().copied().reduce(f32::min), volume.iter().copied().reduce(f32::max));
    assert_all(&volume, 3.0, 0.05);
    let mean = volume.iter().sum::<f32>() / volume.len() as f32;
    assert!((mean / 3.0 - 1.0).abs() < 0.01, "{mean}");
}

/// A board of black and white squares under an irradiance of 2: texels are finer than the probe's pixels in places.
#[test]
fn texels_of_albedo_0_and_1() {
    let mut board = room(1.0);
    board.paints[0] = Paint { albedo: 1.0, emission: 0.0, checker: true };
    board.probes[0].1 = 128;
    let built = board
        .build()
        .paint(&board, |scene, s| s.map_or(Vec3::ZERO, |s| scene.albedo(s.triangle, s.barycentric) * 2.0 / PI));
    let frame = &built.frames(&options(16))[0];
    assert_finite(frame);
    let (mut shown, mut expected) = (0.0, 0.0);
    for (l, a) in frame.radiance.pixels.iter().zip(&frame.albedo.pixels) {
        assert!(l.x <= 1.3 * 2.0 / PI, "brighter than white: {}", l.x);
        shown += l.x;
        expected += a.x * 2.0 / PI;
    }
    assert!((shown / expected - 1.0).abs() < 0.05, "{shown} {expected}");
}

/// Fifteen decades in one probe: a wall of 10⁻⁶, one of 10⁹, the others in between. A probe's pixel that straddles a
/// corner mixes both walls, and no cure gets them apart; well inside, each wall must have its own radiance.
#[test]
fn radiance_of_fifteen_decades_in_one_probe() {
    let decades = Decades::new();
    decades.built.frames(&options(16)).iter().for_each(assert_finite);
    let shares = [0.25, 0.4, 0.5, 0.6, 0.75].map(|a| [0.25, 0.5, 0.75].map(|b| (a, b)));
    let shown = decades.built.relit(&options(16), |relit| decades.shown(relit, shares.as_flattened()));
    assert_all(&shown, 1.0, 1e-3);
}

/// A gradient of fifteen decades along a long wall: within the interpolation's error, which the probe's pixels bound.
#[test]
fn a_gradient_of_fifteen_decades() {
    let high = v(15.0, 4.0, 4.0);
    let plan = Plan::new(closed(DVec3::ZERO, high, 0), &[grey(0.5)]).probe(v(7.5, 2.0, 2.0), 512).view(
        v(1.0, 2.0, 2.0),
        v(14.0, 2.0, 1.0),
        16,
    );
    let level = |x: f64| 10f64.powf(-6.0 + x) as f32;
    let built = plan.build().paint(&plan, |scene, s| {
        s.map_or(Vec3::ZERO, |s| Vec3::splat(level(f64::from(s.position.x) + scene.origin.x)))
    });
    built.frames(&options(16)).iter().for_each(assert_finite);
    built.relit(&options(16), |relit| {
        for i in 10..=140 {
            let x = 0.1 * f64::from(i);
            let l = 0.5 * irradiance(relit, built.local(v(x, 2.0, 0.0)), Vec3::Z).x / PI;
            let ratio = l / level(x);
            assert!((0.8..1.25).contains(&ratio), "at {x} m: {l} for {}", level(x));
        }
    });
}

#[test]
fn ill_pixels_never_become_light() {
    let plan = room(0.5);
    let built = plan.build();
    let mut picture = built.look(0, 64, |_| Vec3::splat(2.0));
    let bad = [Vec3::NAN, Vec3::INFINITY, Vec3::splat(-5.0), Vec3::new(1.0, f32::NAN, 1.0), Vec3::new(2.0, 2.0, -1e9)];
    for (i, p) in picture.pixels.iter_mut().enumerate() {
        // one in seven, and a block
        if i * 31 % 7 == 0 || (i % 64).abs_diff(20) < 3 && (i / 64).abs_diff(18) < 3 {
            *p = bad[i % bad.len()];
        }
    }
    built.put(0, &picture);
    let shown = built.frames(&options(16));
    assert_finite(&shown[0]);
    // the block may be filled by the volume, of a room that is not white: anything from black to L
    let good = shown[0].radiance.pixels.iter().filter(|p| (p.x / 2.0 - 1.0).abs() < 1e-3).count();
    let high = shown[0].radiance.pixels.iter().map(|p| p.max_element()).fold(0.0, f32::max);
    println!("{good} of {} as they should be, greatest {high}", shown[0].depth.len());
    assert!(good > shown[0].depth.len() * 9 / 10 && high < 2.01, "{good}, {high}");

    // nothing but ill pixels: no light; beside a good probe, as if it were not there
    let plan = room(0.5).probe(v(2.4, 1.2, 1.4), 32);
    let built = plan.build().furnace(&plan, 2.0);
    let ill = |width: usize| Picture { width, height: width / 2, pixels: vec![Vec3::NAN; width * width / 2] };
    built.put(1, &ill(32));
    assert_all(&built.picture(), 2.0, 1e-3);
    built.put(0, &ill(64));
    assert!(built.picture().iter().all(|&l| l == 0.0));
}

/// A room with something in it.
fn uneven() -> Plan {
    let mut plan = room_with_panel(0.5);
    plan.views[0].2 = 32;
    plan
}

/// Each of the two alone has a row of its own in `tests/stability`.
#[test]
fn far_coordinates_in_millimetres_give_the_local_metres_picture() {
    let painted = |plan: &Plan| plan.build().paint(plan, gradient).picture();
    let mut far = uneven();
    (far.offset, far.metres_per_unit) = (v(5e6, -5e6, 250.0), 1e-3);
    let error = relative_rmse(&painted(&far), &painted(&uneven()));
    println!("relative RMSE {error:.2e}");
    assert!(error < 1e-3, "{error}");
}

/// With cells of 12 m; smaller ones have a row in `tests/stability`.
#[test]
fn a_long_low_room() {
    let plan = long_low_room();
    for frame in plan.build().furnace(&plan, 2.0).frames(&options(16)) {
        assert_finite(&frame);
        let shown: Vec<f32> = frame.radiance.pixels.iter().map(|p| p.x).collect();
        assert_all(&shown, 2.0, 0.05);
    }
}

/// A second probe in a wall, on a wall, beside one or outside must not disturb what the first sees.
#[test]
fn a_probe_in_on_or_behind_a_wall() {
    for (name, at) in [
        ("on the wall", v(0.0, 1.4, 1.3)),
        ("a micrometre before it", v(1e-6, 1.4, 1.3)),
        ("a millimetre before it", v(1e-3, 1.4, 1.3)),
        ("a micrometre behind it", v(-1e-6, 1.4, 1.3)),
        ("inside the wall", v(-0.05, 1.4, 1.3)),
        ("outside", v(-2.0, 1.4, 1.3)),
        ("in the corner", v(0.0, 0.0, 0.0)),
    ] {
        let (plan, built) = room_with_probe_at_wall(at);
        let off = share_off_2(&built.picture());
        println!("{name}: {off:.3} of the pixels off");
        assert!(off <= 0.02, "{name}: {off}");
        // alone it may know nothing, but ends in a picture
        let mut alone = plan;
        alone.probes.remove(0);
        let built = alone.build().furnace(&alone, 2.0);
        let high = built.picture().into_iter().fold(0.0, f32::max);
        assert!(high < 4.01, "{name}, alone: {high}");
    }
}

/// Surfaces doubled exactly, doubled with another material, cut otherwise, and 10 µm apart.
#[test]
fn surfaces_that_coincide() {
    let lone = room(0.5);
    let floor = lone.quads[0];
    let Quad(corner, u, w, _) = floor;
    for (name, more, tolerance) in [
        ("same", vec![floor], 1e-3),
        ("cut otherwise", vec![Quad(corner + u, w, -u, 0)], 1e-3),
        ("10 µm above", vec![Quad(corner + DVec3::Z * 1e-5, u, w, 0)], 1e-3),
        ("two pieces", vec![Quad(corner, u * 0.5, w, 0), Quad(corner + u * 0.5, u * 0.5, w, 0)], 1e-3),
        // either material may be seen in a pixel: between ½ and 2 times what one alone would show
        ("another material", vec![Quad(corner, u, w, 1)], 1.01),
    ] {
        let mut plan = lone.clone();
        plan.paints.push(grey(0.25));
        plan.quads.extend(more);
        println!("{name}");
        assert_all(&plan.build().furnace(&plan, 2.0).picture(), 2.0, tolerance);
    }
}

#[test]
fn panoramas_of_a_few_pixels() {
    for width in [2, 4, 6, 16] {
        let mut plan = room(0.5);
        plan.probes[0].1 = width;
        // all pixels of so coarse a probe straddle edges: it may tell nothing, but nothing may be brighter than L
        let shown = plan.build().furnace(&plan, 2.0).picture();
        let right = shown.iter().filter(|l| (*l / 2.0 - 1.0).abs() < 0.01).count();
        println!("{width} wide: {right} of {}", shown.len());
        assert!(shown.iter().all(|&l| l < 2.01));
        assert!(width < 16 || 2 * right > shown.len(), "{width} wide: {right} of {}", shown.len());
    }
}

#[test]
fn views_from_outside_and_of_nothing() {
    let plan = room(0.5)
        .view(v(20.0, 20.0, 20.0), v(30.0, 30.0, 30.0), 8)
        .view(v(-5.0, 1.0, 1.0), v(0.0, 1.0, 1.0), 8)
        .view(v(0.0, 1.0, 1.0), v(1.0, 1.0, 1.0), 8);
    let frames = plan.build().furnace(&plan, 2.0).frames(&options(16));
    frames.iter().for_each(assert_finite);
    assert!(frames[1].source.iter().all(|&s| s == Source::None));
    assert!(frames[1].radiance.pixels.iter().all(|&l| l == Vec3::ZERO));
    assert_eq!(frames[1].covered_fraction, 1.0);
    // the outside of the walls, which nothing lights
    assert!(frames[2].radiance.pixels.iter().all(|&l| l == Vec3::ZERO), "{:?}", frames[2].radiance.pixels[0]);
}

#[test]
fn a_site_without_probe_or_lighting_says_so() {
    let plan = room(0.5);
    let built = plan.build().furnace(&plan, 1.0);
    let none = Options { probes: 0, ..options(8) };
    assert!(matches!(prepare(&built.site, &built.scene, &[], &none), Err(SetupError::NoProbe { .. })));
    let noon = Options { lightings: vec!["noon".to_owned()], ..options(8) };
    assert!(matches!(prepare(&built.site, &built.scene, &[], &noon), Err(SetupError::NoLighting { .. })));
    let fine = prepare(&built.site, &built.scene, &[], &options(8)).unwrap();
    let left_out: Vec<_> = fine.left_out.iter().map(|l| l.stage).collect();
    assert_eq!(left_out, ["volume", "merge", "textures"]);
}

/// A lit room, path-traced: what is relit against what is traced.
#[test]
fn a_lit_room_relit_is_the_room_traced() {
    let mut plan = uneven();
    plan.probes[0].1 = 128;
    plan.paints.push(Paint { albedo: 0.0, emission: 10.0, checker: false });
    plan.quads.push(Quad(v(1.5, 1.0, 2.49), DVec3::X, DVec3::Y, 1));
    let built = plan.build().trace(&plan, 64);
    let settings = reference::ReferenceSettings { samples: 256, ..Default::default() };
    let camera = built.site.views[0].camera;
    let truth = trace(&built.scene, &built.lights(), &Eye::Camera(camera), &settings);
    let noise = truth.noise();
    let truth = truth.mean();
    let frame = &built.frames(&options(32))[0];
    assert_finite(frame);
    let error = relmse(&frame.radiance.pixels, &truth.pixels);
    let mean = |p: &Picture| p.pixels.iter().map(|p| f64::from(p.x)).sum::<f64>();
    let bias = mean(&frame.radiance) / mean(&truth) - 1.0;
    let share = frame.source.iter().filter(|&&s| s == Source::Volume).count();
    println!("relMSE {error:.4}, mean {:+.2} %, truth's {noise:?}, {share} pixels from the volume", 100.0 * bias);
    assert!(error < 0.03 && bias.abs() < 0.03, "relMSE {error}, mean off by {bias}");
}

/// The same input gives the same bytes on any number of threads: from the site file to the EXR of every layer, with
/// records of two probes, a sun, and a niche that no probe sees.
#[test]
fn one_two_and_three_threads_write_the_same_bytes() {
    let plan = sunny_room([0; 6], 64, "[20, 19, 18]").view(v(3.7, 2.6, 1.7), v(2.0, 1.0, 0.4), 48).view(
        v(0.4, 0.3, 1.2),
        v(3.5, 2.5, 1.0),
        48,
    );
    let built = plan.build().paint(&plan, |_, s| {
        s.map_or(Vec3::ONE, |s| Vec3::new(1.0, 0.9, 0.7) * (1.0 + s.position.x.sin() * s.position.y.cos().powi(2)))
    });
    let run = |threads: usize| -> Vec<Vec<u8>> {
        let write = |(i, frame): (usize, &Frame)| {
            let path = built.folder.path().join(format!("{threads}-{i}.exr"));
            let (width, height) = (frame.radiance.width, frame.radiance.height);
            write_exr(&path, width, height, &frame.layers(true), None).unwrap();
            fs::read(path).unwrap()
        };
        on_threads(threads, || {
            let frames = built.frames(&options(24));
            assert!(frames.iter().any(|f| f.covered_fraction < 0.9), "some of it must need the volume");
            frames.iter().enumerate().map(write).collect()
        })
    };
    let one = run(1);
    assert!(one == run(2), "two threads");
    assert!(one == run(3), "three threads");
    assert!(one[0] != one[1]);
}
