//! The paper's method as what a view is rendered with.

use glam::Vec3;

use super::Plain;
use crate::render::{Irradiance, Lit, ShadingPoint};
use crate::volume::Nearby;

/// A scene lit the paper's way, for [`crate::render::render`]. Every sample looks up its own irradiance.
pub struct PlainRelit<'a> {
    /// Records and volume.
    pub plain: &'a Plain,
    /// Radiance of the sky in a direction, seen through windows.
    pub sky: &'a (dyn Fn(Vec3) -> Vec3 + Sync),
}

impl Irradiance for PlainRelit<'_> {
    fn at(&self, spot: &ShadingPoint, _: &mut Nearby) -> Lit {
        let (irradiance, source) = self.plain.irradiance(spot.position, spot.normal);
        Lit::known(irradiance, source, 1.0)
    }

    fn sky(&self, direction: Vec3) -> Vec3 {
        (self.sky)(direction)
    }

    /// The paper takes ρ at the point P (section 4.3).
    fn shares(&self) -> bool {
        false
    }
}
