//! Everything that views share, made once: shooting, giving light, the volume's rays.

use glam::Vec3;
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

use super::shown_points;
use crate::panorama::{self, PanoramaError, Picture, Radiometry};
use crate::scene::Scene;
use crate::shoot::{Hits, Light, Outside, charted};
use crate::site::{Camera, Site};
use crate::volume::{self, Transport, Volume};

/// What to make.
#[derive(Clone, Debug)]
pub struct Options {
    /// The lightings to render, by name.
    pub lightings: Vec<String>,
    /// How many of the site's probes to use, in the file's order.
    pub probes: usize,
    /// Use the sun's direction, where the site gives it, to keep shadow edges sharp.
    pub sun: bool,
    /// How finely to fill what no probe sees.
    pub volume: volume::VolumeSettings,
    /// Build the volume even where nothing needs it.
    pub all_stages: bool,
    /// Build the volume for all points that the cameras show, not only for those that no probe sees.
    pub volume_for_all: bool,
}

impl Options {
    /// All lightings and probes of a site, its sun, and the volume where a view needs it.
    #[must_use]
    pub fn of(site: &Site) -> Self {
        Self {
            lightings: site.lightings(),
            probes: site.probes.len(),
            sun: true,
            volume: volume::VolumeSettings::default(),
            all_stages: false,
            volume_for_all: false,
        }
    }
}

/// What all views share.
pub struct Setup {
    /// Per lighting its name and the records of all probes that have a picture of it.
    pub lights: Vec<(String, Light)>,
    /// Per lighting, which of [`Setup::transports`] fits its probes.
    transport_of: Vec<Option<usize>>,
    /// The volume's rays, one set per set of probes.
    pub transports: Vec<Transport>,
    /// Seconds.
    pub timings: Timings,
    /// What was not needed.
    pub left_out: Vec<LeftOut>,
    /// Number of records under the first lighting.
    pub records: usize,
    /// Bytes of hits and of one lighting's records.
    pub record_bytes: usize,
}

/// Seconds that the stages took.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Timings {
    /// Reading the site, the model and the probes' pictures.
    pub load_s: f64,
    /// Casting the probes' rays.
    pub shoot_s: f64,
    /// Giving the hits their light, as records that can be looked up.
    pub index_s: f64,
    /// Casting the volume's rays and sending the light along them.
    pub volume_s: f64,
}

/// A stage that a site does not need.
#[derive(Clone, Debug, Serialize)]
pub struct LeftOut {
    /// The stage.
    pub stage: &'static str,
    /// Why it is not needed.
    pub why: String,
}

/// Why a site cannot be relit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SetupError {
    /// A picture cannot be read.
    #[error(transparent)]
    Panorama(#[from] PanoramaError),
    /// Nothing gives light.
    #[error(
        "{site}: the site has no probe, so nothing can be relit. Add a [[probe]]; `clerestory plan` says where to take them and `clerestory simulate` makes rehearsal probes"
    )]
    NoProbe {
        /// The site file.
        site: String,
    },
    /// A lighting that no probe has.
    #[error("{site}: no probe has a picture for the lighting “{lighting}”. The site's lightings: {known}")]
    NoLighting {
        /// The site file.
        site: String,
        /// What was asked for.
        lighting: String,
        /// What there is.
        known: String,
    },
}

/// Shoots a site's probes and gives them light; casts the volume's rays if some camera shows a point that no probe sees.
pub fn prepare(site: &Site, scene: &Scene, cameras: &[Camera], options: &Options) -> Result<Setup, SetupError> {
    prepare_for(site, scene, |seen| shown_points(scene, seen, cameras), options)
}

/// [`prepare`] for other points than cameras show: `wanted` gives points (position, normal) that the volume shall serve,
/// without those that the given light's probes see, where one is given.
pub fn prepare_for(
    site: &Site,
    scene: &Scene,
    wanted: impl Fn(Option<&Light>) -> Vec<(Vec3, Vec3)>,
    options: &Options,
) -> Result<Setup, SetupError> {
    let mut setup = shoot_probes(site, scene, options)?;
    setup.cast_volume(scene, wanted, options);
    Ok(setup)
}

