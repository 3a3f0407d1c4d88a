//! Furniture and statues, each around its own origin: on the floor in its middle, its front towards +z.

use glam::{DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::PI;

use super::dice::Dice;
use super::palette::Palette;
use crate::common::mesh::{Finish, Model};
use crate::common::parts::{Side, cuboid, revolve};

/// A thing to be put somewhere.
pub struct Piece<'a> {
    /// What it is made of.
    pub model: Model<'a>,
    /// Half its extent along x and z.
    pub half: DVec2,
    /// How high it is.
    pub height: f64,
}

pub(super) fn piece<'a>(name: &str, half: DVec2, height: f64, build: impl FnOnce(&mut Model<'a>)) -> Piece<'a> {
    let mut model = Model::default();
    model.object(name);
    build(&mut model);
    Piece { model, half, height }
}

pub(super) fn block<'a>(m: &mut Model<'a>, finish: &'a Finish, x: [f64; 2], y: [f64; 2], z: [f64; 2]) {
    cuboid(m, finish, dvec3(x[0], y[0], z[0]), dvec3(x[1], y[1], z[1]), &[]);
}

/// A table, with a cloth or things on it.
pub fn table<'a>(p: &'a Palette, dice: &mut Dice) -> Piece<'a> {
    let half = dvec2(dice.between(0.5, 1.1), dice.between(0.35, 0.5));
    let (top, wood) = (dice.between(0.7, 0.8), &p.woods[dice.whole(0, 1)].finish);
    piece("table", half, top + 0.3, |m| {
        block(m, wood, [-half.x, half.x], [top - 0.04, top], [-half.y, half.y]);
        for (sx, sz) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            let (x, z) = (sx * (half.x - 0.07), sz * (half.y - 0.07));
            block(m, wood, [x - 0.035, x + 0.035], [0.0, top - 0.04], [z - 0.035, z + 0.035]);
        }
        block(m, wood, [-half.x + 0.08, half.x - 0.08], [top - 0.14, top - 0.04], [-half.y + 0.06, -half.y + 0.08]);
        if dice.chance(0.4) {
            let cloth = &p.cloths[dice.whole(0, 2)].finish;
            let (x, drop) = (half.x * dice.between(0.5, 0.9), dice.between(0.15, 0.4));
            block(m, cloth, [-x, x], [top, top + 0.006], [-half.y - 0.01, half.y + 0.01]);
            block(m, cloth, [-x, x], [top - drop, top], [half.y, half.y + 0.01]);
            block(m, cloth, [-x, x], [top - drop, top], [-half.y - 0.01, -half.y]);
        }
        for k in 0..dice.whole(1, 4) {
            let at = dvec3(half.x * dice.between(-0.75, 0.75), top + 0.006, half.y * dice.between(-0.7, 0.7));
            small(m, p, at, k, dice);
        }
    })
}

/// A jug, a bowl, a book or a candlestick.
fn small<'a>(m: &mut Model<'a>, p: &'a Palette, at: DVec3, k: usize, dice: &mut Dice) {
    let s = dice.between(0.8, 1.3);
    let scaled = |profile: &[[f64; 2]]| profile.iter().map(|q| q.map(|v| v * s)).collect::<Vec<_>>();
    match (k + dice.whole(0, 3)) % 4 {
        0 => {
            let jug = [
                [0.06, 0.0],
                [0.1, 0.08],
                [0.11, 0.15],
                [0.065, 0.25],
                [0.055, 0.29],
                [0.07, 0.32],
                [0.05, 0.3],
                [0.0, 0.26],
            ];
            revolve(m, &p.glaze.finish, at, &scaled(&jug), 16);
        }
        1 => {
            let bowl = [[0.06, 0.0], [0.05, 0.02], [0.12, 0.07], [0.14, 0.1], [0.13, 0.1], [0.0, 0.03]];
            revolve(m, &p.gilt.finish, at, &scaled(&bowl), 16);
        }
        2 => {
            let half = dvec3(0.09, 0.02, 0.13) * s;
            let cover = &p.cloths[dice.whole(0, 2)].finish;
            cuboid(m, cover, at - half.with_y(0.0), at + half.with_y(half.y * 2.0), &[Side::Bottom]);
        }
        _ => {
            let stick =
                [[0.07, 0.0], [0.07, 0.015], [0.02, 0.04], [0.03, 0.12], [0.015, 0.2], [0.04, 0.23], [0.0, 0.23]];
            revolve(m, &p.gilt.finish, at, &scaled(&stick), 12);
            revolve(
                m,
                &p.plaster_cast.finish,
                at + DVec3::Y * 0.23 * s,
                &[[0.012, 0.0], [0.012, 0.16], [0.0, 0.16]],
                8,
            );
        }
    }
}

