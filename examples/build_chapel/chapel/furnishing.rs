//! Columns, loft and stair, benches, altar, paintings and what stands in the niches.

use glam::{DVec3, dvec2, dvec3};
use std::f64::consts::TAU;

use super::Version;
use super::building::{AISLE, APSE_FLOOR, CAPITAL, NICHE_SILL, ROSE, apse_side};
use super::finish::*;
use crate::common::mesh::{Finish, Model};
use crate::common::parts::{Painting, Plane, Side, cuboid, painting, rectangle, revolve, tube};

/// How far the middle column stands from its true place in the faulty model, metres along +x.
pub const COLUMN_MOVED: f64 = 0.1;
/// How far the vine north of the altar is moved to the right in the faulty model, metres.
pub const VINE_SHIFTED: f64 = 0.12;

/// All that is not wall, vault, floor or roof.
pub fn build(m: &mut Model, version: Version) {
    columns(m, version);
    rose(m);
    loft(m);
    stair(m);
    benches(m);
    chancel(m);
    lamp(m);
    aisle_pieces(m, version);
    sacristy_pieces(m);
    paintings(m, version);
    if version.faulty() {
        m.object("crate");
        cuboid(m, &CRATE, dvec3(10.1, 0.0, -0.9), dvec3(10.6, 0.45, -0.35), &[Side::Bottom]);
    }
}

fn columns(m: &mut Model, version: Version) {
    for (k, x) in [3.0, 6.0, 9.0].into_iter().enumerate() {
        m.object(&format!("column_{}", k + 1));
        let moved = if version.faulty() && k == 1 { COLUMN_MOVED } else { 0.0 };
        let at = dvec3(x + moved, 0.0, -3.25);
        let block = |m: &mut Model, half: [f64; 2], y: [f64; 2], without: &[Side]| {
            let (low, high) = (dvec3(-half[0], y[0], -half[1]), dvec3(half[0], y[1], half[1]));
            cuboid(m, &CARVED, at + low, at + high, without);
        };
        block(m, [0.34, 0.34], [0.0, 0.14], &[Side::Bottom]);
        let base = [[0.33, 0.14], [0.335, 0.17], [0.33, 0.2], [0.29, 0.22], [0.27, 0.25], [0.285, 0.28], [0.25, 0.3]];
        revolve(m, &CARVED, at, &base, 24);
        let shaft = [[0.25, 0.3], [0.25, 0.8], [0.247, 1.3], [0.238, 1.8], [0.225, 2.14]];
        revolve(m, &MARBLE, at, &shaft, 24);
        let capital = [
            [0.225, 2.14],
            [0.25, 2.16],
            [0.25, 2.19],
            [0.23, 2.21],
            [0.24, 2.3],
            [0.27, 2.4],
            [0.32, 2.5],
            [0.33, 2.55],
        ];
        revolve(m, &CARVED, at, &capital, 24);
        block(m, [0.37, 0.37], [2.55, CAPITAL], &[]);
        if moved > 0.0 {
            // what the abacus no longer covers of the wall above
            rectangle(m, &ASHLAR, Side::Bottom, dvec3(x - 0.3, CAPITAL, -3.5), dvec3(x + moved - 0.37, CAPITAL, -3.0));
        }
    }
}

/// Stone tracery in the rose window: a ring, eight spokes and eight rings around it.
fn rose(m: &mut Model) {
    m.object("rose_tracery");
    let plane = ROSE - DVec3::X * 0.45;
    let circle = |centre: DVec3, radius: f64, n: usize| -> Vec<DVec3> {
        (0..n)
            .map(|i| {
                let a = TAU * i as f64 / n as f64;
                centre + dvec3(0.0, a.sin(), a.cos()) * radius
            })
            .collect()
    };
    tube(m, &CARVED, &circle(plane, 0.24, 20), 0.032, 6, true, DVec3::X);
    for k in 0..8 {
        let a = TAU * (f64::from(k) + 0.5) / 8.0;
        let out = dvec3(0.0, a.sin(), a.cos());
        tube(m, &CARVED, &[plane + out * 0.24, plane + out * 1.02], 0.026, 6, false, DVec3::X);
        let b = TAU * f64::from(k) / 8.0;
        let petal = plane + dvec3(0.0, b.sin(), b.cos()) * 0.64;
        tube(m, &CARVED, &circle(petal, 0.2, 16), 0.022, 5, true, DVec3::X);
    }
}

