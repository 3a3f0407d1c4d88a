//! What became of a region's texture: another laying of it, other colours, or another picture.

use crate::audit::finding::What;
use crate::audit::hypothesis::laying::retextured::Relaid;
use crate::audit::picture::correlation;
use crate::audit::picture::regions::Region;
use crate::audit::view::Observations;
use crate::panorama::luminance;

/// Correlation of brightness over a region between the photograph and the model as it is.
pub(crate) fn as_is(observed: &Observations, region: &Region) -> f32 {
    let t = &observed.texture;
    let tested = region.pixels.iter().filter(|i| t.tested[**i]);
    let ln = |i: usize, ratio: f32| luminance(observed.albedo[i] * (t.ratio[i] * ratio).map(f32::exp)).max(1e-6).ln();
    correlation(tested.map(|&i| (ln(i, 1.0), ln(i, 0.0)))).0
}

/// Says what became of a region's texture that follows the model's so closely, and whose colour is off by so many times the threshold;
/// `relaid` is asked for another laying that it may have.
pub(crate) fn explain(as_is: f32, colour: f32, relaid: impl FnOnce() -> Option<Relaid>) -> What {
    let other = if as_is > 0.6 || colour > 1.5 { What::Recoloured } else { What::Changed };
    let relaid = if as_is > 0.75 { None } else { relaid().filter(|r| r.what != What::Moved) };
    relaid.map_or(other, |r| r.what)
}
