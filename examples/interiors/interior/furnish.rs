//! Puts things into rooms: along walls, in the middle, on walls and under ceilings, where there is space.

use glam::{DAffine3, DQuat, DVec2, DVec3, dvec2, dvec3};

use super::Kind;
use super::dice::Dice;
use super::furniture::{Piece, bench, cask, chair, chest, cupboard, lectern, rug, shelf, statue, table};
use super::hangings::{banner, chandelier, sconce};
use super::palette::Palette;
use super::room::{Cover, Room, Through, WALLS, Wall};
use crate::common::mesh::Model;
use crate::common::parts::{Painting, Plane, painting};

/// A rectangle on the floor (x, z) that is taken, between two heights above it.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    /// Its middle.
    pub centre: DVec2,
    /// Halves of its sides.
    pub half: DVec2,
}

impl Taken {
    fn meets(&self, other: &Self, gap: f64) -> bool {
        let apart = (self.centre - other.centre).abs() - self.half - other.half;
        apart.max_element() < gap
    }
}

/// A stretch of a wall that is taken: u and height.
#[derive(Clone, Copy)]
struct Stretch {
    wall: Wall,
    u: [f64; 2],
    v: [f64; 2],
}

/// A room that is being furnished.
pub struct Furnisher<'r, 'a> {
    m: &'r mut Model<'a>,
    room: &'r Room<'a>,
    palette: &'a Palette,
    dice: &'r mut Dice,
    taken: Vec<Taken>,
    walls: Vec<Stretch>,
}

impl<'r, 'a> Furnisher<'r, 'a> {
    /// Starts with what is there already.
    pub fn new(
        m: &'r mut Model<'a>,
        room: &'r Room<'a>,
        palette: &'a Palette,
        dice: &'r mut Dice,
        blocked: &[Taken],
    ) -> Self {
        let mut taken = blocked.to_vec();
        let mut walls = Vec::new();
        for &(wall, hole) in &room.holes {
            let plane = room.plane(wall);
            walls.push(Stretch {
                wall,
                u: [hole.centre - hole.half - 0.1, hole.centre + hole.half + 0.1],
                v: [hole.sill - 0.05, hole.top() + 0.1],
            });
            if matches!(hole.through, Through::Passage { .. } | Through::Door) {
                let before = plane.at(hole.centre, 0.0, -0.45);
                let along = plane.along.abs() * hole.half + plane.normal.abs() * 0.45;
                taken.push(Taken { centre: dvec2(before.x, before.z), half: dvec2(along.x, along.z) });
            }
        }
        Self { m, room, palette, dice, taken, walls }
    }

    fn free(&self, place: &Taken) -> bool {
        let (low, high) = (dvec2(self.room.low.x, self.room.low.z), dvec2(self.room.high.x, self.room.high.z));
        let inside = (place.centre - place.half).cmpge(low).all() && (place.centre + place.half).cmple(high).all();
        inside && !self.taken.iter().any(|t| t.meets(place, 0.08))
    }

    fn put(&mut self, piece: &Piece<'a>, at: DVec3, angle: f64) {
        self.m.add(&piece.model, DAffine3::from_rotation_translation(DQuat::from_rotation_y(angle), at));
    }

    /// Puts a piece somewhere along a wall; whether there was space.
    fn along_wall(&mut self, piece: &Piece<'a>) -> bool {
        for _ in 0..12 {
            let wall = self.dice.pick(&WALLS);
            if self.room.open.contains(&wall) {
                continue;
            }
            let (plane, span) = (self.room.plane(wall), self.room.span(wall));
            if span[1] - span[0] < 2.0 * piece.half.x + 0.2 {
                continue;
            }
            let u = self.dice.between(span[0] + piece.half.x + 0.05, span[1] - piece.half.x - 0.05);
            let stretch = Stretch { wall, u: [u - piece.half.x, u + piece.half.x], v: [0.0, piece.height] };
            let at = plane.at(u, self.room.low.y, -piece.half.y - 0.03);
            let half = plane.along.abs() * piece.half.x + plane.normal.abs() * piece.half.y;
            let place = Taken { centre: dvec2(at.x, at.z), half: dvec2(half.x, half.z) };
            if self.on_wall_free(&stretch) && self.free(&place) {
                self.put(piece, at, plane.normal.x.atan2(plane.normal.z));
                self.taken.push(place);
                self.walls.push(stretch);
                return true;
            }
        }
        false
    }

    fn on_wall_free(&self, s: &Stretch) -> bool {
        !self
            .walls
            .iter()
            .any(|w| w.wall == s.wall && w.u[0] < s.u[1] && s.u[0] < w.u[1] && w.v[0] < s.v[1] && s.v[0] < w.v[1])
    }

