//! Everything that lights a site: sky, sun and emissive surfaces.

use glam::Vec3;
use std::path::PathBuf;

use super::emitters::Emitters;
use super::sky::Sky;
use super::sun_patches::SunPatches;
use crate::panorama::{self, EnvironmentSampler, Panorama, PanoramaError};
use crate::scene::Scene;
use crate::site::{Environment, Site, Sun};

/// The lights of a site. Only lights that were found are sampled, each at every vertex of a path.
pub struct Lights {
    pub(super) sky: Option<Sky>,
    pub(super) sun: Option<Sun>,
    pub(super) emitters: Option<Emitters>,
    pub(super) patches: Option<SunPatches>,
}

/// Why a site cannot be lit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LightError {
    /// The sky's picture cannot be read.
    #[error(transparent)]
    Sky(#[from] PanoramaError),
    /// Nothing shines.
    #[error(
        "{}: nothing gives light: there is no [environment], no [sun] and no emissive material (Ke in the MTL file); \
         add one of them",
        .0.display()
    )]
    Dark(PathBuf),
}

impl Lights {
    /// Lights made by hand; emissive triangles are found in the scene.
    pub fn new(scene: &Scene, sky: Option<Sky>, sun: Option<Sun>) -> Self {
        Self::seen_from(scene, sky, sun, &[])
    }

    /// The same; where pictures are taken (`eyes`, local metres) tells which sun patches to look for, which lowers the
    /// noise of interiors and changes nothing else.
    pub fn seen_from(scene: &Scene, sky: Option<Sky>, sun: Option<Sun>, eyes: &[Vec3]) -> Self {
        let sun = sun.filter(|s| s.irradiance.max_element() > 0.0);
        let patches = sun.as_ref().and_then(|sun| SunPatches::new(scene, sun, eyes));
        Self { sky, sun, emitters: Emitters::new(scene), patches }
    }

    /// The lights that a site file names and those in its model.
    ///
    /// # Errors
    /// When the sky's picture cannot be read, or nothing gives light.
    pub fn load(site: &Site, scene: &Scene) -> Result<Self, LightError> {
        let sky = match &site.environment {
            None => None,
            Some(Environment::Uniform(radiance)) => Some(Sky::Uniform(*radiance)),
            Some(Environment::Image { path, rotation, projection }) => {
                let panorama = Panorama::new(panorama::read(path)?, *projection, *rotation);
                Some(Sky::Image(Box::new(EnvironmentSampler::new(panorama))))
            }
        };
        let poses = site.probes.iter().map(|p| p.pose).chain(site.views.iter().map(|v| v.camera.pose));
        let eyes: Vec<Vec3> = poses.map(|pose| scene.local(pose.position)).collect();
        let lights = Self::seen_from(scene, sky, site.sun, &eyes);
        if lights.is_dark() { Err(LightError::Dark(site.file.clone())) } else { Ok(lights) }
    }

    /// Whether nothing shines.
    pub fn is_dark(&self) -> bool {
        let sky = self.sky.as_ref().is_some_and(|sky| !matches!(sky, Sky::Uniform(r) if r.max_element() <= 0.0));
        !sky && self.sun.is_none() && self.emitters.is_none()
    }
}
