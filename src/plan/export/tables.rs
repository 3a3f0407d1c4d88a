//! A plan in the files that people and scripts read: JSON, CSV and `[[probe]]` blocks. Positions are in the model's own
//! axes and units, so that they paste into a site file.

use glam::DVec3;
use serde::Serialize;
use std::fmt::Write;

use crate::csv::Table;
use crate::plan::stations::result::{FloorPlan, SitePlan, Station};
use crate::scene::Scene;
use crate::site::{Frame, Site};

/// `plan.json`.
#[derive(Clone, Debug, Serialize)]
pub struct PlanJson {
    /// The site's name.
    pub site: String,
    /// From the lowest.
    pub floors: Vec<FloorJson>,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
}

/// A floor of `plan.json`.
#[derive(Clone, Debug, Serialize)]
pub struct FloorJson {
    /// `Ground floor`, ….
    pub name: String,
    /// File names of its sheets, without ending: the plan and the coverage.
    pub sheets: [String; 2],
    /// Height of most of the floor along the model's up axis, model units.
    pub elevation: f64,
    /// Open floor, m².
    pub area_m2: f64,
    /// New stations, the most useful first.
    pub stations: Vec<StationJson>,
    /// Probes that are there already.
    pub existing: Vec<StationJson>,
    /// Share of the open floor that is seen, of what can be seen, by old and new stations.
    pub covered_fraction: f64,
    /// New stations needed at least for the target, on the discretised plan.
    pub lower_bound: usize,
    /// New stations that reach the target in plan; more are there for the check in space and for overlap.
    pub stations_for_plan: usize,
    /// Share seen after 1, 2, … new stations.
    pub curve: Vec<f64>,
    /// Share that the probes see that are there already.
    pub existing_fraction: f64,
    /// Open floor that no station could see, m².
    pub unreachable_m2: f64,
    /// Small parts beside it, m², that cannot be walked to and are open to what is not this floor: not counted.
    pub left_out_m2: f64,
    /// Share of the walls at probe height that is seen within the limits.
    pub wall_fraction: f64,
    /// What rays to the model's surface say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceJson>,
    /// Names of the stations in the order of a short walk.
    pub walk: Vec<String>,
    /// Its length, metres.
    pub walk_m: f64,
    /// Groups of stations that have too little in common with each other.
    pub groups: usize,
    /// Candidates that stand for all places on the floor.
    pub candidates: usize,
    /// Points that stand for its area and walls.
    pub witnesses: usize,
}

/// The check in space.
#[derive(Clone, Debug, Serialize)]
pub struct SurfaceJson {
    /// Share of the surface that can be seen from this floor and is.
    pub covered_fraction: f64,
    /// `covered_fraction` in plan less that on the surface.
    pub difference: f64,
    /// Surface that can be seen from this floor, m².
    pub reachable_m2: f64,
    /// Surface that faces its open space and cannot be seen from any allowed place, m².
    pub unreachable_m2: f64,
}

/// A station.
#[derive(Clone, Debug, Serialize)]
pub struct StationJson {
    /// Unique name.
    pub name: String,
    /// The lens, in the model's axes and units.
    pub position: [f64; 3],
    /// Open floor that it sees, m².
    pub covers_m2: f64,
    /// Share that it adds to the stations before it.
    pub adds_fraction: f64,
    /// Share of the surface in space that it adds; null without that check.
    pub adds_surface_fraction: Option<f64>,
    /// Whether the site file fixes it.
    pub fixed: bool,
    /// Level distances to walls at probe height, metres, and where they end in the model's axes and units.
    pub tapes: Vec<CheckDistanceJson>,
}

/// A distance to check.
#[derive(Clone, Debug, Serialize)]
pub struct CheckDistanceJson {
    /// Metres.
    pub metres: f64,
    /// Degrees clockwise from true north.
    pub bearing: f64,
    /// Where the wall is met.
    pub to: [f64; 3],
}

/// Writes positions as the site file has them.
#[derive(Clone, Copy, Debug)]
pub struct Outward {
    /// Units and axes.
    pub frame: Frame,
    /// The scene's origin.
    pub origin: DVec3,
}

impl Outward {
    /// For a site's scene.
    pub fn of(site: &Site, scene: &Scene) -> Self {
        Self { frame: site.frame, origin: scene.origin }
    }

    /// Decimals that show a millimetre.
    pub fn decimals(&self) -> usize {
        (3.0 + self.frame.metres_per_unit.log10()).ceil().clamp(0.0, 9.0) as usize
    }

    /// A local point, rounded to about a millimetre.
    pub fn point(&self, local: DVec3) -> [f64; 3] {
        // adding zero makes −0 a 0
        self.frame.point_out(local + self.origin).to_array().map(|v| rounded(v, self.decimals() as i32) + 0.0)
    }

    /// A local height along the model's up direction, rounded to about a millimetre.
    pub fn elevation(&self, z: f32) -> f64 {
        rounded(self.frame.height_out(f64::from(z) + self.origin.z), self.decimals() as i32) + 0.0
    }

    /// Degrees clockwise from true north of a direction in plan.
    pub fn bearing(&self, direction: glam::DVec2) -> f64 {
        let own = direction.x.atan2(direction.y).to_degrees();
        // to a tenth, so that a hair west of north is 0 and not 360
        rounded((own - self.frame.north_deg).rem_euclid(360.0), 1) % 360.0
    }
}

