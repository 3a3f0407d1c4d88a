//! The numbers that relighting must survive, each as a small site from file to picture.
//!
//! In a closed room where every direction has the same radiance L, every relit surface shows L: a furnace.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::{
    Built, Paint, Plan, Quad, assert_all, assert_finite, closed, grey, irradiance, options, relative_rmse, sides, v,
};
use clerestory::panorama::Picture;
use clerestory::reference::{self, Eye, trace};
use clerestory::render::{SetupError, Source, prepare};
use clerestory::study::relmse;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

const HIGH: DVec3 = DVec3::new(4.0, 3.0, 2.5);

/// A room, a probe 64 pixels wide off its middle, a view from a corner.
fn room(albedo: f64) -> Plan {
    Plan::new(closed(DVec3::ZERO, HIGH, 0), &[grey(albedo)]).probe(v(1.7, 1.4, 1.3), 64).view(
        v(0.3, 0.4, 1.6),
        v(3.5, 2.5, 0.8),
        24,
    )
}

/// The room with a panel whose back no probe sees, and a view of that back.
fn room_with_panel(albedo: f64) -> Plan {
    let mut plan = room(albedo);
    plan.quads.push(Quad(v(2.8, 0.8, 0.6), DVec3::Y * 1.2, DVec3::Z * 1.2, 0));
    plan.views = vec![(v(3.8, 2.2, 1.3), v(2.8, 1.4, 1.2), 24)];
    plan
}

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
    let plan = room_with_panel(1.0);
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

/// A black surface that seems to send out light (glare, a wrong model) is no record and stays black.
#[test]
fn albedo_0_and_1_and_texels_of_both() {
    let black = room(0.0);
    assert!(black.build().furnace(&black, 3.0).picture().iter().all(|&l| l == 0.0));

    // a board of black and white squares under an irradiance of 2: texels are finer than the probe's pixels in places
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
    let mut plan = room(0.5);
    plan.quads = sides(DVec3::ZERO, HIGH, [0, 1, 2, 3, 4, 5]);
    plan.probes[0].1 = 256;
    plan.paints = vec![grey(0.5); 6];
    // the darkest wall opposite the brightest
    const LEVELS: [f32; 6] = [1.0, 30.0, 1e-3, 1e3, 1e-6, 1e9];
    let built = plan.build().paint(&plan, |scene, s| {
        let level = |name: &str| LEVELS[name[1..].parse::<usize>().unwrap()];
        s.map_or(Vec3::ZERO, |s| {
            Vec3::splat(level(&scene.materials[scene.mesh.materials[s.triangle as usize] as usize].name))
        })
    });
    built.frames(&options(16)).iter().for_each(assert_finite);
    built.relit(&options(16), |relit| {
        for (Quad(corner, u, w, material), level) in plan.quads.iter().zip(LEVELS) {
            let normal = u.cross(*w).normalize();
            let normal = if normal.dot(0.5 * HIGH - *corner) > 0.0 { normal } else { -normal };
            for a in [0.25, 0.4, 0.5, 0.6, 0.75] {
                for b in [0.25, 0.5, 0.75] {
                    let e = irradiance(relit, built.local(*corner + *u * a + *w * b), normal.as_vec3());
                    let l = 0.5 * e.x / PI;
                    assert!((l / level - 1.0).abs() < 1e-3, "side {material}: {l} for {level}");
                }
            }
        }
    });
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

/// A room with something in it, painted with a gradient, so that a shift would show.
fn uneven() -> Plan {
    let mut plan = room_with_panel(0.5);
    plan.views[0] = (v(3.7, 2.6, 1.75), v(1.5, 0.5, 0.75), 32);
    plan
}

fn painted(plan: &Plan) -> Built {
    plan.build().paint(plan, |scene, s| {
        s.map_or(Vec3::ZERO, |s| {
            let (low, high) = scene.mesh.bounds();
            let p = (s.position - low) / (high - low);
            Vec3::splat(1.0 + 4.0 * p.x + 2.0 * p.y * p.z)
        })
    })
}

#[test]
fn far_coordinates_and_millimetres_give_the_local_metres_picture() {
    let near = painted(&uneven()).picture();
    let mut far = uneven();
    far.offset = v(5e6, -5e6, 250.0);
    let mut millimetres = uneven();
    millimetres.metres_per_unit = 1e-3;
    let mut both = far.clone();
    both.metres_per_unit = 1e-3;
    for (name, plan) in [("far", far), ("millimetres", millimetres), ("far millimetres", both)] {
        let error = relative_rmse(&painted(&plan).picture(), &near);
        println!("{name}: relative RMSE {error:.2e}");
        assert!(error < 1e-3, "{name}: {error}");
    }
}

/// 200 × 2 × 2 m, with a cross wall that leaves a gap: the fill's cells are larger than the room is wide.
#[test]
fn a_long_low_room() {
    let high = v(200.0, 2.0, 2.0);
    let mut quads = closed(DVec3::ZERO, high, 0);
    quads.push(Quad(v(20.0, 0.0, 0.0), DVec3::Y * 1.5, DVec3::Z * 2.0, 0));
    let plan = Plan::new(quads, &[grey(1.0)])
        .probe(v(5.0, 1.0, 1.0), 256)
        .probe(v(40.0, 1.0, 1.0), 256)
        .view(v(30.0, 0.6, 1.0), v(20.0, 0.6, 1.0), 16)
        .view(v(2.0, 1.0, 1.0), v(199.0, 1.0, 1.0), 16);
    let built = plan.build().furnace(&plan, 2.0);
    for cells in [16, 64] {
        for frame in built.frames(&options(cells)) {
            assert_finite(&frame);
            let shown: Vec<f32> = frame.radiance.pixels.iter().map(|p| p.x).collect();
            assert_all(&shown, 2.0, 0.05);
        }
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
        let mut plan = room(0.5).probe(at, 32);
        // the wall is 10 cm thick
        plan.quads.extend(closed(DVec3::splat(-0.1), HIGH + 0.1, 0));
        let built = plan.build();
        built.put(0, &built.look(0, 64, |_| Vec3::splat(2.0)));
        // whatever it sees is black in its picture but inside the room
        let inside = |p: DVec3| p.cmpge(DVec3::splat(-1e-4)).all() && p.cmple(HIGH + 1e-4).all();
        built.put(
            1,
            &built.look(1, 32, |s| {
                let seen = s.is_some_and(|s| inside(s.position.as_dvec3() + built.scene.origin));
                Vec3::splat(if seen { 2.0 } else { 0.0 })
            }),
        );
        let shown = built.picture();
        let wrong = shown.iter().filter(|l| (*l / 2.0 - 1.0).abs() > 0.01).count();
        println!("{name}: {wrong} of {} pixels off, least {:?}", shown.len(), shown.iter().copied().reduce(f32::min));
        assert!(wrong * 50 <= shown.len(), "{name}: {wrong} of {}", shown.len());
        // alone it may know nothing, but ends in a picture
        let mut alone = plan.clone();
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
fn probes_that_coincide_say_what_one_says() {
    let one = painted(&room(0.5)).picture();
    let two = painted(&room(0.5).probe(v(1.7, 1.4, 1.3), 64)).picture();
    assert!(relative_rmse(&two, &one) < 1e-5);
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
    let none = clerestory::render::Options { probes: 0, ..options(8) };
    assert!(matches!(prepare(&built.site, &built.scene, &[], &none), Err(SetupError::NoProbe { .. })));
    let noon = clerestory::render::Options { lightings: vec!["noon".to_owned()], ..options(8) };
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
