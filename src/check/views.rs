//! Whether a view's camera and photograph are fit for use.

use serde::Serialize;
use std::path::PathBuf;

use super::cause::Cause;
use super::surroundings::Surroundings;
use crate::panorama::Projection;
use crate::photograph::{Fitness, Photograph};
use crate::scene::Scene;
use crate::site::{CameraSource, Site, View};

/// What is known about one view. Poses are in the model's own axes and units, as the site file takes them.
#[derive(Clone, Debug, Serialize)]
pub struct ViewCheck {
    /// Its name.
    pub name: String,
    /// Where the camera comes from: `site file`, `pose file` or `matches`.
    pub source: &'static str,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Where it stands.
    pub position: [f64; 3],
    /// Heading clockwise from true north, pitch up, roll clockwise as the camera sees it; degrees.
    pub bearings_deg: [f64; 3],
    /// Vertical field of view in degrees.
    pub fov_y_deg: f64,
    /// Vertical focal length in pixels.
    pub focal_px: f64,
    /// Distance in pixels between each match's pixel and where the camera shows its point; infinite behind it.
    pub residuals_px: Vec<f64>,
    /// Root of the mean square of them; `None` without matches.
    pub rms_px: Option<f64>,
    /// How sure a pose from matches is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<Uncertainty>,
    /// Its photograph, if that can be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub photograph: Option<PhotographCheck>,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
}

/// One standard deviation of a pose that was solved for.
#[derive(Clone, Debug, Serialize)]
pub struct Uncertainty {
    /// Of the position along its worst axis, metres.
    pub position_m: f64,
    /// Of the direction about its worst axis, degrees.
    pub direction_deg: f64,
    /// Of the focal length in pixels, where it was solved for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_px: Option<f64>,
}

/// A view's photograph.
#[derive(Clone, Debug, Serialize)]
pub struct PhotographCheck {
    /// Its file.
    pub file: PathBuf,
    /// Share of pixels that measure light.
    pub usable: f64,
    /// Share of pixels that are clipped.
    pub clipped: f64,
    /// Share of pixels that are too dark.
    pub dark: f64,
    /// Share of pixels that the mask leaves out.
    pub masked: f64,
    /// The exposure value that EXIF tells. See [`crate::panorama::Exif::exposure_value`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_value: Option<f64>,
    /// The camera that took it, where the file says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// When it was taken, where the file says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub taken: Option<String>,
}

/// Share of a view's pixels that have to show the model for the view to make sense.
const LEAST_SHOWN: f64 = 0.05;

/// Share of a photograph's pixels that have to measure light.
const LEAST_USABLE: f64 = 0.5;

/// What surrounds a view, in its field.
pub(super) fn surroundings(scene: &Scene, view: &View) -> Surroundings {
    let camera = &view.camera;
    let size = [camera.width as usize, camera.height as usize];
    Surroundings::in_photograph(scene, &camera.pose, &Projection::Camera(camera.model()), size)
}

/// Checks a view that has these surroundings; also gives what is wrong with its place.
pub(super) fn view(
    site: &Site,
    view: &View,
    around: &Surroundings,
    front_is_usual: Option<bool>,
) -> (ViewCheck, Vec<Cause>) {
    let camera = &view.camera;
    // a view may look out of a window, or down from a drone
    let faults: Vec<_> = around.faults(front_is_usual).into_iter().filter(|fault| fault.is_impossible).collect();
    let causes = faults.iter().filter_map(|fault| fault.cause("view", &view.name)).collect();
    let mut warnings: Vec<String> = faults.into_iter().map(|fault| fault.sentence).collect();
    let shown = 1.0 - around.open_share;
    if shown < LEAST_SHOWN && warnings.is_empty() {
        warnings.push(format!(
            "It shows the model in {:.1} % of its pixels: does it look out of the model? Check its pose, units and axes.",
            100.0 * shown
        ));
    }
    let (source, uncertainty) = match &view.source {
        CameraSource::SiteFile => ("site file", None),
        CameraSource::PoseFile(_) => ("pose file", None),
        CameraSource::Matches(found) => (
            "matches",
            Some(Uncertainty {
                position_m: found.position_sd_m,
                direction_deg: found.direction_sd_deg,
                focal_px: found.focal_sd_px,
            }),
        ),
    };
    let miss = |m: &crate::site::Match| camera.project(m.point).map_or(f64::INFINITY, |p| p.distance(m.pixel));
    let residuals_px: Vec<f64> = view.matches.iter().map(miss).collect();
    let sum: f64 = residuals_px.iter().map(|r| r * r).sum();
    let rms_px = (!residuals_px.is_empty()).then(|| (sum / residuals_px.len() as f64).sqrt());
    let check = ViewCheck {
        name: view.name.clone(),
        source,
        size: [camera.width, camera.height],
        position: site.frame.point_out(camera.pose.position).to_array(),
        bearings_deg: site.frame.bearings(&camera.pose.rotation),
        fov_y_deg: camera.fov_y_deg(),
        focal_px: camera.focal.y,
        residuals_px,
        rms_px,
        uncertainty,
        photograph: photograph(view, &mut warnings),
        warnings,
    };
    (check, causes)
}

fn photograph(view: &View, warnings: &mut Vec<String>) -> Option<PhotographCheck> {
    let photo = match Photograph::of(view) {
        Ok(photo) => photo?,
        Err(e) => {
            warnings.push(format!("{e}."));
            return None;
        }
    };
    let usable = photo.share(Fitness::Good);
    if usable < LEAST_USABLE {
        warnings.push(format!("Only {:.0} % of its photograph's pixels measure light.", 100.0 * usable));
    }
    Some(PhotographCheck {
        usable,
        clipped: photo.share(Fitness::Clipped),
        dark: photo.share(Fitness::Dark),
        masked: photo.share(Fitness::Masked),
        exposure_value: photo.exif.exposure_value(),
        camera: photo.exif.camera,
        taken: photo.exif.taken,
        file: photo.path,
    })
}
