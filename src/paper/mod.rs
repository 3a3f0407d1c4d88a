//! The paper's own method, plain: kept so that every improvement can be compared with it in one run.
//!
//! Happa, Bashford-Rogers, Debattista and Chalmers, VAST 2010, section 4, in its order:
//!
//! 1. *Shoot* (4.1): a ray through each panorama pixel, a record where it hits; E = πL/ρ with ρ at that point.
//! 2. *Index* (4.1): a k-d tree of all records, with one radius R for all.
//! 3. *Volume* (4.2): inject and average in a uniform grid, fill empty cells from their neighbours, filter.
//! 4. *Render* (4.3): the average of all records with |P − X| < R and N·Nₛ > 0, or else the volume.
//!
//! Where [`crate::shoot`], [`crate::volume`] and [`crate::render`] do better, this does not: dark texels make records
//! explode, records beside depth edges paint the wrong surface, footprints are the same near and far, and light leaks
//! through walls.
//!
//! ```
//! use clerestory::glam::{Mat3, Vec3};
//! use clerestory::panorama::{Picture, Projection};
//! use clerestory::paper::{Plain, ProbeLight, PaperSettings};
//! # mod given {
//! #     include!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/common/room.rs"));
//! # }
//! # use given::room;
//!
//! let scene = room();
//! let picture = Picture { width: 64, height: 32, pixels: vec![Vec3::splat(0.2); 64 * 32] };
//! let origin = Vec3::new(2.0, 1.5, 1.2);
//! let probe = ProbeLight { origin, to_world: Mat3::IDENTITY, picture: &picture, projection: Projection::LatLong };
//! let plain = Plain::new(&scene, &[probe], PaperSettings::default());
//! let (irradiance, _source) = plain.irradiance(Vec3::new(1.0, 1.0, 0.0), Vec3::Z);
//! assert!((irradiance / (std::f32::consts::PI * 0.2 / 0.5) - 1.0).abs().max_element() < 1e-3);
//! ```

mod mean;
mod shoot;
mod volume;

pub use shoot::{ProbeLight, Record};
pub use volume::Volume;

use glam::Vec3;
use std::time::Instant;

use mean::Mean;
use shoot::Shot;

use crate::panorama::PanoramaError;
use crate::render::{Irradiance, Lit, ShadingPoint, Source, Timings};
use crate::scene::Scene;
use crate::shoot::{KdTree, read_light};
use crate::site::Probe;
use crate::statistics::median;
use crate::volume::{Grid, Nearby};

/// How many times the records' median spacing the radius is, where none is given. Of the radii tried on a cathedral from
/// four probes this comes nearest to the one with the least relative error; see `examples/paper_radius.rs`.
const SPACINGS: f32 = 2.5;

/// What the paper leaves to its user.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperSettings {
    /// The radius R of all records, metres. `None`: 2.5 times the median distance of neighbouring records.
    pub radius_m: Option<f32>,
    /// The least albedo that radiance is divided by, 0..=1. The paper divides by ρ as it is; any real model has texels
    /// so dark that a record of them would outshine its surroundings.
    pub least_albedo: f32,
    /// Cells of the volume along the scene's longest side.
    pub cells: u32,
}

impl Default for PaperSettings {
    fn default() -> Self {
        Self { radius_m: None, least_albedo: 0.05, cells: 64 }
    }
}

/// A site lit the paper's way.
pub struct Plain {
    records: KdTree<Record>,
    volume: Volume,
    /// The records' radius R, metres.
    pub radius_m: f32,
    /// What each stage took; nothing is loaded.
    pub timings: Timings,
}

