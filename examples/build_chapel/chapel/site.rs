//! The two site files and the list of planted faults.

use glam::{DVec3, dvec3};
use serde_json::{Value, json};
use std::fmt::Write;

use super::Version;
use super::building::apse_side;
use super::finish::{PLAQUE, ROSETTE, SHIP, VINE};
use super::furnishing::{COLUMN_MOVED, VINE_SHIFTED};

/// A time of day and its sun.
pub struct Lighting {
    /// The name in the site file.
    pub name: &'static str,
    /// Folder-friendly name.
    pub file: &'static str,
    /// Degrees clockwise from north, and above the horizon.
    pub sun: [f64; 2],
    /// Irradiance on a surface that faces the sun.
    pub irradiance: [f64; 3],
}

impl Lighting {
    /// Unit vector towards the sun in the model's axes.
    pub fn direction(&self) -> DVec3 {
        let [azimuth, elevation] = self.sun.map(f64::to_radians);
        dvec3(azimuth.sin() * elevation.cos(), elevation.sin(), -azimuth.cos() * elevation.cos())
    }
}

/// A day in spring at 45° north. The photographs are taken at the first.
pub const LIGHTINGS: [Lighting; 2] = [
    Lighting { name: "10:00", file: "1000", sun: [145.0, 32.0], irradiance: [48.0, 43.0, 34.0] },
    Lighting { name: "14:30", file: "1430", sun: [222.0, 35.0], irradiance: [50.0, 46.0, 39.0] },
];

/// Probes: name, position and what to say of it.
const PROBES: [(&str, [f64; 3], &str); 3] = [
    ("west", [3.6, 1.6, -0.3], "in the open bay behind the benches"),
    ("east", [9.8, 1.6, 0.25], "before the chancel steps"),
    ("aisle", [7.3, 1.6, -4.4], "in the north aisle"),
];

/// A camera, and what it looks at.
struct ViewAt {
    name: &'static str,
    position: [f64; 3],
    look_at: [f64; 3],
    fov_y: f64,
    what: &'static str,
}

const VIEWS: [ViewAt; 5] = [
    ViewAt {
        name: "floor",
        position: [2.7, 1.75, 1.3],
        look_at: [5.7, 0.35, -1.7],
        fov_y: 62.0,
        what: "the brick floor in the open bay, and the middle column",
    },
    ViewAt {
        name: "panels",
        position: [8.2, 1.65, -1.9],
        look_at: [8.1, 2.15, 3.0],
        fov_y: 58.0,
        what: "the south wall with its paintings",
    },
    ViewAt {
        name: "apse",
        position: [5.5, 1.65, 0.1],
        look_at: [12.0, 1.85, -0.1],
        fov_y: 52.0,
        what: "along the nave to the altar",
    },
    ViewAt {
        name: "aisle",
        position: [6.3, 1.6, -3.85],
        look_at: [10.2, 1.55, -5.3],
        fov_y: 62.0,
        what: "the aisle's north wall with plaque and niche",
    },
    ViewAt {
        name: "sacristy",
        position: [11.25, 1.6, 6.05],
        look_at: [9.3, 1.2, 4.1],
        fov_y: 72.0,
        what: "the side room, which no probe sees",
    },
];

