//! The paper's plain method in rooms whose light is known, with its known faults, which the rest of the program cures.

use crate::support::data::shared;
use crate::support::{load, on_threads};
use clerestory::panorama::{self, Picture, Projection};
use clerestory::paper::{PaperSettings, Plain, PlainRelit, ProbeLight};
use clerestory::render::{Source, render};
use clerestory::scene::{Material, Mesh, Ray, Scene};
use clerestory::study;
use glam::{DVec3, Mat3, Vec3};
use std::f32::consts::PI;

/// A box by its lowest and highest corner, and the material of its six walls.
type Walls = (Vec3, Vec3, u32);

fn scene(boxes: &[Walls], albedos: &[Vec3]) -> Scene {
    let mut mesh = Mesh::default();
    for &(low, high, material) in boxes {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend((0..8).map(|i| {
            let upper = |bit: i32| if i >> bit & 1 == 1 { 1.0 } else { 0.0 };
            low + (high - low) * Vec3::new(upper(0), upper(1), upper(2))
        }));
        for [a, b, c, d] in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]] {
            mesh.triangles.extend([[a, b, c], [a, c, d]].map(|t| t.map(|i: u32| first + i)));
            mesh.materials.extend([material; 2]);
        }
    }
    let materials = albedos
        .iter()
        .map(|&albedo| Material { name: String::new(), albedo, texture: None, emission: Vec3::ZERO })
        .collect();
    Scene::new(mesh, materials, Vec::new(), DVec3::ZERO)
}

fn probe(origin: Vec3, picture: &Picture) -> ProbeLight<'_> {
    ProbeLight { origin, to_world: Mat3::IDENTITY, picture, projection: Projection::LatLong }
}

fn even(radiance: Vec3) -> Picture {
    Picture { width: 128, height: 64, pixels: vec![radiance; 128 * 64] }
}

/// The first surface seen from a place.
fn look(scene: &Scene, origin: Vec3, towards: Vec3) -> (Vec3, Vec3) {
    let ray = Ray { origin, direction: (towards - origin).normalize() };
    let surface = scene.surface(&ray, &scene.tracer.closest(&ray, 1e-3).expect("the room is closed"));
    (surface.position, surface.normal)
}

const ROOM: Walls = (Vec3::new(-3.0, -2.0, 0.0), Vec3::new(3.0, 2.0, 3.0), 0);
const MIDDLE: Vec3 = Vec3::new(0.3, 0.1, 1.5);

#[test]
fn an_evenly_lit_room_is_even() {
    // E = πL/ρ everywhere, whether records or volume tell
    let (radiance, albedo) = (Vec3::new(0.3, 0.2, 0.1), Vec3::new(0.6, 0.5, 0.2));
    let scene = scene(&[ROOM], &[albedo]);
    let picture = even(radiance);
    let want = PI * radiance / albedo;
    for radius_m in [Some(1e-4), None, Some(0.5)] {
        let plain =
            Plain::new(&scene, &[probe(MIDDLE, &picture)], PaperSettings { radius_m, ..PaperSettings::default() });
        let mut sources = Vec::new();
        for towards in [Vec3::X, Vec3::Y, Vec3::NEG_Z, Vec3::new(1.0, 1.0, 1.0), Vec3::new(-3.0, 1.0, -0.2)] {
            let (point, normal) = look(&scene, MIDDLE, MIDDLE + towards);
            let (e, source) = plain.irradiance(point, normal);
            assert!((e / want - 1.0).abs().max_element() < 1e-5, "{radius_m:?} {towards}: {e}");
            sources.push(source);
        }
        let tiny = radius_m == Some(1e-4);
        assert!(sources.contains(if tiny { &Source::Volume } else { &Source::Record }), "{sources:?}");
    }
}

#[test]
fn every_pixel_of_every_probe_is_a_record() {
    let scene = scene(&[ROOM], &[Vec3::splat(0.5)]);
    let picture = even(Vec3::ONE);
    let places = [MIDDLE, MIDDLE - Vec3::X];
    let probes = places.map(|place| probe(place, &picture));
    let plain = Plain::new(&scene, &probes, PaperSettings::default());
    assert_eq!(plain.record_count(), 2 * 128 * 64);
    assert!(plain.record_bytes() <= 64 * plain.record_count());
    assert!(plain.radius_m > 0.05 && plain.radius_m < 0.5, "{}", plain.radius_m);
}

#[test]
fn no_probe_no_light() {
    let scene = scene(&[ROOM], &[Vec3::splat(0.5)]);
    let nothing = Picture::new(0, 0);
    for probes in [vec![], vec![probe(MIDDLE, &nothing)]] {
        let plain = Plain::new(&scene, &probes, PaperSettings::default());
        assert_eq!(plain.irradiance(Vec3::ZERO, Vec3::Z), (Vec3::ZERO, Source::None));
    }
}

#[test]
fn bad_pixels_never_become_light() {
    let scene = scene(&[ROOM], &[Vec3::splat(0.5)]);
    let mut picture = even(Vec3::ONE);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        match i % 5 {
            0 => pixel.x = f32::NAN,
            1 => pixel.y = f32::INFINITY,
            2 => pixel.z = -1.0,
            3 => *pixel = Vec3::splat(f32::MAX),
            _ => (),
        }
    }
    let plain = Plain::new(&scene, &[probe(MIDDLE, &picture)], PaperSettings::default());
    let good = picture.pixels.len().div_ceil(5) - 1;
    assert!((good..=good + 1).contains(&plain.record_count()), "{}", plain.record_count());
    for radius_m in [Some(1e-4), Some(0.5)] {
        let plain =
            Plain::new(&scene, &[probe(MIDDLE, &picture)], PaperSettings { radius_m, ..PaperSettings::default() });
        let (e, _) = plain.irradiance(Vec3::new(1.0, 0.5, 0.0), Vec3::Z);
        assert!((e / (2.0 * PI) - 1.0).abs().max_element() < 1e-5, "{e}");
    }
}

