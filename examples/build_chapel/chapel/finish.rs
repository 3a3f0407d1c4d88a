//! The finishes of the chapel: albedos between 0.15 and 0.8, pictures at their size in metres.

use glam::{DVec2, dvec2};

use super::mesh::Finish;

const fn textured(name: &'static str, texture: &'static str, tile: DVec2) -> Finish {
    Finish { name, kd: [1.0, 1.0, 1.0], texture: Some(texture), tile, grain: false }
}

const fn plain(name: &'static str, kd: [f64; 3]) -> Finish {
    Finish { name, kd, texture: None, tile: DVec2::ONE, grain: false }
}

/// Squared stone in courses 25 cm high.
pub static ASHLAR: Finish = textured("ashlar", "ashlar.jpg", dvec2(2.0, 2.0));
/// Lime plaster with stains.
pub static PLASTER: Finish = textured("plaster", "plaster.jpg", dvec2(2.4, 2.4));
/// Terracotta bricks of 30 × 10 cm, laid with their length along u.
pub static BRICK: Finish = textured("brick", "brick.jpg", dvec2(1.2, 1.2));
/// Stone flags of 60 cm.
pub static FLAG: Finish = textured("flag", "flag.jpg", dvec2(1.2, 1.2));
/// Dark red stone of the columns.
pub static MARBLE: Finish = textured("marble", "marble.jpg", dvec2(1.0, 1.0));
/// Oak, grain along u.
pub static WOOD: Finish = Finish {
    name: "wood",
    kd: [1.0, 1.0, 1.0],
    texture: Some("wood.jpg"),
    tile: dvec2(1.0, 1.0),
    grain: true,
};
/// A painted band with a running wave.
pub static FRIEZE: Finish = textured("frieze", "frieze.jpg", dvec2(1.4, 0.35));
/// Gold stars on blue, in the apse.
pub static STARS: Finish = textured("stars", "stars.jpg", dvec2(0.8, 0.8));
/// A ship at sea, on the south wall.
pub static SHIP: Finish = textured("painting_ship", "ship.jpg", dvec2(1.0, 1.25));
/// A rosette, above the door to the sacristy.
pub static ROSETTE: Finish = textured("painting_rosette", "rosette.jpg", dvec2(1.2, 1.2));
/// A vine, north of the altar.
pub static VINE: Finish = textured("painting_vine", "vine.jpg", dvec2(0.8, 1.6));
/// The altar-piece.
pub static MANDORLA: Finish = textured("painting_mandorla", "mandorla.jpg", dvec2(0.9, 1.6));
/// A terracotta plaque in the aisle.
pub static PLAQUE: Finish = textured("plaque", "plaque.jpg", dvec2(0.5, 0.5));
/// Pale carved stone.
pub static CARVED: Finish = plain("carved", [0.58, 0.54, 0.46]);
/// Altar linen.
pub static LINEN: Finish = plain("linen", [0.74, 0.72, 0.66]);
/// Old brass.
pub static BRASS: Finish = plain("brass", [0.52, 0.38, 0.16]);
/// Glazed blue-green ware.
pub static GLAZE: Finish = plain("glaze", [0.16, 0.32, 0.34]);
/// Walls as seen from outside.
pub static OUTSIDE: Finish = plain("outside", [0.45, 0.41, 0.34]);
/// Roof tiles as seen from outside.
pub static ROOF: Finish = plain("roof", [0.38, 0.2, 0.14]);
/// An unpainted crate that stands only in the faulty model.
pub static CRATE: Finish = plain("crate", [0.5, 0.36, 0.2]);
/// The rosette as the faulty model has it: blue where it should be red.
pub static ROSETTE_RECOLOURED: Finish = textured("painting_rosette", "rosette_recoloured.jpg", dvec2(1.2, 1.2));