    /// Puts a piece in the open at any angle; where, if there was space.
    fn in_the_open(&mut self, piece: &Piece<'a>, square: bool) -> Option<(DVec3, f64)> {
        for _ in 0..16 {
            let quarter = std::f64::consts::FRAC_PI_2 * self.dice.whole(0, 3) as f64;
            let angle = quarter + if square { 0.0 } else { self.dice.between(-0.5, 0.5) };
            let (s, c) = (angle.sin().abs(), angle.cos().abs());
            let half = dvec2(piece.half.x * c + piece.half.y * s, piece.half.x * s + piece.half.y * c);
            let (low, high) = (self.room.low, self.room.high);
            let room = (dvec2(high.x - low.x, high.z - low.z) - 2.0 * half).max(DVec2::ZERO);
            let centre = dvec2(low.x, low.z) + half + room * dvec2(self.dice.unit(), self.dice.unit());
            let place = Taken { centre, half };
            if self.free(&place) {
                let at = dvec3(centre.x, low.y, centre.y);
                self.put(piece, at, angle);
                self.taken.push(place);
                return Some((at, angle));
            }
        }
        None
    }

    /// A table and chairs around it, some pulled away and turned.
    fn table_and_chairs(&mut self) {
        let piece = table(self.palette, self.dice);
        // the chairs' space is taken with the table's
        let around = Piece { half: piece.half + dvec2(0.15, 0.45), ..piece };
        let Some((at, angle)) = self.in_the_open(&around, false) else { return };
        let n = ((around.half.x * 2.0) / 0.7) as usize;
        for k in 0..n {
            for side in [-1.0, 1.0] {
                if self.dice.chance(0.3) {
                    continue;
                }
                let x = (k as f64 + 0.5) / n as f64 * 2.0 * around.half.x - around.half.x;
                let local = dvec3(x, 0.0, side * (around.half.y - self.dice.between(0.12, 0.3)));
                let turn = DQuat::from_rotation_y(angle);
                let facing = if side > 0.0 { std::f64::consts::PI } else { 0.0 };
                let chair = chair(self.palette, self.dice);
                let loose = self.dice.between(-0.35, 0.35);
                self.put(&chair, at + turn * local, angle + facing + loose);
            }
        }
    }

    /// Rows of benches that face a wall.
    pub fn benches(&mut self, rows: usize, towards: f64) {
        let (low, high) = (self.room.low, self.room.high);
        let size = self.room.size();
        let half = (size.y * 0.5 - 0.8) * 0.5;
        for row in 0..rows {
            let x = low.x + size.x * 0.35 + 0.95 * row as f64;
            if x > high.x - 1.6 {
                return;
            }
            for side in [-1.0, 1.0] {
                if self.dice.chance(0.15) {
                    continue;
                }
                let piece = bench(self.palette, self.dice, half);
                let z = 0.5 * (low.z + high.z) + side * (0.5 + half);
                let place = Taken { centre: dvec2(x, z), half: dvec2(0.25, half) };
                if self.free(&place) {
                    let loose = self.dice.between(-0.04, 0.04);
                    self.put(&piece, dvec3(x, low.y, z), towards + loose);
                    self.taken.push(place);
                }
            }
        }
    }

    /// Hangs pictures, cloths and lamps on free stretches of the walls.
    fn on_walls(&mut self, pictures: usize, banners: usize, lamps: usize) {
        let top = self.room.high.y - self.room.low.y;
        for k in 0..pictures {
            let finish = &self.palette.paintings[(k + self.dice.whole(0, 5)) % 6].finish;
            let size = finish.tile + 0.12;
            if let Some((wall, u, v)) = self.stretch(size, [1.0 + 0.5 * size.y, top - 0.1 - 0.5 * size.y], [1.5, 1.9]) {
                let plane = self.room.plane(wall);
                // along to the right of a person who looks at the wall
                let along = (-plane.normal).cross(DVec3::Y);
                let origin = plane.at(u, self.room.low.y, 0.0);
                let hung = Plane { origin, along, normal: plane.normal };
                let frame = if k % 2 == 0 { &self.palette.gilt.finish } else { &self.palette.woods[0].finish };
                self.m.object("painting");
                let what = Painting { plane: hung, centre: dvec2(0.0, v), finish, flip: false, shift: 0.0 };
                painting(self.m, frame, &what);
            }
        }
        for _ in 0..banners {
            let size = dvec2(self.dice.between(0.6, 1.3), self.dice.between(1.0, (top * 0.6).clamp(1.1, 2.6)));
            let high = (top - 0.25).min(3.6);
            if let Some((wall, u, v)) = self.stretch(size, [0.5 * size.y + 0.3, high - 0.5 * size.y], [1.4, 2.4]) {
                let piece = banner(self.palette, self.dice, size);
                self.hang(&piece, wall, u, v + 0.5 * size.y);
            }
        }
        for _ in 0..lamps {
            if let Some((wall, u, v)) = self.stretch(dvec2(0.3, 0.4), [1.5, top - 0.3], [1.7, 2.1]) {
                let piece = sconce(self.palette);
                self.hang(&piece, wall, u, v);
            }
        }
    }

