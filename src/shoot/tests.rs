//! Charts, packed normals, and what records say of a furnace.

use super::hits::{pack_normal, unpack_normal};
use super::records::{measured, shaded};
use super::{Chart, Hits, Light, Records, charted};
use crate::panorama::{CameraModel, Distortion, Lens, Picture, Projection, Radiometry};
use crate::render::{Relit, Source};
use crate::scene::Scene;
use crate::scene::testing::{boxes, grey, parallelograms};
use crate::volume::{self, Nearby, Transport, Volume};
use glam::{DVec2, DVec3, Mat3, Vec3};
use proptest::prelude::*;
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

/// A closed box of one albedo.
fn closed_box(low: Vec3, high: Vec3, albedo: f32) -> Scene {
    grey(boxes(&[(low, high)]), albedo)
}

/// A picture of one radiance everywhere.
fn even(width: usize, height: usize, radiance: Vec3) -> Picture {
    Picture { width, height, pixels: vec![radiance; width * height] }
}

/// The light that one probe's picture tells.
fn lit(scene: &Scene, hits: Hits, picture: &Picture) -> Light {
    Light::new(scene, [(Arc::new(hits), picture, Radiometry::default())], None, None)
}

fn charts() -> Vec<Chart> {
    let mut all: Vec<Chart> = [(2, 1), (4, 2), (6, 3), (64, 32), (1024, 512)].map(|(w, h)| Chart::latlong(w, h)).into();
    all.extend([(1, 1), (7, 5), (64, 48)].map(|(w, h)| Chart::perspective(w, h, 1.2)));
    let mut aside = CameraModel::with_fov([64, 48], 60.0);
    (aside.centre, aside.focal) = (DVec2::new(70.0, 13.0), DVec2::new(50.0, 42.0));
    all.push(Chart::pinhole(64, 48, &aside));
    all
}

#[test]
fn a_direction_lies_in_its_own_cell() {
    for chart in charts() {
        for row in 0..chart.rows() {
            for x in 0..chart.row(row).len() {
                let cell = chart.row(row).start + x;
                let d = chart.middle(row, x);
                assert_eq!(chart.middle_of(cell), d);
                assert!((d.length() - 1.0).abs() < 1e-6);
                let place = chart.place(3.0 * d).expect("every cell is in the picture");
                let n = chart.row(row).len() as f32;
                let off = (place.x * n - x as f32 - 0.5).abs();
                assert!(off < 0.02 && (place.y - row as f32 - 0.5).abs() < 0.02, "{row} {x}: {place}");
                let around = chart.around(place);
                let here: f32 = around.iter().filter(|a| a.0 == cell).map(|a| a.1).sum();
                assert!(here > 0.95, "{row} {x}: {around:?}");
            }
        }
    }
}

#[test]
fn solid_angles_of_cells_are_even() {
    let chart = Chart::latlong(256, 128);
    assert!(chart.len() < 256 * 128 * 65 / 100, "a third fewer cells than pixels: {}", chart.len());
    let even = 4.0 * PI / chart.len() as f32;
    // but for the few rows at the poles, whose cells are held to be at least four
    for row in 2..126 {
        let edge = |r: usize| (PI * r as f32 / 128.0).cos();
        let mine = TAU * (edge(row) - edge(row + 1)) / chart.row(row).len() as f32;
        assert!((mine / even - 1.0).abs() < 0.25, "row {row}: {mine} {even}");
    }
}

#[test]
fn the_seam_and_the_poles_are_continuous() {
    let chart = Chart::latlong(128, 64);
    // a smooth function of the cells' directions comes back smooth
    let value = |cell: usize| chart.middle_of(cell).dot(Vec3::new(0.3, -0.8, 0.5));
    let at = |d: Vec3| chart.around(chart.place(d).expect("all directions")).iter().map(|&(c, w)| w * value(c)).sum();
    for i in 0..2000 {
        let z = 1.0 - 2.0 * (i as f32 + 0.5) / 2000.0;
        // around the seam, which is behind
        let phi = PI + ((i * 7 % 100) as f32 / 100.0 - 0.5) * 0.1;
        let r = (1.0 - z * z).sqrt();
        let d = Vec3::new(r * phi.sin(), r * phi.cos(), z);
        let got: f32 = at(d);
        let expected = d.dot(Vec3::new(0.3, -0.8, 0.5));
        assert!((got - expected).abs() < 0.03, "{d}: {got} {expected}");
    }
    assert!(Chart::perspective(8, 8, 1.0).place(Vec3::NEG_Y).is_none());
}