fn baluster(m: &mut Model, at: DVec3) {
    let profile = [[0.03, 0.08], [0.03, 0.2], [0.045, 0.32], [0.025, 0.55], [0.03, 0.8]];
    revolve(m, &WOOD, at, &profile, 8);
}

/// A gallery at the west end with a balustrade, on two posts.
fn loft(m: &mut Model) {
    m.object("loft");
    let (low, high) = (dvec3(0.0, 2.7, -2.98), dvec3(2.3, 2.9, 3.0));
    cuboid(m, &WOOD, low, high, &[Side::West, Side::South]);
    for z in [-1.2, 1.2] {
        cuboid(m, &WOOD, dvec3(2.02, 0.0, z - 0.08), dvec3(2.18, 2.5, z + 0.08), &[Side::Bottom, Side::Top]);
    }
    cuboid(m, &WOOD, dvec3(2.0, 2.5, -2.98), dvec3(2.2, 2.7, 2.2), &[Side::Top]);
    m.object("balustrade");
    let floor = high.y;
    let mut rail = |x: [f64; 2], z: [f64; 2]| {
        for y in [[0.0, 0.08], [0.8, 0.9]] {
            cuboid(m, &WOOD, dvec3(x[0], floor + y[0], z[0]), dvec3(x[1], floor + y[1], z[1]), &[]);
        }
    };
    rail([2.18, 2.26], [-2.94, 2.14]);
    rail([0.0, 2.18], [-2.94, -2.86]);
    (0..18).for_each(|k| baluster(m, dvec3(2.22, floor, -2.76 + 0.28 * f64::from(k))));
    (0..7).for_each(|k| baluster(m, dvec3(0.25 + 0.28 * f64::from(k), floor, -2.9)));
}

/// Fourteen steps along the south wall up to the loft, with a handrail.
fn stair(m: &mut Model) {
    m.object("stair");
    let (foot, going, rise, z) = (5.66, 0.24, 2.9 / 15.0, [2.2, 3.0]);
    for k in 0..14 {
        let x = [foot - going * f64::from(k + 1), foot - going * f64::from(k)];
        let top = rise * f64::from(k + 1);
        rectangle(m, &WOOD, Side::Top, dvec3(x[0], top, z[0]), dvec3(x[1], top, z[1]));
        rectangle(m, &WOOD, Side::East, dvec3(x[1], top - rise, z[0]), dvec3(x[1], top, z[1]));
        rectangle(m, &PLASTER, Side::North, dvec3(x[0], 0.0, z[0]), dvec3(x[1], top, z[0]));
        if k % 3 == 0 {
            let middle = 0.5 * (x[0] + x[1]);
            cuboid(
                m,
                &WOOD,
                dvec3(middle - 0.02, top, z[0] + 0.04),
                dvec3(middle + 0.02, top + 0.9, z[0] + 0.08),
                &[Side::Bottom],
            );
        }
    }
    rectangle(m, &PLASTER, Side::West, dvec3(2.3, 0.0, z[0]), dvec3(2.3, 14.0 * rise, z[1]));
    let rail = |x: f64| dvec3(x, (foot - x) / going * rise + 1.0, z[0] + 0.06);
    tube(m, &WOOD, &[rail(foot - 0.05), rail(2.35)], 0.035, 8, false, DVec3::Y);
}

/// Four rows of benches on either side of the middle way, facing east.
fn benches(m: &mut Model) {
    m.object("benches");
    for row in 0..4 {
        let x = 6.0 + 0.85 * f64::from(row);
        for z in [[-2.5, -0.65], [0.65, 2.5]] {
            let mut board = |low: [f64; 2], high: [f64; 2], z: [f64; 2]| {
                cuboid(m, &WOOD, dvec3(x + low[0], low[1], z[0]), dvec3(x + high[0], high[1], z[1]), &[Side::Bottom]);
            };
            for end in [[z[0], z[0] + 0.06], [z[1] - 0.06, z[1]]] {
                board([0.0, 0.0], [0.42, 0.46], end);
                board([0.0, 0.46], [0.08, 0.92], end);
            }
            let inside = [z[0] + 0.06, z[1] - 0.06];
            board([0.05, 0.4], [0.44, 0.45], inside);
            board([0.02, 0.45], [0.06, 0.9], inside);
        }
    }
}

