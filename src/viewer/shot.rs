//! The site's views as the page has them: a camera, and the photograph to lay over the model.

use glam::DVec3;
use serde::Serialize;

use super::error::ViewerError;
use super::pack::Block;
use crate::bake::BakeError;
use crate::panorama::{Exposure, Picture, pinhole_of, undistorted};
use crate::photograph;
use crate::scene::Scene;
use crate::site::{Camera, View};

/// A view of the site.
#[derive(Serialize)]
pub(super) struct Shot {
    name: String,
    position: [f32; 3],
    right: [f64; 3],
    forward: [f64; 3],
    /// Tangents of the picture's left, right, lower and upper rim.
    tan: [f64; 4],
    exposures: Vec<f32>,
    photo: bool,
}

/// A view, and its photograph as a JPEG picture without distortion.
pub(super) fn shot(scene: &Scene, view: &View, exposures: &[Exposure]) -> Result<(Shot, Option<Block>), ViewerError> {
    let model = view.camera.model();
    // a lens that no plane can show is shown by what its middle looks like
    let straight = if view.camera.is_pinhole() { Some(model) } else { pinhole_of(&model) };
    let photo = match (&straight, photograph::read(view)?) {
        (Some(straight), Some((picture, _))) => {
            let picture = if view.camera.is_pinhole() { picture } else { undistorted(&picture, &model, straight) };
            Some(jpeg(&picture).map_err(|why| BakeError::Picture { name: view.name.clone(), why })?)
        }
        _ => None,
    };
    let tan = straight.map_or([-1.0, 1.0, -1.0, 1.0], |s| {
        let [w, h] = s.size.map(f64::from);
        let x = |x: f64| (x - s.centre.x) / s.focal.x;
        let y = |y: f64| (s.centre.y - y) / s.focal.y;
        [x(0.0), x(w), y(h), y(0.0)]
    });
    let Camera { pose, .. } = view.camera;
    let shot = Shot {
        name: view.name.clone(),
        position: scene.local(pose.position).to_array(),
        right: (pose.rotation * DVec3::X).to_array(),
        forward: (pose.rotation * DVec3::Y).to_array(),
        tan,
        exposures: exposures.iter().map(|e| e.0).collect(),
        photo: photo.is_some(),
    };
    Ok((shot, photo))
}

/// A picture as people see it, at most so many pixels a side.
fn jpeg(picture: &Picture) -> Result<Block, String> {
    const MOST: u32 = 1280;
    let exposure = Exposure::of(picture);
    let codes = picture.pixels.iter().flat_map(|p| (exposure.show(*p) * 255.0 + 0.5).to_array().map(|c| c as u8));
    let (width, height) = (picture.width as u32, picture.height as u32);
    let full = image::RgbImage::from_raw(width, height, codes.collect()).unwrap_or_default();
    let scale = (f64::from(MOST) / f64::from(width.max(height).max(1))).min(1.0);
    let size = [width, height].map(|v| ((f64::from(v) * scale) as u32).max(1));
    let small = if scale < 1.0 {
        image::imageops::resize(&full, size[0], size[1], image::imageops::FilterType::Triangle)
    } else {
        full
    };
    let mut bytes = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 88);
    small.write_with_encoder(encoder).map_err(|e| e.to_string())?;
    Ok(Block { kind: "image/jpeg", bytes })
}