/// What a photograph shows through a distorted lens is the light of the place that each pixel really saw.
#[test]
fn a_distorted_lens_puts_light_where_it_comes_from() {
    let scene = closed_box(Vec3::ZERO, Vec3::splat(4.0), 0.5);
    let radiance = |d: DVec3| Vec3::new(1.0 + 0.8 * d.x as f32, 1.0 + 0.8 * d.z as f32, 1.0);
    let mut barrel = CameraModel::with_fov([160, 120], 60.0);
    barrel.centre = DVec2::new(90.0, 55.0);
    barrel.focal.x *= 1.05;
    let aside = barrel;
    barrel.distortion = Distortion::brown([-0.15, 0.02, 0.0, 0.0], [0.003, -0.002]);
    let fisheye = CameraModel { lens: Lens::Fisheye, ..barrel };
    for model in [aside, barrel, fisheye] {
        let mut photo = Picture::new(160, 120);
        for (i, p) in photo.pixels.iter_mut().enumerate() {
            *p = radiance(model.direction((i % 160) as f64 + 0.5, (i / 160) as f64 + 0.5));
        }
        let (chart, picture) = charted(photo, Projection::Camera(model));
        let eye = Vec3::splat(2.0);
        let light = lit(&scene, Hits::shoot(&scene, eye, Mat3::IDENTITY, chart), &picture);
        for (x, y) in [(8.0, 8.0), (150.0, 10.0), (80.0, 60.0), (12.0, 110.0), (150.0, 112.0)] {
            let d = model.direction(x, y);
            let point = eye + d.as_vec3() * (2.0 / d.y as f32);
            if point.min_element() < 0.05 || point.max_element() > 4.0 + 1e-4 {
                continue;
            }
            let found = light.observe(&scene, point, Vec3::NEG_Y).expect("it is in the picture").value() * 0.5 / PI;
            assert!(found.distance(radiance(d)) < 0.01, "{model:?} ({x}, {y}): {found}, not {}", radiance(d));
        }
        let aside = model.direction(80.0, 60.0).as_vec3() * Vec3::new(1.0, -1.0, 1.0);
        assert!(light.observe(&scene, eye + aside * (2.0 / aside.y.abs()), Vec3::Y).is_none(), "it is behind");
    }
}

#[test]
fn of_photographs_from_one_tripod_the_one_that_sees_a_point_is_found() {
    let scene = closed_box(Vec3::ZERO, Vec3::splat(4.0), 0.5);
    let picture = even(32, 32, Vec3::ONE);
    let look = |turn: f32| {
        let to_world = Mat3::from_rotation_z(turn);
        (
            Arc::new(Hits::shoot(&scene, Vec3::splat(2.0), to_world, Chart::perspective(32, 32, 1.2))),
            &picture,
            Radiometry::default(),
        )
    };
    // +y, then behind
    let light = Light::new(&scene, [look(0.0), look(PI)], None, None);
    for (probe, y, normal) in [(0, 4.0, Vec3::NEG_Y), (1, 0.0, Vec3::Y)] {
        let found = light.finest(&scene, Vec3::new(2.1, y, 1.9), normal);
        assert_eq!(found.map(|f| f.0), Some(probe), "the wall at y = {y}");
    }
    assert!(light.finest(&scene, Vec3::new(4.0, 2.0, 2.0), Vec3::NEG_X).is_none(), "no photograph shows this wall");
}

