//! From a probe's picture to the chart its records lie in.

use glam::Vec3;

use super::Chart;
use crate::panorama::{self, Panorama, PanoramaError, Picture, Projection, convert, latlong_size};
use crate::site::Probe;
use glam::DMat3;
use std::path::Path;

/// The chart for a probe's picture, and the picture in the chart's projection. Latitude/longitude and perspective stay
/// as they are; others become latitude/longitude as fine as their centre. Pixels that show nothing are NaN, so that
/// they never become light.
pub fn charted(picture: Picture, projection: Projection) -> (Chart, Picture) {
    match projection {
        Projection::LatLong => (Chart::latlong(picture.width, picture.height), picture),
        Projection::Perspective { fov_y } => (Chart::perspective(picture.width, picture.height, fov_y as f32), picture),
        _ => {
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
    }
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