impl Plain {
    /// Shoots, indexes and builds the volume.
    pub fn new(scene: &Scene, probes: &[ProbeLight], settings: PaperSettings) -> Self {
        let start = Instant::now();
        let shots: Vec<Shot> =
            probes.iter().flat_map(|probe| shoot::shoot(scene, probe, settings.least_albedo)).collect();
        let spacing_m = || median(shots.iter().map(|s| s.spacing_m)).unwrap_or(0.0);
        let radius_m = settings.radius_m.unwrap_or_else(|| SPACINGS * spacing_m());
        let shot = start.elapsed().as_secs_f64();

        let records = KdTree::new(shots.iter().map(|s| (s.position, s.record)).collect());
        let indexed = start.elapsed().as_secs_f64();

        let (low, high) = scene.mesh.bounds();
        let grid = Grid::over(low, high, settings.cells.max(1));
        let volume = Volume::build(grid, shots.iter().map(|s| (s.position, s.record.irradiance)));
        let built = start.elapsed().as_secs_f64();

        let timings = Timings { load_s: 0.0, shoot_s: shot, index_s: indexed - shot, volume_s: built - indexed };
        Self { records, volume, radius_m, timings }
    }

    /// The same from a site's probes, as far as they have a picture of a lighting.
    ///
    /// # Errors
    ///
    /// A picture that cannot be read.
    pub fn of_probes(
        scene: &Scene,
        probes: &[Probe],
        lighting: &str,
        settings: PaperSettings,
    ) -> Result<Self, PanoramaError> {
        let lit = probes.iter().filter_map(|p| Some((p, p.picture(lighting)?)));
        let lit =
            lit.map(|(probe, file)| Ok((probe, read_light(probe, &file.path)?))).collect::<Result<Vec<_>, _>>()?;
        let lights = lit.iter().map(|(probe, picture)| ProbeLight {
            origin: scene.local(probe.pose.position),
            to_world: probe.pose.rotation.as_mat3(),
            picture,
            projection: probe.projection,
        });
        Ok(Self::new(scene, &lights.collect::<Vec<_>>(), settings))
    }

    /// Irradiance at a point (local metres) of a surface with unit normal `normal`, and what knew it. A channel that
    /// no record around knows is the volume's.
    pub fn irradiance(&self, point: Vec3, normal: Vec3) -> (Vec3, Source) {
        let mut near = Mean::default();
        self.records.within(point, self.radius_m, |record, _| {
            if record.normal.dot(normal) > 0.0 {
                near.add(record.irradiance);
            }
        });
        let known = [0, 1, 2].map(|c| near.channel(c));
        if let [Some(r), Some(g), Some(b)] = known {
            return (Vec3::new(r, g, b), Source::Record);
        }
        let Some(elsewhere) = self.volume.irradiance(point) else { return (Vec3::ZERO, Source::None) };
        let irradiance = Vec3::from_array(std::array::from_fn(|c| known[c].unwrap_or(elsewhere[c])));
        (irradiance, if near.is_empty() { Source::Volume } else { Source::Record })
    }

    /// Number of records.
    pub fn record_count(&self) -> usize {
        self.records.entries().len()
    }

    /// Bytes that the records and their tree hold.
    pub fn record_bytes(&self) -> usize {
        self.records.bytes()
    }
}

/// A scene lit the paper's way, for [`crate::render::render`]. Every sample looks up its own irradiance.
pub struct PlainRelit<'a> {
    /// Records and volume.
    pub plain: &'a Plain,
    /// Radiance of the sky in a direction, seen through windows.
    pub sky: &'a (dyn Fn(Vec3) -> Vec3 + Sync),
}

impl Irradiance for PlainRelit<'_> {
    fn at(&self, spot: &ShadingPoint, _: &mut Nearby) -> Lit {
        let (irradiance, source) = self.plain.irradiance(spot.position, spot.normal);
        Lit::known(irradiance, source, 1.0)
    }

    fn sky(&self, direction: Vec3) -> Vec3 {
        (self.sky)(direction)
    }

    /// The paper takes ρ at the point P (section 4.3).
    fn shares(&self) -> bool {
        false
    }
}
