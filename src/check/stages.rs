//! Which stages of work a site needs, and which it can leave out.

use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;

use super::reach::unreachable;
use crate::panorama::{self, PanoramaError};
use crate::scene::{Ray, Scene, Tracer};
use crate::site::{Site, View};
use crate::volume::{self, CachePoint, CachePoints, Grid};

/// A stage of work, and whether the site needs it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stage {
    /// `textures`, `unreached`, `shoot`, `lightings`, `merge`, `volume`, `subdivision`, `render`, `audit`, `simulate`,
    /// `floors` or `plan`.
    pub stage: &'static str,
    /// Whether it is needed.
    pub needed: bool,
    /// Why, or why not.
    pub why: String,
    /// What leaving it out saves, where that is worth telling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saves: Option<Saving>,
}

impl Stage {
    fn of(stage: &'static str, needed: bool, why: impl Into<String>) -> Self {
        Self { stage, needed, why: why.into(), saves: None }
    }
}

/// What is not spent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Saving {
    /// Seconds on this machine, as measured on a part or the whole of the work.
    pub seconds: f64,
    /// Bytes of memory.
    pub bytes: u64,
}

/// So high must a model be, metres, before people can walk on two of its floors, one above the other.
const TWO_STOREYS_M: f64 = 3.6;

/// The stages in the order of work. `unseen_share` is the share of what the views show that no probe sees;
/// `None` where they show nothing. What some stages would cost is measured, which takes a moment.
///
/// # Errors
///
/// A probe's picture that cannot be read.
pub fn stages(site: &Site, scene: &Scene, unseen_share: Option<f64>) -> Result<Vec<Stage>, PanoramaError> {
    let probes = site.probes.len();
    let lightings = site.lightings().len();
    let photos = site.views.iter().filter(|v| v.photo.is_some()).count();
    let (views, textures) = (site.views.len(), scene.textures.len());
    let count = |n: usize, one: &str, many: &str| match n {
        0 => format!("the site has no {one}"),
        1 => format!("the site has one {one}"),
        n => format!("the site has {n} {many}"),
    };
    let volume = match unseen_share {
        _ if probes == 0 => Stage::of("volume", false, "the site has no probe to fill it from"),
        Some(share) if share > 0.0 => {
            Stage::of("volume", true, format!("no probe sees {:.1} % of what the views show", 100.0 * share))
        }
        _ => {
            let why = match unseen_share {
                None => "no view shows the model",
                Some(_) => "every sampled point in every view is seen by a probe",
            };
            Stage { saves: Some(volume_cost(scene)), ..Stage::of("volume", false, why) }
        }
    };
    let light = site.environment.is_some() || site.sun.is_some() || scene.materials.iter().any(emits);
    let simulate = match light {
        true => "the site tells where light comes from",
        false => "the site has no environment, no sun and no material that shines",
    };
    let (low, high) = scene.mesh.bounds();
    let height = f64::from(high.z - low.z);
    let floors = match height >= TWO_STOREYS_M {
        true => format!("the model is {height:.1} m high; two storeys take {TWO_STOREYS_M} m"),
        false => format!(
            "the model is {height:.1} m high and two storeys take {TWO_STOREYS_M} m: the height of its one floor comes \
             out of the search for where a tripod can stand"
        ),
    };
    let plan = match probes {
        0 => "no probe has been taken yet",
        _ => "probes have been taken; plan again for more",
    };
    let pictures = match textures {
        0 => "no material has a picture: none is decoded, none looked up".to_owned(),
        1 => "the model has one picture on its materials".to_owned(),
        n => format!("the model has {n} pictures on its materials"),
    };
    Ok(vec![
        Stage::of("textures", textures > 0, pictures),
        unreached_stage(site, scene),
        Stage::of("shoot", probes > 0, count(probes, "probe", "probes")),
        lightings_stage(site, count(lightings, "lighting", "lightings"))?,
        Stage::of("merge", probes > 1, count(probes, "probe", "probes")),
        volume,
        Stage::of("subdivision", false, subdivision(scene)),
        Stage::of(
            "render",
            probes > 0 && views > 0,
            format!("{}, {}", count(probes, "probe", "probes"), count(views, "view", "views")),
        ),
        Stage::of("audit", probes > 0 && photos > 0, count(photos, "photograph", "photographs")),
        Stage::of("simulate", light, simulate),
        Stage::of("floors", height >= TWO_STOREYS_M, floors),
        Stage::of("plan", probes == 0, plan),
    ])
}

/// Whether there is more than one lighting; and what it saves that only the one asked for is decoded.
fn lightings_stage(site: &Site, count: String) -> Result<Stage, PanoramaError> {
    let all = site.lightings();
    let others: Vec<_> =
        site.probes.iter().flat_map(|p| &p.pictures).filter(|lit| Some(&lit.lighting) != all.first()).collect();
    let Some(one) = others.first() else {
        return Ok(Stage::of("lightings", false, count));
    };
    let start = Instant::now();
    let pixels = panorama::read(&one.path)?.pixels.len();
    let rate = start.elapsed().as_secs_f64() / pixels.max(1) as f64;
    let mut all_pixels = 0;
    for lit in &others {
        let (width, height) = panorama::dimensions(&lit.path)?;
        all_pixels += width * height;
    }
    let saves = Saving { seconds: rate * all_pixels as f64, bytes: (all_pixels * size_of::<glam::Vec3>()) as u64 };
    let why = format!("{count}; only the one that is asked for is decoded");
    Ok(Stage { saves: Some(saves), ..Stage::of("lightings", true, why) })
}

