//! What probes and site say about the light under one lighting.

use glam::Vec3;
use smallvec::SmallVec;
use std::borrow::Borrow;
use std::ops::ControlFlow;
use std::sync::{Arc, OnceLock};

use super::hits::Sunlit;
use super::neighbours::Neighbours;
use super::records::measured;
use super::{Hits, Observation, Records, sunlight};
use crate::panorama::{self, Panorama, PanoramaError, Picture, Radiometry, luminance};
use crate::scene::Scene;
use crate::site::{Environment, Site, Sun};
use crate::statistics::{median, quantile};

/// The records of all probes under one lighting, and the light from outside.
pub struct Light {
    /// One set per probe.
    pub records: Vec<Records>,
    /// The sun, its irradiance as the records tell it.
    pub sun: Option<Sun>,
    /// What is behind the windows where no probe tells.
    outside: Option<Outside>,
    pub(super) beyond: OnceLock<Beyond>,
    neighbours: OnceLock<Neighbours>,
}

/// Light from where the model has nothing and nobody tells.
pub(super) enum Beyond {
    /// As much from everywhere as records ask for.
    Even(Vec3),
    /// What comes from each direction of a grid.
    Directions(Vec<Vec3>),
}

/// Which of an observation's records tell the irradiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Choice {
    /// All.
    All,
    /// Those in sun.
    Sun,
    /// Those in shade.
    Shade,
    /// Those in shade, and the sun besides.
    ShadeAndDirect,
    /// The sun, but no less than all records say.
    Direct,
}

/// Light from outside as the site file gives it.
#[derive(Clone)]
pub enum Outside {
    /// The same radiance from everywhere.
    Uniform(Vec3),
    /// A panorama around the site.
    Image(Arc<Panorama>),
}

impl Outside {
    /// What a site gives; `None` where it gives nothing.
    ///
    /// # Errors
    ///
    /// A picture that cannot be read.
    pub fn of(site: &Site) -> Result<Option<Self>, PanoramaError> {
        Ok(match &site.environment {
            None => None,
            Some(Environment::Uniform(radiance)) => Some(Self::Uniform(*radiance)),
            Some(Environment::Image { path, rotation, projection }) => {
                Some(Self::Image(Arc::new(Panorama::new(panorama::read(path)?, *projection, *rotation))))
            }
        })
    }

    /// Radiance that arrives from a direction (the program's axes, unit).
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Uniform(radiance) => *radiance,
            Self::Image(panorama) => panorama.radiance(direction),
        }
    }
}

/// Cells and their weights.
type Cells = SmallVec<[(u32, f32); 4]>;

/// A probe seen less sharply than this share of the sharpest one's solid angle per area is not asked.
const COARSEST: f32 = 0.25;

/// Below this weight records say too little of a point: all of them straddle edges.
const LEAST_WEIGHT: f32 = 0.07;

impl Light {
    /// Gives each probe's hits the light of its picture by the probe's radiometry. `sun` is the site's sun: its direction keeps
    /// sunlit and shaded records apart; its irradiance is measured anew from them, and a sun of which they show nothing
    /// is dropped. A picture may be lent, or given: then its memory is free again before the records take theirs.
    pub fn new<P: Borrow<Picture>>(
        scene: &Scene,
        probes: impl IntoIterator<Item = (Arc<Hits>, P, Radiometry)>,
        sun: Option<Sun>,
        outside: Option<Outside>,
    ) -> Self {
        let measured = |(hits, picture, radiometry): (Arc<Hits>, P, Radiometry)| {
            let measured = measured(&hits.chart, picture.borrow(), &radiometry);
            (hits, measured)
        };
        let probes: Vec<_> = probes.into_iter().map(measured).collect();
        let shine = |sun: Option<Vec3>| -> Vec<Records> {
            probes.iter().map(|(hits, measured)| Records::new(scene, hits.clone(), measured, sun)).collect()
        };
        let records = shine(sun.map(|s| s.direction));
        let (records, sun) = match sun.map(|sun| measured_sun(&records, sun)) {
            Some(None) => (shine(None), None),
            measured => (records, measured.flatten()),
        };
        Self { records, sun, outside, beyond: OnceLock::new(), neighbours: OnceLock::new() }
    }

