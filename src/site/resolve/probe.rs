//! `[[probe]]` tables.

use std::ops::Range;
use toml::Spanned;

use super::super::fault::SiteError;
use super::super::file::{ImageKey, ProbeTable};
use super::super::pose::{Orientation, finite};
use super::super::{LitPicture, Probe, Site};
use super::Resolver;
use super::names::{lighting_name, safe_name};

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
        let gain = t.gain.as_ref().map_or(Ok(1.0), |g| self.number(g, |v| v > 0.0, "a gain above zero"))? as f32;
        Ok(Probe { name: t.name.get_ref().clone(), pose, pictures, projection, gain })
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
