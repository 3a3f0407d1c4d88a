//! The plan of an interior by kind and seed: rooms, the holes in their walls, and what stands before they are furnished.

mod cellar;
mod chapel;
mod hall;
mod rooms;
mod stairs;

use glam::{DVec2, DVec3, dvec2, dvec3};

use super::Kind;
use super::dice::Dice;
use super::furnish::{Furnisher, Taken};
use super::furniture;
use super::palette::Palette;
use super::room::{Cover, Finishes, Hole, Room, Through, Wall};
use crate::common::mesh::Model;

/// A hole to the outside, model's axes: its middle and the halves of its sides.
pub type Window = [DVec3; 3];

/// An interior: everything but its light.
pub struct Layout<'a> {
    /// All that is built.
    pub model: Model<'a>,
    /// Its rooms.
    pub rooms: Vec<Room<'a>>,
    /// Holes to the outside.
    pub windows: Vec<Window>,
}

/// Rooms before they are built, and what a kind adds.
struct Draft<'a> {
    palette: &'a Palette,
    kind: Kind,
    rooms: Vec<Room<'a>>,
    /// What a kind builds beside its rooms.
    extra: Model<'a>,
    /// Where nothing may be put.
    taken: Vec<Taken>,
    windows: Vec<Window>,
    /// Rows of benches in the first room, all facing east.
    benches: usize,
}

impl<'a> Layout<'a> {
    /// The interior of a kind by seed; `lamps` hangs lamps, and where it is `bare` there is nothing else.
    pub fn new(kind: Kind, palette: &'a Palette, lamps: bool, bare: bool, dice: &mut Dice) -> Self {
        let mut draft = Draft {
            palette,
            kind,
            rooms: Vec::new(),
            extra: Model::default(),
            taken: Vec::new(),
            windows: Vec::new(),
            benches: 0,
        };
        match kind {
            Kind::Hall => hall::draw(&mut draft, dice),
            Kind::Chapel => chapel::draw(&mut draft, dice),
            Kind::Rooms => rooms::draw(&mut draft, dice),
            Kind::Cellar => cellar::draw(&mut draft, dice),
            Kind::Stairs => stairs::draw(&mut draft, dice),
        }
        draft.finish(lamps, bare, dice)
    }
}

impl<'a> Draft<'a> {
    fn finish(self, lamps: bool, bare: bool, dice: &mut Dice) -> Layout<'a> {
        let Draft { palette, kind, rooms, extra, taken, mut windows, benches } = self;
        let mut model = Model::default();
        for (i, room) in rooms.iter().enumerate() {
            room.build(&mut model);
            windows.extend(room_windows(room));
            let mut furnisher = Furnisher::new(&mut model, room, palette, dice, &taken);
            let lamps = lamps && (i == 0 || kind != Kind::Chapel);
            if bare {
                furnisher.light(kind, lamps);
                continue;
            }
            if i == 0 && benches > 0 {
                furnisher.benches(benches, std::f64::consts::FRAC_PI_2);
            }
            furnisher.furnish(kind, lamps);
        }
        model.add(&extra, glam::DAffine3::IDENTITY);
        Layout { model, rooms, windows }
    }

    /// The finishes of the k-th room.
    fn finishes(&self, k: usize, dice: &mut Dice) -> Finishes<'a> {
        let p = self.palette;
        let often = if self.kind == Kind::Cellar { 0.0 } else { 0.4 };
        Finishes {
            wall: &p.walls[k % 3].finish,
            dado: dice.chance(often).then(|| (&p.dado.finish, dice.between(0.8, 1.2))),
            frieze: dice.chance(0.6 * often).then_some((&p.frieze.finish, p.frieze.finish.tile.y)),
            floor: &p.floors[k % 3].finish,
            ceiling: &p.ceiling.finish,
            stone: &p.stone.finish,
            wood: &p.woods[0].finish,
        }
    }

    fn room(&self, name: &'static str, low: DVec3, high: DVec3, cover: Cover, k: usize, dice: &mut Dice) -> Room<'a> {
        Room { name, low, high, cover, holes: Vec::new(), open: Vec::new(), finishes: self.finishes(k, dice) }
    }

    /// Puts a column, and keeps its place free.
    fn column(&mut self, at: DVec3, radius: f64, height: f64) {
        let piece = furniture::column(self.palette, radius, height);
        self.extra.add(&piece.model, glam::DAffine3::from_translation(at));
        self.taken.push(Taken { centre: dvec2(at.x, at.z), half: DVec2::splat(radius * 1.4) });
    }
}

/// Windows like `one` spread over a stretch of a wall, some left out; at least one stays.
fn windows(wall: Wall, span: [f64; 2], one: Hole, apart: f64, dice: &mut Dice) -> Vec<(Wall, Hole)> {
    let n = ((span[1] - span[0]) / apart).floor().max(1.0) as usize;
    let at = |k: usize| span[0] + (span[1] - span[0]) * (k as f64 + 0.5) / n as f64;
    let kept = dice.whole(0, n - 1);
    let shift = dice.between(-0.15, 0.15) * apart;
    (0..n)
        .filter(|&k| k == kept || dice.chance(0.7))
        .map(|k| (wall, Hole { centre: at(k) + shift, ..one }))
        .filter(|(_, h)| h.centre - h.half > span[0] + 0.15 && h.centre + h.half < span[1] - 0.15)
        .collect()
}

/// A window by seed in a wall `thickness` thick; the storey is `height` high.
fn window(height: f64, thickness: f64, dice: &mut Dice) -> Hole {
    let half = dice.between(0.4, 0.75);
    let sill = dice.between(0.75, 1.2).min(height - 1.2);
    let round = dice.chance(0.4);
    let head = (sill + dice.between(1.1, 2.0)).min(height - 0.35 - if round { half } else { 0.0 });
    let through = Through::Window { outside: half * dice.between(0.72, 0.95), thickness, bars: dice.chance(0.5) };
    Hole { centre: 0.0, half, sill, head, round, through }
}

/// A way through a wall.
fn passage(centre: f64, half: f64, head: f64, round: bool, thickness: Option<f64>) -> Hole {
    Hole { centre, half, sill: 0.0, head, round, through: Through::Passage { thickness } }
}

/// The outer rims of a room's windows.
fn room_windows(room: &Room) -> Vec<Window> {
    let outer = |&(wall, hole): &(Wall, Hole)| {
        let Through::Window { outside, thickness, .. } = hole.through else { return None };
        let plane = room.plane(wall);
        let top = if hole.round { hole.head + outside.max(hole.half) } else { hole.head };
        let middle = plane.at(hole.centre, room.low.y + 0.5 * (hole.sill + top), thickness);
        Some([middle, plane.along * outside, dvec3(0.0, 0.5 * (top - hole.sill), 0.0)])
    };
    room.holes.iter().filter_map(outer).collect()
}
