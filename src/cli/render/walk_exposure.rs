//! The exposure of a walk.

use clerestory::panorama::Exposure;
use clerestory::site::Camera;

/// One exposure for all frames of a walk, which must not flicker: the [mean](Exposure::mean) of what some of them would have.
pub(super) fn walk_exposure(
    cameras: &[Camera],
    exposure_of: impl FnMut(&Camera) -> anyhow::Result<Exposure>,
) -> anyhow::Result<Exposure> {
    const ASKED: usize = 16;
    let asked = cameras.iter().step_by(cameras.len().div_ceil(ASKED).max(1)).map(exposure_of);
    Ok(Exposure::mean(asked.collect::<anyhow::Result<Vec<_>>>()?))
}
