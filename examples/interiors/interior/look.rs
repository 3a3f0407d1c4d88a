//! How a finish looks: masonry, floors, wood, marble, cloth, gilding.

use glam::{DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::TAU;

use super::dice::Dice;
use super::painting;
use crate::common::pattern::{bond, cloud, hash};

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// Lime plaster, slightly mottled.
    Plaster,
    /// Blocks in courses, each of its own tone, with joints this wide in metres.
    Courses { block: DVec2, joint: f64 },
    /// Squares in two colours.
    Chequer { side: f64 },
    /// Bricks laid in zigzag, `short` wide and four times as long.
    Herringbone { short: f64 },
    /// Boards along u.
    Boards { wide: f64 },
    /// Veined stone.
    Marble,
    /// Woven stripes along v.
    Stripes { wide: f64 },
    /// Woven lozenges with a dot in each.
    Lozenges { wide: f64 },
    /// Backs of books side by side, in one row.
    Books,
    /// Gold leaf in squares.
    Gilding,
    /// A framed picture: landscape, still life or ornament.
    Painting,
    /// A painted band of waves and discs.
    Frieze,
}

/// A pattern in colours.
#[derive(Clone, Debug)]
pub struct Look {
    /// What is drawn.
    pub pattern: Pattern,
    /// Linear albedos: ground, second colour, joints or third colour.
    pub colours: [DVec3; 3],
    /// Metres that the picture spans.
    pub tile: DVec2,
    /// Decides what chance decides.
    pub seed: u64,
}

impl Look {
    /// Linear albedo at a point of the picture (0..1 each way).
    pub fn albedo(&self, p: DVec2) -> DVec3 {
        let colour = self.plain_albedo(p);
        colour.clamp(DVec3::splat(0.004), DVec3::splat(0.86))
    }

    fn plain_albedo(&self, p: DVec2) -> DVec3 {
        let (s, [ground, second, third]) = (self.seed, self.colours);
        let fine = |cells: i64, amount: f64| 1.0 + amount * cloud(p, [cells, cells], 3, s ^ 77);
        match self.pattern {
            Pattern::Plaster => {
                let stain = (0.5 + 0.7 * cloud(p, [3, 3], 4, s)).clamp(0.0, 1.0);
                ground.lerp(second, 0.45 * stain) * fine(24, 0.06)
            }
            Pattern::Courses { block, joint } => {
                let ([x, y], edge) = bond(p, self.tile, block);
                let stone = ground.lerp(second, hash(x, y, s ^ 1)) * (0.75 + 0.4 * hash(x, y, s ^ 2));
                if edge < joint { third * fine(64, 0.1) } else { stone * fine(12, 0.2) }
            }
            Pattern::Chequer { side } => {
                let q = p * self.tile / side;
                let cell = q.floor();
                let edge = (q - cell).min(1.0 - (q - cell)).min_element() * side;
                let dark = (cell.x + cell.y).rem_euclid(2.0) > 0.5;
                let n = (self.tile / side).round();
                let tone = 0.85 + 0.3 * hash(cell.x.rem_euclid(n.x) as i64, cell.y.rem_euclid(n.y) as i64, s);
                let stone = if dark { second } else { ground };
                if edge < 0.002 { third } else { stone * tone * fine(10, 0.15) }
            }
            Pattern::Herringbone { short } => herringbone(self, p, short) * fine(24, 0.15),
            Pattern::Boards { wide } => {
                let rows = (self.tile.y / wide).round();
                let row = (p.y * rows).floor();
                let edge = (p.y * rows - row).min(row + 1.0 - p.y * rows) * wide;
                let shift = hash(row as i64, 1, s);
                let line = cloud(dvec2((p.x + shift).fract(), p.y), [2, 40], 3, s ^ 3);
                let end = ((p.x + shift).fract() * self.tile.x).min(self.tile.x * 0.5) < 0.003;
                let wood = ground.lerp(second, hash(row as i64, 0, s)) * (1.0 + 0.35 * line);
                if edge < 0.002 || end { third } else { wood }
            }
            Pattern::Marble => {
                let warp = dvec2(cloud(p, [3, 3], 4, s ^ 51), cloud(p, [3, 3], 4, s ^ 52));
                let vein = (cloud(p + warp * 0.08, [4, 4], 4, s ^ 53) * 6.0).sin().abs().powf(0.35);
                ground.lerp(second, vein) * fine(12, 0.15)
            }
            Pattern::Stripes { wide } => {
                let n = (self.tile.x / wide).round().max(1.0);
                let phase = (p.x * n).fract();
                let colour = if phase < 0.45 {
                    ground
                } else if phase < 0.55 {
                    third
                } else {
                    second
                };
                colour * fine(48, 0.12)
            }
            Pattern::Lozenges { wide } => {
                let n = (self.tile / wide).round().max(DVec2::ONE);
                let f = (p * n).fract() - 0.5;
                let ring = f.x.abs() + f.y.abs();
                let colour = if ring < 0.16 {
                    third
                } else if ring < 0.42 {
                    ground
                } else {
                    second
                };
                colour * fine(48, 0.12)
            }
            Pattern::Books => {
                let n = 14.0;
                let k = (p.x * n).floor();
                let of = |salt: u64| hash(k as i64, 0, s ^ salt);
                let tall = 0.7 + 0.28 * of(5);
                let edge = (p.x * n - k).min(k + 1.0 - p.x * n);
                let cover = ground.lerp(second, of(6)).lerp(third, of(7) * of(7));
                let band = ((p.y / tall * 5.0).fract() < 0.06 && p.y < tall) as u8 as f64;
                if p.y > tall || edge < 0.04 {
                    dvec3(0.03, 0.025, 0.02)
                } else {
                    cover.lerp(dvec3(0.5, 0.36, 0.1), band)
                }
            }
            Pattern::Gilding => {
                let ([x, y], edge) = bond(p, self.tile, self.tile / 4.0);
                ground * (0.9 + 0.15 * hash(x, y, s)) * if edge < 0.001 { 0.8 } else { 1.0 } * fine(20, 0.12)
            }
            Pattern::Painting => painting::albedo(self, p),
            Pattern::Frieze => {
                let m = (p.x * 2.0).fract();
                let disc = dvec2((m - 0.5) * self.tile.x * 0.5, (p.y - 0.5) * self.tile.y).length() / self.tile.y;
                let wave = (p.y - 0.5 - 0.2 * (TAU * p.x * 2.0).sin()).abs();
                let colour = if !(0.08..0.92).contains(&p.y) {
                    third
                } else if disc < 0.17 || wave < 0.05 {
                    second
                } else {
                    ground
                };
                colour * fine(30, 0.15)
            }
        }
    }
}