#[test]
fn clipped_pixels_are_lower_bounds() {
    let scene = closed_box(Vec3::ZERO, Vec3::splat(4.0), 0.5);
    let code = Radiometry { clipped: 0.98, ..Radiometry::default() };
    let hits = |x: f32| Arc::new(Hits::shoot(&scene, Vec3::new(x, 2.0, 2.0), Mat3::IDENTITY, Chart::latlong(64, 32)));
    let at = |probes: &[(Arc<Hits>, &Picture, Radiometry)]| {
        let light = Light::new(&scene, probes.to_vec(), None, None);
        let (point, normal) = (Vec3::new(0.0, 2.1, 1.9), Vec3::X);
        let e = light.observe(&scene, point, normal).expect("both see the wall").value().x;
        let (probe, cell) = light.finest(&scene, point, normal).expect("the first is near");
        (e / TAU, light.of_cell(&scene, probe, cell).x / TAU)
    };
    // the near probe is overexposed at gain 1: there is more light than that
    let [white, grey] = [1.0, 0.5].map(|value| even(64, 32, Vec3::splat(value)));
    let longer = Radiometry { gain: Vec3::splat(6.0), ..code };
    let (near, far) = (hits(1.0), hits(2.5));
    let close = |got: (f32, f32), e: f32| assert!((got.0 - e).abs() < 1e-3 && (got.1 - e).abs() < 1e-3, "{got:?} {e}");
    close(at(&[(near.clone(), &white, code), (far.clone(), &grey, longer)]), 3.0);
    // where all are clipped, the greatest bound is the best there is
    close(at(&[(near.clone(), &white, code), (far.clone(), &white, longer)]), 6.0);
    close(at(&[(near.clone(), &white, code)]), 1.0);
    // values without an end are light, however high
    let hdr = Radiometry::default();
    assert!((at(&[(near, &white, hdr), (far, &grey, longer)]).0 - 1.0).abs() < 0.3);
}

#[test]
fn a_channel_that_is_not_reflected_takes_the_light_of_the_others() {
    let mut scene = closed_box(Vec3::ZERO, Vec3::splat(4.0), 0.5);
    scene.materials[0].albedo = Vec3::new(0.108, 0.011, 0.0);
    let hits = Hits::shoot(&scene, Vec3::splat(2.0), Mat3::IDENTITY, Chart::latlong(64, 32));
    let light = lit(&scene, hits, &even(64, 32, Vec3::new(0.108, 0.022, 0.0)));
    let e = light.observe(&scene, Vec3::new(0.0, 2.1, 1.9), Vec3::X).expect("the wall is seen").value() / PI;
    assert!((e - Vec3::new(1.0, 2.0, 1.5)).abs().max_element() < 5e-3, "red paint is not black: {e}");
}

/// The model's window begins a tenth of a cell late, so that the cells at its edge caught some sky: eleven times the wall's light.
#[test]
fn sky_that_a_cell_caught_beside_a_window_does_not_light_the_wall() {
    let wall = (Vec3::new(-5.0, 2.0, -5.0), Vec3::X * 5.0, Vec3::Z * 10.0);
    let scene = grey(parallelograms(&[wall]), 0.5);
    let shot = |sky: f32, caught: f32| {
        let light = |x: usize| match x {
            0..23 => 0.2,
            23 => 0.2 + caught,
            _ => sky,
        };
        let picture =
            Picture { width: 48, height: 48, pixels: (0..48 * 48).map(|i| Vec3::splat(light(i % 48))).collect() };
        lit(&scene, Hits::shoot(&scene, Vec3::ZERO, Mat3::IDENTITY, Chart::perspective(48, 48, 1.0)), &picture)
    };
    let cell = 2.0 * 2.0 * 0.5f32.tan() / 48.0;
    let of = |light: &Light, cells: f32| {
        let seen = light.observe(&scene, Vec3::new(-cells * cell, 2.0, 0.1), Vec3::NEG_Y);
        seen.map(|o| o.value().x / (0.2 * PI / 0.5))
    };
    let bright = shot(20.0, 2.0);
    for cells in [0.2, 0.5, 0.8, 1.2, 2.5] {
        let got = of(&bright, cells);
        assert!(got.is_none_or(|e| e > 0.95 && e < 2.0), "{cells} cells from the edge: {got:?}");
    }
    assert!(of(&bright, 1.2).is_some());
    // what is no brighter than the wall takes nothing from it
    let even = shot(0.2, 0.0);
    assert!([0.2, 0.5, 2.5].iter().all(|c| of(&even, *c).is_some_and(|e| (e - 1.0).abs() < 1e-3)));
}

/// A few records of many speak for what no probe sees; which they are hangs on none of the others.
#[test]
fn a_record_less_leaves_the_others_chosen() {
    const SOME: usize = 100;
    let scene = closed_box(Vec3::ZERO, Vec3::splat(4.0), 0.5);
    let hits = Arc::new(Hits::shoot(&scene, Vec3::splat(2.0), Mat3::IDENTITY, Chart::latlong(64, 32)));
    let chosen = |bad: Option<usize>| -> Vec<Vec3> {
        let mut picture = even(64, 32, Vec3::ONE);
        bad.into_iter().for_each(|i| picture.pixels[i] = Vec3::NAN);
        let measured = measured(&hits.chart, &picture, &Radiometry::default());
        let records = [0, 1].map(|_| Records::new(&scene, hits.clone(), &measured, None));
        shaded(&records, SOME).map(|r| r.0).collect()
    };
    let all = chosen(None);
    assert!(all.len().abs_diff(SOME) <= SOME / 10, "{}", all.len());
    // at the first row all records of a corner hang on one pixel
    for bad in [0, 64 * 16 + 20, 64 * 32 - 1] {
        let fewer = chosen(Some(bad));
        let lost = all.iter().filter(|place| !fewer.contains(place)).count();
        let new = fewer.iter().filter(|place| !all.contains(place)).count();
        assert!(lost + new <= 4, "pixel {bad}: {lost} lost, {new} new");
    }
}

