//! One large room, with a row of columns, two or none, and windows mostly on one side.

use glam::{DVec3, dvec3};

use super::{Draft, window, windows};
use crate::interior::dice::Dice;
use crate::interior::room::{Cover, Hole, Through, Wall};

pub(super) fn draw(draft: &mut Draft, dice: &mut Dice) {
    let (long, wide, high) = (dice.between(7.5, 13.0), dice.between(5.0, 8.0), dice.between(3.4, 5.2));
    let cover = if dice.chance(0.3) {
        Cover::Barrel { along_x: true, rise: wide * dice.between(0.2, 0.4), ribs: dice.chance(0.5) }
    } else {
        Cover::Flat { beams: dice.chance(0.65).then(|| dice.between(0.8, 1.8)) }
    };
    let mut room = draft.room("hall", DVec3::ZERO, dvec3(long, high, wide), cover, 0, dice);
    let thickness = dice.between(0.35, 0.7);
    let (light, dark) = if dice.chance(0.5) { (Wall::South, Wall::North) } else { (Wall::North, Wall::South) };
    let one = window(high, thickness, dice);
    let apart = dice.between(2.0, 3.2);
    room.holes.extend(windows(light, room.span(light), one, apart, dice));
    // the far end: a window, or a door; the near one a door
    let end = room.span(Wall::East);
    let middle = 0.5 * (end[0] + end[1]) + dice.between(-1.0, 1.0);
    if dice.chance(0.5) {
        let other = window(high, thickness, dice);
        room.holes.push((Wall::East, Hole { centre: middle, ..other }));
    }
    let door = Hole {
        centre: middle,
        half: dice.between(0.5, 0.8),
        sill: 0.0,
        head: dice.between(2.0, 2.3),
        round: false,
        through: Through::Door,
    };
    room.holes.push((Wall::West, door));
    if dice.chance(0.6) {
        let niche =
            Hole { half: dice.between(0.4, 0.6), sill: 0.8, head: 2.0, round: true, through: Through::Niche, ..door };
        let apart = dice.between(2.5, 4.0);
        room.holes.extend(windows(dark, room.span(dark), niche, apart, dice));
    } else if dice.chance(0.3) {
        // as in few rooms: the same on both sides
        room.holes.extend(windows(dark, room.span(dark), one, apart, dice));
    }
    let rows = if matches!(cover, Cover::Flat { .. }) { dice.whole(0, 2) } else { 0 };
    let bays = (long / dice.between(2.4, 3.4)).round() as usize;
    for row in 0..rows {
        let z = wide * (row as f64 + 1.0) / (rows as f64 + 1.0);
        let radius = dice.between(0.16, 0.26);
        for k in 1..bays {
            draft.column(dvec3(long * k as f64 / bays as f64, 0.0, z), radius, high - 0.22);
        }
        // the beam that they carry
        draft.extra.object("architrave");
        let (low, top) = (dvec3(0.0, high - 0.22, z - 0.14), dvec3(long, high, z + 0.14));
        use crate::common::parts::{Side, cuboid};
        let hidden = [Side::Top, Side::West, Side::East];
        cuboid(&mut draft.extra, &draft.palette.woods[1].finish, low, top, &hidden);
    }
    draft.rooms.push(room);
}
