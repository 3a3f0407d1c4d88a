//! Pictures for the finishes: stone, brick, wood, plaster and paintings, from seeded noise and plain shapes.
//!
//! Colours are linear albedos, u runs right and v up, both 0..1 over the picture.

use crate::common::pattern::{bond, cloud, hash, inside_polygon, jpeg, painted, polar, star};
use glam::{DVec2, DVec3, dvec2, dvec3};
use image::ImageResult;
use std::f64::consts::{PI, TAU};

/// The colour at a point of a picture.
type Paint = fn(DVec2) -> DVec3;

/// Every picture: file name, size in pixels and what is on it.
const PICTURES: [(&str, [u32; 2], Paint); 14] = [
    ("ashlar.jpg", [512, 512], ashlar),
    ("plaster.jpg", [256, 256], plaster),
    ("brick.jpg", [512, 512], brick),
    ("flag.jpg", [256, 256], flag),
    ("marble.jpg", [256, 256], marble),
    ("wood.jpg", [256, 256], wood),
    ("frieze.jpg", [512, 128], frieze),
    ("stars.jpg", [192, 192], stars),
    ("ship.jpg", [240, 300], ship),
    ("rosette.jpg", [256, 256], rosette),
    ("rosette_recoloured.jpg", [256, 256], rosette_recoloured),
    ("vine.jpg", [192, 384], vine),
    ("mandorla.jpg", [216, 384], mandorla),
    ("plaque.jpg", [128, 128], plaque),
];

/// The JPEG file of the picture with this name, if there is one.
pub fn picture(name: &str) -> Option<ImageResult<Vec<u8>>> {
    let (_, [width, height], paint) = PICTURES.into_iter().find(|p| p.0 == name)?;
    Some(jpeg(&painted([width, height], 3, paint), 88))
}

fn ashlar(p: DVec2) -> DVec3 {
    let (block, edge) = bond(p, dvec2(2.0, 2.0), dvec2(0.5, 0.25));
    let tone = hash(block[0], block[1], 11);
    let warm = hash(block[0], block[1], 12);
    let stone = dvec3(0.5, 0.44, 0.34).lerp(dvec3(0.56, 0.46, 0.33), warm) * (0.78 + 0.34 * tone);
    let grain = 1.0 + 0.16 * cloud(p, [16, 16], 4, 13) + 0.1 * cloud(p, [4, 4], 3, 14);
    let mortar = dvec3(0.36, 0.33, 0.28) * (1.0 + 0.1 * cloud(p, [64, 64], 2, 15));
    if edge < 0.007 { mortar } else { stone * grain }
}

fn plaster(p: DVec2) -> DVec3 {
    let stain = 0.5 + 0.5 * cloud(p, [3, 3], 4, 21);
    let base = dvec3(0.72, 0.67, 0.58).lerp(dvec3(0.6, 0.53, 0.43), stain.clamp(0.0, 1.0));
    base * (1.0 + 0.05 * cloud(p, [24, 24], 3, 22))
}

fn brick(p: DVec2) -> DVec3 {
    let (block, edge) = bond(p, dvec2(1.2, 1.2), dvec2(0.3, 0.1));
    let tone = hash(block[0], block[1], 31);
    let fired = hash(block[0], block[1], 32);
    let clay = dvec3(0.44, 0.19, 0.115).lerp(dvec3(0.36, 0.2, 0.16), fired) * (0.62 + 0.6 * tone);
    let mortar = dvec3(0.48, 0.44, 0.37) * (1.0 + 0.1 * cloud(p, [64, 64], 2, 34));
    if edge < 0.006 { mortar } else { clay * (1.0 + 0.2 * cloud(p, [24, 24], 4, 33)) }
}

