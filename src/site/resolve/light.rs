//! The light outside: `[environment]` and `[sun]`.

use glam::Vec3;
use std::collections::BTreeMap;
use toml::Spanned;

use super::super::fault::SiteError;
use super::super::file::{EnvironmentTable, LightingSunTable, ProjectionKey, SunTable, Text, Vector};
use super::super::pose::{finite, finite_number};
use super::super::{Environment, Probe, Sun};
use super::Resolver;

impl Resolver<'_> {
    pub(super) fn environment(&self, table: &Spanned<EnvironmentTable>) -> Result<Environment, SiteError> {
        let t = table.get_ref();
        match (&t.image, &t.radiance) {
            (Some(image), None) => {
                let kind = t.projection.as_ref().map_or(ProjectionKey::LatLong, |key| *key.get_ref());
                let projection = kind.panorama().ok_or_else(|| {
                    self.source.fault(
                        t.projection.as_ref().map_or(table.span(), Spanned::span),
                        "an environment cannot be a perspective picture",
                        "Give a panorama: latlong, angular, mirror-ball, fisheye or cube-cross",
                    )
                })?;
                let path = self.panorama(image.get_ref(), image.span(), &projection)?;
                let heading = t.heading.as_ref().map_or(Ok(0.0), |h| finite_number(&self.source, h))?;
                Ok(Environment::Image { path, rotation: self.frame.rotation(heading, 0.0, 0.0), projection })
            }
            (None, Some(radiance)) => Ok(Environment::Uniform(self.colour(radiance, "radiance")?)),
            (Some(_), Some(radiance)) => Err(self.source.fault(
                radiance.span(),
                "the environment has both an image and a radiance",
                "Keep one of them",
            )),
            (None, None) => Err(self.source.fault(
                table.span(),
                "the environment has neither an image nor a radiance",
                "Add image = \"sky.exr\" or radiance = [r, g, b], or leave the table out",
            )),
        }
    }

    pub(super) fn sun(&self, direction: &Vector, irradiance: &Vector) -> Result<Sun, SiteError> {
        let towards = self.frame.direction_in(finite(&self.source, direction)?);
        let towards = towards.try_normalize().ok_or_else(|| {
            self.source.fault(
                direction.span(),
                "the direction has no length",
                "Give a vector that points towards the sun",
            )
        })?;
        Ok(Sun { direction: towards.as_vec3(), irradiance: self.colour(irradiance, "irradiance")? })
    }

    /// The suns of lightings that have their own.
    pub(super) fn suns(&self, table: &SunTable, probes: &[Probe]) -> Result<BTreeMap<String, Sun>, SiteError> {
        let known = |name: &str| probes.iter().flat_map(|p| &p.pictures).any(|p| p.lighting == name);
        let one = |(name, t): (&Text, &LightingSunTable)| {
            if !known(name.get_ref()) {
                return Err(self.source.fault(
                    name.span(),
                    format!("no probe has a picture of the lighting “{}”", name.get_ref()),
                    "Name a lighting as the probes' image tables do",
                ));
            }
            Ok((name.get_ref().clone(), self.sun(&t.direction, &t.irradiance)?))
        };
        table.under.iter().map(one).collect()
    }

    fn colour(&self, rgb: &Vector, what: &str) -> Result<Vec3, SiteError> {
        let v = finite(&self.source, rgb)?;
        if v.min_element() >= 0.0 && v.as_vec3().is_finite() {
            return Ok(v.as_vec3());
        }
        Err(self.source.fault(
            rgb.span(),
            format!("expected a {what} of three numbers, zero or greater, found {v}"),
            "Light cannot be negative",
        ))
    }
}
