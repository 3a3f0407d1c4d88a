//! Low barrel vaults side by side, with arches between them and small windows high up.

use glam::dvec3;

use super::{Draft, passage, windows};
use crate::interior::dice::Dice;
use crate::interior::room::{Cover, Hole, Through, Wall};

pub(super) fn draw(draft: &mut Draft, dice: &mut Dice) {
    let count = dice.whole(2, 3);
    let long = dice.between(5.0, 8.5);
    let (spring, wide) = (dice.between(1.5, 2.0), dice.between(2.6, 3.8));
    let thickness = dice.between(0.4, 0.7);
    let ribs = dice.chance(0.4);
    let names = ["vault_1", "vault_2", "vault_3"];
    let rise = wide * dice.between(0.26, 0.42);
    for (k, name) in names.into_iter().enumerate().take(count) {
        let z = k as f64 * (wide + thickness);
        // one of them may end earlier
        let end = if k == 1 && dice.chance(0.5) { long * dice.between(0.6, 0.9) } else { long };
        let cover = Cover::Barrel { along_x: true, rise, ribs };
        let (low, high) = (dvec3(0.0, 0.0, z), dvec3(end, spring, z + wide));
        let room = draft.room(name, low, high, cover, if dice.chance(0.7) { 0 } else { k }, dice);
        draft.rooms.push(room);
    }
    for k in 1..count {
        let end = draft.rooms[k - 1].high.x.min(draft.rooms[k].high.x);
        let half = dice.between(0.55, 0.9).min(0.2 * end);
        let head = (spring - half - 0.05).max(0.6);
        for centre in [end * dice.between(0.24, 0.3), end * dice.between(0.7, 0.76)] {
            draft.rooms[k - 1].holes.push((Wall::South, passage(centre, half, head, true, Some(thickness))));
            draft.rooms[k].holes.push((Wall::North, passage(centre, half, head, true, None)));
        }
    }
    // light falls in at the vaults' ends
    let through = Through::Window { outside: 0.25, thickness: 0.6, bars: dice.chance(0.6) };
    for k in 0..count {
        let centre = (k as f64) * (wide + thickness) + wide * dice.between(0.4, 0.6);
        let one = Hole { centre, half: 0.32, sill: 1.25, head: spring + 0.15, round: true, through };
        let wall = if dice.chance(0.6) { Wall::West } else { Wall::East };
        if k == 0 || dice.chance(0.6) {
            draft.rooms[k].holes.push((wall, one));
        }
        let door = Hole { centre, half: 0.5, sill: 0.0, head: 1.85, round: false, through: Through::Door };
        if k == 0 {
            draft.rooms[k].holes.push((if wall == Wall::West { Wall::East } else { Wall::West }, door));
        }
    }
    let niche = Hole { centre: 0.0, half: 0.35, sill: 0.5, head: 1.0, round: true, through: Through::Niche };
    let span = draft.rooms[0].span(Wall::North);
    let niches = windows(Wall::North, span, niche, 2.2, dice);
    draft.rooms[0].holes.extend(niches);
}