/// Whether all of the model can be reached from probes and views.
fn unreached_stage(site: &Site, scene: &Scene) -> Stage {
    let eyes = super::eyes(site, scene.origin, None);
    let Some(marked) = unreachable(&scene.mesh, &eyes) else {
        return Stage::of("unreached", true, "all triangles may be reached from the probes and views");
    };
    let start = Instant::now();
    let whole = Tracer::new(&scene.mesh).bytes();
    let seconds = start.elapsed().as_secs_f64();
    let keep: Vec<bool> = marked.iter().map(|m| !m).collect();
    let count = marked.iter().filter(|m| **m).count();
    let mut bytes = whole.saturating_sub(Tracer::over(&scene.mesh, &keep).bytes());
    let reached = |texture: usize| {
        let of = |material: u32| scene.materials[material as usize].texture == Some(texture as u32);
        scene.mesh.materials.iter().zip(&keep).any(|(m, keep)| *keep && of(*m))
    };
    let pictures = (0..scene.textures.len()).filter(|t| !reached(*t));
    bytes += pictures.map(|t| scene.textures[t].bytes()).sum::<usize>();
    let seconds = seconds * count as f64 / marked.len() as f64;
    let why = format!("{count} triangles lie behind closed walls that part them from all probes and views");
    Stage { saves: Some(Saving { seconds, bytes: bytes as u64 }), ..Stage::of("unreached", false, why) }
}

/// The volume's cells.
fn grid(scene: &Scene) -> Grid {
    let (low, high) = scene.mesh.bounds();
    Grid::over(low, high, volume::VolumeSettings::default().cells)
}

/// What the volume takes where nothing wants it: the places that it would put values at.
fn volume_cost(scene: &Scene) -> Saving {
    let start = Instant::now();
    let grid = grid(scene);
    let cache_points = CachePoints::over(scene, grid);
    let bytes = cache_points.list.len() * size_of::<CachePoint>() + grid.len() * size_of::<u32>();
    Saving { seconds: start.elapsed().as_secs_f64(), bytes: bytes as u64 }
}

/// Why the volume's cells are not divided further where the scene is fine: whatever its size, its values stand on
/// surfaces only, and only those that a view asks for are worked out.
fn subdivision(scene: &Scene) -> String {
    let grid = grid(scene);
    let kib = (grid.len() * size_of::<u32>()) as f64 / 1024.0;
    let [x, y, z] = grid.size.to_array();
    format!(
        "the volume's values stand on surfaces; {x} × {y} × {z} plain cells of {kib:.0} KiB find them in a scene of this size"
    )
}

fn emits(material: &crate::scene::Material) -> bool {
    material.emission.max_element() > 0.0
}

/// The share of points that no probe sees among those that the views show, on a grid of pixels; `None` where no view
/// shows anything. A record's footprint is not asked for: this is plain line of sight.
pub(super) fn unseen_share(site: &Site, scene: &Scene) -> Option<f64> {
    let counts: Vec<(usize, usize)> = site.views.par_iter().map(|v| unseen(site, scene, v)).collect();
    let (unseen, all) = counts.into_iter().fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    (all > 0).then(|| unseen as f64 / all as f64)
}

/// Points that no probe sees, and all points, on a grid of at most 64 × 64 pixels.
fn unseen(site: &Site, scene: &Scene, view: &View) -> (usize, usize) {
    const GRID: u32 = 64;
    let camera = &view.camera;
    let origin = scene.local(camera.pose.position);
    let (mut unseen, mut all) = (0, 0);
    for i in 0..GRID * GRID {
        let part = |n: u32, side: u32| (f64::from(n) + 0.5) / f64::from(GRID) * f64::from(side);
        let (x, y) = (part(i % GRID, camera.width), part(i / GRID, camera.height));
        if !camera.shows(x, y) {
            continue;
        }
        let direction = camera.direction(x, y).as_vec3();
        let ray = Ray { origin, direction };
        let Some(hit) = scene.tracer.closest(&ray, 0.0) else { continue };
        let surface = scene.surface(&ray, &hit);
        all += 1;
        unseen += usize::from(!site.probes.iter().any(|p| sees(scene, scene.local(p.pose.position), &surface)));
    }
    (unseen, all)
}

fn sees(scene: &Scene, probe: glam::Vec3, surface: &crate::scene::Surface) -> bool {
    let way = probe - surface.position;
    let distance = way.length();
    // off the surface by what single precision needs
    let lift = 1e-4 * (1.0 + surface.position.abs().max_element());
    if way.dot(surface.normal) <= 0.0 || distance <= 2.0 * lift {
        return false;
    }
    let ray = Ray { origin: surface.position + surface.normal * lift, direction: way / distance };
    !scene.tracer.occluded(&ray, 0.0, distance - lift)
}