/// The altar with its linen, two candlesticks and a bowl.
fn chancel(m: &mut Model) {
    m.object("altar");
    let floor = APSE_FLOOR;
    cuboid(m, &CARVED, dvec3(13.0, floor, -0.75), dvec3(13.55, floor + 0.9, 0.75), &[Side::Bottom, Side::Top]);
    cuboid(m, &CARVED, dvec3(12.9, floor + 0.9, -0.9), dvec3(13.65, floor + 1.0, 0.9), &[]);
    let cloth = floor + 1.0;
    cuboid(m, &LINEN, dvec3(12.88, cloth, -0.45), dvec3(13.67, cloth + 0.012, 0.45), &[Side::Bottom]);
    cuboid(m, &LINEN, dvec3(12.88, cloth - 0.35, -0.45), dvec3(12.9, cloth, 0.45), &[Side::Top, Side::East]);
    let stick = [
        [0.1, 0.0],
        [0.1, 0.02],
        [0.03, 0.05],
        [0.02, 0.12],
        [0.04, 0.15],
        [0.02, 0.18],
        [0.025, 0.4],
        [0.06, 0.43],
        [0.06, 0.45],
        [0.0, 0.45],
    ];
    let candle = [[0.022, 0.45], [0.022, 0.72], [0.0, 0.74]];
    for z in [-0.62, 0.62] {
        let at = dvec3(13.4, cloth, z);
        revolve(m, &BRASS, at, &stick, 12);
        revolve(m, &LINEN, at, &candle, 8);
    }
    let bowl =
        [[0.07, 0.012], [0.03, 0.05], [0.03, 0.1], [0.1, 0.17], [0.13, 0.25], [0.115, 0.25], [0.08, 0.17], [0.0, 0.13]];
    revolve(m, &BRASS, dvec3(13.25, cloth, 0.0), &bowl, 16);
}

/// A lamp on a rod from the crown of the vault.
fn lamp(m: &mut Model) {
    m.object("lamp");
    let at = dvec3(10.6, 3.3, 0.0);
    let body = [
        [0.0, 0.0],
        [0.03, 0.02],
        [0.02, 0.06],
        [0.09, 0.12],
        [0.16, 0.22],
        [0.17, 0.32],
        [0.14, 0.4],
        [0.15, 0.42],
        [0.05, 0.5],
        [0.02, 0.6],
        [0.0, 0.62],
    ];
    revolve(m, &BRASS, at, &body, 20);
    tube(m, &BRASS, &[at + DVec3::Y * 0.6, dvec3(at.x, 7.6, 0.0)], 0.012, 5, false, DVec3::Z);
}

/// The font, the saint and the vase in the niches, and a plaque.
fn aisle_pieces(m: &mut Model, version: Version) {
    m.object("font");
    let font = [
        [0.34, 0.0],
        [0.34, 0.12],
        [0.2, 0.16],
        [0.16, 0.3],
        [0.16, 0.5],
        [0.22, 0.58],
        [0.42, 0.72],
        [0.44, 0.95],
        [0.38, 0.95],
        [0.34, 0.84],
        [0.0, 0.8],
    ];
    revolve(m, &CARVED, dvec3(1.5, 0.0, -4.45), &font, 16);
    m.object("saint");
    revolve(m, &CARVED, AISLE.at(4.5, NICHE_SILL, 0.16), &SAINT, 24);
    if !version.faulty() {
        m.object("vase");
        revolve(m, &GLAZE, AISLE.at(10.5, NICHE_SILL, 0.14), &VASE, 24);
        m.object("plaque");
        let (low, high) = (dvec3(8.85, 1.45, -5.4), dvec3(9.35, 1.95, -5.35));
        cuboid(m, &CARVED, low, high, &[Side::North, Side::South]);
        let corners = [[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]];
        let metres = corners.map(|[x, y]| dvec2(x - low.x, y - low.y));
        m.face_towards(&PLAQUE, DVec3::Z, &corners.map(|[x, y]| dvec3(x, y, high.z)), &metres);
    }
}

