//! Rooms: a floor, four walls with openings, and a flat ceiling or a barrel vault; windows, doors, arches and niches.
//!
//! Only inner shells are built; windows are tubes through the wall that end in the open air. East is +x, south is +z, up
//! is y, metres.

mod cover;

use glam::{DVec2, DVec3, dvec2};
use std::f64::consts::PI;

use crate::common::mesh::{Finish, Model};
use crate::common::parts::{Line, Opening, Plane, Side, cuboid, level, panel, rectangle, reveal};
use cover::half_ellipse;

/// The walls of a room.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Wall {
    /// At the least x; seen from inside, its normal is +x.
    West,
    /// At the greatest x.
    East,
    /// At the least z.
    North,
    /// At the greatest z.
    South,
}

/// All four.
pub const WALLS: [Wall; 4] = [Wall::West, Wall::East, Wall::North, Wall::South];

/// What closes a room above.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Cover {
    /// A ceiling; with beams this far apart, across the shorter side, if at all.
    Flat { beams: Option<f64> },
    /// Half an ellipse that springs from the top of two walls; along x or along z.
    Barrel { along_x: bool, rise: f64, ribs: bool },
}

/// What a hole in a wall is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Through {
    /// A window, splayed: half width outside, and how thick the wall is. `bars` divide it.
    Window { outside: f64, thickness: f64, bars: bool },
    /// A way to the next room; its sides are built by the room that has `thickness`.
    Passage { thickness: Option<f64> },
    /// A closed door 12 cm deep in the wall.
    Door,
    /// A niche: half a cylinder.
    Niche,
}

/// A hole in a wall.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hole {
    /// The middle: x of walls along x, z of walls along z.
    pub centre: f64,
    /// Half the width inside.
    pub half: f64,
    /// Height of its lower side above the room's floor.
    pub sill: f64,
    /// Height at which a round head springs, or of a flat head.
    pub head: f64,
    /// Round-headed.
    pub round: bool,
    /// What it is.
    pub through: Through,
}

impl Hole {
    /// Height of its highest point above the room's floor.
    pub fn top(&self) -> f64 {
        if self.round { self.head + self.half } else { self.head }
    }

    fn opening(&self, half: f64, floor: f64) -> Opening {
        let (sill, head) = (floor + self.sill, floor + self.head);
        if self.round {
            Opening::arch(self.centre, half, sill, head, 12)
        } else {
            Opening::rectangle([self.centre - half, self.centre + half], [sill, head])
        }
    }
}

/// What a room is finished with.
#[derive(Clone, Copy)]
pub struct Finishes<'a> {
    /// Its walls.
    pub wall: &'a Finish,
    /// Its walls up to a height, and that height.
    pub dado: Option<(&'a Finish, f64)>,
    /// A band of this height under the ceiling or the vault's springing.
    pub frieze: Option<(&'a Finish, f64)>,
    /// Its floor.
    pub floor: &'a Finish,
    /// Its ceiling or vault.
    pub ceiling: &'a Finish,
    /// Reveals and ribs.
    pub stone: &'a Finish,
    /// Beams and doors.
    pub wood: &'a Finish,
}

/// A room.
#[derive(Clone)]
pub struct Room<'a> {
    /// Its name in the model.
    pub name: &'static str,
    /// Least corner, on the floor.
    pub low: DVec3,
    /// Greatest corner, where the ceiling is or the vault springs.
    pub high: DVec3,
    /// What is above.
    pub cover: Cover,
    /// Holes in its walls.
    pub holes: Vec<(Wall, Hole)>,
    /// Walls that others build.
    pub open: Vec<Wall>,
    /// Finishes.
    pub finishes: Finishes<'a>,
}

impl<'a> Room<'a> {
    /// The plane of a wall: u is x or z of the model, heights are the model's.
    pub fn plane(&self, wall: Wall) -> Plane {
        let (origin, along, normal) = match wall {
            Wall::West => (DVec3::X * self.low.x, DVec3::Z, DVec3::X),
            Wall::East => (DVec3::X * self.high.x, DVec3::Z, DVec3::NEG_X),
            Wall::North => (DVec3::Z * self.low.z, DVec3::X, DVec3::Z),
            Wall::South => (DVec3::Z * self.high.z, DVec3::X, DVec3::NEG_Z),
        };
        Plane { origin, along, normal }
    }

