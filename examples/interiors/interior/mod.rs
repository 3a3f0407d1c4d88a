//! Random interiors: a place by seed, pictures of it, and a model of it that is not what made the pictures.

pub mod develop;
pub mod dice;
pub mod furnish;
pub mod furniture;
pub mod given;
pub mod hand_held;
pub mod hangings;
pub mod layout;
pub mod light;
pub mod look;
pub mod outside;
pub mod painting;
pub mod palette;
pub mod pictures;
pub mod room;
pub mod shade;
pub mod site;
pub mod stations;

use clerestory::panorama::{Layer, write_exr};
use clerestory::reference::Eye;
use clerestory::scene::{self, Health, Scene};
use clerestory::site::{Pictures, Site};
use glam::DVec3;
use image::RgbImage;
use std::collections::HashMap;
use std::error::Error;
use std::path::Path;

use crate::common::mesh::{Model, normal};
use crate::common::pattern::{jpeg, painted};
use dice::Dice;
use given::Departure;
use hand_held::{Role, Walk};
use layout::{Layout, Window};
use light::Field;
use palette::Palette;
use shade::Truth;
use site::{Description, Shot};

/// What sort of interior.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// One large room, with columns or without.
    Hall,
    /// A nave under a barrel vault, an apse, aisles.
    Chapel,
    /// Rooms with doors between them.
    Rooms,
    /// Low vaults.
    Cellar,
    /// A high room with a stair and a gallery.
    Stairs,
}

/// All kinds; a seed takes the one at its remainder.
pub const KINDS: [Kind; 5] = [Kind::Rooms, Kind::Hall, Kind::Chapel, Kind::Stairs, Kind::Cellar];

/// What to write.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Which interior.
    pub seed: u64,
    /// Width of the probes' pictures in pixels; they are half as high.
    pub probe_width: usize,
    /// Size of the photographs in pixels.
    pub photo_size: [usize; 2],
    /// Rays a pixel; the root is rounded up.
    pub samples: usize,
    /// Rays that look for light at each of the spots where it is gathered; lights are sampled a third as often.
    pub links: usize,
    /// Texels a metre of the true pictures.
    pub texels: f64,
    /// About how many triangles a scan has.
    pub scan_triangles: f64,
    /// Probes and photographs, or the models alone.
    pub pictures: bool,
    /// Probes as clipped 8-bit JPEG, too, and `site_8bit.toml` that names them.
    pub eight_bit: bool,
    /// A scan by somebody who walks through with a camera in the hand.
    pub hand_held: bool,
}

/// What was drawn.
pub struct Drawn {
    /// What sort of interior it is.
    pub kind: Kind,
    /// Its holes to the outside, model's axes.
    pub windows: Vec<Window>,
}