/// Shoots a site's probes and gives them light, without a volume.
pub fn shoot_probes(site: &Site, scene: &Scene, options: &Options) -> Result<Setup, SetupError> {
    let name = site.file.display().to_string();
    let probes = &site.probes[..options.probes.min(site.probes.len())];
    if probes.is_empty() {
        return Err(SetupError::NoProbe { site: name });
    }
    let mut timings = Timings::default();
    let mut hits: Vec<Option<Arc<Hits>>> = vec![None; probes.len()];
    let mut lights = Vec::new();
    let outside = Outside::of(site)?;
    for lighting in &options.lightings {
        let mut lit = Vec::new();
        for (probe, hits) in probes.iter().zip(&mut hits) {
            let Some(file) = probe.picture(lighting) else { continue };
            let start = Instant::now();
            let (picture, coding) = panorama::read_coded(&file.path)?;
            let (chart, picture) = charted(picture, probe.projection);
            timings.load_s += start.elapsed().as_secs_f64();
            let start = Instant::now();
            // hits do not depend on the lighting: shot once, unless this picture has another size
            let known = hits.take().filter(|h| h.chart == chart);
            let (position, to_world) = (scene.local(probe.pose.position), probe.pose.rotation.as_mat3());
            let shot = known.unwrap_or_else(|| Arc::new(Hits::shoot(scene, position, to_world, chart)));
            *hits = Some(shot.clone());
            timings.shoot_s += start.elapsed().as_secs_f64();
            lit.push((shot, picture, probe.radiometry(coding)));
        }
        if lit.is_empty() {
            let known = site.lightings().join(", ");
            return Err(SetupError::NoLighting { site: name, lighting: lighting.clone(), known });
        }
        let start = Instant::now();
        let sun = site.sun_under(lighting).filter(|_| options.sun);
        lights.push((lighting.clone(), Light::new(scene, lit, sun, outside.clone())));
        timings.index_s += start.elapsed().as_secs_f64();
    }
    let mut left_out = Vec::new();
    if probes.len() == 1 {
        left_out.push(LeftOut { stage: "merge", why: "the site has one probe".to_owned() });
    }
    if scene.textures.is_empty() {
        left_out.push(LeftOut { stage: "textures", why: "no material has a picture".to_owned() });
    }
    let first = || lights.iter().take(1).flat_map(|l| &l.1.records);
    let records = first().map(|r| r.hits().count()).sum();
    let record_bytes = first().map(|r| r.bytes() + r.hits().bytes()).sum();
    let transport_of = vec![None; lights.len()];
    Ok(Setup { lights, transport_of, transports: Vec::new(), timings, left_out, records, record_bytes })
}

impl Setup {
    /// Casts the volume's rays, once for all lightings whose records lie in the same cells.
    fn cast_volume(&mut self, scene: &Scene, wanted: impl Fn(Option<&Light>) -> Vec<(Vec3, Vec3)>, options: &Options) {
        let start = Instant::now();
        let mut sets: Vec<Vec<usize>> = Vec::new();
        for (i, (_, light)) in self.lights.iter().enumerate() {
            match sets.iter_mut().find(|set| same_cells(&self.lights[set[0]].1, light)) {
                Some(set) => set.push(i),
                None => sets.push(vec![i]),
            }
        }
        for set in &sets {
            let mine: Vec<&Light> = set.iter().map(|&i| &self.lights[i].1).collect();
            let wanted = wanted((!options.volume_for_all).then_some(mine[0]));
            if wanted.is_empty() && !options.all_stages {
                continue;
            }
            self.transports.push(Transport::cast(scene, &wanted, &mine, &options.volume));
            set.iter().for_each(|&i| self.transport_of[i] = Some(self.transports.len() - 1));
        }
        if self.transports.is_empty() && !sets.is_empty() {
            let why = "every sampled point in every view is seen by a probe".to_owned();
            self.left_out.insert(0, LeftOut { stage: "volume", why });
        }
        self.timings.volume_s = start.elapsed().as_secs_f64();
    }

    /// The volume of a lighting, by its place in [`Setup::lights`], where there is one.
    pub fn volume(&self, scene: &Scene, lighting: usize) -> Option<Volume<'_>> {
        let transport = &self.transports[self.transport_of[lighting]?];
        Some(Volume::new(scene, transport, &self.lights[lighting].1))
    }

    /// [`Setup::volume`] of each lighting.
    pub fn volumes(&self, scene: &Scene) -> Vec<Option<Volume<'_>>> {
        (0..self.lights.len()).map(|lighting| self.volume(scene, lighting)).collect()
    }
}

/// Whether a transport of one lighting serves another: it names a record by its probe's place in the list and its cell, and takes for
/// seen what has light.
fn same_cells(a: &Light, b: &Light) -> bool {
    a.records.len() == b.records.len() && a.records.iter().zip(&b.records).all(|(a, b)| a.lies_like(b))
}

/// The pictures of a lighting, in the projection that their records lie in, each with its radiometry: what a
/// [`Transfer`](crate::transfer::Transfer) is fed with. Of numbered pictures those of a `frame`, counted from 0.
///
/// # Errors
///
/// A picture that cannot be read.
pub fn pictures(
    site: &Site,
    lighting: &str,
    probes: usize,
    frame: usize,
) -> Result<Vec<(Picture, Radiometry)>, PanoramaError> {
    let lit = site.probes.iter().take(probes).flat_map(|p| p.pictures.iter().map(move |file| (p, file)));
    lit.filter(|(_, file)| file.lighting == lighting)
        .map(|(probe, file)| {
            let (picture, coding) = panorama::read_coded(file.at(frame))?;
            Ok((charted(picture, probe.projection).1, probe.radiometry(coding)))
        })
        .collect()
}
