//! `[[probe]]` tables.

use glam::{DVec2, DVec3, Vec2, Vec3};
use std::ops::Range;
use toml::Spanned;

use super::super::fault::SiteError;
use super::super::file::{GainKey, ImageKey, ProbeTable};
use super::super::pose::{Orientation, finite};
use super::super::{LitPicture, Probe, Site};
use super::Resolver;
use super::names::{lighting_name, safe_name};
use crate::panorama::{Projection, response_rises as rises};

impl Resolver<'_> {
    pub(super) fn probe(&self, table: &Spanned<ProbeTable>) -> Result<Probe, SiteError> {
        let t = table.get_ref();
        safe_name(&self.source, &t.name, "probe")?;
        let orientation = Orientation {
            heading: &t.heading,
            pitch: &t.pitch,
            roll: &t.roll,
            rotation: &t.rotation,
            matrix: &t.matrix,
            look_at: &t.look_at,
        };
        let pose = orientation.pose(&self.source, &self.frame, finite(&self.source, &t.position)?)?;
        let projection = self.projection(&t.projection, &t.fov_y)?;
        let picture = |lighting: &str, name: &str, at: Range<usize>| {
            let path = self.to_be_made(name).map_or_else(|| self.panorama(name, at, &projection), Ok)?;
            Ok(LitPicture { lighting: lighting.to_owned(), path })
        };
        let pictures = match t.image.get_ref() {
            ImageKey::One(name) => vec![picture("", name, t.image.span())?],
            ImageKey::PerLighting(table) if table.is_empty() => {
                return Err(self.source.fault(
                    t.image.span(),
                    "the table of lightings is empty",
                    "Give image = \"picture.exr\", or at least one \"lighting\" = \"picture.exr\"",
                ));
            }
            ImageKey::PerLighting(table) => table
                .iter()
                .map(|(lighting, path)| {
                    lighting_name(&self.source, lighting)?;
                    picture(lighting.get_ref(), path.get_ref(), path.span())
                })
                .collect::<Result<_, SiteError>>()?,
        };
        let gain = t.gain.as_ref().map_or(Ok(Vec3::ONE), |g| self.gain(g))?;
        let two = |key: &Option<Spanned<[f64; 2]>>| key.as_ref().map_or(Ok(Vec2::ZERO), |k| self.two(k));
        let (vignetting, response) = (two(&t.vignetting)?, two(&t.response)?);
        if let (Some(key), false) = (&t.vignetting, matches!(projection, Projection::Perspective { .. })) {
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
        Ok(Probe { name: t.name.get_ref().clone(), pose, pictures, projection, gain, vignetting, response })
    }

    fn gain(&self, key: &Spanned<GainKey>) -> Result<Vec3, SiteError> {
        let GainKey(gain) = *key.get_ref();
        let bad = gain.into_iter().find(|&g| !(g > 0.0 && (g as f32).is_normal()));
        bad.map_or(Ok(DVec3::from(gain).as_vec3()), |bad| {
            Err(self.source.fault(key.span(), format!("expected a gain above zero, found {bad}"), "Correct the number"))
        })
    }

    fn two(&self, key: &Spanned<[f64; 2]>) -> Result<Vec2, SiteError> {
        /// Beyond this a picture's corner, or white, would be brighter or darker by a factor of 3,000.
        const MOST: f64 = 8.0;
        let two = *key.get_ref();
        match two.into_iter().find(|v| v.is_nan() || v.abs() > MOST) {
            None => Ok(DVec2::from(two).as_vec2()),
            Some(bad) => Err(self.source.fault(
                key.span(),
                format!("expected two numbers from -{MOST} to {MOST}, found {bad}"),
                "Correct the number",
            )),
        }
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
