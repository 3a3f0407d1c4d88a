//! A floor's plan for CAD programs, in the model's unit and at its true size: east is +x, north +y.

mod writer;

use glam::{DVec2, DVec3};

use crate::plan::export::tables::Outward;
use crate::plan::stations::result::{FloorPlan, Station};
use writer::{Dxf, Layer};

const WALLS: Layer = Layer { name: "WALLS", colour: 7, dashed: false };
const FURNITURE: Layer = Layer { name: "FURNITURE", colour: 8, dashed: false };
const STATIONS: Layer = Layer { name: "STATIONS", colour: 1, dashed: false };
const PROBES: Layer = Layer { name: "PROBES", colour: 5, dashed: false };
const SIGHT: Layer = Layer { name: "SIGHT_LINES", colour: 3, dashed: true };
const DIMENSIONS: Layer = Layer { name: "DIMENSIONS", colour: 30, dashed: false };

/// The layers that a plan has, whether there is something on them or not.
const LAYERS: [Layer; 6] = [WALLS, FURNITURE, STATIONS, PROBES, SIGHT, DIMENSIONS];

/// Height of words, metres.
const WORDS_M: f64 = 0.12;

/// Draws a floor as DXF R2000: the model cut at lens height and, as furniture, below it; stations with numbers and heights,
/// what each sees, and the distances that a tape can check. The same bytes for the same plan.
pub(super) fn plan_dxf(plan: &FloorPlan, out: &Outward) -> String {
    let unit = out.frame.metres_per_unit;
    let at = |p: DVec2| (p + out.origin.truncate()) / unit;
    let mut dxf = Dxf::new();
    for (layer, lines) in [(WALLS, &plan.section), (FURNITURE, &plan.furniture)] {
        for line in lines {
            let points: Vec<DVec2> = line.iter().map(|p| at(*p)).collect();
            match points.split_last() {
                Some((last, rest)) if rest.len() > 2 && last.distance(rest[0]) * unit < 1e-4 => {
                    dxf.polyline(layer, rest, true);
                }
                _ => dxf.polyline(layer, &points, false),
            }
        }
    }
    let mut station = |layer: Layer, name: &str, s: &Station| {
        let p = at(s.position.truncate());
        let height = (s.position + DVec3::Z * out.origin.z).z / unit;
        dxf.circle(layer, p, 0.1 / unit);
        dxf.place(layer, p, height);
        dxf.text(layer, p + DVec2::splat(0.12 / unit), WORDS_M / unit, 0.0, name);
        let seen: Vec<DVec2> = s.region.outline().into_iter().map(at).collect();
        dxf.polyline(SIGHT, &seen, true);
        for tape in &s.check_distances {
            let to = at(tape.to);
            dxf.polyline(DIMENSIONS, &[p, to], false);
            // words are read from below or from the right
            let turned = (to - p).y.atan2((to - p).x).to_degrees();
            let turned = if turned > 90.0 || turned <= -90.0 { turned + 180.0 } else { turned };
            let length = format!("{:.*}", out.decimals(), tape.metres / unit);
            dxf.text(DIMENSIONS, p.lerp(to, 0.5), WORDS_M / unit, turned, &length);
        }
    };
    plan.present.iter().for_each(|s| station(PROBES, &s.name, s));
    plan.stations.iter().zip(1..).for_each(|(s, number)| station(STATIONS, &format!("{number} {}", s.name), s));
    dxf.file(&LAYERS, unit)
}
