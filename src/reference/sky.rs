//! The light outside: a uniform sky or a panorama.

use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

use super::vertex::cosine_direction;
use crate::panorama::{EnvironmentSample, EnvironmentSampler};

/// Radiance from every direction, and directions to look for it.
pub enum Sky {
    /// The same radiance from everywhere.
    Uniform(Vec3),
    /// A panorama around the site.
    Image(Box<EnvironmentSampler>),
}

impl Sky {
    /// Radiance from a unit direction, program's axes.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Uniform(radiance) => *radiance,
            Self::Image(image) => image.radiance(direction),
        }
    }

    /// A direction in which to look for light, seen from a surface with this normal; `u` in the unit square.
    pub(super) fn sample(&self, normal: Vec3, u: Vec2) -> EnvironmentSample {
        match self {
            Self::Uniform(radiance) => {
                let direction = cosine_direction(normal, u);
                let pdf = normal.dot(direction).max(0.0) * FRAC_1_PI;
                EnvironmentSample { direction, radiance: *radiance, pdf }
            }
            Self::Image(image) => image.sample(u),
        }
    }

    /// Probability per steradian with which [`Sky::sample`] draws a direction.
    pub(super) fn density(&self, normal: Vec3, direction: Vec3) -> f32 {
        match self {
            Self::Uniform(_) => normal.dot(direction).max(0.0) * FRAC_1_PI,
            Self::Image(image) => image.pdf(direction),
        }
    }
}