fn flag(p: DVec2) -> DVec3 {
    let (block, edge) = bond(p, dvec2(1.2, 1.2), dvec2(0.6, 0.6));
    let tone = hash(block[0], block[1], 41);
    let stone = dvec3(0.4, 0.385, 0.35) * (0.8 + 0.35 * tone) * (1.0 + 0.2 * cloud(p, [8, 8], 5, 42));
    if edge < 0.006 { dvec3(0.24, 0.22, 0.19) } else { stone }
}

fn marble(p: DVec2) -> DVec3 {
    let warp = dvec2(cloud(p, [3, 3], 4, 51), cloud(p, [3, 3], 4, 52));
    let vein = (cloud(p + warp * 0.08, [4, 4], 4, 53) * 6.0).sin().abs().powf(0.35);
    dvec3(0.52, 0.4, 0.34).lerp(dvec3(0.27, 0.145, 0.12), vein) * (1.0 + 0.2 * cloud(p, [12, 12], 3, 54))
}

fn wood(p: DVec2) -> DVec3 {
    let board = (p.y * 5.0).floor();
    let edge = (p.y * 5.0 - board).min(board + 1.0 - p.y * 5.0) / 5.0;
    let tone = hash(board as i64, 0, 61);
    let line = cloud(dvec2((p.x + 0.37 * board).fract(), p.y), [2, 40], 3, 62);
    let oak = dvec3(0.34, 0.2, 0.1) * (0.75 + 0.5 * tone) * (1.0 + 0.35 * line);
    if edge < 0.004 { dvec3(0.16, 0.1, 0.055) } else { oak }
}

const RED: DVec3 = dvec3(0.42, 0.09, 0.06);
const BLUE: DVec3 = dvec3(0.09, 0.17, 0.4);
const GOLD: DVec3 = dvec3(0.62, 0.42, 0.1);
const GREEN: DVec3 = dvec3(0.13, 0.28, 0.12);
const WHITE: DVec3 = dvec3(0.7, 0.66, 0.57);
const DARK: DVec3 = dvec3(0.1, 0.06, 0.045);

/// Old paint: the colour, worn by noise.
fn worn(colour: DVec3, p: DVec2, seed: u64) -> DVec3 {
    let wear = (cloud(p, [6, 6], 4, seed) - 0.25).max(0.0);
    colour.lerp(dvec3(0.55, 0.49, 0.4), (wear * 0.8).min(0.5)) * (1.0 + 0.1 * cloud(p, [20, 20], 2, seed + 9))
}

/// A border of two bands, `wide` metres in all; `None` inside.
fn border(p: DVec2, size: DVec2, wide: f64, colours: [DVec3; 2]) -> Option<DVec3> {
    let edge = (p.min(1.0 - p) * size).min_element();
    let along = (p.x * size.x + p.y * size.y) / 0.1;
    if edge < 0.35 * wide {
        Some(colours[0])
    } else if edge < 0.85 * wide {
        Some(if along.fract() < 0.5 { colours[1] } else { colours[0].lerp(WHITE, 0.6) })
    } else if edge < wide {
        Some(DARK)
    } else {
        None
    }
}

fn frieze(p: DVec2) -> DVec3 {
    let m = p * dvec2(1.4, 0.35);
    let wave = 0.175 + 0.06 * (TAU * m.x / 0.7).sin();
    let spiral = [0.175, 0.525, 0.875, 1.225]
        .map(|x: f64| (m - dvec2(x, if ((x / 0.35) as i64) % 2 == 0 { 0.105 } else { 0.245 })).length());
    let nearest = spiral.into_iter().fold(f64::INFINITY, f64::min);
    let colour = if !(0.03..0.32).contains(&m.y) {
        WHITE
    } else if !(0.045..0.305).contains(&m.y) {
        DARK
    } else if nearest < 0.018 {
        GOLD
    } else if nearest < 0.05 {
        BLUE
    } else if (m.y - wave).abs() < 0.016 {
        GOLD
    } else {
        RED
    };
    worn(colour, p, 71)
}

