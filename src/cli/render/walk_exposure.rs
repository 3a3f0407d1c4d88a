//! The exposure of frames that are seen one after another.

use clerestory::panorama::Exposure;
use clerestory::scene::Scene;
use clerestory::site::View;
use indicatif::ProgressBar;

use super::video::Video;
use super::view_light::ViewLight;

/// One exposure for all frames of a walk, or for each view of a video, which must not flicker: the [mean](Exposure::mean) of
/// what some of them would have. `frames` are those of a walk, or per picture of a video the views; `exposures_of` tells what
/// each of the views there would have.
pub(super) fn walk_exposures<T>(
    frames: &[T],
    exposures_of: impl FnMut(&T) -> anyhow::Result<Vec<Exposure>>,
) -> anyhow::Result<Vec<Exposure>> {
    const ASKED: usize = 16;
    let asked = frames.iter().step_by(frames.len().div_ceil(ASKED).max(1)).map(exposures_of);
    let asked = asked.collect::<anyhow::Result<Vec<_>>>()?;
    let views = asked.first().map_or(0, Vec::len);
    Ok((0..views).map(|view| Exposure::mean(asked.iter().filter_map(|all| all.get(view).copied()))).collect())
}

/// The [`walk_exposures`] of frames as `light` has them, each with its numbered picture where there are such; nothing that
/// `filmed` does for it counts in its times.
pub(super) fn steady_exposures(
    scene: &Scene,
    light: &ViewLight,
    filmed: &mut Option<Video>,
    frames: &[&[(View, usize)]],
    share: f32,
) -> anyhow::Result<Vec<Exposure>> {
    /// Samples a pixel: enough for a mean.
    const SAMPLES: u32 = 4;
    let times = filmed.as_ref().map(|video| video.times);
    let bar = ProgressBar::hidden();
    let exposures = walk_exposures(frames, |views| {
        let now = filmed.as_mut().map(|video| video.light(views[0].1)).transpose()?;
        let exposure = |(view, _): &(View, usize)| {
            let frame = light.frame(scene, &view.camera, now.as_deref(), SAMPLES, share, &bar)?;
            Some(Exposure::of(&frame.radiance))
        };
        Ok(views.iter().filter_map(exposure).collect())
    })?;
    if let (Some(video), Some(times)) = (filmed, times) {
        video.times = times;
    }
    Ok(exposures)
}
