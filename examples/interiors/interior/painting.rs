//! What is painted in frames: landscapes, still lifes and ornaments.

use glam::{DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::{PI, TAU};

use super::look::{Look, colour};
use crate::common::pattern::{cloud, hash, polar, star};

/// Linear albedo of the picture of a look at a point (0..1 each way).
pub fn albedo(look: &Look, p: DVec2) -> DVec3 {
    let edge = (p.min(1.0 - p) * look.tile).min_element();
    let paint = if edge < 0.02 {
        look.colours[2]
    } else {
        match look.seed % 4 {
            0 => landscape(look, p),
            1 => still_life(look, p),
            2 => figures(look, p),
            _ => ornament(look, p),
        }
    };
    let worn = (cloud(p, [6, 6], 4, look.seed ^ 17) - 0.25).clamp(0.0, 0.4);
    paint.lerp(dvec3(0.45, 0.38, 0.28), worn) * (1.0 + 0.1 * cloud(p, [20, 20], 2, look.seed ^ 18))
}

/// A number in 0..1 that belongs to the k-th thing of the picture.
fn of(look: &Look, k: i64, what: u64) -> f64 {
    hash(k, 7, look.seed ^ (what << 8))
}

/// Hills in layers before a sky, trees, a sun or moon on one side.
fn landscape(look: &Look, p: DVec2) -> DVec3 {
    let horizon = 0.45 + 0.2 * of(look, 0, 1);
    let mut paint = dvec3(0.5, 0.5, 0.42).lerp(look.colours[1], ((p.y - horizon) / (1.0 - horizon)).clamp(0.0, 1.0));
    let orb = dvec2(if of(look, 0, 2) < 0.5 { 0.2 } else { 0.8 }, 0.82);
    if polar(p, orb, look.tile).0 < 0.07 * look.tile.x {
        paint = dvec3(0.75, 0.6, 0.25);
    }
    for layer in 0..4i64 {
        let high = horizon * (1.0 - 0.22 * layer as f64);
        let ridge =
            high + 0.09 * cloud(dvec2(p.x * 0.5, 0.1 * layer as f64), [5, 5], 4, look.seed ^ (layer as u64 + 3));
        if p.y < ridge {
            let far = layer as f64 / 3.0;
            paint = dvec3(0.3, 0.36, 0.4).lerp(look.colours[0], far) * (1.0 - 0.35 * far);
        }
        let x = of(look, layer, 4);
        let crown = dvec2(x, ridge.min(high) + 0.08);
        if layer > 1 && polar(p, crown, look.tile).0 < (0.05 + 0.05 * of(look, layer, 5)) * look.tile.x {
            paint = dvec3(0.07, 0.14, 0.05);
        }
        if layer > 1 && (p.x - x).abs() < 0.008 && p.y < crown.y && p.y > ridge - 0.12 {
            paint = dvec3(0.1, 0.06, 0.03);
        }
    }
    paint
}

/// A table with fruit and a jug before a dark ground.
fn still_life(look: &Look, p: DVec2) -> DVec3 {
    let table = 0.28 + 0.08 * of(look, 0, 1);
    let mut paint = if p.y < table { look.colours[0] * 0.6 } else { look.colours[1] * (0.25 + 0.3 * p.x) };
    let jug = (p - dvec2(0.3 + 0.4 * of(look, 0, 2), table)) * look.tile / look.tile.x;
    let belly = 0.1 + 0.045 * (jug.y * 14.0).sin();
    if jug.x.abs() < belly && (-0.04..0.38).contains(&jug.y) {
        paint = look.colours[2] * (0.5 + 3.0 * (jug.x + 0.1));
    }
    for k in 0..7 {
        let at = dvec2(0.12 + 0.76 * of(look, k, 3), table - 0.08 + 0.1 * of(look, k, 4));
        let r = (0.04 + 0.04 * of(look, k, 5)) * look.tile.x;
        let (away, angle) = polar(p, at, look.tile);
        if away < r {
            let lit = 0.55 + 0.45 * (angle - 2.2).cos() * away / r;
            paint = colour(0.14 * of(look, k, 6), 0.85, 0.55) * lit;
        }
    }
    paint
}

/// Robed figures in a row, with haloes.
fn figures(look: &Look, p: DVec2) -> DVec3 {
    let mut paint = if p.y < 0.16 { look.colours[0] * 0.5 } else { dvec3(0.52, 0.38, 0.12) };
    let count = 2 + (look.seed / 4 % 3) as i64;
    for k in 0..count {
        let x = (k as f64 + 0.5) / count as f64 + 0.06 * (of(look, k, 1) - 0.5);
        let tall = 0.62 + 0.14 * of(look, k, 2);
        let wide = (0.36 - 0.2 * (p.y / tall)) / count as f64 * (1.0 + 0.15 * (p.y * 25.0 + k as f64).sin());
        let head = dvec2(x, tall + 0.05);
        let robe = colour(of(look, k, 3), 0.75, 0.35);
        let away = polar(p, head, look.tile).0 / look.tile.x;
        if away < 0.2 / count as f64 && away > 0.13 / count as f64 {
            paint = dvec3(0.65, 0.5, 0.15);
        } else if away < 0.13 / count as f64 {
            paint = dvec3(0.5, 0.33, 0.22);
        } else if p.y > 0.06 && p.y < tall && (p.x - x).abs() < wide {
            let fold = ((p.x - x) / wide * 9.0 + 2.0 * p.y).sin();
            paint = robe * (0.75 + 0.3 * fold);
        }
    }
    paint
}

/// Rings of petals around a centre that is not the picture's, and corners of different colours.
fn ornament(look: &Look, p: DVec2) -> DVec3 {
    let centre = dvec2(0.4 + 0.2 * of(look, 0, 1), 0.4 + 0.2 * of(look, 0, 2));
    let (r, angle) = polar(p, centre, look.tile);
    let r = r / look.tile.min_element();
    let petals = 5.0 + (look.seed / 4 % 8) as f64;
    let corner = colour(of(look, i64::from(p.x < centre.x) + 2 * i64::from(p.y < centre.y), 4), 0.7, 0.3);
    if r < 0.07 {
        look.colours[2]
    } else if r < 0.2 * star(angle, petals, 0.5) {
        look.colours[0]
    } else if r < 0.23 {
        dvec3(0.08, 0.05, 0.04)
    } else if r < 0.4 * star(angle + PI / petals, petals + 3.0, 0.35) {
        look.colours[1]
    } else if r < 0.44 && (angle * 24.0 / TAU).rem_euclid(1.0) < 0.5 {
        look.colours[2]
    } else {
        corner
    }
}