#[test]
fn what_reflects_nothing_tells_nothing() {
    // a black pillar in a room of pure red: green and blue are known to nobody
    let pillar = (Vec3::new(1.0, 1.0, 0.0), Vec3::new(1.5, 1.5, 3.0), 1);
    let scene = scene(&[ROOM, pillar], &[Vec3::new(0.5, 0.0, 0.0), Vec3::ZERO]);
    let picture = even(Vec3::new(1.0, 0.0, 0.0));
    let plain = Plain::new(&scene, &[probe(MIDDLE, &picture)], PaperSettings::default());
    let (point, normal) = look(&scene, MIDDLE, Vec3::new(1.0, 1.2, 1.5));
    assert!(plain.record_count() < 128 * 64);
    let (e, source) = plain.irradiance(point, normal);
    assert_eq!(source, Source::Volume);
    assert!((e - Vec3::new(2.0 * PI, 0.0, 0.0)).length() < 1e-4, "{e}");
}

#[test]
fn records_behind_a_surface_do_not_count() {
    let scene = scene(&[ROOM], &[Vec3::splat(0.5)]);
    let picture = even(Vec3::ONE);
    let plain = Plain::new(&scene, &[probe(MIDDLE, &picture)], PaperSettings::default());
    let floor = Vec3::new(0.5, 0.2, 0.0);
    assert_eq!(plain.irradiance(floor, Vec3::Z).1, Source::Record);
    assert_eq!(plain.irradiance(floor, Vec3::NEG_Z).1, Source::Volume);
}

#[test]
fn the_volume_leaks_through_walls() {
    // the paper's volume has one value for both sides of a wall: a dark room 10 cm beside a lit one is lit
    let lit = ROOM;
    let dark = (Vec3::new(3.1, -2.0, 0.0), Vec3::new(9.0, 2.0, 3.0), 0);
    let scene = scene(&[lit, dark], &[Vec3::splat(0.5)]);
    let picture = even(Vec3::ONE);
    let plain = Plain::new(&scene, &[probe(MIDDLE, &picture)], PaperSettings::default());
    let (point, normal) = look(&scene, Vec3::new(6.0, 0.0, 1.5), Vec3::new(6.0, 0.0, 0.0));
    let (e, source) = plain.irradiance(point, normal);
    assert_eq!(source, Source::Volume);
    assert!(e.min_element() > 0.5 * 2.0 * PI, "{e}");
}

#[test]
fn a_turn_is_applied() {
    let scene = scene(&[ROOM], &[Vec3::splat(0.5)]);
    // bright in the right half of the picture: east of a probe that looks north, south of one that looks east
    let mut picture = even(Vec3::ONE);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        *pixel *= if i % 128 >= 64 { 4.0 } else { 1.0 };
    }
    let mut probe = probe(MIDDLE, &picture);
    let east = look(&scene, MIDDLE, MIDDLE + Vec3::X);
    let south = look(&scene, MIDDLE, MIDDLE - Vec3::Y);
    let e = |probe: ProbeLight, (point, normal)| {
        let (e, source) = Plain::new(&scene, &[probe], PaperSettings::default()).irradiance(point, normal);
        assert_eq!(source, Source::Record);
        e.x / (2.0 * PI)
    };
    assert!((e(probe, east) - 4.0).abs() < 1e-4);
    probe.to_world = Mat3::from_rotation_z(-0.5 * PI);
    assert!((e(probe, south) - 4.0).abs() < 1e-4);
}

#[test]
fn threads_do_not_matter() {
    let scene = scene(&[ROOM], &[Vec3::splat(0.5)]);
    let mut picture = even(Vec3::ONE);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        *pixel *= (i as f32 * 0.618).fract();
    }
    let bits = |threads: usize| {
        on_threads(threads, || {
            let probes = [probe(MIDDLE, &picture), probe(MIDDLE + Vec3::Y, &picture)];
            let plain = Plain::new(&scene, &probes, PaperSettings::default());
            let places = (0..300).map(|i| Vec3::new(i as f32 * 0.018 - 2.7, 0.3, if i % 2 == 0 { 0.0 } else { 0.4 }));
            places.map(|p| plain.irradiance(p, Vec3::Z).0.to_array().map(f32::to_bits)).collect::<Vec<_>>()
        })
    };
    assert_eq!(bits(1), bits(3));
}

/// A plain script of the paper's method got a mean FLIP of .149 and a mean relative MSE of .337 over the four
/// photographs at four samples a pixel; this checks one of them at one sample, loosely.
#[test]
fn sibenik_is_relit_as_well_as_the_paper_can() {
    let Some(folder) = shared("truth/sibenik") else { return };
    let (site, scene) = load(&folder);
    let plain = Plain::of_probes(&scene, &site.probes, "", PaperSettings::default()).unwrap();
    let nave = &site.views[0];
    let truth = panorama::read(nave.photo.as_ref().unwrap()).unwrap();
    let relit = PlainRelit { plain: &plain, sky: &|_| Vec3::ZERO };
    let frame = render(&scene, &relit, &nave.camera, 1, &|_, _| ());
    let relmse = study::relmse(&frame.radiance.pixels, &truth.pixels);
    println!("{} records, radius {} m, relative MSE {relmse}", plain.record_count(), plain.radius_m);
    assert!((0.95..1.0).contains(&frame.covered_fraction), "{}", frame.covered_fraction);
    assert!(relmse < 0.25, "{relmse}");
}
