//! Which stages of work a site needs, and which it can leave out.

use rayon::prelude::*;
use serde::Serialize;

use crate::scene::{Ray, Scene};
use crate::site::{Site, View};

/// A stage of work, and whether the site needs it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Stage {
    /// `textures`, `shoot`, `lightings`, `merge`, `volume`, `render`, `audit`, `simulate` or `plan`.
    pub stage: &'static str,
    /// Whether it is needed.
    pub needed: bool,
    /// Why, or why not.
    pub why: String,
}

/// The stages in the order of work. `unseen_share` is the share of what the views show that no probe sees;
/// `None` where they show nothing.
pub fn stages(site: &Site, scene: &Scene, unseen_share: Option<f64>) -> Vec<Stage> {
    let stage = |stage, needed, why: String| Stage { stage, needed, why };
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
        _ if probes == 0 => (false, "the site has no probe to fill it from".to_owned()),
        None => (false, "no view shows the model".to_owned()),
        Some(0.0) => (false, "every sampled point in every view is seen by a probe".to_owned()),
        Some(share) => (true, format!("no probe sees {:.1} % of what the views show", 100.0 * share)),
    };
    let light = site.environment.is_some() || site.sun.is_some() || scene.materials.iter().any(emits);
    vec![
        stage("textures", textures > 0, format!("the model has {textures} pictures on its materials")),
        stage("shoot", probes > 0, count(probes, "probe", "probes")),
        stage("lightings", lightings > 1, count(lightings, "lighting", "lightings")),
        stage("merge", probes > 1, count(probes, "probe", "probes")),
        stage("volume", volume.0, volume.1),
        stage(
            "render",
            probes > 0 && views > 0,
            format!("{}, {}", count(probes, "probe", "probes"), count(views, "view", "views")),
        ),
        stage("audit", probes > 0 && photos > 0, count(photos, "photograph", "photographs")),
        stage(
            "simulate",
            light,
            if light {
                "the site tells where light comes from"
            } else {
                "the site has no environment, no sun and no material that shines"
            }
            .to_owned(),
        ),
        stage(
            "plan",
            probes == 0,
            if probes == 0 { "no probe has been taken yet" } else { "probes have been taken; plan again for more" }
                .to_owned(),
        ),
    ]
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
