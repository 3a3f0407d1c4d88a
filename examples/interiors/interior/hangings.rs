//! What hangs: rings of lamps, lamps on walls, cloth.

use glam::{DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::{PI, TAU};

use super::dice::Dice;
use super::furniture::{Piece, block, piece};
use super::palette::Palette;
use crate::common::mesh::Model;
use crate::common::parts::{revolve, tube};

/// A ring of lamps that hangs with its ring at the origin, on a chain `chain` metres long.
pub fn chandelier<'a>(p: &'a Palette, dice: &mut Dice, chain: f64) -> Piece<'a> {
    let (r, n) = (dice.between(0.3, 0.6), dice.whole(4, 8));
    piece("chandelier", DVec2::splat(r), 0.3, |m| {
        let circle: Vec<_> = (0..20)
            .map(|i| {
                let a = TAU * f64::from(i) / 20.0;
                dvec3(r * a.cos(), 0.0, r * a.sin())
            })
            .collect();
        tube(m, &p.iron.finish, &circle, 0.015, 6, true, DVec3::Y);
        for k in 0..3 {
            let a = TAU * f64::from(k) / 3.0;
            let rim = dvec3(r * a.cos(), 0.0, r * a.sin());
            tube(m, &p.iron.finish, &[rim, DVec3::Y * r], 0.008, 5, false, DVec3::X);
        }
        tube(m, &p.iron.finish, &[DVec3::Y * r, DVec3::Y * chain.max(r + 0.1)], 0.01, 5, false, DVec3::X);
        for k in 0..n {
            let a = TAU * k as f64 / n as f64;
            let at = dvec3(r * a.cos(), 0.015, r * a.sin());
            revolve(m, &p.plaster_cast.finish, at, &[[0.02, 0.0], [0.02, 0.07], [0.0, 0.07]], 8);
            flame(m, p, at + DVec3::Y * 0.08, 0.028);
        }
    })
}

/// A lamp on a wall: a plate and a globe before it; the wall is at z = 0.
pub fn sconce<'a>(p: &'a Palette) -> Piece<'a> {
    piece("sconce", dvec2(0.1, 0.1), 0.3, |m| {
        block(m, &p.gilt.finish, [-0.06, 0.06], [-0.1, 0.1], [0.0, 0.02]);
        tube(m, &p.gilt.finish, &[dvec3(0.0, -0.05, 0.02), dvec3(0.0, -0.05, 0.15)], 0.012, 6, false, DVec3::Y);
        flame(m, p, dvec3(0.0, -0.03, 0.15), 0.05);
    })
}

/// A globe that shines.
fn flame<'a>(m: &mut Model<'a>, p: &'a Palette, at: DVec3, r: f64) {
    let globe: Vec<_> = (0..=8)
        .map(|k| {
            let a = PI * f64::from(k) / 8.0;
            [r * a.sin(), r * (1.0 - a.cos())]
        })
        .collect();
    revolve(m, &p.lamp.finish, at, &globe, 12);
}

/// A cloth that hangs in folds before a wall at z = 0, its upper edge at the origin.
pub fn banner<'a>(p: &'a Palette, dice: &mut Dice, size: DVec2) -> Piece<'a> {
    let cloth = &p.cloths[dice.whole(0, 2)].finish;
    let (folds, deep) = (dice.between(2.0, 6.0), dice.between(0.015, 0.05));
    let phase = dice.between(0.0, TAU);
    piece("banner", dvec2(size.x * 0.5, 0.08), size.y, |m| {
        let n = (folds * 8.0) as usize;
        let point = |i: usize, v: f64| {
            let t = i as f64 / n as f64;
            let wave = (TAU * folds * t + phase).sin() * deep * (0.4 + 0.6 * v);
            dvec3(size.x * (t - 0.5), -size.y * v, 0.02 + deep + wave)
        };
        for j in 0..4 {
            let v = [f64::from(j) / 4.0, f64::from(j + 1) / 4.0];
            for i in 0..n {
                let ring = [(i, v[1]), (i + 1, v[1]), (i + 1, v[0]), (i, v[0])];
                let points = ring.map(|(i, v)| point(i, v));
                let metres = ring.map(|(i, v)| dvec2(size.x * i as f64 / n as f64, size.y * (1.0 - v)));
                m.face_towards(cloth, DVec3::Z, &points, &metres);
            }
        }
        let rod = [dvec3(-0.5 * size.x - 0.06, 0.01, 0.04), dvec3(0.5 * size.x + 0.06, 0.01, 0.04)];
        tube(m, &p.iron.finish, &rod, 0.012, 6, false, DVec3::Y);
    })
}
