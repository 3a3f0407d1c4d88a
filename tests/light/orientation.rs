//! Which way is which, against OpenEXR's own orientation charts.
//!
//! The charts label their axes: right-handed, y up. In the latitude/longitude chart the centre column shows +Z, a quarter
//! to its right −X, the top row +Y. So OpenEXR's frame turns into ours (+x right, +y forward, +z up) by x = −X, y = +Z,
//! z = +Y: a rotation, no mirror. The cube chart stacks its faces as +X, −X, +Y, −Y, +Z, −Z, each seen from inside with
//! Y up; +Y has Z up, −Y has Z down.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use crate::support::data::shared;
use clerestory::panorama::{Panorama, Picture, Projection, convert, read};
use glam::{DMat3, Vec3};

fn chart(name: &str) -> Option<Picture> {
    shared(&format!("hdr/{name}")).map(|path| read(&path).unwrap())
}

/// The latitude/longitude chart at half its size, to be quick.
fn latlong_chart() -> Option<Picture> {
    let panorama = Panorama::new(chart("OrientationLatLong.exr")?, Projection::LatLong, DMat3::IDENTITY);
    Some(convert(&panorama, Projection::LatLong, 512, 256))
}

/// Copies a face of the stacked cube to a cell of a cross, turned by 180° where told.
fn paste(cross: &mut Picture, cube: &Picture, face: usize, (column, row): (usize, usize), turned: bool) {
    let side = cube.width;
    for (x, y) in (0..side * side).map(|i| (i % side, i / side)) {
        let (fx, fy) = if turned { (side - 1 - x, side - 1 - y) } else { (x, y) };
        let to = (row * side + y) * cross.width + column * side + x;
        cross.pixels[to] = cube.pixels[(face * side + fy) * side + fx];
    }
}

const POS_X: usize = 0;
const NEG_X: usize = 1;
const POS_Y: usize = 2;
const NEG_Y: usize = 3;
const POS_Z: usize = 4;
const NEG_Z: usize = 5;

/// The chart as a cross whose front shows +Z: right −X, left +X. Above and below front, the cross's faces have front's
/// right for right; the chart's ±Y have +X for right, so they are turned.
fn cross(cube: &Picture, vertical: bool) -> Picture {
    let side = cube.width;
    let mut cross = if vertical { Picture::new(3 * side, 4 * side) } else { Picture::new(4 * side, 3 * side) };
    paste(&mut cross, cube, POS_Y, (1, 0), true);
    paste(&mut cross, cube, POS_X, (0, 1), false);
    paste(&mut cross, cube, POS_Z, (1, 1), false);
    paste(&mut cross, cube, NEG_X, (2, 1), false);
    paste(&mut cross, cube, NEG_Y, (1, 2), true);
    if vertical {
        paste(&mut cross, cube, NEG_Z, (1, 3), true);
    } else {
        paste(&mut cross, cube, NEG_Z, (3, 1), false);
    }
    cross
}

/// Correlation of two pictures' brightness over the sphere.
fn correlation(a: &Picture, b: &Picture) -> f64 {
    let weight = |i: usize| Projection::LatLong.solid_angle(a.width, a.height, 0, i / a.width);
    let grey = |p: Vec3| f64::from(p.x + p.y + p.z);
    let sum = |f: &dyn Fn(usize) -> f64| (0..a.pixels.len()).map(|i| weight(i) * f(i)).sum::<f64>();
    let total = sum(&|_| 1.0);
    let mean = |p: &Picture| sum(&|i| grey(p.pixels[i])) / total;
    let (ma, mb) = (mean(a), mean(b));
    let product =
        |p: &Picture, mp: f64, q: &Picture, mq: f64| sum(&|i| (grey(p.pixels[i]) - mp) * (grey(q.pixels[i]) - mq));
    product(a, ma, b, mb) / (product(a, ma, a, ma) * product(b, mb, b, mb)).sqrt()
}

fn latlong_of(cross: Picture, width: usize, height: usize) -> Picture {
    convert(&Panorama::new(cross, Projection::CubeCross, DMat3::IDENTITY), Projection::LatLong, width, height)
}

#[test]
fn the_cube_chart_unfolds_into_the_latlong_chart() {
    let (Some(latlong), Some(cube)) = (latlong_chart(), chart("OrientationCube.exr")) else { return };
    for vertical in [true, false] {
        let got = latlong_of(cross(&cube, vertical), latlong.width, latlong.height);
        let alike = correlation(&got, &latlong);
        println!("vertical cross {vertical}: correlation {alike:.4}");
        assert!(alike > 0.9, "vertical cross {vertical}: correlation {alike}");
    }
}

#[test]
fn any_other_way_round_does_not_match() {
    let (Some(latlong), Some(cube)) = (latlong_chart(), chart("OrientationCube.exr")) else { return };
    let right = cross(&cube, true);
    let mut mirrored = right.clone();
    for row in mirrored.pixels.chunks_mut(right.width) {
        row.reverse();
    }
    let mut poles_not_turned = right.clone();
    paste(&mut poles_not_turned, &cube, POS_Y, (1, 0), false);
    paste(&mut poles_not_turned, &cube, NEG_Y, (1, 2), false);
    let mut back_not_turned = right.clone();
    paste(&mut back_not_turned, &cube, NEG_Z, (1, 3), false);
    let mut sides_swapped = right.clone();
    paste(&mut sides_swapped, &cube, NEG_X, (0, 1), false);
    paste(&mut sides_swapped, &cube, POS_X, (2, 1), false);
    let best = correlation(&latlong_of(right, latlong.width, latlong.height), &latlong);
    for wrong in [mirrored, poles_not_turned, back_not_turned, sides_swapped] {
        let alike = correlation(&latlong_of(wrong, latlong.width, latlong.height), &latlong);
        println!("wrong way round: correlation {alike:.4}, right: {best:.4}");
        assert!(alike < best - 0.02, "{alike} for {best}");
    }
}

#[test]
fn the_chart_survives_every_projection() {
    let Some(latlong) = latlong_chart() else { return };
    let panorama = Panorama::new(latlong.clone(), Projection::LatLong, DMat3::IDENTITY);
    for (projection, width, height) in
        [(Projection::Angular, 512, 512), (Projection::MirrorBall, 1024, 1024), (Projection::CubeCross, 512, 384)]
    {
        let there = convert(&panorama, projection, width, height);
        let back = convert(&Panorama::new(there, projection, DMat3::IDENTITY), Projection::LatLong, 512, 256);
        let alike = correlation(&back, &latlong);
        println!("{projection:?} and back: correlation {alike:.4}");
        assert!(alike > 0.9, "{projection:?}: {alike}");
    }
}
