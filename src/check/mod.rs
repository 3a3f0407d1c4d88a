//! Whether a site is fit for work: the model's health, the probes' sanity, and which stages the site needs.

mod probes;
mod reach;
mod stages;
mod views;

pub use probes::{PictureCheck, ProbeCheck};
pub use reach::unreachable;
pub use stages::{Saving, Stage, stages};
pub use views::ViewCheck;

use serde::Serialize;

use crate::panorama::PanoramaError;
use crate::scene::{self, Edges, Health, Scene, SceneError};
use crate::site::Site;

/// What is known about a site after reading all of it. Serialises to the JSON of `check --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// The site's name.
    pub site: String,
    /// Whether nothing at all is to be warned of.
    pub ok: bool,
    /// What is odd in the site file, a sentence each.
    pub warnings: Vec<String>,
    /// What import found in the model.
    pub model: Health,
    /// How the model's triangles meet.
    pub edges: Edges,
    /// What is odd in how triangles meet, a sentence each.
    pub edge_warnings: Vec<String>,
    /// Each probe, in the site's order.
    pub probes: Vec<ProbeCheck>,
    /// Each view, in the site's order.
    pub views: Vec<ViewCheck>,
    /// The share, over all views' pixels that show the model, of points that no probe sees; `None` without views.
    pub unseen_share: Option<f64>,
    /// The stages of work, in order.
    pub stages: Vec<Stage>,
}

/// Why a site could not be checked to the end.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The model cannot be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A picture cannot be used.
    #[error(transparent)]
    Picture(#[from] PanoramaError),
}

/// Reads everything a site names and tells what it is fit for.
///
/// # Errors
///
/// A model or picture that cannot be used at all; what is merely odd is told in the result.
pub fn check(site: &Site) -> Result<Check, CheckError> {
    let mut model = Health::default();
    let scene = scene::load(site, &mut model)?;
    let edges = scene::edges(&scene.mesh);
    let probes = probes::probes(site, &scene, &edges)?;
    let views: Vec<_> = site.views.iter().map(|v| views::view(site, &scene, v)).collect();
    let unseen_share = stages::unseen_share(site, &scene);
    let edge_warnings = edge_warnings(&edges);
    let quiet = site.warnings.is_empty() && model.warnings.is_empty() && edge_warnings.is_empty();
    Ok(Check {
        site: site.name.clone(),
        ok: quiet && probes.iter().all(|p| p.warnings.is_empty()) && views.iter().all(|v| v.warnings.is_empty()),
        warnings: site.warnings.clone(),
        stages: stages(site, &scene, unseen_share)?,
        model,
        edges,
        edge_warnings,
        probes,
        views,
        unseen_share,
    })
}

/// Where rays start: all probes, and the views, or those named; metres from `origin`.
pub fn eyes(site: &Site, origin: glam::DVec3, views: Option<&[&str]>) -> Vec<glam::Vec3> {
    let wanted = |name: &str| views.is_none_or(|v| v.contains(&name));
    let cameras = site.views.iter().filter(|v| wanted(&v.name)).map(|v| v.camera.pose);
    site.probes.iter().map(|p| p.pose).chain(cameras).map(|pose| (pose.position - origin).as_vec3()).collect()
}

/// Rims and cracks are usual in models of interiors; only what misleads is worth a sentence.
fn edge_warnings(edges: &Edges) -> Vec<String> {
    let share = |count: usize| count as f64 / edges.total.max(1) as f64;
    let mut warnings = Vec::new();
    if share(edges.inverted) > 0.02 {
        warnings.push(format!(
            "{} edges ({:.1} %) lie between triangles that are wound against each other: some faces are inside out. \
             Surfaces count as two-sided here, so pictures stay right.",
            edges.inverted,
            100.0 * share(edges.inverted)
        ));
    }
    if share(edges.non_manifold) > 0.02 {
        warnings.push(format!(
            "{} edges ({:.1} %) belong to three or more triangles: look for faces that are modelled twice.",
            edges.non_manifold,
            100.0 * share(edges.non_manifold)
        ));
    }
    warnings
}

/// Points spread evenly over the unit sphere: a Fibonacci lattice (González, *Measurement of areas on a sphere using
/// Fibonacci and latitude–longitude lattices*, 2010).
pub(crate) fn sphere(count: usize) -> impl Iterator<Item = glam::Vec3> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    (0..count).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (sin, cos) = (golden_angle * i as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        glam::DVec3::new(radius * cos, radius * sin, z).as_vec3()
    })
}

/// Straight down, and a little beside it: a ray that meets an edge exactly may slip through.
fn downward() -> [glam::Vec3; 3] {
    [(0.0, 0.0), (1e-3, 2e-3), (-2e-3, 1e-3)].map(|(x, y)| glam::Vec3::new(x, y, -1.0).normalize())
}

/// Whether a mesh with such edges is wound well enough for fronts and backs to mean something.
pub(crate) fn winding_means_something(edges: &Edges) -> bool {
    edges.inverted * 20 <= edges.total
}

/// What a few thousand rays from a point tell of its surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Surroundings {
    /// Distance of the nearest hit in metres; infinite without any.
    nearest_m: f32,
    /// Distance that half the hits are nearer than; infinite without any.
    median_m: f32,
    /// Share of rays that hit within 5 cm.
    close_share: f64,
    /// Share of hits on a triangle's back.
    back_share: f64,
    /// Share of rays that hit nothing.
    open_share: f64,
    /// Distance straight down, if anything is there.
    beneath_m: Option<f32>,
}

impl Surroundings {
    fn of(scene: &Scene, position: glam::Vec3) -> Self {
        const RAYS: usize = 2048;
        const CLOSE_M: f32 = 0.05;
        let cast = |direction| {
            let ray = scene::Ray { origin: position, direction };
            scene.tracer.closest(&ray, 0.0).map(|hit| (hit.t, scene.mesh.normal(hit.triangle).dot(direction) > 0.0))
        };
        let mut hits: Vec<(f32, bool)> = sphere(RAYS).filter_map(cast).collect();
        hits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let share = |n: usize, of: usize| n as f64 / of.max(1) as f64;
        Self {
            nearest_m: hits.first().map_or(f32::INFINITY, |h| h.0),
            median_m: hits.get(hits.len() / 2).map_or(f32::INFINITY, |h| h.0),
            close_share: share(hits.iter().filter(|h| h.0 < CLOSE_M).count(), RAYS),
            back_share: share(hits.iter().filter(|h| h.1).count(), hits.len()),
            open_share: share(RAYS - hits.len(), RAYS),
            beneath_m: downward().into_iter().find_map(cast).map(|h| h.0),
        }
    }
}
