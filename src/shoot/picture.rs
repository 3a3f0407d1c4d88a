//! From a probe's picture to the chart its records lie in.

use glam::{DMat3, Vec3};

use super::Chart;
use crate::panorama::{self, Panorama, PanoramaError, Picture, Projection, convert, latlong_size, pinhole_of};
use crate::site::Probe;
use std::path::Path;

/// The chart for a probe's picture, and the picture in the chart's projection. Latitude/longitude and photographs without
/// distortion stay as they are; those with distortion become straight; all others, and lenses too wide for a plane,
/// become latitude/longitude as fine as their centre. Pixels that show nothing are NaN, so that they never become light.
pub fn charted(picture: Picture, projection: Projection) -> (Chart, Picture) {
    let (width, height) = (picture.width, picture.height);
    match projection {
        Projection::LatLong => (Chart::latlong(width, height), picture),
        Projection::Perspective { fov_y } => (Chart::perspective(width, height, fov_y), picture),
        Projection::Camera(model) if model.is_pinhole() => (Chart::pinhole(width, height, &model), picture),
        Projection::Camera(model) => match pinhole_of(&model.resized(width as u32, height as u32)) {
            Some(straight) => {
                let picture = panorama::undistorted(&picture, &model, &straight);
                (Chart::pinhole(picture.width, picture.height, &straight), picture)
            }
            None => around(picture, projection),
        },
        _ => around(picture, projection),
    }
}

/// The picture in latitude/longitude.
fn around(picture: Picture, projection: Projection) -> (Chart, Picture) {
    let panorama = Panorama::new(picture, projection, DMat3::IDENTITY);
    let (width, height) = latlong_size(&panorama);
    let mut picture = convert(&panorama, Projection::LatLong, width, height);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        let direction = Projection::LatLong.direction(width, height, x, y);
        if direction.and_then(|d| panorama.shown(d)).is_none() {
            *pixel = Vec3::NAN;
        }
    }
    (Chart::latlong(width, height), picture)
}

/// The radiance that a probe's picture shows, in the picture's own projection; clipped values are taken as they stand.
///
/// # Errors
///
/// As [`panorama::read`].
pub fn read_light(probe: &Probe, path: &Path) -> Result<Picture, PanoramaError> {
    let (mut picture, coding) = panorama::read_coded(path)?;
    probe.radiometry(coding).develop(&mut picture);
    Ok(picture)
}
