//! Records: a probe's hits with the light of one of its pictures.

use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::Arc;

use super::hits::{Hits, unpack_normal};
use super::sunlight::{self, Sunlit};
use crate::panorama::Picture;
use crate::scene::Scene;

/// The irradiance records of one probe under one lighting: hits, which all lightings share, and 16 bytes of light each.
///
/// A cell that measured radiance L on a surface of albedo ρ is an observation L = ρE/π of the irradiance E. Records are
/// never divided by a texel: where E is wanted, it is the least-squares estimate π Σ w ρL / Σ w ρ² over the records
/// around (see [`Observation`]), in which dark texels count for little.
pub struct Records {
    hits: Arc<Hits>,
    light: Vec<CellLight>,
}

#[derive(Clone, Copy)]
struct CellLight {
    /// Radiance.
    radiance: [f32; 3],
    /// How far to trust it, 0..=1 in 65535 steps: low beside a depth edge, 0 for a bad pixel.
    trust: u16,
    /// Whether the sun shines on the surface.
    sunlit: Sunlit,
}

/// Sums over records of what they say about a point's irradiance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Observation {
    /// Σ w ρL.
    pub rho_l: Vec3,
    /// Σ w ρ².
    pub rho2: Vec3,
    /// Σ w.
    pub weight: f32,
}

impl Observation {
    fn record(&mut self, rho: Vec3, radiance: Vec3, weight: f32) {
        self.rho_l += rho * radiance * weight;
        self.rho2 += rho * rho * weight;
        self.weight += weight;
    }

    /// Adds another observation, `scale` times as heavy.
    pub fn add(&mut self, other: &Self, scale: f32) {
        self.rho_l += other.rho_l * scale;
        self.rho2 += other.rho2 * scale;
        self.weight += other.weight * scale;
    }

    /// Irradiance, per channel; 0 where no surface reflects anything in that channel.
    pub fn irradiance(&self) -> Vec3 {
        let e = |l: f32, r: f32| if r > 0.0 { PI * l / r } else { 0.0 };
        Vec3::new(e(self.rho_l.x, self.rho2.x), e(self.rho_l.y, self.rho2.y), e(self.rho_l.z, self.rho2.z))
    }
}

/// What the records say about a point, apart for records in shadow and in sunlight.
#[derive(Clone, Copy, Debug, Default)]
pub struct Observations {
    /// From records that the sun does not reach.
    pub shade: Observation,
    /// From records in direct sun.
    pub sun: Observation,
    /// From records that a shadow's edge runs through.
    pub mixed: Observation,
}

impl Observations {
    /// Adds others, `scale` times as heavy.
    pub fn add(&mut self, other: &Self, scale: f32) {
        self.shade.add(&other.shade, scale);
        self.sun.add(&other.sun, scale);
        self.mixed.add(&other.mixed, scale);
    }
}

impl Records {
    /// Gives a probe's hits the light of a picture in the chart's own projection. `sun` is the direction towards the
    /// sun, where it is known.
    pub fn new(scene: &Scene, hits: Arc<Hits>, picture: &Picture, gain: f32, sun: Option<Vec3>) -> Self {
        let sunlit = sun.map(|sun| sunlight::sunlit(scene, &hits, sun));
        let chart = &hits.chart;
        let light = (0..chart.rows())
            .into_par_iter()
            .flat_map_iter(|row| {
                let (range, hits, sunlit) = (chart.row(row), &hits, &sunlit);
                let n = range.len();
                range.clone().map(move |i| {
                    let sunlit = sunlit.as_ref().map_or(Sunlit::No, |s| s[i]);
                    let purity = f32::from(hits.cells[i].purity) / 65535.0;
                    let trust = purity.powi(4).max(1e-3);
                    match row_average(picture, row, i - range.start, n) {
                        Some(l) => {
                            CellLight { radiance: (l * gain).to_array(), trust: (trust * 65535.0) as u16, sunlit }
                        }
                        None => CellLight { radiance: [0.0; 3], trust: 0, sunlit },
                    }
                })
            })
            .collect();
        Self { light, hits }
    }

    /// The probe's hits.
    pub fn hits(&self) -> &Hits {
        &self.hits
    }