/// A floor and a table under an even sky that neither the site nor the photograph shows: the light on the floor tells how
/// bright it is.
#[test]
fn the_open_top_of_a_scan_sends_what_records_ask_for() {
    let floor = (Vec3::new(-5.0, -5.0, 0.0), Vec3::X * 10.0, Vec3::Y * 10.0);
    let table = (Vec3::new(-6.0, -6.0, 0.5), Vec3::X * 0.5, Vec3::Y * 0.5);
    let scene = grey(parallelograms(&[floor, table]), 0.5);
    // straight down; under a sky of radiance 3 the floor sends 1.5
    let down = Mat3::from_rotation_x(-0.5 * PI);
    let hits = Hits::shoot(&scene, Vec3::new(0.0, 0.0, 2.0), down, Chart::perspective(48, 48, 1.0));
    let light = lit(&scene, hits, &even(48, 48, Vec3::splat(1.5)));
    let beyond = light.beyond(&scene, Vec3::Z);
    assert!((beyond - 3.0).abs().max_element() < 0.03, "{beyond}");
    // what the photograph does not show takes the light of what it shows
    let (aside, up) = (Vec3::new(4.0, 3.0, 0.0), Vec3::Z);
    assert!(light.observe(&scene, aside, up).is_none());
    let e = light.seen_neighbour(&scene, aside, up).expect("the floor is in sight");
    assert!((e / (3.0 * PI) - 1.0).abs().max_element() < 1e-3, "{e}");
    assert!(light.seen_neighbour(&scene, aside, -up).is_none(), "nothing faces down");
    // the volume guesses as much, and says that it is a guess; a picture takes the neighbour
    let settings = volume::VolumeSettings { cells: 16, rays: 64, ..volume::VolumeSettings::default() };
    let transport = Transport::cast(&scene, &[(aside, up)], &[&light], &settings);
    let volume = Volume::new(&scene, &transport, &light);
    let guess = volume.irradiance(&scene, aside, up, &mut Nearby::default()).expect("it was wanted");
    assert!(guess.is_guess() && volume.is_open(), "{guess:?}");
    assert!((guess.irradiance / (3.0 * PI) - 1.0).abs().max_element() < 0.05, "{guess:?}");
    let relit = Relit { scene: &scene, light: &light, volume: Some(&volume), volume_only: false };
    let there = relit.lit(aside, up, &mut Nearby::default());
    assert_eq!((there.source, there.shade), (Source::Neighbour, e));
}

