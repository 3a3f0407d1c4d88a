//! What a volume says of a point.

use glam::Vec3;

/// What a volume says of a point.
#[derive(Clone, Copy, Debug)]
pub struct Filled {
    /// Irradiance without direct sun.
    pub irradiance: Vec3,
    /// The share of what the point sees from where somebody tells what light comes, 0..=1; the rest is guessed to be as
    /// [`Light::beyond`](crate::shoot::Light::beyond).
    pub told: f32,
}

impl Filled {
    /// From this share on what is told makes the value; below, it is mostly a guess.
    pub(super) const TOLD: f32 = 0.9;

    /// Whether the value is mostly a guess of what lies beyond.
    pub fn is_guess(&self) -> bool {
        self.told < Self::TOLD
    }
}

/// Irradiance E(n) = n · vector of a surface, per channel.
pub(crate) fn irradiance(vectors: &[Vec3; 3], normal: Vec3) -> Vec3 {
    Vec3::new(vectors[0].dot(normal), vectors[1].dot(normal), vectors[2].dot(normal)).max(Vec3::ZERO)
}