    /// What this probe says about the surface at `point` with unit normal `normal`. `reach` is the half width of the
    /// kernel in cells; 1 is bilinear.
    pub fn observe(&self, point: Vec3, normal: Vec3, reach: i32) -> Observations {
        let mut sums = Observations::default();
        let chart = &self.hits.chart;
        let p = point - self.hits.origin;
        if normal.dot(p) >= 0.0 {
            return sums;
        }
        let Some(place) = chart.place(self.hits.to_probe * p) else { return sums };
        let tolerance = p.length() * chart.cell_angle();
        let inv = 1.0 / reach as f32;
        let y = place.y - 0.5;
        for row in y.floor() as i32 + 1 - reach..=y.floor() as i32 + reach {
            if row < 0 || row >= chart.rows() as i32 {
                continue;
            }
            let wy = 1.0 - (row as f32 - y).abs() * inv;
            let range = chart.row(row as usize);
            let n = range.len() as i32;
            let x = place.x * n as f32 - 0.5;
            for column in x.floor() as i32 + 1 - reach..=x.floor() as i32 + reach {
                let wx = 1.0 - (column as f32 - x).abs() * inv;
                let column = if (0..n).contains(&column) {
                    column
                } else if chart.wraps() {
                    column.rem_euclid(n)
                } else {
                    continue;
                };
                let i = range.start + column as usize;
                let cell = &self.hits.cells[i];
                let n_cell = unpack_normal(cell.normal);
                let facing = n_cell.dot(normal);
                if (n_cell.dot(p) - cell.plane).abs() < tolerance && facing > 0.3 {
                    let light = &self.light[i];
                    let rho = Vec3::from(cell.albedo.map(f32::from)) / 65535.0;
                    let w = (wx * wy + 1e-6) * facing.powi(4) * f32::from(light.trust) / 65535.0;
                    let radiance = Vec3::from(light.radiance);
                    match light.sunlit {
                        Sunlit::No => sums.shade.record(rho, radiance, w),
                        Sunlit::Yes => sums.sun.record(rho, radiance, w),
                        Sunlit::Partly => sums.mixed.record(rho, radiance, w),
                    }
                }
            }
        }
        sums
    }

    /// The places of bright things: for every cell whose brightest channel is above `threshold`, a position and its
    /// radiance × area (m²) across the line of sight, summed over channels. A cell that sees the sky stands where the
    /// frame of its window is, as far as the nearest surface a few cells beside it.
    pub fn bright_places(&self, threshold: f32) -> Vec<(Vec3, f32)> {
        let chart = &self.hits.chart;
        let to_world = self.hits.to_probe.transpose();
        let angle = chart.cell_angle();
        let distance = |row: usize, i: usize| {
            let cell = &self.hits.cells[i];
            let d = to_world * chart.direction(row, (i - chart.row(row).start) as f32 + 0.5, row as f32 + 0.5);
            cell.is_hit().then(|| cell.plane / unpack_normal(cell.normal).dot(d))
        };
        let mut places = Vec::new();
        for row in 0..chart.rows() {
            let range = chart.row(row);
            for i in range.clone() {
                let radiance = Vec3::from(self.light[i].radiance);
                if radiance.max_element() <= threshold {
                    continue;
                }
                let reach = (1..=40).flat_map(|k| [i.checked_sub(k), Some(i + k)]).flatten();
                let beside = || reach.filter(|j| range.contains(j)).find_map(|j| distance(row, j));
                if let Some(t) = distance(row, i).or_else(beside) {
                    let d = to_world * chart.direction(row, (i - range.start) as f32 + 0.5, row as f32 + 0.5);
                    places.push((self.hits.origin + d * t, radiance.element_sum() * angle * angle * t * t));
                }
            }
        }
        places
    }

    /// Mean radiance over all cells with a surface.
    pub fn mean_radiance(&self) -> Vec3 {
        let mut sum = glam::DVec3::ZERO;
        let mut count = 0u32;
        for (light, cell) in self.light.iter().zip(&self.hits.cells) {
            if cell.is_hit() && light.trust > 0 {
                sum += Vec3::from(light.radiance).as_dvec3();
                count += 1;
            }
        }
        (sum / f64::from(count.max(1))).as_vec3()
    }

    /// How fine this probe's records are on a surface: the solid angle of a square metre of it, in steradians.
    pub fn fineness(&self, point: Vec3, normal: Vec3) -> f32 {
        let p = point - self.hits.origin;
        let d2 = p.length_squared();
        (-normal.dot(p) / (d2 * d2.sqrt())).max(0.0)
    }
}

/// The mean radiance of cell `x` of `n` in a row, from the picture's pixels that it overlaps; pixels that are not
/// finite or are negative do not count; `None` where none does.
fn row_average(picture: &Picture, row: usize, x: usize, n: usize) -> Option<Vec3> {
    let pixels = &picture.pixels[row * picture.width..][..picture.width];
    let scale = picture.width as f32 / n as f32;
    let (from, to) = (x as f32 * scale, (x + 1) as f32 * scale);
    let mut sum = Vec3::ZERO;
    let mut weight = 0.0;
    for i in from as usize..(to.ceil() as usize).min(picture.width) {
        let w = (to.min((i + 1) as f32) - from.max(i as f32)).max(0.0);
        let v = pixels[i];
        if v.is_finite() && v.min_element() >= 0.0 {
            sum += v * w;
            weight += w;
        }
    }
    (weight > 0.0).then(|| sum / weight)
}
