//! Light as a linear operator: the irradiance of any surface points as a weighted sum of what the probes' cells measured
//! (precomputed radiance transfer: Sloan, Kautz and Snyder, SIGGRAPH 2002, with measured light in the place of a basis).
//!
//! Cells → [records](RecordTransfer) → [places of the volume](VolumeTransfer) → points: each step a sparse matrix that is
//! found once. A new picture of the same probes lights all points by three products and casts no ray.
//!
//! Not linear in [`Relit`] are the weights that hang on the light itself: a record's neighbours count by how alike they
//! are, clipped cells do not, the volume is evened out by its noise, and the sun's irradiance is a median. Here they stay as
//! the lighting made them that the operator was built for. So it is exact for that lighting and its multiples; for another
//! one it takes the first one's weights. What is not measured at all but guessed goes with the mean of what is measured.
//!
//! ```
//! use clerestory::render::Relit;
//! use clerestory::transfer::Transfer;
//! # use clerestory::glam::{Mat3, Vec3};
//! # use clerestory::panorama::{Picture, Projection, Radiometry};
//! # use clerestory::shoot::{Hits, Light, charted};
//! # use std::sync::Arc;
//! # mod given {
//! #     include!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/common/room.rs"));
//! # }
//! # use given::room;
//! # let scene = room(); // 4 × 3 × 2.5 m, grey: half of the light comes back
//! # let panorama = Picture { width: 64, height: 32, pixels: vec![Vec3::splat(0.2); 64 * 32] };
//! # let (chart, picture) = charted(panorama, Projection::LatLong);
//! # let hits = Arc::new(Hits::shoot(&scene, Vec3::new(2.0, 1.5, 1.2), Mat3::IDENTITY, chart));
//! # let light = Light::new(&scene, [(hits, &picture, Radiometry::default())], None, None);
//! let relit = Relit { scene: &scene, light: &light, volume: None, volume_only: false };
//! let points = [(Vec3::new(1.0, 1.0, 0.0), Vec3::Z)];
//! let transfer = Transfer::new(&relit, &[(&picture, Radiometry::default())], &points);
//! // another picture of the same probe, twice as bright: no ray is cast
//! let brighter = Picture { pixels: picture.pixels.iter().map(|p| 2.0 * p).collect(), ..picture.clone() };
//! let [before, after] = [&picture, &brighter].map(|p| transfer.light(&transfer.measure(&[p]), Vec3::ZERO, Vec3::ONE)[0]);
//! assert!((after - 2.0 * before).abs().max_element() < 1e-4);
//! ```

use glam::{DVec3, Vec3, Vec3A};
use rayon::prelude::*;
use std::collections::BTreeMap;

use crate::lists::Lists;
use crate::panorama::{Picture, Radiometry, luminance};
use crate::render::{Irradiance, Relit, Source};
use crate::scene::Scene;
use crate::shoot::hits::Sunlit;
use crate::shoot::{Choice, Light, RecordTransfer};
use crate::volume::{Nearby, VolumeTransfer, irradiance};

/// A point of a surface and its unit normal, local metres.
pub type Point = (Vec3, Vec3);

/// Points that are looked up one after the other, so that what is kept from one to the next hangs on nothing else.
pub const LOT: usize = 64;

/// Irradiance at points as a function of probes' pictures.
pub struct Transfer<'a> {
    probes: Vec<RecordTransfer>,
    volume: Option<VolumeTransfer<'a>>,
    rows: Rows,
    /// Luminance of the mean of what cells measured, when it was built.
    mean: f32,
    /// The sun's irradiance on a surface that faces it, and per probe and channel by how much what cells in the sun measured exceeded
    /// what cells in shade did, when it was built.
    sun: Vec3,
    contrast: Vec3,
}

/// The last step's matrix.
#[derive(Default)]
struct Rows {
    /// Per point the records that light it, and the places, each with its weight.
    records: Lists<(u32, f32)>,
    places: Lists<(u32, f32)>,
    normals: Vec<Vec3>,
    /// Per point the cosine that the sun's direct irradiance counts with.
    sun: Vec<f32>,
    /// Points whose light is no sum of records and places, and that light.
    guessed: Vec<(u32, Vec3)>,
}

/// How one point is lit.
#[derive(Default)]
struct Row {
    records: Vec<(u32, u32, f32)>,
    places: Vec<(u32, f32)>,
    sun: f32,
    guessed: Option<Vec3>,
}

