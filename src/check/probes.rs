//! Whether probes stand where a probe can stand, and whether their pictures are light.

use serde::Serialize;
use std::path::PathBuf;

use super::cause::Cause;
use super::surroundings::Surroundings;
use crate::panorama::{self, Exif, PanoramaError, PictureHealth};
use crate::scene::Scene;
use crate::site::{Probe, Site};

/// What is known about one probe.
#[derive(Clone, Debug, Serialize)]
pub struct ProbeCheck {
    /// The probe's name.
    pub name: String,
    /// In the model's own axes and units.
    pub position: [f64; 3],
    /// Distance of the nearest surface in metres; `None` where there is none around.
    pub nearest_m: Option<f32>,
    /// Height above the surface straight beneath in metres; `None` where there is none.
    pub height_m: Option<f32>,
    /// Share of directions in which a surface is nearer than 5 cm. Directions are all around, but of a photograph those
    /// in its field of view.
    pub close_share: f64,
    /// Share of hits on the back of a triangle, by its winding.
    pub back_share: f64,
    /// Share of directions in which there is no surface.
    pub open_share: f64,
    /// Its pictures, in the site's order.
    pub pictures: Vec<PictureCheck>,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
}

/// What is known about one of a probe's pictures: counts of pixels.
#[derive(Clone, Debug, Serialize)]
pub struct PictureCheck {
    /// The lighting; empty for a lone picture.
    pub lighting: String,
    /// The file; of numbered pictures the first.
    pub file: PathBuf,
    /// How many numbered pictures there are; 1 for a lone one.
    pub frames: usize,
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Pixels that are no light, or doubtful.
    #[serde(flatten)]
    pub health: PictureHealth,
    /// The exposure value that EXIF tells. See [`Exif::exposure_value`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_value: Option<f64>,
}

/// Checks all probes; reads their pictures one at a time. `around` is what surrounds each, `front_is_usual` as
/// [`Surroundings::faults`] takes it. Also gives what is wrong with places.
pub(super) fn probes(
    site: &Site,
    around: &[Surroundings],
    front_is_usual: Option<bool>,
) -> Result<(Vec<ProbeCheck>, Vec<Cause>), PanoramaError> {
    let mut checks = Vec::new();
    let mut causes = Vec::new();
    for (probe, around) in site.probes.iter().zip(around) {
        let faults = around.faults(front_is_usual);
        causes.extend(faults.iter().filter_map(|fault| fault.cause("probe", &probe.name)));
        let mut warnings: Vec<String> = faults.into_iter().map(|fault| fault.sentence).collect();
        let mut pictures = Vec::new();
        for lit in &probe.pictures {
            let picture = panorama::read(&lit.path)?;
            let health = picture.health();
            warnings.extend(picture_warnings(&lit.lighting, &health));
            pictures.push(PictureCheck {
                lighting: lit.lighting.clone(),
                file: lit.path.clone(),
                frames: lit.frames.len().max(1),
                width: picture.width,
                height: picture.height,
                health,
                exposure_value: Exif::read(&lit.path).exposure_value(),
            });
        }
        checks.push(ProbeCheck {
            name: probe.name.clone(),
            position: site.frame.point_out(probe.pose.position).to_array(),
            nearest_m: Some(around.nearest_m).filter(|d| d.is_finite()),
            height_m: around.beneath_m,
            close_share: around.close_share,
            back_share: around.back_share,
            open_share: around.open_share,
            pictures,
            warnings,
        });
    }
    Ok((checks, causes))
}

/// What surrounds a probe: a photograph's field of view, else all around.
pub(super) fn surroundings(scene: &Scene, probe: &Probe) -> Surroundings {
    if !probe.projection.is_photograph() {
        return Surroundings::of(scene, scene.local(probe.pose.position));
    }
    let size = probe.pictures.first().and_then(|lit| panorama::dimensions(&lit.path).ok());
    Surroundings::in_photograph(scene, &probe.pose, &probe.projection, size.unwrap_or((4, 3)).into())
}

fn picture_warnings(lighting: &str, health: &PictureHealth) -> Vec<String> {
    let share = |n: usize| 100.0 * n as f64 / health.pixels.max(1) as f64;
    let of = if lighting.is_empty() { "its picture".to_owned() } else { format!("its picture “{lighting}”") };
    let mut warnings = Vec::new();
    let mut warn = |count: usize, limit: f64, what: &str| {
        if count > 0 && share(count) > limit {
            warnings.push(format!("{count} pixels ({:.2} %) of {of} {what}.", share(count)));
        }
    };
    warn(health.nan, 0.0, "are not numbers and are left out");
    warn(health.infinite, 0.0, "are infinite and are left out");
    warn(health.negative, 0.0, "are negative and are left out");
    warn(health.black, 1.0, "are black: a nadir patch, or underexposed");
    warn(health.clipped, 0.0, "are clipped at the largest value: light is missing there; bracket more exposures");
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_tell_their_ill_pixels() {
        let health = PictureHealth { pixels: 1000, nan: 1, infinite: 2, negative: 3, black: 20, clipped: 5 };
        let warnings = picture_warnings("10:00", &health);
        assert_eq!(warnings.len(), 5);
        assert!(warnings[2].starts_with("3 pixels (0.30 %) of its picture “10:00” are negative"));
        assert_eq!(picture_warnings("", &PictureHealth { pixels: 1000, black: 5, ..Default::default() }).len(), 0);
    }
}