/// A room with a window, behind which the probe sees a sky over the ground: more of both is there than it sees.
#[test]
fn what_a_window_shows_to_no_probe_is_as_what_is_seen_beside_it() {
    let (x, y, z) = (Vec3::X * 4.0, Vec3::Y * 4.0, Vec3::Z * 4.0);
    let whole = [(Vec3::ZERO, x, y), (z, x, y), (Vec3::ZERO, x, z), (Vec3::ZERO, y, z), (y, x, z)];
    // the wall at x = 4 has an opening of a metre
    let wall = |low: [f32; 2], high: [f32; 2]| {
        (Vec3::new(4.0, low[0], low[1]), Vec3::Y * (high[0] - low[0]), Vec3::Z * (high[1] - low[1]))
    };
    let around = [
        wall([0.0, 0.0], [4.0, 1.5]),
        wall([0.0, 2.5], [4.0, 4.0]),
        wall([0.0, 1.5], [1.5, 2.5]),
        wall([2.5, 1.5], [4.0, 2.5]),
    ];
    let scene = grey(parallelograms(&[&whole[..], &around].concat()), 0.5);
    let chart = Chart::latlong(256, 128);
    let mut picture = even(256, 128, Vec3::ONE);
    let hits = Hits::shoot(&scene, Vec3::splat(2.0), Mat3::IDENTITY, chart.clone());
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        let (column, row) = ((i % 256) as f32 + 0.5, (i / 256) as f32 + 0.5);
        let elevation = PI * (0.5 - row / 128.0);
        let ahead = (column / 256.0 - 0.5).abs() * TAU;
        // straight ahead is along y: the window is to one side of it
        if elevation.abs() < 0.5 && (ahead - 0.5 * PI).abs() < 0.5 {
            *pixel = if elevation > 0.0 { Vec3::new(20.0, 30.0, 40.0) } else { Vec3::new(4.0, 3.0, 2.0) };
        }
    }
    let light = lit(&scene, hits, &picture);
    let [up, down] = [0.8, -0.8].map(|z| Vec3::new(0.6, 0.0, z));
    assert!([up, down].iter().all(|d| light.told_sky(*d).is_none()));
    assert!((light.beyond(&scene, up) / Vec3::new(20.0, 30.0, 40.0) - 1.0).abs().max_element() < 1e-3);
    assert!((light.beyond(&scene, down) / Vec3::new(4.0, 3.0, 2.0) - 1.0).abs().max_element() < 1e-3);
    // what is not told is no part of a picture
    assert_eq!(light.sky(up), Vec3::ZERO);
}

proptest! {
    #[test]
    fn weights_sum_to_one_and_cells_exist(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..1.0, which in 0usize..9) {
        let d = Vec3::new(x, y, z);
        prop_assume!(d.length() > 1e-3);
        let chart = &charts()[which];
        if let Some(place) = chart.place(d) {
            let around = chart.around(place);
            let sum: f32 = around.iter().map(|a| a.1).sum();
            prop_assert!((sum - 1.0).abs() < 1e-4, "{around:?}");
            for (cell, weight) in around {
                prop_assert!(cell < chart.len() && (-1e-4..=1.0001).contains(&weight));
            }
        }
    }

    #[test]
    fn packed_normals_are_close(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..1.0) {
        let n = Vec3::new(x, y, z);
        prop_assume!(n.length() > 1e-3);
        let n = n.normalize();
        let back = unpack_normal(pack_normal(n));
        let angle = 2.0 * (0.5 * n.distance(back)).asin();
        prop_assert!(angle.to_degrees() < 0.004, "{n} {back}: {}°", angle.to_degrees());
    }

    /// In any box that is not too flat for the probe's pixels, of any albedo, from any place inside: E = πL/ρ on every
    /// wall.
    #[test]
    fn records_of_a_furnace_are_its_irradiance(
        size in prop::array::uniform3(2.0f32..4.0),
        at in prop::array::uniform3(0.2f32..0.8),
        albedo in 0.001f32..1.0,
        wall in 0usize..6,
        on in prop::array::uniform2(0.1f32..0.9),
    ) {
        let (high, at) = (Vec3::from(size), Vec3::from(at) * Vec3::from(size));
        let scene = closed_box(Vec3::ZERO, high, albedo);
        let chart = Chart::latlong(64, 32);
        let hits = Arc::new(Hits::shoot(&scene, at, Mat3::from_rotation_z(0.4), chart));
        prop_assert_eq!(hits.count(), hits.chart.len());
        let picture = even(64, 32, Vec3::new(1.0, 2.0, 0.5));
        let radiometry = Radiometry { gain: Vec3::splat(2.0), ..Radiometry::default() };
        let light = Light::new(&scene, [(hits, &picture, radiometry)], None, None);
        let axis = wall / 2;
        let (mut point, mut normal) = (Vec3::ZERO, Vec3::ZERO);
        point[(axis + 1) % 3] = on[0] * high[(axis + 1) % 3];
        point[(axis + 2) % 3] = on[1] * high[(axis + 2) % 3];
        point[axis] = if wall % 2 == 0 { 0.0 } else { high[axis] };
        normal[axis] = if wall % 2 == 0 { 1.0 } else { -1.0 };
        let e = light.observe(&scene, point, normal).expect("the wall is seen").value();
        let expected = PI * Vec3::new(2.0, 4.0, 1.0) / albedo;
        // albedo is kept in 65535 steps
        prop_assert!(((e / expected) - 1.0).abs().max_element() < 1e-3 + 1.0 / (65535.0 * albedo), "{e} {expected}");
        prop_assert!(light.observe(&scene, point, -normal).is_none(), "the other side is not seen");
    }
}