/// Writes a whole site: `site.toml` and what it names, the true place in `truth/`, and what differs in `truth.json`.
///
/// # Errors
/// When a file cannot be written, or the place cannot be loaded again.
pub fn write(folder: &Path, options: &Options) -> Result<Drawn, Box<dyn Error>> {
    let seed = options.seed;
    let kind = KINDS[(seed % KINDS.len() as u64) as usize];
    let dice = |purpose: &str| Dice::new(seed, purpose);
    let palette = Palette::new(kind, &mut dice("palette"));
    let lamps = dice("lamps").chance(if kind == Kind::Cellar { 0.9 } else { 0.35 });
    let bare = dice("bare").chance(0.12);
    let layout = Layout::new(kind, &palette, lamps, bare, &mut dice("layout"));
    let inside = layout.rooms.iter().map(|r| 0.5 * (r.low + r.high)).sum::<DVec3>() / layout.rooms.len() as f64;
    let sun = outside::sun(&layout.windows, inside, &mut dice("sun"));
    let scan = (seed % 3 == 2).then_some(options.scan_triangles);
    let departure = Departure::new(area(&layout.model), scan, &mut dice("given"));
    let description = Description {
        seed,
        kind,
        bare,
        sun,
        names_sun: dice("named").chance(0.5),
        departure,
        probes: Vec::new(),
        views: Vec::new(),
        walk: None,
        photo_size: options.photo_size,
    };

    for part in ["truth", "model", "probes", "photos"] {
        std::fs::create_dir_all(folder.join(part))?;
    }
    let sky = outside::sky(&mut dice("sky"));
    let layer = Layer::vectors("", ["R", "G", "B"], &sky.pixels, true);
    write_exr(&folder.join("truth/sky.exr"), sky.width, sky.height, &[layer], None)?;
    let used = pictures_of(&layout.model, &palette, options.texels);
    write_true_model(&folder.join("truth"), &layout.model, &used)?;
    let (site, scene) = load(folder, &description)?;
    if options.hand_held {
        write_walk(folder, description, &site, &scene, &layout, &palette, options)?;
        return Ok(Drawn { kind, windows: layout.windows });
    }
    write_given_model(&folder.join("model"), &layout.model, &departure, &used)?;
    let description = with_stations(description, &scene, &layout, options);
    let (site, _) = load(folder, &description)?;
    std::fs::write(folder.join("site.toml"), description.site_file("exr"))?;
    if options.eight_bit {
        std::fs::write(folder.join("site_8bit.toml"), description.site_file("jpg"))?;
    }
    let mut shots = Vec::new();
    if options.pictures {
        let gloss = site::gloss(&scene, &palette);
        shots = pictures::take(folder, &site, &scene, &layout.windows, &gloss, options)?;
    }
    std::fs::write(folder.join("truth.json"), description.truth(&shots, &palette))?;
    Ok(Drawn { kind, windows: layout.windows })
}

/// Writes all of a site that somebody walks through with a camera.
fn write_walk(
    folder: &Path,
    description: Description,
    site: &Site,
    scene: &Scene,
    layout: &Layout,
    palette: &Palette,
    options: &Options,
) -> Result<(), Box<dyn Error>> {
    let seed = options.seed;
    let walk = Walk::new(scene, layout, &mut Dice::new(seed, "walk"));
    let full = options.photo_size[0] / 9 * 8;
    let lamps = pictures::lamps(site, scene, &layout.windows)?;
    let eyes: Vec<Eye> = (0..walk.frames.len()).map(|k| walk.eye(k, full / 2)).collect();
    let places = eyes.iter().flat_map(|eye| shade::seen(scene, eye, pictures::STRIDE));
    let field = Field::new(scene, &lamps, places, options.links, seed);
    let taken =
        walk.take(&Truth { scene, lamps: &lamps, field: &field, gloss: &site::gloss(scene, palette) }, full, seed);
    for (k, shot) in taken.iter().enumerate() {
        let role = walk.frames[k].2;
        let part = match role {
            Role::Fused => continue,
            Role::Probe => "probes",
            Role::Photograph => "photos",
        };
        let file = folder.join(part).join(hand_held::name(role, k) + ".jpg");
        std::fs::write(file, jpeg(&shot.picture, shot.camera.quality)?)?;
    }
    // about as large where a walk shows a million triangles
    let voxel = 0.013 * (1e6 / options.scan_triangles).sqrt();
    let fused = walk.fused(scene, &taken, full, voxel as f32, seed);
    std::fs::write(folder.join("model/model.obj"), hand_held::obj(&fused, scene))?;
    std::fs::write(folder.join("model/model.mtl"), "newmtl scan\nKd 1 1 1\n")?;
    let objects: String = fused.objects.iter().map(|o| format!("{o}\n")).collect();
    std::fs::write(folder.join("truth/objects.txt"), objects)?;
    let description = Description { walk: Some((walk, taken)), photo_size: [full, full * 3 / 4], ..description };
    std::fs::write(folder.join("truth/site.toml"), description.true_site_file())?;
    std::fs::write(folder.join("site.toml"), description.site_file("jpg"))?;
    Ok(std::fs::write(folder.join("truth.json"), description.truth(&[], palette))?)
}

