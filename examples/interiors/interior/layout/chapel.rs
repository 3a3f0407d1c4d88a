//! A nave under a barrel vault, an apse in the east, an aisle on one side or both behind arches.

use glam::{DVec3, dvec2, dvec3};
use std::f64::consts::{FRAC_PI_2, PI};

use super::{Draft, passage, window, windows};
use crate::common::mesh::{Finish, Model};
use crate::common::parts::{Opening, Plane, Side, cuboid, level, panel, rectangle, reveal};
use crate::interior::dice::Dice;
use crate::interior::furnish::Taken;
use crate::interior::palette::Palette;
use crate::interior::room::{Cover, Hole, Room, Through, Wall};

/// Sides of the apse, half of a regular polygon.
const SIDES: usize = 5;

pub(super) fn draw(draft: &mut Draft, dice: &mut Dice) {
    let (long, wide) = (dice.between(8.0, 12.0), dice.between(4.6, 6.2));
    let (spring, rise) = (dice.between(3.9, 5.2), wide * dice.between(0.28, 0.48));
    let cover = Cover::Barrel { along_x: true, rise, ribs: dice.chance(0.6) };
    let mut nave = draft.room("nave", DVec3::ZERO, dvec3(long, spring, wide), cover, 0, dice);
    let thickness = dice.between(0.4, 0.7);
    let bays = (long / dice.between(2.4, 3.2)).round() as usize;
    let bay = long / bays as f64;
    let half = bay * dice.between(0.3, 0.38);
    let head = dice.between(1.9, 2.4);
    let both = dice.chance(0.3);
    let aisle_side = if dice.chance(0.5) { Wall::North } else { Wall::South };
    let high = (head + half + 0.4).max(3.0);
    let width = dice.between(1.7, 2.6);
    for (k, side) in [(0, Wall::North), (1, Wall::South)] {
        if side == aisle_side || both {
            let z = if side == Wall::North {
                [-thickness - width, -thickness]
            } else {
                [wide + thickness, wide + thickness + width]
            };
            let beams = dice.chance(0.5).then_some(1.0);
            let name = ["aisle_north", "aisle_south"][k];
            let mut aisle =
                draft.room(name, dvec3(0.0, 0.0, z[0]), dvec3(long, high, z[1]), Cover::Flat { beams }, 1, dice);
            let other = if side == Wall::North { Wall::South } else { Wall::North };
            for b in 0..bays {
                let centre = bay * (b as f64 + 0.5);
                nave.holes.push((side, passage(centre, half, head, true, Some(thickness))));
                aisle.holes.push((other, passage(centre, half, head, true, None)));
            }
            let one = window(high, thickness, dice);
            aisle.holes.extend(windows(side, aisle.span(side), one, bay, dice));
            draft.rooms.push(aisle);
        } else {
            let sill = dice.between(1.4, 2.2);
            let one =
                Hole { sill, head: (sill + 1.4).min(spring - 0.6), round: true, ..window(spring, thickness, dice) };
            nave.holes.extend(windows(side, nave.span(side), one, bay, dice));
        }
    }
    let door = Hole { centre: 0.5 * wide, half: 0.7, sill: 0.0, head: 2.2, round: false, through: Through::Door };
    nave.holes.push((Wall::West, door));
    // the arch to the apse
    let radius = wide * dice.between(0.3, 0.4);
    let apse_spring = (spring - radius - 0.3).min(dice.between(2.4, 3.2)).max(2.0);
    let deep = 0.4;
    nave.holes.push((Wall::East, passage(0.5 * wide, radius, apse_spring, true, Some(deep))));
    let centre = dvec3(long + deep, 0.0, 0.5 * wide);
    let side_window = Hole {
        half: dice.between(0.28, 0.4),
        sill: dice.between(1.0, 1.4),
        head: apse_spring - 0.7,
        round: true,
        ..window(apse_spring, 0.5, dice)
    };
    let lit = [dice.chance(0.6), dice.chance(0.5), dice.chance(0.6)];
    apse(draft, &nave, centre, radius, apse_spring, side_window, lit);
    altar(&mut draft.extra, draft.palette, centre, dice);
    draft.taken.push(Taken { centre: dvec2(centre.x - deep, centre.z), half: dvec2(1.2, radius) });
    draft.benches = dice.whole(2, 4);
    draft.rooms.insert(0, nave);
    // shafts before the piers between the arches
    if dice.chance(0.6) {
        for k in 1..bays {
            for (side, z) in [(Wall::North, 0.0), (Wall::South, wide)] {
                if side == aisle_side || both {
                    let inward = if side == Wall::North { 0.18 } else { -0.18 };
                    draft.column(dvec3(bay * k as f64, 0.0, z + inward), 0.13, head + 0.5);
                }
            }
        }
    }
}