fn stars(p: DVec2) -> DVec3 {
    let hit = [dvec2(0.25, 0.25), dvec2(0.75, 0.75)].into_iter().any(|c| {
        let (r, a) = polar(p, c, dvec2(0.8, 0.8));
        r < 0.085 * star(a + PI / 8.0, 8.0, 0.6)
    });
    let dot = [dvec2(0.25, 0.75), dvec2(0.75, 0.25)].into_iter().any(|c| polar(p, c, dvec2(0.8, 0.8)).0 < 0.018);
    worn(if hit || dot { GOLD } else { BLUE }, p, 81)
}

/// A ship under sail, the sun in the upper left corner, three fish.
fn ship(p: DVec2) -> DVec3 {
    let size = dvec2(1.0, 1.25);
    if let Some(colour) = border(p, size, 0.09, [RED, GOLD]) {
        return worn(colour, p, 91);
    }
    let m = p * size;
    let swell = |x: f64, k: f64| 0.34 + 0.022 * (TAU * (x / 0.25) + k).sin();
    let hull = [[0.28, 0.5], [0.86, 0.54], [0.8, 0.4], [0.72, 0.33], [0.42, 0.33], [0.34, 0.4]];
    let sail = [[0.56, 0.58], [0.56, 1.0], [0.84, 0.62]];
    let jib = [[0.52, 0.6], [0.52, 0.92], [0.3, 0.6]];
    let flag = [[0.54, 1.04], [0.54, 1.12], [0.4, 1.08]];
    let (r, a) = polar(p, dvec2(0.24, 0.82), size);
    let fish = [[0.28, 0.2, 1.0], [0.55, 0.24, 1.0], [0.78, 0.18, -1.0]].into_iter().any(|[x, y, way]| {
        let d = (m - dvec2(x, y)) * dvec2(way, 1.0);
        (d * dvec2(1.0, 2.4)).length() < 0.07 || (d.x < -0.05 && d.x > -0.12 && d.y.abs() < (-0.05 - d.x) * 0.7)
    });
    let colour = if fish {
        GOLD
    } else if m.y < swell(m.x, 0.0) {
        if (m.y + 0.02 * (TAU * m.x / 0.2).sin()).rem_euclid(0.07) < 0.014 { WHITE } else { BLUE }
    } else if inside_polygon(m, &hull) {
        if (m.y - 0.1 * m.x).rem_euclid(0.06) < 0.01 { DARK } else { dvec3(0.3, 0.15, 0.07) }
    } else if inside_polygon(m, &sail) {
        if (m.x * 12.0).fract() < 0.5 { WHITE } else { RED }
    } else if inside_polygon(m, &jib) {
        WHITE
    } else if inside_polygon(m, &flag) {
        RED
    } else if (m.x - 0.54).abs() < 0.012 && m.y < 1.13 {
        DARK
    } else if r < 0.085 {
        GOLD
    } else if r < 0.15 && (a * 12.0 / TAU).rem_euclid(1.0) < 0.4 {
        RED
    } else {
        dvec3(0.5, 0.53, 0.5).lerp(dvec3(0.3, 0.42, 0.55), p.y)
    };
    worn(colour, p, 92)
}

fn rosette_in(p: DVec2, ground: DVec3, petal: DVec3) -> DVec3 {
    let size = dvec2(1.2, 1.2);
    if let Some(colour) = border(p, size, 0.09, [ground, WHITE]) {
        return worn(colour, p, 101);
    }
    let (r, a) = polar(p, dvec2(0.5, 0.5), size);
    let colour = if r < 0.06 {
        GOLD
    } else if r < 0.19 * star(a, 8.0, 0.55) {
        WHITE
    } else if r < 0.22 {
        DARK
    } else if r < 0.42 * star(a + PI / 12.0, 12.0, 0.35) {
        petal
    } else if r < 0.43 {
        GOLD
    } else if r < 0.46 {
        DARK
    } else {
        ground
    };
    worn(colour, p, 102)
}