/// The site file of either version; probes and photographs are the same files, since there is only one real chapel.
pub fn toml(version: Version) -> String {
    let (title, model) = match version {
        Version::Truth => ("Chapel", "model"),
        Version::AsModelled => ("Chapel, as modelled", "as_modelled"),
    };
    let mut out = String::new();
    if version.faulty() {
        out += "# The chapel as somebody modelled it, with mistakes: faults.json lists them. Probes and photographs are of the\n\
                # real one (site.toml), so an audit of this site has something to find.\n";
    } else {
        out += "# The chapel: a site in every detail that clerestory reads. Positions are in the model's own axes (y up,\n\
                # east = +x, south = +z) and units. Paths are relative to this file.\n";
    }
    let [sun, later] = &LIGHTINGS;
    let [d, d2] = [sun, later].map(Lighting::direction);
    let ([r, g, b], [r2, g2, b2]) = (sun.irradiance, later.irradiance);
    let _ = write!(
        out,
        r#"
[site]
name = "{title}"
units = "m"                   # m, cm, mm, ft, in, or metres per model unit
up = "y"                      # the model's up axis
north = 0.0                   # degrees clockwise from the model's north (-z) to true north

[model]
path = "{model}/chapel.obj"

# Light from outside. Only `simulate` needs it: `render` takes its light from the probes.
[environment]
image = "sky.exr"             # latitude/longitude, without the sun
heading = 0.0                 # where its centre column looks

[sun]                         # at {time}, when the photographs were taken
direction = [{:.4}, {:.4}, {:.4}]   # towards the sun
irradiance = [{r:?}, {g:?}, {b:?}]        # on a surface that faces it

[sun.under."{later}"]             # where it stands in the other lighting
direction = [{:.4}, {:.4}, {:.4}]
irradiance = [{r2:?}, {g2:?}, {b2:?}]

# Probes: panoramas taken on a tripod, 512 x 256 pixels, in two lightings. The centre column looks east, to the altar.
"#,
        d.x,
        d.y,
        d.z,
        d2.x,
        d2.y,
        d2.z,
        time = sun.name,
        later = later.name,
    );
    for (name, at, what) in PROBES {
        let pictures = LIGHTINGS.each_ref().map(|l| format!(r#""{}" = "{}""#, l.name, probe_file(name, l)));
        let _ = write!(
            out,
            "\n[[probe]]                     # {what}\nname = \"{name}\"\nposition = {at:?}\nheading = 90.0\nimage = {{ {} }}\n",
            pictures.join(", ")
        );
    }
    out += "\n# Views: pictures to be rendered; each has a photograph to compare with.\n";
    for ViewAt { name, position, look_at, fov_y, what } in VIEWS {
        let _ = write!(
            out,
            "\n[[view]]                      # {what}\nname = \"{name}\"\nposition = {position:?}\nlook_at = {look_at:?}\nfov_y = {fov_y:?}\n\
             size = [256, 256]\nphoto = \"photos/{name}.exr\"\n"
        );
    }
    out += r#"
[plan]
probe_height = 1.6            # metres above the floor
clearance = 0.35              # least distance from the tripod to a wall, metres
incidence = 80.0              # degrees from the normal past which a surface does not count as seen
target_coverage = 0.95
max_probes = 8
keep_out = [[[10.3, -0.3], [10.9, -0.3], [10.9, 0.3], [10.3, 0.3]]]   # below the lamp; (x, z) pairs
"#;
    out
}

/// A probe's picture in one lighting, relative to the site.
fn probe_file(name: &str, lighting: &Lighting) -> String {
    format!("probes/{name}_{}.exr", lighting.file)
}

/// The planted faults, for whoever tests an audit: what differs from the real chapel, where, and how large.
pub fn faults() -> String {
    let on = |k: usize, height: f64| {
        let p = apse_side(k).at(0.0, height, 0.0);
        [p.x, p.y, p.z].map(|v| (v * 1e3).round() / 1e3)
    };
    let fault = |id: &str,
                 kind: &str,
                 what: &str,
                 object: &str,
                 position: [f64; 3],
                 size: [f64; 3],
                 views: &[&str],
                 note: &str| {
        json!({ "id": id, "kind": kind, "what": what, "object": object, "position": position, "size_m": size, "views": views, "note": note })
    };
    let list: Vec<Value> = vec![
        fault(
            "floor",
            "texture",
            "rotated",
            "floor",
            [4.5, 0.0, 0.0],
            [2.8, 0.0, 5.6],
            &["floor"],
            "the bricks of the second bay run across the nave, not along it",
        ),
        fault(
            "ship",
            "texture",
            "mirrored",
            "painting_ship",
            [6.0, 2.3, 3.0],
            [SHIP.tile.x, SHIP.tile.y, 0.04],
            &["panels"],
            "the painting is mirrored left to right",
        ),
        fault(
            "rosette",
            "texture",
            "recoloured",
            "painting_rosette",
            [10.2, 3.15, 3.0],
            [ROSETTE.tile.x, ROSETTE.tile.y, 0.04],
            &["panels"],
            "green and ochre where it is red and blue",
        ),
        fault(
            "vine",
            "texture",
            "shifted",
            "painting_vine_north",
            on(0, 2.3),
            [VINE.tile.x, VINE.tile.y, 0.04],
            &["apse"],
            &format!("the picture is {} cm too far right in its frame", VINE_SHIFTED * 100.0),
        ),
        fault(
            "plaque",
            "geometry",
            "missing",
            "plaque",
            [9.1, 1.7, -5.375],
            [PLAQUE.tile.x, PLAQUE.tile.y, 0.05],
            &["aisle"],
            "a terracotta plaque on the aisle's wall is not modelled",
        ),
        fault(
            "niche",
            "geometry",
            "missing",
            "niches, vase",
            [10.5, 1.72, -5.4],
            [0.9, 1.45, 0.45],
            &["aisle"],
            "the eastern niche and the vase in it are not modelled",
        ),
        fault(
            "column",
            "geometry",
            "moved",
            "column_2",
            [6.0 + COLUMN_MOVED, 1.35, -3.25],
            [0.74, 2.7, 0.74],
            &["floor"],
            &format!("the middle column stands {} cm too far east", COLUMN_MOVED * 100.0),
        ),
        fault(
            "crate",
            "geometry",
            "extra",
            "crate",
            [10.35, 0.225, -0.625],
            [0.5, 0.45, 0.55],
            &["apse"],
            "a crate that is not there",
        ),
    ];
    format!("{:#}\n", json!({ "model": "as_modelled.toml", "truth": "site.toml", "faults": list }))
}
