//! Light must not leak through walls, and sun patches must not spread. `-- --nocapture` prints the figures.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::{Built, Plan, Quad, closed, grey, irradiance, options, sides, v};
use clerestory::reference;
use clerestory::render::Options;
use clerestory::scene::{Scene, Surface};
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

const WALL_M: f64 = 0.1;

/// Radiance of the lit room, which ends at x = 4, bright beside the wall: albedo ½ under an irradiance of 1 … 11.
fn lit(scene: &Scene, surface: Option<&Surface>, end_m: f32) -> Vec3 {
    let Some(s) = surface else { return Vec3::ZERO };
    let x = s.position.x + scene.origin.x as f32;
    if x > end_m { Vec3::ZERO } else { Vec3::splat(0.5 / PI * (1.0 + 10.0 * (x / 4.0).clamp(0.0, 1.0))) }
}

/// The plan's surface points on a lattice of `step` metres within a box, pushed `step`/2 off its sides, and the inward
/// normal.
fn inner_points(low: DVec3, high: DVec3, step: f64) -> Vec<(DVec3, DVec3)> {
    let mut points = Vec::new();
    for Quad(corner, u, w, _) in closed(low, high, 0) {
        let inward = u.cross(w).normalize();
        let inward = if inward.dot(0.5 * (low + high) - corner) > 0.0 { inward } else { -inward };
        let (n, m) = ((u.length() / step) as u32, (w.length() / step) as u32);
        for i in 0..n {
            for j in 0..m {
                let (a, b) = ((f64::from(i) + 0.5) / f64::from(n), (f64::from(j) + 0.5) / f64::from(m));
                points.push((corner + u * a + w * b, inward));
            }
        }
    }
    points
}

/// The lit room and the dark one.
const LIT: (DVec3, DVec3) = (DVec3::ZERO, DVec3::new(4.0, 3.0, 2.5));
const DARK: (DVec3, DVec3) = (DVec3::new(4.0 + WALL_M, 0.0, 0.0), DVec3::new(7.0, 3.0, 2.5));

/// Mean irradiance of the lit room; mean and greatest irradiance of the dark one, and the greatest that the volume alone
/// tells there.
fn rooms(built: &Built, cells: u32) -> [f32; 4] {
    let options = Options { volume_for_all: true, ..options(cells) };
    built.relit(&options, |relit| {
        let all = |(low, high): (DVec3, DVec3)| -> Vec<f32> {
            let points = inner_points(low, high, 0.23);
            points.iter().map(|&(p, n)| irradiance(relit, built.local(p), n.as_vec3()).x).collect()
        };
        let (lit, dark) = (all(LIT), all(DARK));
        let volume = relit.volume.expect("asked for");
        let alone: Vec<f32> = inner_points(DARK.0, DARK.1, 0.23)
            .iter()
            .filter_map(|&(p, n)| volume.irradiance(&built.scene, built.local(p), n.as_vec3(), &mut Default::default()))
            .map(|filled| filled.irradiance)
            .map(|e| e.x)
            .collect();
        assert!(alone.len() > dark.len() / 3, "the volume must tell of the dark room: {}", alone.len());
        let mean = |e: &[f32]| e.iter().sum::<f32>() / e.len() as f32;
        let greatest = |e: &[f32]| e.iter().copied().fold(0.0, f32::max);
        [mean(&lit), mean(&dark), greatest(&dark), greatest(&alone)]
    })
}

/// Two closed rooms, a wall of 10 cm between them.
fn two_rooms() -> Plan {
    let mut quads = closed(v(0.0, 0.0, 0.0), v(4.0, 3.0, 2.5), 0);
    quads.extend(closed(v(4.0 + WALL_M, 0.0, 0.0), v(7.0, 3.0, 2.5), 0));
    Plan::new(quads, &[grey(0.5)]).view(v(6.5, 1.5, 1.6), v(4.1, 1.4, 1.2), 48)
}

/// The same on one floor and under one ceiling that run on below and above the wall.
fn common_floor() -> Plan {
    let mut quads = closed(v(0.0, 0.0, 0.0), v(7.0, 3.0, 2.5), 0);
    quads.extend(sides(v(4.0, 0.0, 0.0), v(4.0 + WALL_M, 3.0, 2.5), [0; 6]).split_off(4));
    Plan::new(quads, &[grey(0.5)]).view(v(6.5, 1.5, 1.6), v(4.1, 1.4, 0.6), 48)
}

