//! Whether a site is fit for work: the model's health, the probes' sanity, and which stages the site needs.
//!
//! ```no_run
//! use clerestory::check::check;
//! use clerestory::site::Site;
//!
//! let site = Site::load("my-chapel".as_ref())?;
//! for cause in &check(&site)?.causes {
//!     println!("{}", cause.sentence); // what explains the rest, first
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cause;
mod frame;
mod pictures;
mod probes;
mod reach;
mod stages;
mod surroundings;
mod views;
pub use cause::{Cause, CauseKind};
pub(crate) use frame::{length, log_normal};
pub use probes::{PictureCheck, ProbeCheck};
pub use reach::{eyes, unreachable};
pub use stages::{Saving, Stage, stages};
pub use views::ViewCheck;

use rayon::prelude::*;
use serde::Serialize;

use crate::panorama::PanoramaError;
use crate::register::RegisterError;
use crate::scene::{self, Edges, Health, SceneError};
use crate::site::Site;

/// What is known about a site after reading all of it. Serialises to the JSON of `check --json`.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Check {
    /// The site's name.
    pub site: String,
    /// Whether nothing at all is to be warned of.
    pub ok: bool,
    /// Mistakes that explain what else is odd, the first cause first.
    pub causes: Vec<Cause>,
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
#[non_exhaustive]
pub enum CheckError {
    /// The model cannot be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A picture cannot be used.
    #[error(transparent)]
    Picture(#[from] PanoramaError),
    /// A picture cannot be compared with the model.
    #[error(transparent)]
    Register(#[from] RegisterError),
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
    let around_probes: Vec<_> = site.probes.par_iter().map(|p| probes::surroundings(&scene, p)).collect();
    let around_views: Vec<_> = site.views.par_iter().map(|v| views::surroundings(&scene, v)).collect();
    let around = || around_probes.iter().chain(&around_views);
    let front_is_usual = edges.winding_is_meaningful().then(|| surroundings::usual_side(around()));
    let nearest_m: Vec<f32> = around().map(|a| a.nearest_m).collect();
    let mut causes = frame::causes(site, &scene, &nearest_m);
    let (probes, of_probes) = probes::probes(site, &around_probes, front_is_usual)?;
    causes.extend(of_probes);
    let views = site.views.iter().zip(&around_views).map(|(v, around)| views::view(site, v, around, front_is_usual));
    let (views, of_views): (Vec<_>, Vec<_>) = views.unzip();
    causes.extend(of_views.into_iter().flatten());
    // in another unit or with another axis up no picture fits
    if !causes.iter().any(|c| c.kind <= CauseKind::Units) {
        let of_pictures = pictures::causes(site, &scene, &causes)?;
        causes.extend(of_pictures);
    }
    let causes = cause::ordered(causes);
    let unseen_share = stages::unseen_share(site, &scene);
    let edge_warnings = edge_warnings(&edges);
    let quiet = causes.is_empty() && site.warnings.is_empty() && model.warnings.is_empty() && edge_warnings.is_empty();
    Ok(Check {
        site: site.name.clone(),
        ok: quiet && probes.iter().all(|p| p.warnings.is_empty()) && views.iter().all(|v| v.warnings.is_empty()),
        causes,
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

/// Rims and cracks are usual in models of interiors; only what misleads is worth a sentence.
fn edge_warnings(edges: &Edges) -> Vec<String> {
    let mut warnings = Vec::new();
    let mut warn = |count: usize, what: &str| {
        let share = count as f64 / edges.total.max(1) as f64;
        if share > 0.02 {
            warnings.push(format!("{count} edges ({:.1} %) {what}.", 100.0 * share));
        }
    };
    warn(
        edges.inverted,
        "lie between triangles that are wound against each other: some faces are inside out. Surfaces count as two-sided \
         here, so pictures stay right",
    );
    warn(edges.non_manifold, "belong to three or more triangles: look for faces that are modelled twice");
    warnings
}
