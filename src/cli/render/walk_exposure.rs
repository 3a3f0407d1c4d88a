//! The exposure of a walk.

use clerestory::panorama::Exposure;
use clerestory::site::Camera;

/// One exposure for all frames of a walk, which must not flicker: the geometric mean of what some of them would have.
pub(super) fn walk_exposure(
    cameras: &[Camera],
    mut exposure_of: impl FnMut(&Camera) -> anyhow::Result<Exposure>,
) -> anyhow::Result<Exposure> {
    const ASKED: usize = 16;
    let (mut sum, mut count) = (0.0, 0.0);
    for camera in cameras.iter().step_by(cameras.len().div_ceil(ASKED).max(1)) {
        sum += exposure_of(camera)?.0.ln();
        count += 1.0;
    }
    Ok(Exposure((sum / f32::max(count, 1.0)).exp()))
}
