//! Records: a probe's hits with the light of one of its pictures.

use glam::{DVec3, U16Vec3, Vec3, Vec4, Vec4Swizzles};
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::Arc;

use super::hits::{CellHit, Hits, Sunlit, clear, hides, split_rows, unpack_normal};
use super::{Chart, Mean, Observation};
use crate::panorama::{Picture, Radiometry, radius2};
use crate::scene::Scene;

/// The irradiance records of one probe under one lighting.
///
/// A cell that measured radiance L on a surface of albedo ρ is an observation L = ρE/π of its irradiance E. The paper
/// divides by ρ (section 4.1), which explodes where ρ → 0. Here a record's E is the least-squares estimate
/// E = π Σ w ρL / Σ w ρ² over the cells next to it that see the same surface under the same sun: dark texels count for
/// little, cells that straddle an edge for next to nothing, and nothing is ever divided by a texel.
pub struct Records {
    pub(super) hits: Arc<Hits>,
    pub(super) records: Vec<Record>,
}

/// One cell's record; 24 bytes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Record {
    /// Surface normal towards the probe, octahedral.
    pub(super) normal: u32,
    /// normal · (point − probe), metres; infinite where there is no surface, `light` then is the sky's radiance.
    pub(super) plane: f32,
    /// Irradiance.
    pub(super) light: [f32; 3],
    /// How far to trust it, 0..=1 in 65535 steps.
    pub(super) trust: u16,
    /// Whether the sun shines on the surface.
    pub(super) sunlit: Sunlit,
    /// Whether the cell shows a clipped pixel: the light was at least that.
    pub(super) clipped: bool,
}

impl Records {
    /// Gives a probe's hits the light that its cells [`measured`]. `sun` is the direction towards the sun, where there is
    /// one.
    pub(super) fn new(scene: &Scene, hits: Arc<Hits>, measured: &[Option<Measured>], sun: Option<Vec3>) -> Self {
        let sunlit = sun.map(|sun| hits.sunlit(scene, sun));
        let chart = &hits.chart;
        let estimate = Estimate::new(&hits, measured, sunlit.as_deref());
        let mut records = vec![Record::default(); chart.len()];
        split_rows(chart, &mut records).into_par_iter().for_each(|(row, records)| {
            let middle = chart.middles(row);
            for (x, record) in records.iter_mut().enumerate() {
                *record = estimate.record(row, x, middle(x), |_, _| ());
            }
        });
        Self { hits, records }
    }

    /// The probe's hits; a clone of these can be given another lighting.
    pub fn hits(&self) -> &Arc<Hits> {
        &self.hits
    }

    /// Bytes held beside the hits.
    pub fn bytes(&self) -> usize {
        self.records.len() * size_of::<Record>()
    }

    /// Irradiance of the surface that a cell sees, or the sky's radiance if it sees none.
    pub fn light(&self, cell: u32) -> Vec3 {
        Vec3::from(self.records[cell as usize].light)
    }

