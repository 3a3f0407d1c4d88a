//! A first site file for a model: what its frame seems to be, and the pictures and cameras that lie beside it.
//!
//! [`draft`] looks, guesses and gives the text; writing it is the caller's. What is guessed says so in the text, with what
//! speaks for it, so that a person can judge.
//!
//! ```
//! use clerestory::init::{Sources, draft};
//! use std::path::Path;
//! # let chapel = concat!(env!("CARGO_MANIFEST_DIR"), "/sites/chapel");
//!
//! let model = Path::new(chapel).join("model/chapel.obj");
//! let draft = draft(&Path::new(chapel).join("draft.toml"), &Sources { model, ..Sources::default() })?;
//! assert!(draft.text.contains("path = \"model/chapel.obj\""));
//! # Ok::<(), clerestory::init::InitError>(())
//! ```

mod error;
mod found;
mod gathered;
mod guess;
mod hints;
mod names;
mod scans;
mod text;

pub use error::InitError;
pub use gathered::Sources;

pub use guess::{Guess, Guessed};

use glam::DVec3;
use std::path::{Path, PathBuf};

use crate::scene::{self, ModelFormat};
use crate::site::{CameraSource, Pose, Site};
use gathered::{Findings, Gathered};

/// A site file to be written, and what a person should know of it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Draft {
    /// The site file's text.
    pub text: String,
    /// Unit and up axis.
    pub guess: Guess,
    /// Views.
    pub views: usize,
    /// Probes, with those of which nothing tells where they were taken.
    pub probes: usize,
    /// Probes whose place `register` has to find.
    pub unplaced: usize,
    /// Photographs that became no view, as nothing tells where they were taken.
    pub unposed: usize,
    /// The camera file taken.
    pub pose_file: Option<PathBuf>,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
}

/// Drafts a site file that will be `file`, and is not written yet. The pictures of an E57 file are: into a folder beside it,
/// called after the model.
///
/// # Errors
///
/// A model that cannot be read, and folders without pictures. Whatever else is odd is told in the draft.
pub fn draft(file: &Path, sources: &Sources) -> Result<Draft, InitError> {
    let (mesh, origin) = scene::mesh_of(&sources.model)?;
    let mut warnings = Vec::new();
    let mut pictures = Gathered::of(sources, &mut warnings)?;
    let mut hints = hints::of_file(&sources.model, &mesh);
    let format = ModelFormat::of(&sources.model);
    if format == Some(ModelFormat::E57) {
        let stem = sources.model.file_stem().unwrap_or_default().to_string_lossy();
        let folder = crate::atomic_write::folder_of(file).join(format!("{stem}-pictures"));
        pictures.scanned = scans::taken_out(&sources.model, &folder, sources.overwrite, &mut warnings)?;
        let setups = scene::e57::setups(&sources.model)?;
        hints.eyes.extend(setups.iter().map(|s| s.position));
        hints.ups.extend(setups.iter().map(|s| s.up));
    }
    let written = |guess: &Guess, pictures: &Gathered| {
        let text = text::site_file(&Findings {
            name: site_name(file, &sources.model),
            folder: crate::atomic_write::folder_of(file),
            model: &sources.model,
            coloured: !mesh.colours.is_empty() && format != Some(ModelFormat::Gltf),
            guess,
            pictures,
        });
        let site = Site::of_text(file, &text);
        (text, site)
    };
    let mut guess = guess::guess(&mesh, origin, &hints);
    let (mut text, mut site) = written(&guess, &pictures);
    if let (Err(why), Some(_)) = (&site, &pictures.pose_file) {
        pictures.left_out = Some(why.to_string());
        (text, site) = written(&guess, &pictures);
    }
    let solved = site.as_ref().map(solved_cameras).unwrap_or_default();
    if !solved.is_empty() {
        // where cameras stand, and how they were held, speaks for unit and axis
        for (eye, up) in solved {
            hints.eyes.push(eye);
            hints.ups.push(up);
        }
        guess = guess::guess(&mesh, origin, &hints);
        (text, site) = written(&guess, &pictures);
    }
    let (views, probes, unplaced) = match &site {
        Ok(site) => (site.views.len(), site.probes.len(), site.probes.iter().filter(|p| !p.placed).count()),
        Err(why) => {
            warnings.push(format!("The site file needs a hand: {why}."));
            (0, 0, 0)
        }
    };
    warnings.extend(pictures.left_out.iter().map(|why| format!("The camera file is left out: {why}.")));
    warnings.extend(site.iter().flat_map(|s| s.warnings.iter().cloned()));
    let pose_file = site.ok().and_then(|s| s.pose_file);
    Ok(Draft { text, guess, views, probes, unplaced, unposed: pictures.unposed.len(), pose_file, warnings })
}

/// Place and upward direction, in the model's axes and units, of each camera that another program solved.
fn solved_cameras(site: &Site) -> Vec<(DVec3, DVec3)> {
    let views = site.views.iter().filter(|v| matches!(v.source, CameraSource::PoseFile(_))).map(|v| v.camera.pose);
    let probes = site.probes.iter().filter(|p| site.pose_file.is_some() && p.projection.is_photograph() && p.placed);
    let probes = probes.map(|p| p.pose);
    let in_model =
        |pose: Pose| (site.frame.point_out(pose.position), site.frame.direction_out(pose.rotation * DVec3::Z));
    views.chain(probes).map(in_model).collect()
}

/// After the site file, its folder or the model.
fn site_name(file: &Path, model: &Path) -> String {
    let stem = |path: &Path| path.file_stem().map(|s| s.to_string_lossy().into_owned());
    let own = stem(file).filter(|s| s != "site");
    let folder = std::path::absolute(file).ok().and_then(|f| stem(f.parent()?));
    let name = own.or_else(|| stem(model)).or(folder).unwrap_or_else(|| "site".to_owned());
    name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
