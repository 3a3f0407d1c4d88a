//! The finishes of an interior, drawn by seed.

use glam::{DVec2, DVec3, dvec2, dvec3};
use std::borrow::Cow;

use super::Kind;
use super::dice::Dice;
use super::look::{Look, Pattern, earthy, pale, strong};
use crate::common::mesh::Finish;

/// A finish and how it looks.
pub struct Material {
    /// As the mesh knows it.
    pub finish: Finish,
    /// What its picture shows; `None` for one colour.
    pub look: Option<Look>,
    /// Share of the light that it mirrors head-on (Fresnel's F0), in the true place only.
    pub gloss: f64,
}

/// Every finish that a part may take.
pub struct Palette {
    /// Of the rooms in turn.
    pub walls: [Material; 3],
    /// Of the walls' lower part, where there is one.
    pub dado: Material,
    /// Of the rooms in turn.
    pub floors: [Material; 3],
    /// Flat ceilings and vaults.
    pub ceiling: Material,
    /// A painted band under the ceiling.
    pub frieze: Material,
    /// Window reveals, arches and steps.
    pub stone: Material,
    /// Shafts of columns.
    pub marble: Material,
    /// Furniture and beams.
    pub woods: [Material; 2],
    /// Banners, curtains and table-cloths.
    pub cloths: [Material; 3],
    /// A carpet.
    pub rug: Material,
    /// Pictures in frames.
    pub paintings: [Material; 6],
    /// Frames, capitals and candlesticks.
    pub gilt: Material,
    /// Jugs and bowls.
    pub glaze: Material,
    /// Statues.
    pub plaster_cast: Material,
    /// Backs of books.
    pub books: Material,
    /// Iron of grilles and chandeliers.
    pub iron: Material,
    /// What gives light.
    pub lamp: Material,
}

impl Palette {
    /// The finishes of an interior of a kind.
    pub fn new(kind: Kind, dice: &mut Dice) -> Self {
        let wood = |name: &'static str, dice: &mut Dice| {
            let tone = dice.between(0.5, 1.5);
            let ground = dvec3(0.34, 0.2, 0.1) * tone;
            let look = [ground, ground * dice.between(0.6, 0.9), ground * 0.35];
            let mut m = textured(name, dvec2(1.2, 0.9), Pattern::Boards { wide: 0.15 }, look, dice);
            m.finish.grain = true;
            m.gloss = 0.03;
            m
        };
        let size = |dice: &mut Dice| dvec2(dice.between(0.55, 1.5), dice.between(0.55, 1.4));
        let picture = |name: &'static str, dice: &mut Dice| {
            let colours = [strong(dice), strong(dice), dvec3(0.55, 0.38, 0.12)];
            let size = size(dice);
            textured(name, size, Pattern::Painting, colours, dice)
        };
        let bright = match kind {
            Kind::Cellar => dice.between(60.0, 140.0),
            _ => dice.between(15.0, 60.0),
        };
        let mut lamp = plain("lamp", DVec3::splat(0.6));
        lamp.finish.emission = [bright, bright * dice.between(0.68, 0.85), bright * dice.between(0.35, 0.6)];
        Self {
            walls: ["wall_1", "wall_2", "wall_3"].map(|n| wall(n, kind, dice)),
            dado: dado(dice),
            floors: ["floor_1", "floor_2", "floor_3"].map(|n| floor(n, kind, dice)),
            ceiling: ceiling(kind, dice),
            frieze: {
                let colours = [strong(dice), strong(dice), pale(dice)];
                textured("frieze", dvec2(1.6, 0.4), Pattern::Frieze, colours, dice)
            },
            stone: {
                let c = dvec3(0.56, 0.51, 0.43) * dice.between(0.75, 1.15);
                textured("stone", dvec2(1.2, 1.2), Pattern::Plaster, [c, c * 0.7, c], dice)
            },
            marble: marble("marble", dice),
            woods: [wood("wood_1", dice), wood("wood_2", dice)],
            cloths: ["cloth_1", "cloth_2", "cloth_3"].map(|n| cloth(n, dice)),
            rug: {
                let wide = dice.pick(&[0.2, 0.3]);
                let colours = [strong(dice), strong(dice), pale(dice)];
                textured("rug", dvec2(2.4, 1.5), Pattern::Lozenges { wide }, colours, dice)
            },
            paintings: ["painting_1", "painting_2", "painting_3", "painting_4", "painting_5", "painting_6"]
                .map(|n| picture(n, dice)),
            gilt: {
                let gold = [dvec3(0.62, 0.43, 0.12); 3];
                Material { gloss: 0.05, ..textured("gilt", dvec2(0.4, 0.4), Pattern::Gilding, gold, dice) }
            },
            glaze: Material { gloss: 0.04, ..plain("glaze", strong(dice)) },
            plaster_cast: plain("cast", dvec3(0.62, 0.58, 0.5) * dice.between(0.7, 1.15)),
            books: {
                let colours = [dvec3(0.25, 0.1, 0.06), dvec3(0.08, 0.14, 0.08), dvec3(0.5, 0.4, 0.25)];
                textured("books", dvec2(0.7, 0.32), Pattern::Books, colours, dice)
            },
            iron: plain("iron", dvec3(0.07, 0.065, 0.06)),
            lamp,
        }
    }

    /// All of them.
    pub fn all(&self) -> Vec<&Material> {
        let lists: [&[Material]; 5] = [&self.walls, &self.floors, &self.woods, &self.cloths, &self.paintings];
        let single = [
            &self.dado,
            &self.ceiling,
            &self.frieze,
            &self.stone,
            &self.marble,
            &self.rug,
            &self.gilt,
            &self.glaze,
            &self.plaster_cast,
            &self.books,
            &self.iron,
            &self.lamp,
        ];
        lists.into_iter().flatten().chain(single).collect()
    }
}