#[test]
fn no_light_leaks_through_a_wall() {
    for (name, rooms_plan) in [("two shells", two_rooms()), ("common floor", common_floor())] {
        let at = v(1.7, 1.4, 1.5);
        for (probes, plan) in [
            (1, rooms_plan.clone().probe(at, 256)),
            (2, rooms_plan.clone().probe(at, 256).probe(v(6.0, 1.0, 1.5), 256)),
        ] {
            let built = plan.build().paint(&plan, |scene, s| lit(scene, s, 4.05));
            for cells in [16, 64] {
                let [lit, mean, greatest, volume] = rooms(&built, cells);
                println!(
                    "{name}, {probes} probe(s), {cells} cells: lit {lit:.3}, dark mean {mean:.5}, greatest {greatest:.5}, volume's greatest {volume:.5}"
                );
                assert!(lit > 3.0, "the lit room must be lit: {lit}");
                assert!(volume < 0.01 * lit, "{name}, {cells} cells: volume {volume} beside {lit}");
                assert!(mean < 0.01 * lit, "{name}, {cells} cells: mean {mean} beside {lit}");
                assert!(greatest < 0.01 * lit, "{name}, {cells} cells: {greatest} beside {lit}");
            }
        }
    }
}

/// A dark room that touches the lit one only along an edge, and one that stands on its ceiling.
#[test]
fn no_light_leaks_round_a_closed_corner_or_through_a_ceiling() {
    for (name, dark) in [
        ("corner", (v(4.0 + 0.05, 3.0 + 0.05, 0.0), v(7.0, 6.0, 2.5))),
        ("edge on edge", (v(4.0, 3.0, 0.0), v(7.0, 6.0, 2.5))),
        ("storey", (v(0.0, 0.0, 2.5 + WALL_M), v(4.0, 3.0, 5.0))),
    ] {
        let mut quads = closed(LIT.0, LIT.1, 0);
        quads.extend(closed(dark.0, dark.1, 0));
        let middle = 0.5 * (dark.0 + dark.1);
        let plan = Plan::new(quads, &[grey(0.5)]).view(middle, middle - v(1.0, 1.0, 0.3), 48);
        let plan = plan.probe(v(1.7, 1.4, 1.5), 256);
        let built = plan.build().paint(&plan, |scene, s| {
            let inside = s.is_some_and(|s| {
                let p = s.position.as_dvec3() + scene.origin;
                p.cmpge(LIT.0 - 0.01).all() && p.cmple(LIT.1 + 0.01).all()
            });
            if inside { Vec3::splat(0.5 * 10.0 / PI) } else { Vec3::ZERO }
        });
        for cells in [16, 64] {
            let (lit, dark) = built.relit(&options(cells), |relit| {
                let mut greatest = 0.0f32;
                for (p, n) in inner_points(dark.0, dark.1, 0.23) {
                    greatest = greatest.max(irradiance(relit, built.local(p), n.as_vec3()).x);
                }
                (irradiance(relit, built.local(v(1.0, 1.0, 0.0)), Vec3::Z).x, greatest)
            });
            println!("{name}, {cells} cells: lit {lit:.3}, dark greatest {dark:.5}");
            assert!((lit / 10.0 - 1.0).abs() < 0.01, "{lit}");
            assert!(dark < 0.01 * lit, "{name}, {cells} cells: {dark}");
        }
    }
}

/// The dark side of the wall's foot, on the floor both rooms share, at a probe of many resolutions: where the probe's
/// pixels are coarser than the wall is thick, the floor behind the wall lies between a lit pixel and the wall's.
#[test]
fn records_do_not_reach_under_a_wall() {
    for width in [64, 256] {
        let plan = common_floor().probe(v(1.0, 1.4, 0.8), width);
        let built = plan.build().paint(&plan, |scene, s| lit(scene, s, 4.05));
        let greatest = built.relit(&options(64), |relit| {
            let mut greatest = (0.0f32, 0.0);
            for i in 0..40 {
                let x = 4.0 + WALL_M + 0.005 + 0.02 * f64::from(i);
                let e = irradiance(relit, built.local(v(x, 1.43, 0.0)), Vec3::Z).x;
                if e > greatest.0 {
                    greatest = (e, x);
                }
            }
            greatest
        });
        println!("probe {width} wide: greatest on the dark floor {greatest:?} beside 11");
        assert!(greatest.0 < 0.11, "probe {width} wide: {greatest:?}");
    }
}