    /// What this probe says about the surface at `point` with unit normal `normal`: the four records around it in the
    /// probe's chart, bilinear, each as far as it lies on the same surface.
    pub fn observe(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Observation {
        let mut sums = Observation::default();
        self.look(scene, point, normal, |cell, sunlit, weight| {
            let record = &self.records[cell];
            sums.of(sunlit).add(Vec3::from(record.light), weight);
            sums.clipped += if record.clipped { weight } else { 0.0 };
        });
        sums
    }

    /// Tells the cells whose records [speak](Self::observe) of a point, whether the sun shines on them, and their weights.
    #[inline]
    pub(super) fn look(&self, scene: &Scene, point: Vec3, normal: Vec3, mut tell: impl FnMut(usize, Sunlit, f32)) {
        let chart = &self.hits.chart;
        let p = point - self.hits.origin;
        if normal.dot(p) >= 0.0 {
            return;
        }
        let Some(place) = chart.place(self.hits.to_probe * p) else { return };
        let tolerance = p.length() * chart.cell_angle();
        let around = chart.around(place);
        // neighbours mostly share a normal
        let (mut packed, mut n) = (self.records[around[0].0].normal, unpack_normal(self.records[around[0].0].normal));
        let mut behind = false;
        let mut weights = [0.0; 4];
        for (weight, (cell, kernel)) in weights.iter_mut().zip(around) {
            let record = &self.records[cell];
            if record.normal != packed {
                (packed, n) = (record.normal, unpack_normal(record.normal));
            }
            let off = n.dot(p) - record.plane;
            let facing = n.dot(normal);
            behind |= record.plane.is_finite() && hides(off, facing, tolerance);
            if off.abs() < tolerance {
                *weight = kernel * record.agreement(facing);
            }
        }
        // a point that the probe itself sees is joined to what it sees beside it: one ray instead of one a cell
        let clear = !behind || weights.iter().all(|w| *w == 0.0) || self.sees(scene, point, normal, tolerance);
        for ((cell, _), weight) in around.into_iter().zip(weights) {
            if weight > 0.0 && (clear || self.hits.joined(scene, cell, point, normal, tolerance)) {
                tell(cell, self.records[cell].sunlit, weight);
            }
        }
    }

    /// Whether nothing stands between the probe and a point, seen from just above its surface.
    fn sees(&self, scene: &Scene, point: Vec3, normal: Vec3, tolerance_m: f32) -> bool {
        clear(scene, point + normal * (0.5 * tolerance_m), self.hits.origin, 0.0)
    }

    /// The sky's radiance in a direction, where all four cells around it see the sky, and whether that is clipped: no
    /// more than a lower bound. `tell` hears of each cell that counts and its weight.
    pub(super) fn sky(&self, direction: Vec3, mut tell: impl FnMut(usize, f32)) -> Option<(Vec3, bool)> {
        let place = self.hits.chart.place(self.hits.to_probe * direction)?;
        let (mut mean, mut clipped) = (Mean::default(), false);
        for (cell, kernel) in self.hits.chart.around(place) {
            let record = &self.records[cell];
            if record.plane.is_finite() {
                return None;
            }
            let weight = kernel * f32::from(record.trust);
            mean.add(Vec3::from(record.light), weight);
            tell(cell, weight);
            clipped |= record.clipped && kernel > 0.0;
        }
        (mean.weight > 0.0).then(|| (mean.value(), clipped))
    }

    /// Whether any pixel that a cell's record is made of measures light.
    pub fn knows(&self, cell: u32) -> bool {
        let record = &self.records[cell as usize];
        record.trust > 0 || record.light != [0.0; 3]
    }

    /// Whether its records lie in the same cells as another's, and the same ones have light.
    pub fn lies_like(&self, other: &Self) -> bool {
        let (a, b) = (&self.hits, &other.hits);
        a.origin == b.origin
            && a.to_probe == b.to_probe
            && a.chart == b.chart
            && (0..self.records.len() as u32).all(|cell| self.knows(cell) == other.knows(cell))
    }

    /// Whether a cell's light is no more than a lower bound.
    pub fn is_clipped(&self, cell: u32) -> bool {
        self.records[cell as usize].clipped
    }

    /// All trusted records of surfaces: (cell, normal, irradiance, in direct sun or not; edges and clipped ones are left
    /// out).
    pub(super) fn trusted(&self) -> impl Iterator<Item = (usize, Vec3, Vec3, bool)> {
        self.records.iter().enumerate().filter_map(|(i, r)| {
            let whole = r.plane.is_finite() && r.trust > u16::MAX / 2 && r.sunlit != Sunlit::Partly && !r.clipped;
            whole.then(|| (i, unpack_normal(r.normal), Vec3::from(r.light), r.sunlit == Sunlit::Yes))
        })
    }

    /// Radiance that leaves the surface a cell sees, or comes from the sky behind it.
    fn radiance(&self, cell: usize) -> Vec3 {
        let hit = &self.hits.cells[cell];
        let light = Vec3::from(self.records[cell].light);
        if hit.is_hit() { hit.albedo() * light / PI } else { light }
    }

    /// Mean radiance over all cells that see a surface.
    pub fn mean_radiance(&self) -> Vec3 {
        let mut sum = DVec3::ZERO;
        let mut count = 0u32;
        for (cell, hit) in self.hits.cells.iter().enumerate() {
            if hit.is_hit() && self.records[cell].trust > 0 {
                sum += self.radiance(cell).as_dvec3();
                count += 1;
            }
        }
        (sum / f64::from(count.max(1))).as_vec3()
    }

    /// The places of bright things: for every cell whose brightest channel is above `threshold`, a position and its
    /// radiance × area (m²) across the line of sight, summed over channels. A cell that sees the sky stands where the
    /// frame of its window is: as far as the nearest surface beside it.
    pub fn bright_places(&self, threshold: f32) -> Vec<(Vec3, f32)> {
        /// How many cells beside a sky cell to look for its window's frame.
        const FRAME: usize = 40;
        let chart = &self.hits.chart;
        let to_world = self.hits.to_probe.transpose();
        let angle = chart.cell_angle();
        (0..chart.rows())
            .into_par_iter()
            .flat_map_iter(|row| {
                let range = chart.row(row);
                let direction = move |i: usize| to_world * chart.middle(row, i - chart.row(row).start);
                let distance = move |i: usize| {
                    let hit = &self.hits.cells[i];
                    hit.is_hit().then(|| hit.plane / unpack_normal(hit.normal).dot(direction(i)))
                };
                range.clone().filter_map(move |i| {
                    let radiance = self.radiance(i);
                    if radiance.max_element() <= threshold {
                        return None;
                    }
                    let beside = || {
                        (1..=FRAME)
                            .flat_map(|k| [i.checked_sub(k), Some(i + k)])
                            .flatten()
                            .filter(|j| range.contains(j))
                            .find_map(distance)
                    };
                    let t = distance(i).or_else(beside)?;
                    let area = angle * angle * t * t;
                    Some((self.hits.origin + direction(i) * t, radiance.element_sum() * area))
                })
            })
            .collect()
    }
}

/// About so many of the trusted records in shade, spread over all probes: places, normals and irradiance. Each is chosen by
/// its own number, so that one more or less elsewhere leaves it.
pub(super) fn shaded(probes: &[Records], most: usize) -> impl Iterator<Item = (Vec3, Vec3, Vec3)> {
    /// The golden ratio's part after the point: whole multiples of it are spread evenly over a turn.
    const GOLDEN: u32 = 0x9e37_79b9;
    let in_shade = |r: &Records| r.trusted().filter(|t| !t.3).count();
    let count: usize = probes.iter().map(in_shade).sum();
    let share = (most as f64 / count.max(1) as f64).min(1.0);
    let last = (share * f64::from(u32::MAX)) as u32;
    probes.iter().enumerate().flat_map(move |(probe, records)| {
        let chosen = move |cell: usize| ((cell + probe) as u32).wrapping_mul(GOLDEN) <= last;
        let some = records.trusted().filter(move |t| !t.3 && chosen(t.0));
        some.map(|(cell, normal, e, _)| (records.hits().place(cell as u32).0, normal, e))
    })
}

impl Record {
    /// How far a point near this record's plane is on its surface, 0..=1: the two conditions of the paper's section 4.3,
    /// with the distance taken across the surface's plane and the cosine between the normals to a high power, times the
    /// record's trust.
    #[inline]
    fn agreement(&self, facing: f32) -> f32 {
        if facing > LEAST_FACING { facing.powi(FACING) * f32::from(self.trust) * (1.0 / 65535.0) } else { 0.0 }
    }
}

/// Normals farther apart than the arc cosine of this (72°) are not one surface.
const LEAST_FACING: f32 = 0.3;

/// Records count by this power of the cosine between their normals and the point's: cos³² is one half at 12°, so that
/// the facets of a column keep their own light while a finely tessellated vault is smooth.
const FACING: i32 = 32;

/// Neighbouring cells whose brightness differs by this share count half: light changes there, and the kernel narrows.
const SIMILAR: f32 = 0.5;

/// How alike two brightnesses are, 0..=1.
fn similarity(a: f32, b: f32) -> f32 {
    let difference = (a - b) / (0.5 * SIMILAR * (a + b)).max(f32::MIN_POSITIVE);
    1.0 / (1.0 + difference * difference)
}

/// A rough irradiance/π, summed over channels, to compare neighbours by; dark albedos are floored.
fn brightness(hit: &CellHit, measured: Option<Measured>) -> f32 {
    measured.map_or(0.0, |m| m.radiance.element_sum()) / hit.albedo().element_sum().max(0.03)
}

/// What a cell measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    pub(super) radiance: Vec3,
    /// Whether a clipped pixel has part in it.
    pub(super) clipped: bool,
}

