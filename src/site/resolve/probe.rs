//! `[[probe]]` tables.

use glam::{DVec2, DVec3, Vec2, Vec3};
use std::ops::Range;
use toml::Spanned;

use super::super::fault::SiteError;
use super::super::file::{GainKey, ImageKey, Pair, ProbeTable, ProjectionKey, Text};
use super::super::pose::finite;
use super::super::sequence::numbered;
use super::super::site::{LitPicture, Places, Probe, Site};
use super::Resolver;
use super::names::{lighting_name, safe_name};
use crate::panorama::{Exif, Lens, Projection, response_rises as rises};

impl Resolver<'_> {
    pub(super) fn probe(&self, table: &Spanned<ProbeTable>) -> Result<Probe, SiteError> {
        let t = table.get_ref();
        safe_name(&self.source, &t.name, "probe")?;
        let orientation = t.orientation();
        let position = match &t.position {
            Some(position) => finite(&self.source, position)?,
            None if self.places == Places::MayBeMissing && orientation.look_at.is_none() => DVec3::ZERO,
            None => {
                return Err(self.source.fault(
                    table.span(),
                    "the key `position` is missing",
                    "Add position = [x, y, z]; or let `clerestory register` find it from the picture: see its --write",
                ));
            }
        };
        let pose = orientation.pose(&self.source, &self.frame, position)?;
        let projection = self.probe_projection(table)?;
        let picture = |(lighting, name, at): (Option<&Text>, &str, Range<usize>)| {
            let lighting = match lighting {
                Some(lighting) => lighting_name(&self.source, lighting)?,
                None => String::new(),
            };
            if let Some(frames) = self.sequence(name, &projection, &at)? {
                return Ok(LitPicture { lighting, path: frames[0].clone(), frames });
            }
            let path = self.to_be_made(name).map_or_else(|| self.panorama(name, at, &projection), Ok)?;
            Ok(LitPicture { lighting, path, frames: Vec::new() })
        };
        let pictures = named_pictures(&t.image).into_iter().map(picture).collect::<Result<Vec<_>, SiteError>>()?;
        if pictures.is_empty() {
            return Err(self.source.fault(
                t.image.span(),
                "the table of lightings is empty",
                "Give image = \"picture.exr\", or at least one \"lighting\" = \"picture.exr\"",
            ));
        }
        let gain = t.gain.as_ref().map_or(Ok(Vec3::ONE), |g| self.gain(g))?;
        let two = |key: &Option<Pair>| key.as_ref().map_or(Ok(Vec2::ZERO), |k| self.two(k));
        let (vignetting, response) = (two(&t.vignetting)?, two(&t.response)?);
        if let (Some(key), false) = (&t.vignetting, projection.is_photograph()) {
            return Err(self.source.fault(
                key.span(),
                "vignetting belongs to projection = \"perspective\" only",
                "Remove vignetting, or set the projection",
            ));
        }
        if let (Some(key), false) = (&t.response, rises(response)) {
            return Err(self.source.fault(
                key.span(),
                "the response falls somewhere between black and white",
                "Give [a, b] with 1 + a x + 2 b x² above zero for all x from 0 to 1",
            ));
        }
        let (name, placed) = (t.name.get_ref().clone(), t.position.is_some());
        Ok(Probe { name, pose, placed, pictures, projection, gain, vignetting, response })
    }

    fn gain(&self, key: &Spanned<GainKey>) -> Result<Vec3, SiteError> {
        let GainKey(gain) = *key.get_ref();
        let bad = gain.into_iter().find(|&g| !(g > 0.0 && (g as f32).is_normal()));
        bad.map_or(Ok(DVec3::from(gain).as_vec3()), |bad| {
            Err(self.source.fault(key.span(), format!("expected a gain above zero, found {bad}"), "Correct the number"))
        })
    }

    fn two(&self, key: &Pair) -> Result<Vec2, SiteError> {
        /// Beyond this a picture's corner, or white, would be brighter or darker by a factor of 3,000.
        const MOST: f64 = 8.0;
        let two: [f64; 2] = **key.get_ref();
        match two.into_iter().find(|v| v.is_nan() || v.abs() > MOST) {
            None => Ok(DVec2::from(two).as_vec2()),
            Some(bad) => Err(self.source.fault(
                key.span(),
                format!("expected two numbers from -{MOST} to {MOST}, found {bad}"),
                "Correct the number",
            )),
        }
    }

    /// How a probe's pixels map to directions. A calibrated lens counts the pixels of the probe's first picture.
    fn probe_projection(&self, table: &Spanned<ProbeTable>) -> Result<Projection, SiteError> {
        let t = table.get_ref();
        let keys = t.lens();
        let any = keys.calibrated().or(keys.fov_y.as_ref().map(Spanned::span));
        let kind = t.projection.as_ref().map_or(ProjectionKey::LatLong, |key| *key.get_ref());
        let lens = match (kind, any, &t.projection) {
            (ProjectionKey::Perspective, Some(_), _) => Lens::Perspective,
            (ProjectionKey::Fisheye, Some(_), _) => Lens::Fisheye,
            (ProjectionKey::Perspective, None, Some(key)) => {
                return Err(self.source.fault(
                    key.span(),
                    "a perspective picture needs fov_y or fx",
                    "Add fov_y = its vertical field of view in degrees, or fx (and fy, cx, cy) in pixels",
                ));
            }
            (_, Some(at), _) => {
                return Err(self.source.fault(
                    at,
                    "a lens belongs to projection = \"perspective\" or \"fisheye\" only",
                    "Remove this key, or set the projection",
                ));
            }
            (kind, None, _) => return Ok(kind.panorama().unwrap_or(Projection::LatLong)),
        };
        if let (Lens::Perspective, None, Some(fov)) = (lens, keys.calibrated(), keys.fov_y) {
            return Ok(Projection::Perspective { fov_y: self.field_of_view(fov)?.to_radians() });
        }
        let Some((_, name, at)) = named_pictures(&t.image).into_iter().next() else { return Ok(Projection::LatLong) };
        let path = match numbered(&self.folder, name) {
            Ok(frames) => frames[0].clone(),
            Err(_) => self.existing(name, at.clone(), "the picture")?,
        };
        let size = self.size_of(&path, at)?;
        let model = self.camera_model(&keys, size, lens, false, ("probe", table.span()))?;
        Ok(Projection::Camera(model))
    }
}