/// A patch of sun on the lit room's floor that touches the wall.
#[test]
fn a_sun_patch_at_the_wall_stays_on_its_side() {
    let plan = common_floor().probe(v(1.7, 1.4, 1.5), 256);
    let built = plan.build().paint(&plan, |scene, s| {
        let Some(s) = s else { return Vec3::ZERO };
        let p = s.position.as_dvec3() + scene.origin;
        let patch = p.z < 0.01 && p.x > 3.2 && p.x < 4.05 && (p.y - 1.5).abs() < 0.5;
        Vec3::splat(
            0.5 / PI
                * if patch {
                    1000.0
                } else if p.x < 4.05 {
                    10.0
                } else {
                    0.0
                },
        )
    });
    for cells in [16, 64] {
        let greatest = built.relit(&options(cells), |relit| {
            let e = |p, n| irradiance(relit, built.local(p), n).x;
            assert!((e(v(3.6, 1.5, 0.0), Vec3::Z) / 1000.0 - 1.0).abs() < 0.01, "the patch must be there");
            inner_points(v(4.1, 0.0, 0.0), v(7.0, 3.0, 2.5), 0.11)
                .iter()
                .map(|&(p, n)| e(p, n.as_vec3()))
                .fold(0.0, f32::max)
        });
        println!("sun patch, {cells} cells: dark greatest {greatest:.5}");
        // 1 % of the room beside it, itself 1 % of the patch
        assert!(greatest < 0.1, "{cells} cells: {greatest}");
    }
}

/// A closed room of albedo 0.6 with a window and the sun. A low wall hides a niche from the probe, right beside the sun
/// patch. The volume there against path-traced truth.
#[test]
fn a_sun_patch_does_not_spread_through_the_fill() {
    let (high, sun) = (v(4.0, 4.0, 3.0), v(-0.5, 0.0, 0.7).normalize());
    let mut quads = closed(DVec3::ZERO, high, 0);
    // the west wall has a window: y 1.4 … 2.6, z 1.2 … 2.4
    quads.remove(4);
    for (corner, y, z) in [
        (v(0.0, 0.0, 0.0), 4.0, 1.2),
        (v(0.0, 0.0, 2.4), 4.0, 0.6),
        (v(0.0, 0.0, 1.2), 1.4, 1.2),
        (v(0.0, 2.6, 1.2), 1.4, 1.2),
    ] {
        quads.push(Quad(corner, DVec3::Y * y, DVec3::Z * z, 0));
    }
    // a screen, 1 m high and 10 cm thick, at x = 2: the sun patch ends before it or climbs it, the niche is behind it
    quads.extend(closed(v(2.0, 0.5, 0.0), v(2.1, 3.5, 1.0), 0));
    let mut plan =
        Plan::new(quads, &[grey(0.6)]).probe(v(0.9, 2.0, 0.9), 256).view(v(3.5, 3.0, 1.6), v(2.2, 2.0, 0.2), 48);
    plan.more = format!(
        "[environment]\nradiance = [1, 1, 1]\n[sun]\ndirection = [{}, {}, {}]\nirradiance = [60, 60, 60]",
        sun.x, sun.y, sun.z
    );
    let start = std::time::Instant::now();
    let built = plan.build().trace(&plan, 32);
    println!("traced in {:?}", start.elapsed());
    let lights = built.lights();
    let (mut points, mut patch) = (Vec::new(), 0.0f32);
    // behind the screen: its back and the floor near it
    for i in 0..4 {
        let y = 0.9 + 0.7 * f64::from(i);
        points.push((v(2.1, y, 0.3), Vec3::X));
        points.push((v(2.1, y, 0.8), Vec3::X));
        points.push((v(2.3, y, 0.0), Vec3::Z));
    }
    let settings = reference::ReferenceSettings { samples: 16384, ..Default::default() };
    let truth: Vec<f32> = points
        .iter()
        .map(|&(p, n)| {
            let (e, error) = reference::irradiance(&built.scene, &lights, built.local(p), n, &settings);
            assert!(error.x < 0.04 * e.x, "the truth is too noisy: {e} ± {error}");
            e.x
        })
        .collect();
    for i in 0..20 {
        let p = built.local(v(0.1 * f64::from(i), 2.0, 0.0));
        patch = patch.max(reference::irradiance(&built.scene, &lights, p, Vec3::Z, &settings).0.x);
    }
    let greatest = truth.iter().copied().fold(0.0, f32::max);
    assert!(patch > 10.0 * greatest, "the patch ({patch}) must be far brighter than the niche ({greatest})");
    for cells in [16, 64] {
        built.relit(&options(cells), |relit| {
            let volume = relit.volume.expect("the niche needs the volume");
            for (&(p, n), &t) in points.iter().zip(&truth) {
                let point = built.local(p);
                assert!(relit.light.observe(&built.scene, point, n).is_none(), "{p} is meant to be unseen");
                let e = volume
                    .irradiance(&built.scene, point, n, &mut Default::default())
                    .map_or(f32::NAN, |f| f.irradiance.x);
                println!("{cells} cells, {p}, normal {n}: {e:.3} for {t:.3}, {:+.1} %", 100.0 * (e / t - 1.0));
            }
            for (&(p, n), &t) in points.iter().zip(&truth) {
                let e = irradiance(relit, built.local(p), n).x;
                assert!((e / t - 1.0).abs() < 0.2, "{cells} cells, {p}: {e} for {t}");
            }
        });
    }
}