/// Writes `truth/site.toml` and loads it with the true model.
fn load(folder: &Path, description: &Description) -> Result<(Site, Scene), Box<dyn Error>> {
    let file = folder.join("truth/site.toml");
    std::fs::write(&file, description.true_site_file())?;
    let site = Site::load_with(&file, Pictures::MayBeMissing)?;
    let scene = scene::load(&site, &mut Health::default())?;
    Ok((site, scene))
}

/// The same with probes and views where the scene has space for them.
fn with_stations(description: Description, scene: &Scene, layout: &Layout, options: &Options) -> Description {
    let seed = description.seed;
    let mut dice = Dice::new(seed, "stations");
    let frame = site::FRAME;
    let count = dice.whole(2, 3);
    let probes = stations::probes(scene, &frame, layout, count, &mut dice);
    let fov_y = (dice.between(46.0, 66.0) * 10.0f64).round() / 10.0;
    let half = (0.5 * fov_y.to_radians()).tan();
    let [w, h] = options.photo_size.map(|n| n as f64);
    let count = dice.whole(2, 3);
    let views = stations::views(scene, &frame, layout, &probes, [half * w / h, half], count, &mut dice);
    let views = views
        .into_iter()
        .map(|station| {
            let k1 = if dice.chance(0.6) { (dice.between(-0.12, 0.06) * 1e4).round() * 1e-4 } else { 0.0 };
            (station, Shot { fov_y, k1 })
        })
        .collect();
    Description { probes, views, ..description }
}

/// The pictures of the finishes that a model uses, by file name.
fn pictures_of<'p>(model: &Model, palette: &'p Palette, texels: f64) -> Vec<(&'p str, RgbImage)> {
    let used = model.finishes();
    let mut all = Vec::new();
    for material in palette.all() {
        let (Some(look), Some(name)) = (&material.look, material.finish.texture.as_deref()) else { continue };
        if used.iter().any(|f| f.name == material.finish.name) {
            let size = (look.tile * texels).round().as_uvec2().to_array().map(|n| n.clamp(16, 768));
            all.push((name, painted(size, 2, |p| look.albedo(p))));
        }
    }
    all
}

fn write_true_model(folder: &Path, model: &Model, pictures: &[(&str, RgbImage)]) -> Result<(), Box<dyn Error>> {
    std::fs::write(folder.join("model.obj"), model.obj("A random interior", "model.mtl"))?;
    std::fs::write(folder.join("model.mtl"), model.mtl())?;
    for (name, picture) in pictures {
        std::fs::write(folder.join(name), jpeg(picture, 93)?)?;
    }
    Ok(())
}

fn write_given_model(
    folder: &Path,
    truth: &Model,
    departure: &Departure,
    pictures: &[(&str, RgbImage)],
) -> Result<(), Box<dyn Error>> {
    let given: HashMap<&str, RgbImage> = pictures.iter().map(|(n, p)| (*n, departure.picture(n, p))).collect();
    if departure.scan {
        std::fs::write(folder.join("model.obj"), departure.scanned(truth, &given))?;
        std::fs::write(folder.join("model.mtl"), "newmtl scan\nKd 1 1 1\n")?;
        return Ok(());
    }
    let model = departure.remeshed(truth);
    std::fs::write(folder.join("model.obj"), model.obj("A random interior as modelled", "model.mtl"))?;
    std::fs::write(folder.join("model.mtl"), model.mtl())?;
    for (name, _) in pictures {
        std::fs::write(folder.join(name), jpeg(&given[name], 88)?)?;
    }
    Ok(())
}

/// Square metres of a model's surface.
fn area(model: &Model) -> f64 {
    let faces = model.objects.iter().flat_map(|(_, faces)| faces);
    faces.map(|f| 0.5 * normal(&f.corners.iter().map(|c| model.position(c[0])).collect::<Vec<_>>()).length()).sum()
}