/// Edges are known to this share of a cell: so much of a cell beside one may show what is across it.
const EDGE_OFF: f32 = 0.5;

/// How far to trust what a cell measured, 0..=1: as far as it sees one surface, and is brighter than what it may have caught of
/// something brighter across an edge, as beside windows.
fn trust(hits: &Hits, measured: &[Option<Measured>], row: usize, x: usize) -> f32 {
    let cell = hits.chart.row(row).start + x;
    let hit = &hits.cells[cell];
    let (Some(own), true) = (measured[cell], hit.is_hit()) else { return 0.0 };
    let light = |m: Measured| m.radiance.max_element();
    let beside = hits.neighbours(row, x).filter_map(|j| measured[j].map(|m| (j, light(m))));
    let across = beside.filter(|(j, l)| *l > light(own) && hits.parted(row, x, *j));
    let brightest = across.fold(light(own), |most, (_, l)| most.max(l));
    let caught = EDGE_OFF * (brightest - light(own)) / light(own).max(f32::MIN_POSITIVE);
    hit.trust() / (1.0 + caught * caught)
}

/// What the irradiance of a record is estimated from.
pub(super) struct Estimate<'a> {
    hits: &'a Hits,
    /// What each cell measured; `None` for bad pixels.
    measured: &'a [Option<Measured>],
    /// [`brightness`] of each cell.
    brightness: Vec<f32>,
    /// How far each cell can be trusted, 0..=1.
    trust: Vec<f32>,
    sunlit: Option<&'a [Sunlit]>,
}