/// A chair.
pub fn chair<'a>(p: &'a Palette, dice: &mut Dice) -> Piece<'a> {
    let wood = &p.woods[dice.whole(0, 1)].finish;
    let seat = if dice.chance(0.5) { &p.cloths[0].finish } else { wood };
    piece("chair", dvec2(0.23, 0.23), 0.95, |m| {
        block(m, seat, [-0.22, 0.22], [0.42, 0.46], [-0.21, 0.21]);
        for x in [-0.19, 0.19] {
            block(m, wood, [x - 0.02, x + 0.02], [0.0, 0.95], [-0.21, -0.17]);
            block(m, wood, [x - 0.02, x + 0.02], [0.0, 0.42], [0.16, 0.2]);
        }
        for y in [0.6, 0.82] {
            block(m, wood, [-0.17, 0.17], [y, y + 0.09], [-0.2, -0.18]);
        }
    })
}

/// A bench, with a back or without.
pub fn bench<'a>(p: &'a Palette, dice: &mut Dice, half: f64) -> Piece<'a> {
    let (wood, back) = (&p.woods[dice.whole(0, 1)].finish, dice.chance(0.6));
    piece("bench", dvec2(half, 0.22), if back { 0.9 } else { 0.45 }, |m| {
        block(m, wood, [-half, half], [0.41, 0.45], [-0.2, 0.2]);
        for x in [-half + 0.1, half - 0.1] {
            block(m, wood, [x - 0.03, x + 0.03], [0.0, 0.41], [-0.18, 0.18]);
        }
        if back {
            block(m, wood, [-half, half], [0.55, 0.9], [-0.22, -0.19]);
            for x in [-half + 0.1, half - 0.1] {
                block(m, wood, [x - 0.03, x + 0.03], [0.45, 0.6], [-0.22, -0.18]);
            }
        }
    })
}

/// Shelves with books and jugs.
pub fn shelf<'a>(p: &'a Palette, dice: &mut Dice) -> Piece<'a> {
    let (half, height, wood) = (dice.between(0.4, 0.9), dice.between(1.3, 2.1), &p.woods[dice.whole(0, 1)].finish);
    piece("shelf", dvec2(half, 0.17), height, |m| {
        for x in [[-half, -half + 0.03], [half - 0.03, half]] {
            block(m, wood, x, [0.0, height], [-0.16, 0.16]);
        }
        block(m, wood, [-half, half], [0.0, height], [-0.17, -0.15]);
        let boards = (height / 0.4).floor() as usize;
        for k in 0..=boards {
            let y = 0.08 + (height - 0.12) * k as f64 / boards as f64;
            block(m, wood, [-half + 0.03, half - 0.03], [y, y + 0.025], [-0.15, 0.15]);
            if k == boards || dice.chance(0.2) {
                continue;
            }
            if dice.chance(0.65) {
                let from = -half + 0.04 + half * dice.between(0.0, 0.5);
                let to = half - 0.04 - half * dice.between(0.0, 0.4);
                let (high, front) = (dice.between(0.22, 0.3), dice.between(0.06, 0.12));
                block(m, &p.books.finish, [from, to], [y + 0.025, y + 0.025 + high], [-0.14, front]);
            } else {
                let at = dvec3(half * dice.between(-0.6, 0.6), y + 0.025, 0.0);
                small(m, p, at, k, dice);
            }
        }
    })
}