    /// The range of u of a wall.
    pub fn span(&self, wall: Wall) -> [f64; 2] {
        match wall {
            Wall::West | Wall::East => [self.low.z, self.high.z],
            Wall::North | Wall::South => [self.low.x, self.high.x],
        }
    }

    /// The holes of a wall.
    pub fn holes_in(&self, wall: Wall) -> impl Iterator<Item = &Hole> {
        self.holes.iter().filter(move |h| h.0 == wall).map(|h| &h.1)
    }

    /// Size on the floor.
    pub fn size(&self) -> DVec2 {
        dvec2(self.high.x - self.low.x, self.high.z - self.low.z)
    }

    /// Builds all of it.
    pub fn build(&self, m: &mut Model<'a>) {
        m.object(&format!("{}_floor", self.name));
        rectangle(m, self.finishes.floor, Side::Top, self.low, self.high.with_y(self.low.y));
        for wall in WALLS.into_iter().filter(|w| !self.open.contains(w)) {
            m.object(&format!("{}_{wall:?}", self.name).to_lowercase());
            self.wall(m, wall);
        }
        m.object(&format!("{}_ceiling", self.name));
        match self.cover {
            Cover::Flat { beams } => {
                let low = self.low.with_y(self.high.y);
                rectangle(m, self.finishes.ceiling, Side::Bottom, low, self.high);
                if let Some(apart) = beams {
                    m.object(&format!("{}_beams", self.name));
                    self.beams(m, apart);
                }
            }
            Cover::Barrel { along_x, rise, ribs } => self.barrel(m, along_x, rise, ribs),
        }
    }

    /// The upper edge of a wall.
    fn top(&self, wall: Wall) -> Line {
        let span = self.span(wall);
        match self.cover {
            Cover::Barrel { along_x, rise, .. } if along_x == matches!(wall, Wall::West | Wall::East) => {
                half_ellipse(span, self.high.y, rise)
            }
            _ => level(span, self.high.y),
        }
    }

    fn wall(&self, m: &mut Model<'a>, wall: Wall) {
        let (plane, span, floor) = (self.plane(wall), self.span(wall), self.low.y);
        let holes: Vec<Opening> = self.holes_in(wall).map(|h| h.opening(h.half, floor)).collect();
        let mut bands = vec![(self.low.y, self.finishes.wall)];
        if let Some((finish, height)) = self.finishes.dado {
            bands = vec![(self.low.y, finish), (self.low.y + height, self.finishes.wall)];
        }
        if let Some((finish, height)) = self.finishes.frieze {
            bands.push((self.high.y - height, finish));
            bands.push((self.high.y, self.finishes.wall));
        }
        for (i, &(from, finish)) in bands.iter().enumerate() {
            let to = bands.get(i + 1).map_or(f64::INFINITY, |b| b.0);
            let inside: Vec<Opening> = holes.iter().filter_map(|h| clipped(h, from, to)).collect();
            let top = if to.is_finite() { level(span, to) } else { self.top(wall) };
            panel(m, finish, &plane, &level(span, from), &top, &inside);
        }
        for hole in self.holes_in(wall) {
            self.fill(m, &plane, hole);
        }
    }