/// A robed figure: foot, folds, shoulders, neck, head.
const SAINT: [[f64; 2]; 24] = [
    [0.22, 0.0],
    [0.22, 0.08],
    [0.17, 0.08],
    [0.175, 0.14],
    [0.16, 0.26],
    [0.15, 0.4],
    [0.135, 0.52],
    [0.125, 0.6],
    [0.14, 0.68],
    [0.165, 0.78],
    [0.175, 0.86],
    [0.16, 0.93],
    [0.11, 0.98],
    [0.06, 1.0],
    [0.045, 1.03],
    [0.055, 1.05],
    [0.075, 1.09],
    [0.085, 1.14],
    [0.08, 1.19],
    [0.06, 1.23],
    [0.1, 1.2],
    [0.1, 1.215],
    [0.04, 1.25],
    [0.0, 1.26],
];

/// A bellied vase with a lip.
const VASE: [[f64; 2]; 16] = [
    [0.1, 0.0],
    [0.11, 0.02],
    [0.09, 0.05],
    [0.13, 0.14],
    [0.19, 0.26],
    [0.215, 0.38],
    [0.2, 0.5],
    [0.14, 0.6],
    [0.085, 0.68],
    [0.075, 0.76],
    [0.09, 0.82],
    [0.13, 0.86],
    [0.12, 0.87],
    [0.08, 0.82],
    [0.06, 0.74],
    [0.0, 0.7],
];

/// A cupboard, a table with a jug and a chest.
fn sacristy_pieces(m: &mut Model) {
    m.object("sacristy_furniture");
    cuboid(m, &WOOD, dvec3(8.82, 0.0, 4.3), dvec3(9.3, 1.9, 5.5), &[Side::Bottom]);
    for z in [[4.34, 4.88], [4.92, 5.46]] {
        cuboid(m, &WOOD, dvec3(9.3, 0.1, z[0]), dvec3(9.325, 1.8, z[1]), &[Side::West]);
    }
    let table = [dvec3(10.75, 0.72, 4.5), dvec3(11.5, 0.78, 5.9)];
    cuboid(m, &WOOD, table[0], table[1], &[]);
    for (x, z) in [(10.8, 4.55), (11.38, 4.55), (10.8, 5.78), (11.38, 5.78)] {
        let leg = [dvec3(x, 0.0, z), dvec3(x + 0.07, table[0].y, z + 0.07)];
        cuboid(m, &WOOD, leg[0], leg[1], &[Side::Bottom, Side::Top]);
    }
    let jug =
        [[0.07, 0.0], [0.11, 0.08], [0.12, 0.16], [0.07, 0.26], [0.06, 0.3], [0.08, 0.34], [0.06, 0.32], [0.0, 0.28]];
    revolve(m, &GLAZE, dvec3(11.1, table[1].y, 5.0), &jug, 16);
}

fn paintings(m: &mut Model, version: Version) {
    let faulty = version.faulty();
    // along to the right of a person who looks south
    let south = |x: f64| Plane { origin: dvec3(x, 0.0, 3.0), along: DVec3::NEG_X, normal: DVec3::NEG_Z };
    let mut hang = |name: &str, plane: Plane, height: f64, finish: &'static Finish, flip: bool, shift: f64| {
        m.object(name);
        painting(m, &WOOD, &Painting { plane, centre: dvec2(0.0, height), finish, flip, shift });
    };
    hang("painting_ship", south(6.0), 2.3, &SHIP, faulty, 0.0);
    let rosette = if faulty { &ROSETTE_RECOLOURED } else { &ROSETTE };
    hang("painting_rosette", south(10.2), 3.15, rosette, false, 0.0);
    hang("painting_vine_north", apse_side(0), 2.3, &VINE, false, if faulty { VINE_SHIFTED } else { 0.0 });
    hang("painting_mandorla", apse_side(2), 2.5, &MANDORLA, false, 0.0);
    hang("painting_vine_south", apse_side(4), 2.3, &VINE, true, 0.0);
}