    fn hang(&mut self, piece: &Piece<'a>, wall: Wall, u: f64, v: f64) {
        let plane = self.room.plane(wall);
        self.put(piece, plane.at(u, self.room.low.y + v, 0.0), plane.normal.x.atan2(plane.normal.z));
    }

    /// A free stretch of a wall of this size: wall, u and height of its middle, which is between `v` and best `near`.
    fn stretch(&mut self, size: DVec2, v: [f64; 2], near: [f64; 2]) -> Option<(Wall, f64, f64)> {
        for _ in 0..14 {
            let wall = self.dice.pick(&WALLS);
            let span = self.room.span(wall);
            if self.room.open.contains(&wall) || span[1] - span[0] < size.x + 0.3 || v[0] > v[1] {
                continue;
            }
            let u = self.dice.between(span[0] + 0.5 * size.x + 0.1, span[1] - 0.5 * size.x - 0.1);
            let v = self.dice.between(near[0], near[1]).clamp(v[0], v[1]);
            let s = Stretch { wall, u: [u - 0.5 * size.x, u + 0.5 * size.x], v: [v - 0.5 * size.y, v + 0.5 * size.y] };
            if self.on_wall_free(&s) {
                self.walls.push(s);
                return Some((wall, u, v));
            }
        }
        None
    }

    /// Hangs a ring of lamps from the ceiling.
    fn chandelier(&mut self) {
        let (low, high) = (self.room.low, self.room.high);
        let ring = (low.y + self.dice.between(2.2, 2.6)).min(high.y - 0.5);
        let (x, z) = (self.dice.between(0.35, 0.65), self.dice.between(0.4, 0.6));
        let at = dvec3(low.x + (high.x - low.x) * x, ring, low.z + (high.z - low.z) * z);
        let ceiling = match self.room.cover {
            Cover::Flat { .. } => high.y,
            Cover::Barrel { along_x, rise, .. } => {
                let t = if along_x { 2.0 * z - 1.0 } else { 2.0 * x - 1.0 };
                high.y + rise * (1.0 - t * t).max(0.0).sqrt()
            }
        };
        let piece = chandelier(self.palette, self.dice, ceiling - ring);
        self.put(&piece, at, 0.0);
    }

    /// Furnishes the room as its kind is. `lamps` says whether there is light of lamps.
    pub fn furnish(&mut self, kind: Kind, lamps: bool) {
        let area = self.room.size().element_product();
        let amount = |per: f64| ((area / per) as usize).clamp(1, 7);
        let p = self.palette;
        if kind != Kind::Cellar && self.dice.chance(0.5) {
            let piece = rug(p);
            if self.in_the_open(&piece, true).is_some() {
                // furniture may stand on it
                self.taken.pop();
            }
        }
        match kind {
            Kind::Chapel => {}
            Kind::Cellar => {}
            _ => (0..amount(16.0).min(3)).for_each(|_| self.table_and_chairs()),
        }
        for _ in 0..amount(7.0) {
            let which = self.dice.whole(0, 6);
            let piece = match (kind, which) {
                (Kind::Cellar, 0..=3) => cask(p, self.dice),
                (Kind::Chapel, 0..=2) | (_, 6) => statue(p, self.dice),
                (Kind::Cellar, _) | (_, 0) => chest(p, self.dice),
                (_, 1..=2) => shelf(p, self.dice),
                (_, 3) => cupboard(p, self.dice),
                _ => {
                    let half = self.dice.between(0.5, 0.9);
                    bench(p, self.dice, half)
                }
            };
            self.along_wall(&piece);
        }
        for _ in 0..amount(18.0).min(3) {
            let piece = match (kind, self.dice.whole(0, 3)) {
                (Kind::Cellar, 0..=2) => cask(p, self.dice),
                (_, 0) => lectern(p, self.dice),
                (_, 1) => statue(p, self.dice),
                _ => chest(p, self.dice),
            };
            self.in_the_open(&piece, false);
        }
        let n = amount(10.0);
        match kind {
            Kind::Cellar => self.on_walls(0, 0, if lamps { 2 } else { 0 }),
            _ => {
                let sconces = if lamps && self.dice.chance(0.6) { 2 } else { 0 };
                self.on_walls(n.min(4), n.div_ceil(3).min(2), sconces);
            }
        }
        if lamps && kind != Kind::Cellar {
            self.chandelier();
        }
    }

    /// Hangs lamps alone.
    pub fn light(&mut self, kind: Kind, lamps: bool) {
        if lamps && kind == Kind::Cellar {
            self.on_walls(0, 0, 2);
        } else if lamps {
            self.chandelier();
        }
    }
}
