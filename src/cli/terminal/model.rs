//! A site's model as verbs read it.

use clerestory::scene::{self, Health, Scene};
use clerestory::site::Site;
use std::path::Path;
use std::time::Instant;

use super::output::apart;

/// A model, what was odd in it, and the seconds that reading it took.
pub(crate) struct Model {
    pub(crate) scene: Scene,
    pub(crate) health: Health,
    pub(crate) seconds: f64,
}

impl Model {
    /// Reads the whole of a site's model; results are to go into `folder`, in which none of the model's materials and pictures may
    /// lie.
    pub(crate) fn of(site: &Site, folder: &Path) -> anyhow::Result<Self> {
        let (start, mut health) = (Instant::now(), Health::default());
        let scene = scene::load(site, &mut health)?;
        apart(folder, &health.files)?;
        Ok(Self { scene, health, seconds: start.elapsed().as_secs_f64() })
    }
}
