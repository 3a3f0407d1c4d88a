//! The finishes of the chapel: albedos between 0.15 and 0.8, pictures at their size in metres.

use glam::dvec2;

use crate::common::mesh::Finish;

/// Squared stone in courses 25 cm high.
pub static ASHLAR: Finish = Finish::textured("ashlar", "ashlar.jpg", dvec2(2.0, 2.0));
/// Lime plaster with stains.
pub static PLASTER: Finish = Finish::textured("plaster", "plaster.jpg", dvec2(2.4, 2.4));
/// Terracotta bricks of 30 × 10 cm, laid with their length along u.
pub static BRICK: Finish = Finish::textured("brick", "brick.jpg", dvec2(1.2, 1.2));
/// Stone flags of 60 cm.
pub static FLAG: Finish = Finish::textured("flag", "flag.jpg", dvec2(1.2, 1.2));
/// Dark red stone of the columns.
pub static MARBLE: Finish = Finish::textured("marble", "marble.jpg", dvec2(1.0, 1.0));
/// Oak, grain along u.
pub static WOOD: Finish = Finish::textured("wood", "wood.jpg", dvec2(1.0, 1.0)).grained();
/// A painted band with a running wave.
pub static FRIEZE: Finish = Finish::textured("frieze", "frieze.jpg", dvec2(1.4, 0.35));
/// Gold stars on blue, in the apse.
pub static STARS: Finish = Finish::textured("stars", "stars.jpg", dvec2(0.8, 0.8));
/// A ship at sea, on the south wall.
pub static SHIP: Finish = Finish::textured("painting_ship", "ship.jpg", dvec2(1.0, 1.25));
/// A rosette, above the door to the sacristy.
pub static ROSETTE: Finish = Finish::textured("painting_rosette", "rosette.jpg", dvec2(1.2, 1.2));
/// A vine, north of the altar.
pub static VINE: Finish = Finish::textured("painting_vine", "vine.jpg", dvec2(0.8, 1.6));
/// The altar-piece.
pub static MANDORLA: Finish = Finish::textured("painting_mandorla", "mandorla.jpg", dvec2(0.9, 1.6));
/// A terracotta plaque in the aisle.
pub static PLAQUE: Finish = Finish::textured("plaque", "plaque.jpg", dvec2(0.5, 0.5));
/// Pale carved stone.
pub static CARVED: Finish = Finish::plain("carved", [0.58, 0.54, 0.46]);
/// Altar linen.
pub static LINEN: Finish = Finish::plain("linen", [0.74, 0.72, 0.66]);
/// Old brass.
pub static BRASS: Finish = Finish::plain("brass", [0.52, 0.38, 0.16]);
/// Glazed blue-green ware.
pub static GLAZE: Finish = Finish::plain("glaze", [0.16, 0.32, 0.34]);
/// Walls as seen from outside.
pub static OUTSIDE: Finish = Finish::plain("outside", [0.45, 0.41, 0.34]);
/// Roof tiles as seen from outside.
pub static ROOF: Finish = Finish::plain("roof", [0.38, 0.2, 0.14]);
/// An unpainted crate that stands only in the faulty model.
pub static CRATE: Finish = Finish::plain("crate", [0.5, 0.36, 0.2]);
/// The rosette as the faulty model has it: blue where it should be red.
pub static ROSETTE_RECOLOURED: Finish = Finish::textured("painting_rosette", "rosette_recoloured.jpg", dvec2(1.2, 1.2));