impl<'a> Estimate<'a> {
    pub(super) fn new(hits: &'a Hits, measured: &'a [Option<Measured>], sunlit: Option<&'a [Sunlit]>) -> Self {
        let brightness = hits.cells.par_iter().zip(measured).map(|(hit, l)| brightness(hit, *l)).collect();
        let mut trusts = vec![0.0; hits.chart.len()];
        split_rows(&hits.chart, &mut trusts).into_par_iter().for_each(|(row, cells)| {
            cells.iter_mut().enumerate().for_each(|(x, cell)| *cell = trust(hits, measured, row, x));
        });
        Self { hits, measured, brightness, trust: trusts, sunlit }
    }

    fn sunlit(&self, cell: usize) -> Sunlit {
        self.sunlit.map_or(Sunlit::No, |s| s[cell])
    }

    /// The record of cell `x` of a row, which looks along `middle`: least squares over the 3 × 3 cells around it under a
    /// tent kernel. `tell` hears which cells count, and how much.
    #[inline]
    pub(super) fn record(&self, row: usize, x: usize, middle: Vec3, mut tell: impl FnMut(usize, f32)) -> Record {
        let chart = &self.hits.chart;
        let cell = chart.row(row).start + x;
        let hit = &self.hits.cells[cell];
        let sunlit = self.sunlit(cell);
        if !hit.is_hit() {
            let sky = self.measured[cell];
            let trust = if sky.is_some() { u16::MAX } else { 0 };
            let light = sky.map_or(Vec3::ZERO, |m| m.radiance).to_array();
            let clipped = sky.is_some_and(|m| m.clipped);
            return Record { normal: 0, plane: f32::INFINITY, light, trust, sunlit, clipped };
        }
        let normal = unpack_normal(hit.normal);
        let d = self.hits.to_probe.transpose() * middle;
        let p = d * (hit.plane / normal.dot(d));
        let tolerance = p.length() * chart.cell_angle();
        let level = self.brightness[cell];
        // a clipped neighbour would darken a cell that measured light, not one that is itself clipped
        let clipped = self.measured[cell].is_some_and(|m| m.clipped);
        let (mut rho_l, mut rho2, mut trust, mut total) = (Vec3::ZERO, Vec3::ZERO, 0.0, 0.0);
        for (other, kernel) in chart.patch(row, x) {
            total += kernel;
            let (Some(measured), theirs) = (self.measured[other], &self.hits.cells[other]) else { continue };
            let (l, facing) = (measured.radiance, theirs.facing_packed(p, normal, hit.normal, tolerance));
            if facing < LEAST_FACING || self.sunlit(other) != sunlit || measured.clipped && !clipped {
                continue;
            }
            let rho = theirs.albedo();
            let facing = if facing < 1.0 { facing.powi(FACING) } else { 1.0 };
            let weight = kernel * facing * self.trust[other] * similarity(level, self.brightness[other]);
            rho_l += rho * l * weight;
            rho2 += rho * rho * weight;
            trust += weight;
            tell(other, weight);
        }
        let light = irradiance(rho_l, rho2);
        let trust = (trust / total * 65535.0) as u16;
        Record { normal: hit.normal, plane: hit.plane, light, trust, sunlit, clipped }
    }
}

