//! A generated building: rooms in rows, doors that join them all, pillars.

use clerestory::plan::open_space::OpenSpace;
use clerestory::plan::polygon::Polygon;
use glam::{DVec2, dvec2};

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
/// A spine of corridors, one a storey, joined at one end; rooms hang on both sides of each, with a door of their own.
/// Each room has 4 corners and its door 4; each pillar is a square hole.
pub(crate) fn building(corners: usize, holes: usize, seed: u64) -> Polygon {
    let mut dice = Dice(seed);
    let rooms = (corners.saturating_sub(4 * holes) / 8).max(2);
    // a wing has two rows of rooms on its corridor
    let along = ((rooms as f64).sqrt().ceil() as usize).max(1);
    let wings = rooms.div_ceil(2 * along);
    let (room, wall, hall, door) = (4.0, 0.3, 2.0, 1.0);
    let pitch = 2.0 * room + hall + 4.0 * wall;
    let length = along as f64 * (room + wall);
    let mut outer = vec![dvec2(-3.0, 0.0)];
    let mut places = Vec::new();
    let mut left = rooms;
    for w in 0..wings {
        let base = w as f64 * pitch + room + wall;
        outer.push(dvec2(0.0, base));
        outer.insert(0, DVec2::NAN); // taken out below: keeps the two sides of the loop apart in one pass
        outer.remove(0);
        if w == 0 {
            outer[0] = dvec2(-3.0, base);
        }
        let mut row = |side: f64, columns: &mut dyn Iterator<Item = usize>, outer: &mut Vec<DVec2>| {
            for c in columns {
                if left == 0 {
                    continue;
                }
                left -= 1;
                let x = c as f64 * (room + wall);
                let hall_edge = if side < 0.0 { base } else { base + hall };
                let near = hall_edge + side * wall;
                let far = near + side * (room - 0.5 * dice.roll());
                let d = x + 0.3 + (room - door - 0.6) * dice.roll();
                let mut ring = [
                    dvec2(d, hall_edge),
                    dvec2(d, near),
                    dvec2(x, near),
                    dvec2(x, far),
                    dvec2(x + room, far),
                    dvec2(x + room, near),
                    dvec2(d + door, near),
                    dvec2(d + door, hall_edge),
                ];
                if side > 0.0 {
                    ring.reverse();
                }
                outer.extend(ring);
                places.push(dvec2(x + room / 2.0, (near + far) / 2.0));
            }
        };
        row(-1.0, &mut (0..along), &mut outer);
        outer.push(dvec2(length, base));
        outer.push(dvec2(length, base + hall));
        row(1.0, &mut (0..along).rev(), &mut outer);
        outer.push(dvec2(0.0, base + hall));
    }
    let top = (wings - 1) as f64 * pitch + room + wall + hall;
    outer.push(dvec2(-3.0, top));
    let pillar = |k: usize, dice: &mut Dice| {
        let centre = places[k * places.len() / holes.max(1) % places.len()];
        let at = centre
            + dvec2(dice.roll() - 0.5, dice.roll() - 0.5)
            + 0.7 * ((k * holes.max(1)) / places.len().max(1)) as f64 * 0.0;
        let half = 0.15 + 0.1 * dice.roll();
        vec![at + dvec2(-half, -half), at + dvec2(-half, half), at + dvec2(half, half), at + dvec2(half, -half)]
    };
    let mut dice = Dice(seed + 1);
    let mut all: Vec<Vec<DVec2>> = (0..holes).map(|k| pillar(k, &mut dice)).collect();
    // few rooms for many pillars: a row of small ones in the side corridor
    if holes > places.len() {
        let step = (top - room - wall) / (holes + 1) as f64;
        all = (0..holes)
            .map(|k| {
                let at = dvec2(-1.5 + 0.5 * (dice.roll() - 0.5), room + wall + step * (k + 1) as f64);
                let half = 0.3 * step.min(0.5);
                vec![at + dvec2(-half, -half), at + dvec2(-half, half), at + dvec2(half, half), at + dvec2(half, -half)]
            })
            .collect();
    }
    Polygon { outer, holes: all }
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
