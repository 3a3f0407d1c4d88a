//! The site files and the list of what is true.

use clerestory::scene::Scene;
use clerestory::site::{Frame, Up};
use serde_json::json;
use std::collections::BTreeMap;
use std::fmt::Write;

use super::Kind;
use super::develop::Camera;
use super::given::Departure;
use super::hand_held::{self, Walk};
use super::outside::Sun;
use super::palette::Palette;
use super::stations::Station;

/// Metres, y up, as models are written.
pub const FRAME: Frame = Frame { metres_per_unit: 1.0, up: Up::Y, north_deg: 0.0 };

/// A camera's lens.
#[derive(Clone, Copy, Debug)]
pub struct Shot {
    /// Vertical field of view without distortion, degrees.
    pub fov_y: f64,
    /// Radial distortion.
    pub k1: f64,
}

/// What is known of a photograph that was taken.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    /// How it was developed.
    pub camera: Camera,
    /// Pixels by which the camera moved.
    pub blur: [f64; 2],
}

/// All of a site but its pictures.
pub struct Description {
    /// Which interior.
    pub seed: u64,
    /// What it is.
    pub kind: Kind,
    /// Whether it stands empty.
    pub bare: bool,
    /// The sun, if it shines in.
    pub sun: Option<Sun>,
    /// Whether `site.toml` says where the sun stands.
    pub names_sun: bool,
    /// How the given model differs from the true one.
    pub departure: Departure,
    /// Where probes stand.
    pub probes: Vec<Station>,
    /// Where photographs are taken.
    pub views: Vec<(Station, Shot)>,
    /// A walk with a camera instead of both, and what it took.
    pub walk: Option<(Walk, Vec<hand_held::Taken>)>,
    /// Their size in pixels.
    pub photo_size: [usize; 2],
}

impl Description {
    /// `site.toml`, with probes' pictures of this kind of file.
    pub fn site_file(&self, ending: &str) -> String {
        let poses = if self.walk.is_some() { "The poses are as tracked" } else { "The poses are true" };
        let mut out = format!(
            "# A random interior, seed {0}. {poses}; the model is not quite true (truth.json).\n\n[site]\nname = \"Interior {0}\"\n\
             units = \"m\"\nup = \"y\"\n\n[model]\npath = \"model/model.obj\"\n",
            self.seed
        );
        if let (Some(sun), true) = (self.sun, self.names_sun) {
            out += &sun_table(sun);
        }
        out + &self.stations("", ending, true)
    }

    /// `truth/site.toml`: the true model and all of its light.
    pub fn true_site_file(&self) -> String {
        let mut out = String::from(
            "# What the pictures were made from.\n\n[site]\nname = \"True interior\"\nunits = \"m\"\nup = \"y\"\n\n[model]\n\
             path = \"model.obj\"\n\n[environment]\nimage = \"sky.exr\"\nheading = 0.0\n",
        );
        if let Some(sun) = self.sun {
            out += &sun_table(sun);
        }
        out + &self.stations("../", "exr", false)
    }

    /// `given` are poses as the program is told them.
    fn stations(&self, up: &str, ending: &str, given: bool) -> String {
        if let Some((walk, taken)) = &self.walk {
            return walk.stations(up, taken, self.photo_size[0], given, self.seed);
        }
        let mut out = String::new();
        let pose = |s: &Station| {
            let [heading, pitch, roll] = s.bearings;
            let position = s.position.to_array();
            format!("position = {position:?}\nheading = {heading:?}\npitch = {pitch:?}\nroll = {roll:?}\n")
        };
        for (k, probe) in self.probes.iter().enumerate() {
            let (name, pose) = (format!("probe_{}", k + 1), pose(probe));
            let _ = write!(out, "\n[[probe]]\nname = \"{name}\"\n{pose}image = \"{up}probes/{name}.{ending}\"\n");
        }
        for (k, (view, shot)) in self.views.iter().enumerate() {
            let (name, pose, Shot { fov_y, k1 }) = (format!("view_{}", k + 1), pose(view), shot);
            // the focal length, since distortion changes the field of view
            let focal = 0.5 * self.photo_size[1] as f64 / (0.5 * fov_y.to_radians()).tan();
            let _ = write!(
                out,
                "\n[[view]]\nname = \"{name}\"\n{pose}fx = {focal:.4}\nk1 = {k1:?}\nsize = {:?}\nphoto = \
                 \"{up}photos/{name}.jpg\"\n",
                self.photo_size
            );
        }
        out
    }

    /// `truth.json`: everything that chance decided and a test may want to know.
    pub fn truth(&self, shots: &[Taken], palette: &Palette) -> String {
        let pose = |s: &Station| json!({ "position": s.position.to_array(), "bearings": s.bearings });
        let views = self.views.iter().enumerate().map(|(k, (station, shot))| {
            let mut view = pose(station);
            view["name"] = json!(format!("view_{}", k + 1));
            view["k1"] = json!(shot.k1);
            if let Some(Taken { camera, blur }) = shots.get(k) {
                view["gain"] = json!(camera.gain);
                view["vignetting"] = json!(camera.vignetting);
                view["noise"] = json!(camera.noise);
                view["jpeg"] = json!(camera.quality);
                view["motion_px"] = json!(blur);
            }
            view
        });
        let probes = self.probes.iter().enumerate().map(|(k, station)| {
            let mut probe = pose(station);
            probe["name"] = json!(format!("probe_{}", k + 1));
            probe
        });
        let d = &self.departure;
        let walk = self.walk.as_ref().map(|(walk, taken)| {
            let frames = walk.frames.iter().zip(taken).enumerate().map(|(k, ((station, _, role), shot))| {
                let mut frame = pose(station);
                frame["name"] = json!(hand_held::name(*role, k));
                frame["gain"] = json!(shot.camera.gain);
                frame["motion_px"] = json!(shot.blur);
                frame
            });
            json!({ "drift_m_deg": walk.drift, "k1": walk.k1, "frames": frames.collect::<Vec<_>>() })
        });
        let glossy = palette.all().into_iter().filter(|m| m.gloss > 0.0);
        let gloss: BTreeMap<&str, f64> = glossy.map(|m| (&*m.finish.name, m.gloss)).collect();
        let sun = self.sun.map(|s| json!({ "direction": s.direction.to_array(), "irradiance": s.irradiance }));
        let truth = json!({
            "seed": self.seed,
            "kind": format!("{:?}", self.kind).to_lowercase(),
            "bare": self.bare,
            "scan": d.scan,
            "gloss": gloss,
            "sun": sun,
            "sun_is_named": self.names_sun && self.sun.is_some(),
            "model": {
                "warp_rms_m": d.warp,
                "longest_edge_m": d.edge,
                "texture_blur_texels": d.blur,
                "texture_size": d.size,
                "texture_tint": d.tint,
            },
            "walk": walk,
            "probes": probes.collect::<Vec<_>>(),
            "views": views.collect::<Vec<_>>(),
        });
        format!("{truth:#}\n")
    }
}

fn sun_table(sun: Sun) -> String {
    let d = sun.direction;
    format!("\n[sun]\ndirection = [{:.5}, {:.5}, {:.5}]\nirradiance = {:?}\n", d.x, d.y, d.z, sun.irradiance)
}

/// Fresnel's F0 of each material of a scene.
pub fn gloss(scene: &Scene, palette: &Palette) -> Vec<f64> {
    let all = palette.all();
    let of = |name: &str| all.iter().find(|m| m.finish.name == name).map_or(0.0, |m| m.gloss);
    scene.materials.iter().map(|m| of(&m.name)).collect()
}