impl<'a> Transfer<'a> {
    /// The operator for some points. `pictures` are those that `relit` was lit by, in the probes' order, each with its
    /// radiometry.
    pub fn new(relit: &'a Relit, pictures: &[(&Picture, Radiometry)], points: &[Point]) -> Self {
        let found: Vec<Row> = points
            .par_chunks(LOT)
            .flat_map_iter(|points| {
                let mut near = Nearby::default();
                points.iter().map(move |&point| row(relit, point, &mut near)).collect::<Vec<_>>()
            })
            .collect();
        // records are numbered as they come up, then sorted by probe and cell, so that products read memory in order
        let mut numbers: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let mut ask = |probe: u32, cell: u32| {
            let next = numbers.len() as u32;
            *numbers.entry((probe, cell)).or_insert(next)
        };
        let mut rows = Rows::default();
        for (i, row) in found.into_iter().enumerate() {
            let records: Vec<_> = row.records.iter().map(|&(probe, cell, w)| (ask(probe, cell), w)).collect();
            rows.records.push(&records);
            rows.places.push(&row.places);
            rows.normals.push(points[i].1);
            rows.sun.push(row.sun);
            rows.guessed.extend(row.guessed.map(|e| (i as u32, e)));
        }
        let light = relit.light;
        let mut volume = relit.volume.map(|volume| VolumeTransfer::new(relit.scene, light, volume, &mut ask));
        let mut order = vec![0; numbers.len()];
        let mut cells = vec![Vec::new(); pictures.len()];
        for (place, (&(probe, cell), &number)) in numbers.iter().enumerate() {
            order[number as usize] = place as u32;
            cells[probe as usize].push(cell);
        }
        rows.records.items_mut().iter_mut().for_each(|t| t.0 = order[t.0 as usize]);
        volume.iter_mut().for_each(|v| v.renumber(&order));
        let sun = light.sun.map(|s| s.direction);
        let probe = |((records, &(picture, radiometry)), cells): ((_, &(&Picture, Radiometry)), &Vec<u32>)| {
            RecordTransfer::new(records, picture, radiometry, sun, cells)
        };
        let probes: Vec<RecordTransfer> = light.records.iter().zip(pictures).zip(&cells).map(probe).collect();
        let sun = light.sun.map_or(Vec3::ZERO, |s| s.irradiance);
        let mut all = Self { probes, volume, rows, mean: 0.0, sun, contrast: Vec3::ZERO };
        let pictures: Vec<&Picture> = pictures.iter().map(|p| p.0).collect();
        let measured = all.measure(&pictures);
        (all.mean, all.contrast) = (mean(&measured), all.contrast(&measured));
        all
    }

    /// How many times as bright as when the operator was built what the cells [measured](Transfer::measure) is, in the mean.
    pub fn brightness(&self, measured: &[Vec<Vec3A>]) -> f32 {
        if self.mean > 0.0 { mean(measured) / self.mean } else { 1.0 }
    }

    /// The irradiance of the sun on a surface that faces it: as much more or less than when the operator was built as cells in the sun
    /// exceed those in shade by now.
    pub fn sun(&self, measured: &[Vec<Vec3A>]) -> Vec3 {
        let now = self.contrast(measured);
        let times = |c: usize| if self.contrast[c] > 0.0 { (now[c] / self.contrast[c]).max(0.0) } else { 1.0 };
        self.sun * Vec3::from([0, 1, 2].map(times))
    }

    /// By how much the mean of what cells in the sun measured exceeds that of cells in shade.
    fn contrast(&self, measured: &[Vec<Vec3A>]) -> Vec3 {
        let mut sums = [(DVec3::ZERO, 0usize); 2];
        for (probe, measured) in self.probes.iter().zip(measured) {
            for (&sunlit, m) in probe.sunlit().iter().zip(measured) {
                let Some(k) = [Sunlit::No, Sunlit::Yes].into_iter().position(|s| s == sunlit) else { continue };
                sums[k] = (sums[k].0 + Vec3::from(*m).as_dvec3(), sums[k].1 + 1);
            }
        }
        let [shade, sun] = sums.map(|(sum, count)| (sum / count.max(1) as f64).as_vec3());
        sun - shade
    }

    /// What each probe's cells measure in its picture, which has the size of the one that the operator was built with.
    pub fn measure(&self, pictures: &[&Picture]) -> Vec<Vec<Vec3A>> {
        self.probes.iter().zip(pictures).map(|(probe, picture)| probe.measure(picture)).collect()
    }

