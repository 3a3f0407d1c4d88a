//! What an audit found and a plan planned, as marks on the surface.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::path::Path;

use super::error::ViewerError;
use crate::scene::{Ray, Scene};
use crate::site::{Site, View};

/// A name at a place.
#[derive(Serialize)]
pub(super) struct Mark {
    pub(super) name: String,
    pub(super) position: [f32; 3],
}

/// A finding with its outline.
#[derive(Serialize)]
pub(super) struct Shown {
    id: String,
    view: String,
    kind: String,
    what: String,
    score: f64,
    words: String,
    position: [f32; 3],
    /// Points of the outline.
    points: Vec<[f32; 3]>,
}

#[derive(Deserialize)]
struct Findings {
    findings: Vec<Finding>,
}

/// The part of a finding in `findings.json` that is shown.
#[derive(Deserialize)]
struct Finding {
    id: String,
    view: String,
    kind: String,
    what: String,
    score: f64,
    mask: String,
    position: [f64; 3],
    #[serde(default)]
    note: String,
}

#[derive(Deserialize)]
struct Plan {
    floors: Vec<Floor>,
}

#[derive(Deserialize)]
struct Floor {
    stations: Vec<Station>,
}

#[derive(Deserialize)]
struct Station {
    name: String,
    position: [f64; 3],
}

fn read<T: for<'a> Deserialize<'a>>(path: &Path, from: &str) -> Result<T, ViewerError> {
    let unusable = |why: String| ViewerError::Unusable { path: path.to_owned(), why, from: from.to_owned() };
    let text = std::fs::read_to_string(path).map_err(|e| unusable(e.to_string()))?;
    serde_json::from_str(&text).map_err(|e| unusable(e.to_string()))
}

fn local(site: &Site, scene: &Scene, position: [f64; 3]) -> [f32; 3] {
    scene.local(site.frame.point_in(DVec3::from(position))).to_array()
}

/// The stations of a plan (`plan.json`).
pub(super) fn stations(site: &Site, scene: &Scene, path: &Path) -> Result<Vec<Mark>, ViewerError> {
    let plan: Plan = read(path, "clerestory plan")?;
    let mark = |s: Station| Mark { position: local(site, scene, s.position), name: s.name };
    Ok(plan.floors.into_iter().flat_map(|f| f.stations).map(mark).collect())
}

/// The findings in a folder that an audit wrote, outlined on the surface by their masks.
pub(super) fn findings(site: &Site, scene: &Scene, folder: &Path) -> Result<Vec<Shown>, ViewerError> {
    let all: Findings = read(&folder.join("findings.json"), "clerestory audit")?;
    all.findings
        .into_iter()
        .map(|f| {
            let view = site.views.iter().find(|v| v.name == f.view);
            let points = match view {
                Some(view) => outline(scene, view, &folder.join(&f.mask))?,
                None => Vec::new(),
            };
            let Finding { id, view, kind, what, score, note, .. } = f;
            Ok(Shown { id, view, kind, what, score, words: note, position: local(site, scene, f.position), points })
        })
        .collect()
}

/// The points of the surface that a mask's rim shows, at most so many.
fn outline(scene: &Scene, view: &View, mask: &Path) -> Result<Vec<[f32; 3]>, ViewerError> {
    const MOST: usize = 400;
    let unusable = |e: image::ImageError| ViewerError::Unusable {
        path: mask.to_owned(),
        why: e.to_string(),
        from: "clerestory audit".into(),
    };
    let mask = image::open(mask).map_err(unusable)?.into_luma8();
    let (width, height) = mask.dimensions();
    let inside = |x: i64, y: i64| {
        let within = (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y);
        within && mask.get_pixel(x as u32, y as u32).0[0] > 127
    };
    let rim: Vec<(i64, i64)> = (0..i64::from(height))
        .flat_map(|y| (0..i64::from(width)).map(move |x| (x, y)))
        .filter(|&(x, y)| inside(x, y) && [(1, 0), (-1, 0), (0, 1), (0, -1)].iter().any(|(i, j)| !inside(x + i, y + j)))
        .collect();
    let origin = scene.local(view.camera.pose.position);
    let scale = [f64::from(view.camera.width) / f64::from(width), f64::from(view.camera.height) / f64::from(height)];
    let point = |&(x, y): &(i64, i64)| {
        let direction = view.camera.direction((x as f64 + 0.5) * scale[0], (y as f64 + 0.5) * scale[1]).as_vec3();
        let hit = scene.tracer.closest(&Ray { origin, direction }, 1e-3)?;
        Some((origin + direction * (hit.t * 0.999) + Vec3::ZERO).to_array())
    };
    Ok(rim.iter().step_by(rim.len().div_ceil(MOST).max(1)).filter_map(point).collect())
}
