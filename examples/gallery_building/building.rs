//! A generated building: rooms along corridors, doors, pillars.

use clerestory::plan::free_space::open_space::OpenSpace;
use clerestory::plan::free_space::polygon::{Polygon, Ring};
use glam::{DVec2, dvec2};

const ROOM: f64 = 4.0;
const WALL: f64 = 0.3;
const HALL: f64 = 2.0;
const DOOR: f64 = 1.0;

/// Numbers that look random and are the same everywhere (Steele, Lea and Flood's SplitMix64).
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    /// 0 to 1.
    pub(crate) fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// About so many corners in all, with exactly so many holes.
///
/// A hall runs along the left; wings with a corridor branch off it, rooms hang on both sides of each. A room has 4
/// corners and its door 4; a pillar is a square hole in a room (in the hall where rooms are fewer than pillars).
pub(crate) fn building(corners: usize, holes: usize, seed: u64) -> Polygon {
    let mut dice = Dice(seed);
    let rooms = (corners.saturating_sub(4 * holes) / 8).max(2);
    let along = (rooms as f64).sqrt().ceil() as usize;
    let wings = rooms.div_ceil(2 * along);
    let length = along as f64 * (ROOM + WALL) + WALL;
    let base = |w: usize| w as f64 * (2.0 * ROOM + HALL + 4.0 * WALL);
    let top = base(wings - 1) + HALL;
    let mut outer = vec![dvec2(-3.0, 0.0)];
    let mut centres = Vec::new();
    for w in 0..wings {
        let first = w * 2 * along;
        let here = rooms.saturating_sub(first).min(2 * along);
        let (below, above) = (here.min(along), here.saturating_sub(along));
        outer.push(dvec2(0.0, base(w)));
        for c in 0..below {
            outer.extend(room(c, base(w), -1.0, &mut dice, &mut centres));
        }
        outer.extend([dvec2(length, base(w)), dvec2(length, base(w) + HALL)]);
        for c in (0..above).rev() {
            outer.extend(room(c, base(w) + HALL, 1.0, &mut dice, &mut centres).into_iter().rev());
        }
        outer.push(dvec2(0.0, base(w) + HALL));
    }
    outer.push(dvec2(-3.0, top));
    let pillars = (0..holes).map(|k| {
        let shift = dvec2(dice.roll() - 0.5, dice.roll() - 0.5);
        if holes <= centres.len() {
            square(centres[k * centres.len() / holes] + shift, 0.15 + 0.1 * dice.roll())
        } else {
            let step = top / (holes + 1) as f64;
            square(dvec2(-1.5 + shift.x, step * (k + 1) as f64), 0.3 * step.min(0.5))
        }
    });
    let holes = pillars.collect();
    Polygon { outer, holes }
}

/// A room and its door, below (−1) or above (1) a corridor's edge, from left to right.
fn room(column: usize, edge: f64, side: f64, dice: &mut Dice, centres: &mut Vec<DVec2>) -> [DVec2; 8] {
    let left = WALL + column as f64 * (ROOM + WALL);
    let right = left + ROOM;
    let near = edge + side * WALL;
    let far = near + side * (ROOM - 0.5 * dice.roll());
    let door = left + 0.3 + (ROOM - DOOR - 0.6) * dice.roll();
    centres.push(dvec2((left + right) / 2.0, (near + far) / 2.0));
    [
        dvec2(door, edge),
        dvec2(door, near),
        dvec2(left, near),
        dvec2(left, far),
        dvec2(right, far),
        dvec2(right, near),
        dvec2(door + DOOR, near),
        dvec2(door + DOOR, edge),
    ]
}

fn square(at: DVec2, half: f64) -> Ring {
    [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(x, y)| at + dvec2(x, y) * half).to_vec()
}

/// Places inside, spread evenly by chance.
pub(crate) fn places(open: &OpenSpace, count: usize) -> Vec<DVec2> {
    let mut dice = Dice(7);
    let (low, high) = open.bounds();
    let mut places = Vec::new();
    while places.len() < count {
        let p = low + (high - low) * dvec2(dice.roll(), dice.roll());
        places.extend(open.contains(p).then_some(p));
    }
    places
}
