//! What became of a region's texture: another laying of it, other colours, or another picture.

use super::regions::Region;
use super::relaid::relaid;
use super::view::Maps;
use super::{What, correlation};
use crate::panorama::luminance;
use crate::scene::Scene;

/// Brightness of less variance than this is even.
const LEAST_VARIANCE: f64 = 1e-8;

/// Correlation of brightness over a region between the photograph and the model as it is.
pub(super) fn as_is(maps: &Maps, region: &Region) -> f32 {
    let t = &maps.texture;
    let tested = region.pixels.iter().filter(|i| t.tested[**i]);
    let ln = |i: usize, ratio: f32| luminance(maps.albedo[i] * (t.ratio[i] * ratio).map(f32::exp)).max(1e-6).ln();
    correlation(tested.map(|&i| (ln(i, 1.0), ln(i, 0.0))), LEAST_VARIANCE).0
}

/// Says what became of a region's texture that follows the model's so closely, and whose colour is off by so many times the threshold.
pub(super) fn explain(scene: &Scene, maps: &Maps, region: &Region, as_is: f32, colour: f32) -> What {
    let other = if as_is > 0.6 || colour > 1.5 { What::Recoloured } else { What::Changed };
    let relaid =
        if as_is > 0.75 { None } else { relaid(scene, maps, &region.pixels).filter(|r| r.what != What::Moved) };
    relaid.map_or(other, |r| r.what)
}
