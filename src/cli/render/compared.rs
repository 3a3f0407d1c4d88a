//! `render --compare`.

use clerestory::panorama::Picture;
use clerestory::photograph;
use clerestory::radiometry::{PhotographFit, fit_to_render};
use clerestory::render::{Frame, Source};
use clerestory::scene::Scene;
use clerestory::site::{Camera, View};
use clerestory::study::{Comparison, compare, hidden};
use glam::Vec3;
use std::collections::BTreeMap;

/// A photograph to compare with.
pub(super) struct Masked {
    picture: Picture,
    /// The value from which it is clipped.
    clipped: f32,
    /// The pixels that its view's mask leaves out.
    left_out: Option<Vec<bool>>,
}

/// How close a view is to its photograph, as that comes, and after it was fitted to the view.
#[derive(Default)]
pub(super) struct Compared {
    pub(super) error: Option<Comparison>,
    pub(super) fit: Option<PhotographFit>,
    pub(super) error_after_fit: Option<Comparison>,
}

/// Compares a frame with its photograph; `probes` are the probes' places, local metres.
pub(super) fn compared(scene: &Scene, probes: &[Vec3], camera: &Camera, frame: &Frame, photo: &Masked) -> Compared {
    let hidden = hidden(scene, probes, camera);
    let left_out = photo.left_out.as_deref();
    let error = |photo: &Picture| compare(&hidden, camera, frame, photo, left_out);
    let lit = |i: usize| frame.source[i] != Source::None && left_out.is_none_or(|out| !out[i]);
    let fit = fit_to_render(&photo.picture, &frame.radiance, photo.clipped, lit);
    let error_after_fit = fit.and_then(|fit| error(&fit.develop(&photo.picture)));
    Compared { error: error(&photo.picture), fit, error_after_fit }
}

/// The photographs to compare with, by view.
pub(super) fn photos(views: &[&View]) -> anyhow::Result<BTreeMap<String, Masked>> {
    let mut photos = BTreeMap::new();
    for view in views {
        if let Some((picture, coding)) = photograph::read(view)? {
            let photo = Masked { picture, clipped: coding.clipped(), left_out: photograph::left_out(view)? };
            photos.insert(view.name.clone(), photo);
        }
    }
    Ok(photos)
}
