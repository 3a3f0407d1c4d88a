//! From a probe's picture to the chart its records lie in.

use super::Chart;
use crate::panorama::{self, PanoramaError, Picture, Projection, latlong, pinhole_of};
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

fn around(picture: Picture, projection: Projection) -> (Chart, Picture) {
    let picture = latlong(picture, projection);
    (Chart::latlong(picture.width, picture.height), picture)
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