/// A cupboard with two doors.
pub fn cupboard<'a>(p: &'a Palette, dice: &mut Dice) -> Piece<'a> {
    let (half, height, wood) = (dice.between(0.45, 0.75), dice.between(1.2, 2.1), dice.whole(0, 1));
    let (body, doors) = (&p.woods[wood].finish, &p.woods[1 - wood].finish);
    piece("cupboard", dvec2(half, 0.28), height, |m| {
        block(m, body, [-half, half], [0.0, height], [-0.27, 0.24]);
        block(m, body, [-half - 0.03, half + 0.03], [height, height + 0.05], [-0.28, 0.28]);
        for x in [[-half + 0.05, -0.02], [0.02, half - 0.05]] {
            block(m, doors, x, [0.1, height - 0.06], [0.24, 0.26]);
        }
        revolve(m, &p.gilt.finish, dvec3(0.06, height * 0.5, 0.275), &[[0.0, -0.02], [0.02, 0.0], [0.0, 0.02]], 8);
    })
}

/// A chest, or two crates on one another.
pub fn chest<'a>(p: &'a Palette, dice: &mut Dice) -> Piece<'a> {
    let half = dvec2(dice.between(0.35, 0.6), dice.between(0.22, 0.32));
    let (height, wood) = (dice.between(0.4, 0.6), dice.whole(0, 1));
    let (body, top) = (&p.woods[wood].finish, &p.woods[1 - wood].finish);
    let second = dice.chance(0.4);
    piece("chest", half, if second { height * 1.8 } else { height }, |m| {
        block(m, body, [-half.x, half.x], [0.0, height], [-half.y, half.y]);
        for x in [-0.6 * half.x, 0.6 * half.x] {
            block(m, &p.iron.finish, [x - 0.025, x + 0.025], [0.0, height + 0.006], [-half.y - 0.006, half.y + 0.006]);
        }
        if second {
            let (a, b) = (half * dice.between(0.6, 0.8), height * 1.7);
            block(m, top, [-a.x, a.x * 0.8], [height + 0.006, b], [-a.y, a.y]);
        }
    })
}

/// A cask that stands upright.
pub fn cask<'a>(p: &'a Palette, dice: &mut Dice) -> Piece<'a> {
    let (r, h) = (dice.between(0.24, 0.36), dice.between(0.65, 0.95));
    let wood = &p.woods[dice.whole(0, 1)].finish;
    piece("cask", DVec2::splat(r * 1.2), h, |m| {
        let side: Vec<_> = (0..=8)
            .map(|k| {
                let t = f64::from(k) / 8.0;
                [r * (1.0 + 0.18 * (PI * t).sin()), h * t]
            })
            .chain([[r * 0.93, h], [r * 0.93, h - 0.03], [0.0, h - 0.03]])
            .collect();
        revolve(m, wood, DVec3::ZERO, &side, 20);
        for t in [0.12, 0.3, 0.7, 0.88] {
            let hoop = r * (1.0 + 0.18 * (PI * t).sin()) + 0.006;
            let y = h * t;
            revolve(m, &p.iron.finish, DVec3::ZERO, &[[hoop, y - 0.02], [hoop, y + 0.02]], 20);
        }
    })
}

/// A figure turned on a lathe: its profile by seed, robed, with a head.
pub fn figure<'a>(m: &mut Model<'a>, finish: &'a Finish, base: DVec3, height: f64, dice: &mut Dice) {
    let wide = dice.between(0.16, 0.22);
    let mut profile = vec![[wide, 0.0], [wide, 0.06]];
    for k in 0..9 {
        let t = f64::from(k) / 8.0;
        let body = 0.85 - 0.35 * (PI * t * 0.8).sin() + if t > 0.6 { 0.5 * (t - 0.6) } else { 0.0 };
        profile.push([wide * (body + dice.between(-0.06, 0.06)), 0.08 + 0.68 * t]);
    }
    profile.extend([[0.06, 0.81], [0.045, 0.83], [0.06, 0.86], [0.075, 0.9], [0.07, 0.94], [0.04, 0.98], [0.0, 1.0]]);
    let scaled: Vec<_> = profile.iter().map(|q| [q[0] * height, q[1] * height]).collect();
    revolve(m, finish, base, &scaled, 24);
}