    /// What the probes that see a point most sharply say about it; `None` where none sees it. A probe that is clipped there
    /// is asked only where all that see the point are, and then the brightest of them: light was at least that.
    pub fn observe(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<Observation> {
        self.observe_above(scene, point, normal, LEAST_WEIGHT, |_, _| ())
    }

    /// [`Light::observe`], or with `least` weight zero [`Light::observe_untrusted`]'s records; `tell` hears of each record that
    /// counts: its probe, its cell, whether the sun shines on it, and its weight.
    pub(crate) fn weigh(
        &self,
        scene: &Scene,
        (point, normal): (Vec3, Vec3),
        untrusted: bool,
        mut tell: impl FnMut(u32, u32, Sunlit, f32),
    ) -> Option<Observation> {
        let least = if untrusted { 0.0 } else { LEAST_WEIGHT };
        let mut asked: SmallVec<[(usize, f32); 8]> = SmallVec::new();
        let o = self.observe_above(scene, point, normal, least, |probe, share| asked.push((probe, share)));
        for (probe, share) in asked {
            self.records[probe].look(scene, point, normal, |cell, sunlit, weight| {
                tell(probe as u32, cell as u32, sunlit, share * weight);
            });
        }
        o
    }

    /// The probe that sees a point of a surface most sharply, and its cell that is nearest; `None` where none sees it.
    pub fn finest(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<(u32, u32)> {
        self.finest_of(scene, point, normal, |_, _| true)
    }

    /// The same of the probes whose picture shows light there: what is not light is no black surface.
    pub fn finest_known(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<(u32, u32)> {
        self.finest_of(scene, point, normal, Records::knows)
    }

    fn finest_of(
        &self,
        scene: &Scene,
        point: Vec3,
        normal: Vec3,
        counts: impl Fn(&Records, u32) -> bool,
    ) -> Option<(u32, u32)> {
        self.sharpest_first(point, normal, |_, i| {
            let records = &self.records[i];
            match records.hits().find(scene, point, normal).filter(|cell| counts(records, *cell)) {
                Some(cell) => ControlFlow::Break((i as u32, cell)),
                None => ControlFlow::Continue(()),
            }
        })
    }

    /// Irradiance of the nearest record of the probe that sees a point of a surface most sharply and has light there.
    pub fn nearest(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<Vec3> {
        self.finest_known(scene, point, normal).map(|(probe, cell)| self.records[probe as usize].light(cell))
    }

    /// Irradiance by whatever records there are, however little they can be trusted: better than nothing where there is
    /// no volume.
    pub fn observe_untrusted(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<Vec3> {
        self.observe_above(scene, point, normal, 0.0, |_, _| ()).map(|o| o.value())
    }

    /// Irradiance, without direct sun, of the nearest records that a point sees, or that lie on its surface: where neither
    /// records nor a volume tell.
    pub fn neighbour(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<Vec3> {
        self.neighbours().light(scene, point, normal)
    }

    /// The same, of records that the point sees and that face alike only: light that cannot come through a wall.
    pub fn seen_neighbour(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<Vec3> {
        self.neighbours().seen(scene, point, normal)
    }

    fn neighbours(&self) -> &Neighbours {
        self.neighbours.get_or_init(|| Neighbours::new(&self.records))
    }

    /// Irradiance of the surface that a probe's cell sees; where the cell is clipped, as other probes tell, but no less.
    pub fn of_cell(&self, scene: &Scene, probe: u32, cell: u32) -> Vec3 {
        let records = &self.records[probe as usize];
        let light = records.light(cell);
        if !records.is_clipped(cell) {
            return light;
        }
        let (point, normal) = records.hits().place(cell);
        self.observe(scene, point, normal).map_or(light, |o| o.value().max(light))
    }

    /// `tell` hears which probes count, and with what share.
    #[inline]
    fn observe_above(
        &self,
        scene: &Scene,
        point: Vec3,
        normal: Vec3,
        least: f32,
        mut tell: impl FnMut(usize, f32),
    ) -> Option<Observation> {
        let mut best = 0.0;
        let mut brightest = 0;
        let (mut sum, mut bound) = (Observation::default(), Observation::default());
        let mut moments = Vec3::ZERO;
        self.sharpest_first(point, normal, |fine, i| {
            if fine <= COARSEST * best {
                return ControlFlow::Break(());
            }
            let o = self.records[i].observe(scene, point, normal);
            if o.weight() > least && o.is_bound() {
                if luminance(o.value()) > luminance(bound.value()) || bound.weight() == 0.0 {
                    (bound, brightest) = (o, i);
                }
            } else if o.weight() > least {
                best = if best > 0.0 { best } else { fine };
                let share = (fine / best) * (fine / best);
                sum.add(&o, share);
                tell(i, share);
                moments += Vec3::new(1.0, luminance(o.value()), luminance(o.value()).powi(2)) * (share * o.weight());
            }
            ControlFlow::Continue(())
        });
        if best == 0.0 {
            return (bound.weight() > 0.0).then(|| {
                tell(brightest, 1.0);
                bound
            });
        }
        let mean = moments.y / moments.x;
        let variance = (moments.z / moments.x - mean * mean).max(0.0);
        sum.disagreement = (variance.sqrt() / mean.max(f32::MIN_POSITIVE)).min(1.0);
        Some(sum)
    }

    /// Visits the probes that a surface faces with their [fineness](Hits::fineness) there, sharpest first and of equals
    /// the first one, until `visit` breaks with a result.
    fn sharpest_first<B>(
        &self,
        point: Vec3,
        normal: Vec3,
        mut visit: impl FnMut(f32, usize) -> ControlFlow<B>,
    ) -> Option<B> {
        let mut few = [(0.0f32, 0usize); 32];
        let mut many;
        let order: &mut [(f32, usize)] = if self.records.len() <= few.len() {
            &mut few[..self.records.len()]
        } else {
            many = vec![(0.0, 0); self.records.len()];
            &mut many
        };
        for (i, (slot, probe)) in order.iter_mut().zip(&self.records).enumerate() {
            *slot = (probe.hits().fineness(point, normal), i);
        }
        order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for &(fine, i) in order.iter().take_while(|o| o.0 > 0.0) {
            if let ControlFlow::Break(result) = visit(fine, i) {
                return Some(result);
            }
        }
        None
    }

    /// Irradiance at a point that an observation is about, given whether the sun reaches it. Records in sun and in shade
    /// are never mixed. `None` where the records say too little.
    pub fn resolve(&self, o: &Observation, in_sun: bool, normal: Vec3) -> Option<Vec3> {
        Some(match self.choose(o, in_sun, normal)? {
            Choice::All => o.value(),
            Choice::Sun => o.sun.value(),
            Choice::Shade => o.shade.value(),
            Choice::ShadeAndDirect => o.shade.value() + self.unshadowed_sun(normal),
            Choice::Direct => o.value().max(self.unshadowed_sun(normal)),
        })
    }

    /// Which records tell the irradiance of a point; see [`Light::resolve`].
    pub(crate) fn choose(&self, o: &Observation, in_sun: bool, normal: Vec3) -> Option<Choice> {
        if self.sun.is_none() {
            return Some(Choice::All);
        }
        match in_sun {
            true if o.sun.weight > LEAST_WEIGHT => Some(Choice::Sun),
            true if o.shade.weight > LEAST_WEIGHT => Some(Choice::ShadeAndDirect),
            true if o.value().cmpge(self.unshadowed_sun(normal)).all() => Some(Choice::All),
            true => Some(Choice::Direct),
            false if o.shade.weight > LEAST_WEIGHT => Some(Choice::Shade),
            // taking the sun away from what is nearly all sun leaves only noise: let the volume tell
            false => None,
        }
    }

    /// Whether the sun shines on a point that an observation is about, as far as its records agree on it.
    pub fn sunlit(&self, o: &Observation) -> Option<bool> {
        let few = 1e-3 * o.weight();
        if self.sun.is_none() || o.sun.weight + o.edge.weight < few {
            Some(false)
        } else if o.shade.weight + o.edge.weight < few {
            Some(true)
        } else {
            None
        }
    }

    /// Whether the sun reaches a point, by a shadow ray.
    pub fn sun_reaches(&self, scene: &Scene, point: Vec3, normal: Vec3) -> bool {
        self.sun.is_some_and(|s| sunlight::reaches(scene, point, normal, s.direction))
    }

    /// Cosine between a normal and the direction to the sun; 0 where the surface faces away, and without a sun.
    pub fn sun_cosine(&self, normal: Vec3) -> f32 {
        self.sun.map_or(0.0, |s| normal.dot(s.direction).max(0.0))
    }

    /// Direct sun on a surface, as irradiance.
    pub fn direct_sun(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Vec3 {
        if self.sun_reaches(scene, point, normal) { self.unshadowed_sun(normal) } else { Vec3::ZERO }
    }

    /// Direct sun on a surface that nothing shadows, as irradiance.
    pub fn unshadowed_sun(&self, normal: Vec3) -> Vec3 {
        self.sun.map_or(Vec3::ZERO, |s| s.irradiance * self.sun_cosine(normal))
    }

    /// Radiance of the sky in a direction: as the first probe saw it that is not clipped there, else as the site gives it,
    /// and at least what clipped probes saw; else black.
    pub fn sky(&self, direction: Vec3) -> Vec3 {
        self.told_sky(direction).unwrap_or_default()
    }

    /// Radiance of the sky in a direction, as probes or the site tell.
    pub fn told_sky(&self, direction: Vec3) -> Option<Vec3> {
        let mut least = None;
        for (radiance, clipped) in self.records.iter().filter_map(|r| r.sky(direction, |_, _| ())) {
            if !clipped {
                return Some(radiance);
            }
            least = Some(least.unwrap_or(Vec3::ZERO).max(radiance));
        }
        let given = self.outside.as_ref().map(|outside| outside.radiance(direction));
        match (least, given) {
            (Some(least), Some(given)) => Some(least.max(given)),
            (least, given) => least.or(given),
        }
    }

    /// The probe that alone tells of the sky in a direction, and its cells with their shares; `None` where none does.
    pub(crate) fn sky_cells(&self, direction: Vec3) -> Option<(u32, Cells)> {
        self.records.iter().enumerate().find_map(|(i, records)| {
            let mut cells = Cells::new();
            let (_, clipped) = records.sky(direction, |cell, weight| cells.push((cell as u32, weight)))?;
            let total: f32 = cells.iter().map(|c| c.1).sum();
            cells.iter_mut().for_each(|c| c.1 /= total);
            (!clipped).then_some((i as u32, cells))
        })
    }

    /// Mean radiance of all surfaces the probes see.
    pub fn mean_radiance(&self) -> Vec3 {
        let n = self.records.len().max(1) as f32;
        self.records.iter().map(Records::mean_radiance).sum::<Vec3>() / n
    }
}

/// The sun with its irradiance measured: per channel the median, over records in sun, of what they have above the median
/// record in shade, ÷ cosine. `None` where that is under a twentieth of the site's figure.
fn measured_sun(records: &[Records], sun: Sun) -> Option<Sun> {
    let trusted = || records.iter().flat_map(Records::trusted);
    let facing = || {
        let in_sun = trusted().filter(|(.., in_sun)| *in_sun);
        in_sun.map(|(_, normal, e, _)| (e, normal.dot(sun.direction))).filter(|(_, cos)| *cos > 0.2)
    };
    if facing().nth(19).is_none() {
        // no probe shows a sun patch: nothing to measure, and nothing to keep apart
        return Some(sun);
    }
    let in_shade = || trusted().filter(|(.., in_sun)| !in_sun);
    // nearly all records are in shade: one list for all channels, no longer than it must be
    let mut shade = Vec::with_capacity(in_shade().count());
    let mut channel = |c: usize| {
        shade.clear();
        shade.extend(in_shade().map(|(_, _, e, _)| e[c]));
        let base = quantile(&mut shade, 0.5).unwrap_or(0.0);
        median(facing().map(|(e, cos)| (e[c] - base) / cos)).unwrap_or(0.0).max(0.0)
    };
    let irradiance = Vec3::new(channel(0), channel(1), channel(2));
    (irradiance.element_sum() > 0.05 * sun.irradiance.element_sum()).then_some(Sun { irradiance, ..sun })
}