fn rosette(p: DVec2) -> DVec3 {
    rosette_in(p, RED, BLUE)
}

fn rosette_recoloured(p: DVec2) -> DVec3 {
    rosette_in(p, GREEN, dvec3(0.45, 0.36, 0.1))
}

/// A vine that winds up a pole, its leaves and grapes to alternate sides.
fn vine(p: DVec2) -> DVec3 {
    let size = dvec2(0.8, 1.6);
    if let Some(colour) = border(p, size, 0.07, [BLUE, GOLD]) {
        return worn(colour, p, 111);
    }
    let m = p * size;
    let stem = |y: f64| 0.4 + 0.11 * (TAU * y / 0.62).sin() + 0.05 * (TAU * y / 1.7).cos();
    let mut colour = dvec3(0.6, 0.52, 0.36);
    if (m.x - stem(m.y)).abs() < 0.017 {
        colour = dvec3(0.2, 0.13, 0.06);
    }
    for k in 0..9 {
        let y = 0.17 + 0.155 * f64::from(k);
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let (r, a) = polar(p, dvec2(stem(y) + side * 0.13, y + 0.03) / size, size);
        if r < 0.085 * star(a + 0.3 * f64::from(k), 5.0, 0.45) {
            colour = GREEN;
        }
        if k % 3 == 1 {
            for g in 0..6 {
                let row = [0, 0, 0, 1, 1, 2][g];
                let along = [-1.0, 0.0, 1.0, -0.5, 0.5, 0.0][g];
                let c = dvec2(stem(y) - side * 0.12 + 0.034 * along, y - 0.03 * f64::from(row));
                if m.distance(c) < 0.019 {
                    colour = dvec3(0.28, 0.08, 0.24);
                }
            }
        }
    }
    worn(colour, p, 112)
}

/// An almond of rings around a cross, with stars in the corners.
fn mandorla(p: DVec2) -> DVec3 {
    let size = dvec2(0.9, 1.6);
    if let Some(colour) = border(p, size, 0.08, [GOLD, RED]) {
        return worn(colour, p, 121);
    }
    let m = p * size - dvec2(0.45, 0.8);
    // two circles whose overlap is the almond
    let almond = (m.x.abs() + 0.42).hypot(m.y) / 0.74;
    let cross = (m.x.abs() < 0.035 && (-0.34..0.34).contains(&m.y)) || (m.x.abs() < 0.15 && (m.y - 0.13).abs() < 0.035);
    let corner =
        [dvec2(-0.27, 0.56), dvec2(0.27, 0.56), dvec2(-0.27, -0.56), dvec2(0.27, -0.56)].into_iter().any(|c| {
            let d = m - c;
            d.length() < 0.1 * star(d.y.atan2(d.x) + PI / 2.0, 6.0, 0.6)
        });
    let ray = (m.y.atan2(m.x) * 16.0 / TAU).rem_euclid(1.0) < 0.5;
    let colour = if cross {
        WHITE
    } else if almond < 0.74 {
        if ray { GOLD } else { GOLD * 0.72 }
    } else if almond < 0.8 {
        DARK
    } else if almond < 0.9 {
        RED
    } else if almond < 1.0 {
        WHITE
    } else if corner {
        GOLD
    } else {
        BLUE
    };
    worn(colour, p, 122)
}

fn plaque(p: DVec2) -> DVec3 {
    let size = dvec2(0.5, 0.5);
    let (r, a) = polar(p, dvec2(0.5, 0.5), size);
    let edge = (p.min(1.0 - p) * size).min_element();
    let raised = edge < 0.03 || (r < 0.17 * star(a + PI / 2.0, 5.0, 0.62)) || (0.185..0.205).contains(&r);
    let clay = if raised { dvec3(0.56, 0.27, 0.16) } else { dvec3(0.3, 0.12, 0.075) };
    clay * (1.0 + 0.2 * cloud(p, [10, 10], 4, 131))
}
