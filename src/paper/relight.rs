//! The paper's method as what a view is rendered with.

use glam::Vec3;

use super::Plain;
use crate::render::{Irradiance, Source};
use crate::volume::Nearby;

/// A scene lit the paper's way, for [`crate::render::render`]. Every sample looks up its own irradiance.
pub struct PlainRelit<'a> {
    /// Records and volume.
    pub plain: &'a Plain,
    /// Radiance of the sky in a direction, seen through windows.
    pub sky: &'a (dyn Fn(Vec3) -> Vec3 + Sync),
}

impl Irradiance for PlainRelit<'_> {
    fn irradiance(
        &self,
        normal: Vec3,
        positions: &[Vec3],
        _: &mut Nearby,
        put: &mut dyn FnMut(usize, Vec3),
    ) -> (Source, f32) {
        let mut counts = [0usize; 3];
        for (i, &point) in positions.iter().enumerate() {
            let (irradiance, source) = self.plain.irradiance(point, normal);
            counts[source as usize] += 1;
            put(i, irradiance);
        }
        let [_, record, volume] = counts;
        let source = match record + volume {
            0 => Source::None,
            known if 2 * record >= known => Source::Record,
            _ => Source::Volume,
        };
        (source, 1.0)
    }

    fn sky(&self, direction: Vec3) -> Vec3 {
        (self.sky)(direction)
    }

    /// The paper takes ρ at the point P (section 4.3).
    fn filters_albedo(&self) -> bool {
        false
    }
}