/// The pictures that a probe's key names: lighting, unless there is one picture only, name, and its place in the text.
fn named_pictures(image: &Spanned<ImageKey>) -> Vec<(Option<&Text>, &str, Range<usize>)> {
    match image.get_ref() {
        ImageKey::One(name) => vec![(None, name, image.span())],
        ImageKey::PerLighting(all) => {
            all.iter().map(|(lighting, name)| (Some(lighting), name.get_ref().as_str(), name.span())).collect()
        }
    }
}

/// Gives probes the gains that their exposures by EXIF ask for, around 1, if no probe `has_gain` of its own and each tells
/// one exposure for all of its pictures. Light arrives in the ratio of 2 to the exposure value.
pub(super) fn with_exif_gains(probes: &mut [Probe], has_gain: bool) {
    /// Exposure values within which two pictures count as exposed alike: half a third of a stop.
    const ALIKE: f64 = 1.0 / 6.0;
    if has_gain || probes.len() < 2 {
        return;
    }
    let value = |probe: &Probe| {
        let values = probe.pictures.iter().map(|lit| Exif::read(&lit.path).exposure_value());
        let values: Option<Vec<f64>> = values.collect();
        let values = values.filter(|v| !v.is_empty())?;
        values.iter().all(|v| (v - values[0]).abs() < ALIKE).then_some(values[0])
    };
    let values: Option<Vec<f64>> = probes.iter().map(value).collect();
    let Some(values) = values else { return };
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    for (probe, value) in probes.iter_mut().zip(values) {
        probe.gain = Vec3::splat((value - mean).exp2() as f32);
    }
}

/// Warns of lightings that some probes have and others lack.
pub(super) fn with_lighting_warnings(mut site: Site) -> Site {
    let all = site.lightings();
    for probe in &site.probes {
        let missing: Vec<_> = all.iter().filter(|l| probe.pictures.iter().all(|p| &p.lighting != *l)).collect();
        if missing.is_empty() {
            continue;
        }
        let named = |l: &String| if l.is_empty() { "the unnamed lighting".to_owned() } else { format!("“{l}”") };
        let list = missing.into_iter().map(named).collect::<Vec<_>>().join(", ");
        site.warnings.push(format!("Probe “{}” has no picture for {list}, which other probes have.", probe.name));
    }
    site
}