/// The side of the apse with this number, 0 in the north; u runs from its middle.
fn side(k: usize, centre: DVec3, radius: f64) -> Plane {
    let step = PI / SIDES as f64;
    let a = step * (k as f64 + 0.5) - FRAC_PI_2;
    let out = dvec3(a.cos(), 0.0, a.sin());
    let origin = centre + out * radius * (0.5 * step).cos();
    Plane { origin, along: dvec3(-a.sin(), 0.0, a.cos()), normal: -out }
}

fn apse<'a>(
    draft: &mut Draft<'a>,
    nave: &Room<'a>,
    centre: DVec3,
    radius: f64,
    spring: f64,
    window: Hole,
    lit: [bool; 3],
) {
    let p = draft.palette;
    let (wall, m) = (&p.walls[0].finish, &mut draft.extra);
    let half = radius * (0.5 * PI / SIDES as f64).sin();
    m.object("apse");
    for k in 0..SIDES {
        let plane = side(k, centre, radius);
        let mut holes = Vec::new();
        if (1..=3).contains(&k) && lit[k - 1] && window.half < half - 0.1 {
            let Through::Window { outside, thickness, .. } = window.through else { return };
            let front = Opening::arch(0.0, window.half, window.sill, window.head, 12);
            let behind = Opening::arch(0.0, outside.min(window.half), window.sill, window.head, 12);
            reveal(m, &p.stone.finish, &plane, &front, &behind, thickness, true);
            let top = window.head + window.half;
            let middle = plane.at(0.0, 0.5 * (window.sill + top), thickness);
            let rim = [middle, plane.along * outside.min(window.half), DVec3::Y * (0.5 * (top - window.sill))];
            draft.windows.push(rim);
            holes.push(front);
        }
        panel(m, wall, &plane, &level([-half, half], 0.0), &level([-half, half], spring), &holes);
    }
    m.object("conch");
    let vault: &Finish = &p.ceiling.finish;
    let step = PI / SIDES as f64;
    // as many pieces as the arch before it, so that no light falls between the two
    const RISES: usize = 6;
    let point = |k: usize, j: usize| {
        let (a, e) = (step * k as f64 - FRAC_PI_2, FRAC_PI_2 * j as f64 / RISES as f64);
        centre + dvec3(radius * e.cos() * a.cos(), spring + radius * e.sin(), radius * e.cos() * a.sin())
    };
    for k in 0..SIDES {
        for j in 0..RISES {
            let ring = [(k, j), (k + 1, j), (k + 1, j + 1), (k, j + 1)];
            let corners = ring.map(|(k, j)| point(k, j));
            let inward = centre + DVec3::Y * spring - corners.iter().sum::<DVec3>() / 4.0;
            let metres = ring.map(|(k, j)| dvec2(step * k as f64, FRAC_PI_2 * j as f64 / RISES as f64) * radius);
            m.face_towards(vault, inward, &corners, &metres);
        }
    }
    m.object("apse_floor");
    let rim: Vec<_> = (0..=SIDES).map(|k| point(k, 0).with_y(0.0)).collect();
    let metres: Vec<_> = rim.iter().map(|p| dvec2(p.x, -p.z)).collect();
    m.face_towards(nave.finishes.floor, DVec3::Y, &rim, &metres);
}

/// An altar on a step, its cloth, candlesticks.
fn altar<'a>(m: &mut Model<'a>, p: &'a Palette, centre: DVec3, dice: &mut Dice) {
    m.object("altar");
    let at = centre + dvec3(0.35 + dice.between(0.0, 0.2), 0.0, dice.between(-0.05, 0.05));
    let box_at = |m: &mut Model<'a>, f: &'a Finish, x: [f64; 2], y: [f64; 2], half: f64| {
        cuboid(m, f, at + dvec3(x[0], y[0], -half), at + dvec3(x[1], y[1], half), &[Side::Bottom]);
    };
    let half = dice.between(0.6, 0.85);
    box_at(m, &p.stone.finish, [-0.7, 0.35], [0.0, 0.15], half + 0.3);
    box_at(m, &p.marble.finish, [-0.25, 0.25], [0.15, 1.0], half);
    box_at(m, &p.stone.finish, [-0.32, 0.32], [1.0, 1.08], half + 0.08);
    let cloth = &p.cloths[0].finish;
    box_at(m, cloth, [-0.33, 0.33], [1.08, 1.09], half * 0.6);
    let low = at + dvec3(-0.335, 0.7, -half * 0.6);
    rectangle(m, cloth, Side::West, low, low + dvec3(0.0, 0.39, half * 1.2));
    for sign in [-1.0, 1.0] {
        let stick = [[0.09, 0.0], [0.09, 0.02], [0.025, 0.05], [0.035, 0.18], [0.02, 0.36], [0.05, 0.4], [0.0, 0.4]];
        let foot = at + dvec3(0.1, 1.08, sign * half * 0.8);
        crate::common::parts::revolve(m, &p.gilt.finish, foot, &stick, 12);
    }
}