fn plain(name: &'static str, colour: DVec3) -> Material {
    Material { finish: Finish::plain(name, colour.to_array().map(rounded)), look: None, gloss: 0.0 }
}

/// Four digits are enough for a file that people read.
fn rounded(v: f64) -> f64 {
    (v * 1e4).round() * 1e-4
}

fn textured(name: &'static str, tile: DVec2, pattern: Pattern, colours: [DVec3; 3], dice: &mut Dice) -> Material {
    let mut finish = Finish::textured(name, "", tile);
    finish.texture = Some(Cow::Owned(format!("{name}.jpg")));
    let look = Look { pattern, colours, tile, seed: dice.next() >> 8 };
    Material { finish, look: Some(look), gloss: 0.0 }
}

fn brick(name: &'static str, dice: &mut Dice) -> Material {
    let tone = dice.between(0.7, 1.2);
    let block = dice.pick(&[dvec2(0.3, 0.1), dvec2(0.24, 0.08), dvec2(0.3, 0.06)]);
    let colours = [dvec3(0.44, 0.19, 0.115) * tone, dvec3(0.36, 0.2, 0.16) * tone, dvec3(0.45, 0.42, 0.36)];
    // a whole even number of courses, so that the bond closes at the picture's edge
    textured(name, dvec2(1.2, block.y * 12.0), Pattern::Courses { block, joint: 0.006 }, colours, dice)
}

fn ashlar(name: &'static str, dice: &mut Dice) -> Material {
    let block = dice.pick(&[dvec2(0.5, 0.25), dvec2(0.6, 0.3), dvec2(0.4, 0.2)]);
    let tone = dice.between(0.75, 1.2);
    let colours = [dvec3(0.5, 0.44, 0.34) * tone, dvec3(0.56, 0.46, 0.33) * tone, dvec3(0.36, 0.33, 0.28)];
    textured(name, dvec2(block.x * 4.0, block.y * 6.0), Pattern::Courses { block, joint: 0.007 }, colours, dice)
}

fn plaster(name: &'static str, dice: &mut Dice) -> Material {
    let ground = if dice.chance(0.25) { earthy(dice) } else { pale(dice) };
    let second = ground * dvec3(0.82, 0.78, 0.7);
    textured(name, dvec2(2.4, 2.4), Pattern::Plaster, [ground, second, second], dice)
}

fn marble(name: &'static str, dice: &mut Dice) -> Material {
    let (ground, second) = dice.pick(&[
        (dvec3(0.52, 0.4, 0.34), dvec3(0.27, 0.145, 0.12)),
        (dvec3(0.6, 0.58, 0.55), dvec3(0.38, 0.38, 0.4)),
        (dvec3(0.16, 0.27, 0.2), dvec3(0.07, 0.12, 0.09)),
    ]);
    Material { gloss: 0.04, ..textured(name, dvec2(1.0, 1.0), Pattern::Marble, [ground, second, second], dice) }
}