    /// What stands in a hole.
    fn fill(&self, m: &mut Model<'a>, plane: &Plane, hole: &Hole) {
        let (floor, stone) = (self.low.y, self.finishes.stone);
        let front = hole.opening(hole.half, floor);
        match hole.through {
            Through::Window { outside, thickness, bars } => {
                let behind = hole.opening(outside, floor);
                reveal(m, self.finishes.wall, plane, &front, &behind, thickness, true);
                if bars {
                    let depth = thickness * 0.7;
                    let half = outside + (hole.half - outside) * 0.3;
                    let height = [floor + hole.sill, floor + hole.head];
                    let mut bar = |u: [f64; 2], v: [f64; 2]| {
                        let (a, b) = (plane.at(u[0], v[0], depth), plane.at(u[1], v[1], depth + 0.04));
                        cuboid(m, self.finishes.wood, a.min(b), a.max(b), &[]);
                    };
                    bar([hole.centre - 0.02, hole.centre + 0.02], [height[0], floor + hole.top() - 0.02]);
                    let n = ((hole.head - hole.sill) / 0.55).round().max(2.0) as usize;
                    for k in 1..=n {
                        let v = height[0] + (height[1] - height[0]) * k as f64 / n as f64;
                        bar([hole.centre - half, hole.centre + half], [v - 0.015, v + 0.015]);
                    }
                }
            }
            Through::Passage { thickness: Some(thickness) } => {
                reveal(m, stone, plane, &front, &front, thickness, true);
            }
            Through::Passage { thickness: None } => {}
            Through::Door => {
                reveal(m, stone, plane, &front, &front, 0.12, true);
                let leaf = Plane { origin: plane.origin - plane.normal * 0.12, ..*plane };
                panel(m, self.finishes.wood, &leaf, &front.low, &front.high, &[]);
            }
            Through::Niche => niche(m, self.finishes.wall, stone, plane, hole, floor),
        }
    }
}

/// The part of an opening between two heights.
fn clipped(hole: &Opening, from: f64, to: f64) -> Option<Opening> {
    let above = |line: &Line| line.iter().all(|p| p.y >= to);
    let below = |line: &Line| line.iter().all(|p| p.y <= from);
    if above(&hole.low) || below(&hole.high) {
        return None;
    }
    let clip = |line: &Line| -> Line {
        let mut out = vec![line[0]];
        for pair in line.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let mut cuts: Vec<f64> = [from, to]
                .into_iter()
                .filter(|y| y.is_finite() && (a.y - y) * (b.y - y) < 0.0)
                .map(|y| (y - a.y) / (b.y - a.y))
                .collect();
            cuts.sort_by(f64::total_cmp);
            out.extend(cuts.iter().map(|&t| a.lerp(b, t)));
            out.push(b);
        }
        out.iter().map(|p| dvec2(p.x, p.y.clamp(from, to))).collect()
    };
    Some(Opening { low: clip(&hole.low), high: clip(&hole.high) })
}

/// Half a cylinder behind a hole, under a quarter of a sphere if its head is round, else under a flat top.
fn niche<'a>(m: &mut Model<'a>, finish: &'a Finish, stone: &'a Finish, plane: &Plane, hole: &Hole, floor: f64) {
    const SIDES: usize = 12;
    let point = |i: usize, r: f64, y: f64| {
        let a = PI * i as f64 / SIDES as f64;
        plane.at(hole.centre - r * a.cos(), floor + y, r * a.sin())
    };
    let mut rows = vec![(hole.half, hole.sill)];
    if hole.round {
        rows.extend((0..=SIDES / 2).map(|j| {
            let a = PI * j as f64 / SIDES as f64;
            (hole.half * a.cos(), hole.head + hole.half * a.sin())
        }));
    } else {
        rows.push((hole.half, hole.head));
    }
    let axis = plane.at(hole.centre, floor + hole.sill.midpoint(hole.head), 0.0);
    for row in rows.windows(2) {
        for i in 0..SIDES {
            let ring = [(i, row[0]), (i + 1, row[0]), (i + 1, row[1]), (i, row[1])];
            let points = ring.map(|(i, (r, y))| point(i, r, y));
            let metres = ring.map(|(i, (_, y))| dvec2(PI * hole.half * i as f64 / SIDES as f64, y));
            m.face_towards(finish, axis - points.iter().sum::<DVec3>() / 4.0, &points, &metres);
        }
    }
    let mut flat = |y: f64, towards: DVec3| {
        let rim: Vec<_> = (0..=SIDES).map(|i| point(i, hole.half, y)).collect();
        let metres: Vec<_> = rim.iter().map(|p| dvec2(p.x, p.z)).collect();
        m.face_towards(stone, towards, &rim, &metres);
    };
    flat(hole.sill, DVec3::Y);
    if !hole.round {
        flat(hole.head, DVec3::NEG_Y);
    }
}
