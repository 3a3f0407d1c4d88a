//! A site's model as verbs read it.

use clerestory::scene::{self, Health, Scene};
use clerestory::site::Site;
use clerestory::study::{Clock, Seconds};
use std::path::Path;

use super::output::apart;

/// A model, what was odd in it, and what reading it took.
pub(crate) struct Model {
    pub(crate) scene: Scene,
    pub(crate) health: Health,
    pub(crate) read: Seconds,
}

impl Model {
    /// Reads the whole of a site's model; results are to go into `folder`, in which none of the model's materials and pictures may
    /// lie.
    pub(crate) fn of(site: &Site, folder: &Path) -> anyhow::Result<Self> {
        let (clock, mut health) = (Clock::start(), Health::default());
        let scene = scene::load(site, &mut health)?;
        apart(folder, &health.files)?;
        Ok(Self { scene, health, read: clock.read() })
    }
}