/// Bricks four times as long as wide in a zigzag: along the diagonal the pattern repeats every eight widths.
fn herringbone(look: &Look, p: DVec2, short: f64) -> DVec3 {
    let q = p * look.tile / short;
    let (x, y) = (q.x.floor(), q.y.floor());
    // cell (x, y) belongs to a brick that lies along x where (x − y) mod 8 < 4, else to one that stands along y
    let d = (x - y).rem_euclid(8.0);
    let (lying, along, id) = if d < 4.0 {
        (true, d, [x - d, y])
    } else {
        let up = 7.0 - d;
        (false, up, [x, y - up])
    };
    let (f, g) = if lying { (q.x - x, q.y - y) } else { (q.y - y, q.x - x) };
    let ends = (along + f).min(4.0 - along - f);
    let edge = ends.min(g).min(1.0 - g) * short;
    let n = (look.tile / short).round();
    let id = [id[0].rem_euclid(n.x) as i64, id[1].rem_euclid(n.y) as i64];
    let brick = look.colours[0].lerp(look.colours[1], hash(id[0], id[1], look.seed));
    if edge < 0.0025 { look.colours[2] } else { brick * (0.8 + 0.35 * hash(id[1], id[0], look.seed ^ 9)) }
}

/// A colour of this hue (turns), saturation and value as a linear albedo.
pub fn colour(hue: f64, saturation: f64, value: f64) -> DVec3 {
    let channel = |shift: f64| {
        let t = ((hue + shift).rem_euclid(1.0) * 6.0 - 3.0).abs() - 1.0;
        value * (1.0 - saturation * (1.0 - t.clamp(0.0, 1.0)))
    };
    dvec3(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0))
}

/// A saturated colour of paint or cloth.
pub fn strong(dice: &mut Dice) -> DVec3 {
    let hue = dice.pick(&[0.0, 0.02, 0.07, 0.11, 0.3, 0.38, 0.56, 0.62, 0.8]) + dice.between(-0.02, 0.02);
    colour(hue, dice.between(0.45, 0.85), dice.between(0.15, 0.5))
}

/// An earthy colour that whole walls are painted in.
pub fn earthy(dice: &mut Dice) -> DVec3 {
    colour(dice.pick(&[0.02, 0.06, 0.1, 0.13, 0.3, 0.42, 0.58]), dice.between(0.25, 0.55), dice.between(0.25, 0.55))
}

/// A pale colour of walls.
pub fn pale(dice: &mut Dice) -> DVec3 {
    colour(dice.pick(&[0.08, 0.1, 0.13, 0.3, 0.55]), dice.between(0.05, 0.32), dice.between(0.5, 0.78))
}