/// A plan as JSON.
pub fn json(site: &Site, plan: &SitePlan<'_>, out: &Outward) -> PlanJson {
    PlanJson {
        site: site.name.clone(),
        floors: plan.floors.iter().map(|f| floor(f, out)).collect(),
        warnings: plan.warnings.clone(),
    }
}

/// File names of a floor's sheets, without ending: the plan and the coverage.
pub fn sheets(floor: &FloorPlan) -> [String; 2] {
    ["plan", "coverage"].map(|kind| format!("{kind}-{}", floor.floor.slug))
}

fn floor(f: &FloorPlan, out: &Outward) -> FloorJson {
    let covered = rounded(f.covered_fraction(), 6);
    FloorJson {
        name: f.floor.name.clone(),
        sheets: sheets(f),
        elevation: out.elevation(f.floor.elevation),
        area_m2: rounded(f.area_m2, 3),
        stations: f.stations.iter().map(|s| station(s, out)).collect(),
        existing: f.present.iter().map(|s| station(s, out)).collect(),
        covered_fraction: covered,
        lower_bound: f.lower_bound,
        stations_for_plan: f.needed,
        curve: f.curve.iter().map(|v| rounded(*v, 6)).collect(),
        existing_fraction: rounded(f.present_fraction, 6),
        unreachable_m2: rounded(f.unreachable_m2, 3),
        left_out_m2: rounded(f.floor.left_out.area(), 3),
        wall_fraction: rounded(f.wall_fraction, 6),
        surface: f.surface.map(|s| SurfaceJson {
            covered_fraction: rounded(s.covered_fraction, 6),
            difference: rounded(covered - s.covered_fraction, 6),
            reachable_m2: rounded(s.reachable_m2, 3),
            unreachable_m2: rounded(s.unreachable_m2, 3),
        }),
        walk: f.walk.iter().map(|i| f.stations[*i].name.clone()).collect(),
        walk_m: rounded(f.walk_m, 2),
        groups: f.groups,
        candidates: f.discrete[0],
        witnesses: f.discrete[1],
    }
}

fn station(s: &Station, out: &Outward) -> StationJson {
    let tapes = s.check_distances.iter().map(|t| CheckDistanceJson {
        metres: rounded(t.metres, 3),
        bearing: out.bearing(t.to - s.position.truncate()),
        to: out.point(t.to.extend(s.position.z)),
    });
    StationJson {
        name: s.name.clone(),
        position: out.point(s.position),
        covers_m2: rounded(s.covers_m2, 3),
        adds_fraction: rounded(s.adds_fraction, 6),
        adds_surface_fraction: s.adds_surface_fraction.map(|f| rounded(f, 6)),
        fixed: s.fixed,
        tapes: tapes.collect(),
    }
}

fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    (value * scale).round() / scale
}

/// A plan as CSV: a row a station, the most useful of each floor first.
pub fn csv(plan: &SitePlan<'_>, out: &Outward) -> String {
    let mut table = Table::new([
        "floor",
        "number",
        "station",
        "x",
        "y",
        "z",
        "covers_m2",
        "adds_fraction",
        "covered_fraction",
        "tape_1_m",
        "tape_2_m",
        "tape_3_m",
        "adds_surface_fraction",
    ]);
    for f in &plan.floors {
        for (i, s) in f.stations.iter().enumerate() {
            let tape = |k: usize| s.check_distances.get(k).map_or_else(String::new, |t| format!("{:.2}", t.metres));
            let [x, y, z] = out.point(s.position).map(|v| v.to_string());
            table.row([
                f.floor.name.clone(),
                (i + 1).to_string(),
                s.name.clone(),
                x,
                y,
                z,
                format!("{:.2}", s.covers_m2),
                format!("{:.4}", s.adds_fraction),
                format!("{:.4}", f.curve[i]),
                tape(0),
                tape(1),
                tape(2),
                s.adds_surface_fraction.map_or_else(String::new, |f| format!("{f:.4}")),
            ]);
        }
    }
    table.finish()
}

/// The proposed stations as blocks of a site file.
pub fn probe_blocks(plan: &SitePlan<'_>, out: &Outward) -> String {
    let mut text = String::new();
    for f in &plan.floors {
        for s in &f.stations {
            let [x, y, z] = out.point(s.position);
            let _ = writeln!(
                text,
                "[[probe]]                     # {}, {}\nname = \"{}\"\nposition = [{x:?}, {y:?}, {z:?}]\n\
                 heading = 0.0\nimage = \"probes/{}.exr\"\n",
                f.floor.name,
                purpose(s),
                s.name,
                s.name
            );
        }
    }
    text
}

/// So many things, in words: `1 station`, `2 stations`.
pub fn counted(count: usize, thing: &str) -> String {
    if count == 1 { format!("1 {thing}") } else { format!("{count} {thing}s") }
}

/// How many stations any plan takes, in words.
pub fn at_least(bound: usize) -> String {
    format!("at least {bound} {} needed", if bound == 1 { "is" } else { "are" })
}

/// What a station is there for.
pub fn purpose(station: &Station) -> String {
    match (station.adds_fraction, station.adds_surface_fraction) {
        (floor, _) if floor >= 0.0005 => format!("adds {:.1} % of the floor", 100.0 * floor),
        (_, Some(surface)) if surface >= 0.0005 => format!("adds {:.1} % of the surface in 3D", 100.0 * surface),
        _ => "for walls or overlap".to_owned(),
    }
}
