//! The light outside: a uniform sky or a panorama.

use glam::{Mat3, Vec2, Vec3};

use super::vertex::cosine_direction;
use crate::panorama::{EnvironmentSampler, Panorama};

/// Radiance from every direction, and directions to look for it.
pub enum Sky {
    /// The same radiance from everywhere.
    Uniform(Vec3),
    /// A panorama around the site.
    Image(Box<SkyImage>),
}

/// A panorama as a sky.
pub struct SkyImage {
    panorama: Panorama,
    sampler: EnvironmentSampler,
    /// From the panorama's axes to the program's.
    rotation: Mat3,
}

/// A direction towards the sky, drawn at random.
pub(super) struct SkySample {
    /// Unit, program's axes.
    pub(super) direction: Vec3,
    pub(super) radiance: Vec3,
    /// Probability per steradian.
    pub(super) density: f32,
}

impl Sky {
    /// A panorama around the site; `rotation` takes its axes to the program's.
    pub fn image(panorama: Panorama, rotation: Mat3) -> Self {
        let sampler = EnvironmentSampler::new(&panorama);
        Self::Image(Box::new(SkyImage { panorama, sampler, rotation }))
    }

    /// Radiance from a unit direction, program's axes.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Uniform(radiance) => *radiance,
            Self::Image(image) => image.panorama.radiance(image.rotation.transpose() * direction),
        }
    }

    /// A direction in which to look for light, seen from a surface with this normal; `u` in the unit square.
    pub(super) fn sample(&self, normal: Vec3, u: Vec2) -> SkySample {
        match self {
            Self::Uniform(radiance) => {
                let direction = cosine_direction(normal, u);
                let density = normal.dot(direction).max(0.0) * std::f32::consts::FRAC_1_PI;
                SkySample { direction, radiance: *radiance, density }
            }
            Self::Image(image) => {
                let (local, density) = image.sampler.sample(u);
                SkySample { direction: image.rotation * local, radiance: image.panorama.radiance(local), density }
            }
        }
    }

    /// Probability per steradian with which [`Sky::sample`] draws a direction.
    pub(super) fn density(&self, normal: Vec3, direction: Vec3) -> f32 {
        match self {
            Self::Uniform(_) => normal.dot(direction).max(0.0) * std::f32::consts::FRAC_1_PI,
            Self::Image(image) => image.sampler.pdf(image.rotation.transpose() * direction),
        }
    }
}
