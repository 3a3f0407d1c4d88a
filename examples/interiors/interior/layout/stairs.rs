//! A high room with a flight of steps along one wall up to a gallery.

use glam::{DVec3, dvec2, dvec3};

use super::{Draft, window, windows};
use crate::common::mesh::{Finish, Model};
use crate::common::parts::{Side, cuboid, rectangle, revolve, tube};
use crate::interior::dice::Dice;
use crate::interior::furnish::Taken;
use crate::interior::room::{Cover, Hole, Through, Wall};

pub(super) fn draw(draft: &mut Draft, dice: &mut Dice) {
    let (long, wide, high) = (dice.between(6.0, 9.0), dice.between(4.5, 6.5), dice.between(5.0, 6.5));
    let cover = if dice.chance(0.4) {
        Cover::Barrel { along_x: true, rise: wide * 0.3, ribs: dice.chance(0.4) }
    } else {
        Cover::Flat { beams: dice.chance(0.5).then_some(1.1) }
    };
    let mut room = draft.room("stair_hall", DVec3::ZERO, dvec3(long, high, wide), cover, 0, dice);
    let thickness = dice.between(0.35, 0.6);
    // windows low on the west and high on the north: the stair runs along the south wall, the gallery is in the east
    let high_up = Hole { sill: 3.3, head: (high - 0.6).min(4.6), round: false, ..window(high, thickness, dice) };
    room.holes.extend(windows(Wall::North, room.span(Wall::North), high_up, 2.2, dice));
    let low = window(3.0, thickness, dice);
    let centre = wide * dice.between(0.3, 0.45);
    room.holes.push((Wall::West, Hole { centre, ..low }));
    let door = Hole { centre: long * 0.3, half: 0.55, sill: 0.0, head: 2.1, round: false, through: Through::Door };
    room.holes.push((Wall::North, door));
    draft.rooms.push(room);

    let (gallery, deep) = (dice.between(2.6, 3.0), dice.between(1.3, 2.0));
    let broad = dice.between(0.9, 1.2);
    let steps = (gallery / 0.175).round() as usize;
    let (rise, going) = (gallery / steps as f64, 0.26);
    let end = long - deep;
    let start = end - going * (steps - 1) as f64;
    let (wood, stone) = (&draft.palette.woods[0].finish, &draft.palette.stone.finish);
    let tread: &Finish = if dice.chance(0.5) { wood } else { stone };
    let m = &mut draft.extra;
    m.object("stair");
    let z = [wide - broad, wide];
    for k in 0..steps - 1 {
        let x = [start + going * k as f64, start + going * (k + 1) as f64];
        let top = rise * (k + 1) as f64;
        rectangle(m, tread, Side::Top, dvec3(x[0], top, z[0]), dvec3(x[1], top, z[1]));
        rectangle(m, tread, Side::West, dvec3(x[0], top - rise, z[0]), dvec3(x[0], top, z[1]));
        rectangle(m, stone, Side::North, dvec3(x[0], 0.0, z[0]), dvec3(x[1], top, z[0]));
    }
    m.object("gallery");
    cuboid(
        m,
        wood,
        dvec3(end, gallery - 0.18, 0.0),
        dvec3(long, gallery, wide),
        &[Side::East, Side::South, Side::North],
    );
    rectangle(m, stone, Side::East, dvec3(end, 0.0, z[0]), dvec3(end, gallery - 0.18, z[1]));
    m.object("balustrade");
    let rail = |x: f64| dvec3(x, (x - start) / going * rise + 1.0, z[0] + 0.05);
    tube(m, wood, &[rail(start), rail(end)], 0.035, 8, false, DVec3::Y);
    for k in (0..steps - 1).step_by(2) {
        let x = start + going * (k as f64 + 0.5);
        baluster(m, wood, dvec3(x, rise * (k + 1) as f64, z[0] + 0.05), 0.88);
    }
    let front = [0.02, z[0]];
    tube(
        m,
        wood,
        &[dvec3(end + 0.05, gallery + 0.95, front[0]), dvec3(end + 0.05, gallery + 0.95, front[1])],
        0.035,
        8,
        false,
        DVec3::Y,
    );
    let n = ((front[1] - front[0]) / 0.2) as usize;
    for k in 0..n {
        let z = front[0] + (front[1] - front[0]) * (k as f64 + 0.5) / n as f64;
        baluster(m, wood, dvec3(end + 0.05, gallery, z), 0.95);
    }
    let mut take = |x: [f64; 2], z: [f64; 2]| {
        let (low, high) = (dvec2(x[0], z[0]), dvec2(x[1], z[1]));
        draft.taken.push(Taken { centre: 0.5 * (low + high), half: 0.5 * (high - low) });
    };
    take([start - 0.6, long], [z[0] - 0.1, wide]);
    for z in [0.9, z[0] - 0.9] {
        draft.column(dvec3(end + 0.15, 0.0, z), 0.11, gallery - 0.18);
    }
}

fn baluster<'a>(m: &mut Model<'a>, finish: &'a Finish, at: DVec3, height: f64) {
    let profile = [[0.022, 0.0], [0.02, 0.15], [0.036, 0.35], [0.018, 0.65], [0.022, 1.0]];
    revolve(m, finish, at, &profile.map(|[r, t]| [r, t * height]), 8);
}