    /// Irradiance at all points under a lighting: what the cells [measured](Transfer::measure), the sun's irradiance on a
    /// surface that faces it, and how many times as bright as the site gives it the sky is, per channel.
    pub fn light(&self, measured: &[Vec<Vec3A>], sun: Vec3, sky: Vec3) -> Vec<Vec3> {
        let factor = self.brightness(measured);
        let records: Vec<Vec3A> = self
            .probes
            .iter()
            .zip(measured)
            .map(|(probe, measured)| probe.light(measured))
            .collect::<Vec<_>>()
            .concat();
        let vectors = self.volume.as_ref().map_or_else(Vec::new, |v| v.vectors(&records, sun, sky, factor));
        let rows = &self.rows;
        let one = |i: usize| {
            let seen: Vec3A = rows.records.get(i).iter().map(|&(record, w)| records[record as usize] * w).sum();
            let of_place = |&(place, w): &(u32, f32)| irradiance(&vectors[place as usize], rows.normals[i]) * w;
            let unseen: Vec3 = rows.places.get(i).iter().map(of_place).sum();
            Vec3::from(seen) + unseen + sun * rows.sun[i]
        };
        let mut all: Vec<Vec3> = (0..rows.normals.len()).into_par_iter().with_min_len(4096).map(one).collect();
        for &(point, e) in &rows.guessed {
            all[point as usize] = e * factor;
        }
        all
    }
}

/// The luminance of the mean of what cells measured.
fn mean(measured: &[Vec<Vec3A>]) -> f32 {
    let row = |row: &[Vec3A]| row.iter().map(|m| f64::from(luminance(Vec3::from(*m)))).sum::<f64>();
    let sums: Vec<f64> = measured.iter().flat_map(|m| m.par_chunks(4096).map(row).collect::<Vec<_>>()).collect();
    (sums.iter().sum::<f64>() / measured.iter().map(Vec::len).sum::<usize>().max(1) as f64) as f32
}

/// What lights a point, as [`Relit`] finds it.
fn row(relit: &Relit, (point, normal): Point, near: &mut Nearby) -> Row {
    let (scene, light) = (relit.scene, relit.light);
    let lit = relit.lit(point, normal, near);
    let in_sun = lit.needs_shadow_ray && relit.in_sun(point, normal);
    let (e, source) =
        if in_sun || !lit.needs_shadow_ray { (lit.sun, lit.source) } else { (lit.shade, lit.shade_source) };
    let guess = || Row { guessed: Some(e), ..Row::default() };
    if source == Source::Record {
        return of_records(light, scene, (point, normal), in_sun, lit.needs_shadow_ray, relit.volume.is_none())
            .unwrap_or_else(guess);
    }
    let (Source::Volume, Some(volume)) = (source, relit.volume) else { return guess() };
    let places = volume.places(scene, point, normal, near);
    if places.is_empty() {
        return guess();
    }
    let sun = if in_sun { light.sun_cosine(normal) } else { 0.0 };
    Row { places, sun, ..Row::default() }
}

/// The sum of records that lights a point; `None` where it is none.
fn of_records(
    light: &Light,
    scene: &Scene,
    (point, normal): Point,
    in_sun: bool,
    needs_shadow_ray: bool,
    untrusted: bool,
) -> Option<Row> {
    let mut all: Vec<(u32, u32, Sunlit, f32)> = Vec::new();
    let observed = light.weigh(scene, (point, normal), false, |p, c, s, w| all.push((p, c, s, w)));
    let in_sun =
        if needs_shadow_ray { in_sun } else { observed.as_ref().and_then(|o| light.sunlit(o)).unwrap_or(in_sun) };
    let choice = match observed.as_ref().and_then(|o| light.choose(o, in_sun, normal)) {
        Some(choice) => choice,
        None if untrusted => {
            all.clear();
            light.weigh(scene, (point, normal), true, |p, c, s, w| all.push((p, c, s, w)))?;
            Choice::All
        }
        None => return None,
    };
    let of = |which: Option<Sunlit>| -> Vec<(u32, u32, f32)> {
        let chosen = all.iter().filter(|r| which.is_none_or(|w| r.2 == w));
        let total: f32 = chosen.clone().map(|r| r.3).sum();
        chosen.map(|r| (r.0, r.1, r.3 / total)).collect()
    };
    let direct = light.sun_cosine(normal);
    Some(match choice {
        Choice::All => Row { records: of(None), ..Row::default() },
        Choice::Sun => Row { records: of(Some(Sunlit::Yes)), ..Row::default() },
        Choice::Shade => Row { records: of(Some(Sunlit::No)), ..Row::default() },
        Choice::ShadeAndDirect => Row { records: of(Some(Sunlit::No)), sun: direct, ..Row::default() },
        Choice::Direct => Row { sun: direct, ..Row::default() },
    })
}