fn wall(name: &'static str, kind: Kind, dice: &mut Dice) -> Material {
    let masonry = match kind {
        Kind::Cellar => 1.0,
        Kind::Chapel => 0.6,
        Kind::Hall | Kind::Stairs => 0.35,
        Kind::Rooms => 0.2,
    };
    if !dice.chance(masonry) {
        plaster(name, dice)
    } else if dice.chance(if kind == Kind::Cellar { 0.6 } else { 0.35 }) {
        brick(name, dice)
    } else {
        ashlar(name, dice)
    }
}

fn dado(dice: &mut Dice) -> Material {
    if dice.chance(0.5) {
        let c = earthy(dice) * 0.8;
        textured("dado", dvec2(2.4, 1.2), Pattern::Plaster, [c, c * 0.75, c], dice)
    } else {
        let c = dvec3(0.3, 0.18, 0.09) * dice.between(0.6, 1.3);
        textured("dado", dvec2(1.2, 1.2), Pattern::Boards { wide: 0.2 }, [c, c * 0.8, c * 0.3], dice)
    }
}

fn floor(name: &'static str, kind: Kind, dice: &mut Dice) -> Material {
    let which = if kind == Kind::Cellar { dice.whole(2, 3) } else { dice.whole(0, 4) };
    let gloss = dice.between(0.015, 0.05);
    let stone = dvec3(0.42, 0.4, 0.36) * dice.between(0.7, 1.25);
    let mut floor = match which {
        0 => {
            let side = dice.pick(&[0.25, 0.3, 0.4]);
            let dark = dice.pick(&[dvec3(0.07, 0.07, 0.075), dvec3(0.3, 0.09, 0.06), dvec3(0.1, 0.18, 0.13)]);
            let colours = [dvec3(0.56, 0.53, 0.47), dark, stone * 0.4];
            textured(name, DVec2::splat(side * 6.0), Pattern::Chequer { side }, colours, dice)
        }
        1 => {
            let short = dice.pick(&[0.07, 0.09]);
            let clay = if dice.chance(0.5) { dvec3(0.42, 0.19, 0.12) } else { dvec3(0.36, 0.22, 0.12) };
            let colours = [clay, clay * 0.7, clay * 0.3];
            textured(name, DVec2::splat(short * 16.0), Pattern::Herringbone { short }, colours, dice)
        }
        2 => {
            let block = dice.pick(&[dvec2(0.6, 0.6), dvec2(0.8, 0.5), dvec2(0.45, 0.45)]);
            let colours = [stone, stone * dvec3(0.9, 0.85, 0.75), stone * 0.5];
            textured(name, dvec2(block.x * 3.0, block.y * 4.0), Pattern::Courses { block, joint: 0.006 }, colours, dice)
        }
        3 => brick(name, dice),
        _ => {
            let c = dvec3(0.36, 0.22, 0.11) * dice.between(0.6, 1.3);
            textured(name, dvec2(2.4, 1.28), Pattern::Boards { wide: 0.16 }, [c, c * 0.75, c * 0.3], dice)
        }
    };
    // bricks and what lies in cellars is not polished
    floor.gloss = if kind == Kind::Cellar || which == 3 { 0.0 } else { gloss };
    floor
}

fn ceiling(kind: Kind, dice: &mut Dice) -> Material {
    match kind {
        Kind::Cellar => brick("ceiling", dice),
        Kind::Chapel if dice.chance(0.3) => ashlar("ceiling", dice),
        Kind::Hall | Kind::Rooms if dice.chance(0.4) => {
            let c = dvec3(0.34, 0.2, 0.1) * dice.between(0.6, 1.3);
            textured("ceiling", dvec2(2.4, 1.6), Pattern::Boards { wide: 0.2 }, [c, c * 0.8, c * 0.4], dice)
        }
        _ => plaster("ceiling", dice),
    }
}

fn cloth(name: &'static str, dice: &mut Dice) -> Material {
    let wide = dice.pick(&[0.1, 0.16, 0.2]);
    let pattern = if dice.chance(0.5) { Pattern::Stripes { wide } } else { Pattern::Lozenges { wide } };
    let colours = [strong(dice), strong(dice), dvec3(0.6, 0.5, 0.25)];
    textured(name, dvec2(0.8, 0.8), pattern, colours, dice)
}