/// A statue on a block.
pub fn statue<'a>(p: &'a Palette, dice: &mut Dice) -> Piece<'a> {
    let (block_high, tall) = (dice.between(0.6, 1.0), dice.between(0.8, 1.2));
    let half = dice.between(0.22, 0.28);
    piece("statue", DVec2::splat(half + 0.03), block_high + tall, |m| {
        block(m, &p.stone.finish, [-half, half], [0.0, block_high], [-half, half]);
        let rim = half + 0.03;
        block(m, &p.stone.finish, [-rim, rim], [block_high - 0.07, block_high], [-rim, rim]);
        let finish = if dice.chance(0.25) { &p.gilt.finish } else { &p.plaster_cast.finish };
        figure(m, finish, DVec3::Y * block_high, tall, dice);
    })
}

/// A lectern with an open book.
pub fn lectern<'a>(p: &'a Palette, dice: &mut Dice) -> Piece<'a> {
    let wood = &p.woods[dice.whole(0, 1)].finish;
    piece("lectern", dvec2(0.3, 0.3), 1.3, |m| {
        block(m, wood, [-0.25, 0.25], [0.0, 0.06], [-0.25, 0.25]);
        block(m, wood, [-0.06, 0.06], [0.06, 1.05], [-0.06, 0.06]);
        let desk = |x: f64, t: f64, up: f64| dvec3(x, 1.05 + 0.22 * t + up, 0.2 - 0.4 * t);
        for (finish, x, up) in [(wood, 0.3, 0.0), (&p.plaster_cast.finish, 0.22, 0.02)] {
            let (a, b) = (0.1 * (up * 50.0), 1.0 - 0.1 * (up * 50.0));
            let points = [desk(-x, a, up), desk(x, a, up), desk(x, b, up), desk(-x, b, up)];
            let metres = [dvec2(0.0, 0.0), dvec2(2.0 * x, 0.0), dvec2(2.0 * x, 0.4), dvec2(0.0, 0.4)];
            m.face_towards(finish, DVec3::Y, &points, &metres);
        }
    })
}

/// A carpet 1 cm thick.
pub fn rug<'a>(p: &'a Palette) -> Piece<'a> {
    let half = p.rug.finish.tile * 0.5;
    piece("rug", half, 0.01, |m| {
        cuboid(m, &p.rug.finish, dvec3(-half.x, 0.0, -half.y), dvec3(half.x, 0.01, half.y), &[Side::Bottom]);
    })
}

/// A column: a foot, a shaft with a slight swelling, a capital; from the floor to `height`.
pub fn column<'a>(p: &'a Palette, radius: f64, height: f64) -> Piece<'a> {
    let half = radius * 1.4;
    piece("column", DVec2::splat(half), height, |m| {
        block(m, &p.stone.finish, [-half, half], [0.0, 0.12], [-half, half]);
        let r = radius;
        let foot = [[1.3 * r, 0.12], [1.34 * r, 0.16], [1.3 * r, 0.2], [1.1 * r, 0.23], [1.15 * r, 0.27], [r, 0.3]];
        revolve(m, &p.stone.finish, DVec3::ZERO, &foot, 20);
        let top = height - 0.55;
        let shaft = [[r, 0.3], [r, 0.3 + 0.4 * (top - 0.3)], [0.97 * r, 0.3 + 0.7 * (top - 0.3)], [0.9 * r, top]];
        revolve(m, &p.marble.finish, DVec3::ZERO, &shaft, 20);
        let capital = [
            [0.9 * r, top],
            [r, top + 0.03],
            [0.95 * r, top + 0.07],
            [1.05 * r, top + 0.2],
            [1.25 * r, top + 0.33],
            [1.35 * r, top + 0.4],
        ];
        revolve(m, &p.stone.finish, DVec3::ZERO, &capital, 20);
        block(m, &p.stone.finish, [-half, half], [top + 0.4, height], [-half, half]);
    })
}