/// The least-squares irradiance π Σ w ρL / Σ w ρ² per channel. A channel that the surface does not reflect says nothing of
/// its light, which is taken to be as the mean of the others; black all over is zero.
fn irradiance(rho_l: Vec3, rho2: Vec3) -> [f32; 3] {
    let known = rho2.cmpgt(Vec3::ZERO);
    let e = (PI * rho_l / rho2).min(Vec3::splat(f32::MAX));
    let count = known.bitmask().count_ones().max(1) as f32;
    let mean = Vec3::select(known, e / count, Vec3::ZERO).element_sum();
    Vec3::select(known, e, Vec3::splat(mean)).to_array()
}

/// What each cell of a chart measured, from a picture in the chart's own projection.
pub(super) fn measured(chart: &Chart, picture: &Picture, radiometry: &Radiometry) -> Vec<Option<Measured>> {
    measured_as(chart, picture, radiometry, |_, measured| measured)
}

/// Something of each cell of a chart and what it measured: the mean radiance of the picture's pixels that it overlaps. Pixels that are
/// not finite or are negative do not count; `None` where none does.
pub(super) fn measured_as<T: Clone + Default + Send>(
    chart: &Chart,
    picture: &Picture,
    radiometry: &Radiometry,
    one: impl Fn(usize, Option<Measured>) -> T + Sync,
) -> Vec<T> {
    let mut all = vec![T::default(); chart.len()];
    split_rows(chart, &mut all).into_par_iter().for_each_init(Vec::new, |developed, (row, cells)| {
        let pixels = &picture.pixels[row * picture.width..][..picture.width];
        developed.clear();
        developed.extend((0..).zip(pixels).map(|(i, &pixel)| {
            let r2 = radius2(picture.width, picture.height, i as f32 + 0.5, row as f32 + 0.5);
            if Picture::valid(pixel) { radiometry.light(pixel, r2).extend(1.0) } else { Vec4::ZERO }
        }));
        let scale = picture.width as f32 / cells.len() as f32;
        let (start, mut from, mut first) = (chart.row(row).start, 0f32, 0);
        for (x, cell) in cells.iter_mut().enumerate() {
            let to = (x + 1) as f32 * scale;
            // up to the next whole number: f32::ceil is a slow call on plain x86-64
            let whole = to as usize;
            let last = (whole + usize::from((whole as f32) < to)).min(picture.width);
            let mut sum = Vec4::ZERO;
            for (i, &light) in (first..last).zip(&developed[first..last]) {
                sum += light * (to.min((i + 1) as f32) - from.max(i as f32)).max(0.0);
            }
            let clipped = || pixels[first..last].iter().any(|p| Picture::valid(*p) && radiometry.is_clipped(*p));
            let measured = (sum.w > 0.0).then(|| Measured { radiance: sum.xyz() / sum.w, clipped: clipped() });
            *cell = one(start + x, measured);
            (from, first) = (to, whole.min(picture.width));
        }
    });
    all
}

impl CellHit {
    /// Albedo averaged over the cell.
    pub(super) fn albedo(&self) -> Vec3 {
        U16Vec3::from_array(self.albedo).as_vec3() * (1.0 / 65535.0)
    }

    /// How far to trust what the cell measured: falls steeply with the share of it that sees another surface.
    fn trust(&self) -> f32 {
        if self.purity == u16::MAX { 1.0 } else { (f32::from(self.purity) / 65535.0).powi(4).max(1e-3) }
    }
}

#[cfg(test)]
mod equivalence;
