//! Plain rooms in a row and one beside them, with doors between.

use glam::dvec3;

use super::{Draft, passage, window, windows};
use crate::interior::dice::Dice;
use crate::interior::room::{Cover, Hole, Through, Wall};

pub(super) fn draw(draft: &mut Draft, dice: &mut Dice) {
    let high = dice.between(2.6, 3.6);
    let thickness = dice.between(0.15, 0.4);
    let outside = dice.between(0.3, 0.6);
    let count = dice.whole(2, 3);
    let wide = dice.between(3.6, 5.5);
    let names = ["room_1", "room_2", "room_3"];
    let mut x = 0.0;
    let mut walls = Vec::new();
    for (k, name) in names.into_iter().enumerate().take(count) {
        let long = dice.between(3.2, 5.5);
        let beams = dice.chance(0.35).then(|| dice.between(0.6, 1.2));
        let depth = wide * dice.between(0.8, 1.1);
        let mut room =
            draft.room(name, dvec3(x, 0.0, 0.0), dvec3(x + long, high, depth), Cover::Flat { beams }, k, dice);
        let light = if dice.chance(0.7) { Wall::North } else { Wall::South };
        let one = window(high, outside, dice);
        let apart = dice.between(1.6, 2.6);
        room.holes.extend(windows(light, room.span(light), one, apart, dice));
        walls.push((x, depth));
        x += long + thickness;
        draft.rooms.push(room);
    }
    // doors from room to room, where both have wall
    for k in 1..count {
        let shared = walls[k - 1].1.min(walls[k].1);
        let (centre, half) = (dice.between(0.9, shared - 0.9), dice.between(0.42, 0.6));
        let (head, round) = (dice.between(2.0, 2.15), dice.chance(0.3));
        let head = if round { head - 0.3 } else { head };
        draft.rooms[k - 1].holes.push((Wall::East, passage(centre, half, head, round, Some(thickness))));
        draft.rooms[k].holes.push((Wall::West, passage(centre, half, head, round, None)));
    }
    let through = Through::Door;
    let z = dice.between(1.0, walls[0].1 - 1.0);
    draft.rooms[0]
        .holes
        .push((Wall::West, Hole { centre: z, half: 0.45, sill: 0.0, head: 2.05, round: false, through }));
    if dice.chance(0.5) {
        let last = &mut draft.rooms[count - 1];
        let niche =
            Hole { centre: 0.0, half: 0.4, sill: 0.9, head: 1.8, round: dice.chance(0.5), through: Through::Niche };
        let centre = dice.between(0.8, walls[count - 1].1 - 0.8);
        last.holes.push((Wall::East, Hole { centre, ..niche }));
    }
}
