//! A picture as registration looks at it: log-luminance by direction, from fine to coarse.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::raster::{Raster, direction};
use crate::panorama::{Picture, Projection, luminance};
use crate::statistics::median;

/// One level of a picture.
pub(super) struct Level {
    pub(super) raster: Raster,
    /// Natural logarithm of luminance.
    pub(super) sharp: Vec<f32>,
    /// The same smoothed over neighbouring cells.
    pub(super) log: Vec<f32>,
    /// Solid angle in cells at the equator where the picture tells something, else 0.
    pub(super) weight: Vec<f32>,
}

impl Level {
    /// The level with left and right exchanged.
    pub(super) fn mirrored(&self) -> Self {
        let Raster { full, corner: [left, top], width, height, .. } = self.raster;
        let turned = |values: &[f32]| values.chunks(width).flat_map(|row| row.iter().rev().copied()).collect();
        Self {
            raster: Raster::new(full, [full - left - width, top], width, height),
            sharp: turned(&self.sharp),
            log: turned(&self.log),
            weight: turned(&self.weight),
        }
    }
}

/// Luminance below this share of the picture's median counts as this much: the logarithm must not run away.
const DARKEST: f32 = 1e-3;

/// The coarsest level's cells round the sphere.
const COARSEST: usize = 128;

/// A picture that shows less than this share of the sphere is looked at twice as finely at all levels.
const NARROW: f32 = 0.25;

/// A picture's levels, each half as fine as the one before; the last has 128 cells round the sphere, 256 for a picture that shows
/// little of it. The first has at most `finest` of them (twice as many), and not more than the picture's pixels
/// deserve. `usable` marks pixels that measure light.
pub(super) fn pyramid(
    picture: &Picture,
    usable: &dyn Fn(usize) -> bool,
    projection: &Projection,
    finest: usize,
) -> Vec<Level> {
    let (w, h) = (picture.width, picture.height);
    let native = native(projection, w, h) * 1.05;
    let shown = window(COARSEST, COARSEST, projection, w, h);
    let narrow = (shown.len() as f32) < NARROW * (COARSEST * COARSEST / 2) as f32;
    let (coarsest, finest) = if narrow { (2 * COARSEST, 2 * finest) } else { (COARSEST, finest) };
    let mut full = coarsest;
    while 2 * full <= finest && (2 * full) as f64 <= native {
        full *= 2;
    }
    let values: Vec<f32> = picture.pixels.iter().map(|p| luminance(*p)).collect();
    let good: Vec<bool> = (0..values.len()).map(|i| Picture::valid(picture.pixels[i]) && usable(i)).collect();
    let mut raster = window(full, coarsest, projection, w, h);
    let fine = (native / full as f64 * 1.5).ceil().clamp(1.0, 8.0) as usize;
    // pixel by pixel where the cells are the picture's own
    let same = *projection == Projection::LatLong && w == full && h == full / 2;
    let mut cells: Vec<(f32, f32)> = (0..raster.len())
        .into_par_iter()
        .map(|i| {
            if same {
                return if good[i] { (values[i], 1.0) } else { (0.0, 0.0) };
            }
            let (x, y) = ((raster.corner[0] + i % raster.width) as f32, (raster.corner[1] + i / raster.width) as f32);
            let (mut sum, mut count) = (0.0, 0.0);
            for k in 0..fine * fine {
                let sub = |k: usize| (k as f32 + 0.5) / fine as f32;
                let d = direction(full, x + sub(k % fine), y + sub(k / fine));
                let pixel = projection.pixel(w, h, d.as_dvec3());
                if let Some(v) = pixel.and_then(|p| bilinear(&values, &good, w, h, p)) {
                    sum += v;
                    count += 1.0;
                }
            }
            if count > 0.0 { (sum / count, count / (fine * fine) as f32) } else { (0.0, 0.0) }
        })
        .collect();
    let brightness = cells.iter().filter(|c| c.1 > 0.0).map(|c| c.0);
    let floor = median(brightness).map_or(1.0, |middle| (DARKEST * middle).max(1e-30));
    let mut levels = Vec::new();
    loop {
        let weight: Vec<f32> =
            cells.iter().enumerate().map(|(i, c)| if c.1 > 0.5 { c.1 * raster.sine(i) } else { 0.0 }).collect();
        let light: Vec<f32> = cells.iter().map(|c| c.0.max(floor)).collect();
        let sharp: Vec<f32> = light.iter().map(|l| l.ln()).collect();
        let log = raster.soften(&sharp, &weight);
        let next = (raster.full > coarsest).then(|| (raster.halved(), halved(&raster, &cells)));
        levels.push(Level { raster, sharp, log, weight });
        match next {
            Some((r, c)) => (raster, cells) = (r, c),
            None => break,
        }
    }
    levels
}

/// Cells round the sphere that are as fine as the picture's middle.
fn native(projection: &Projection, width: usize, height: usize) -> f64 {
    const STEP: f64 = 1e-3;
    let ahead = |x: f64| projection.pixel(width, height, DVec3::new(x, 1.0, 0.0).normalize());
    match (ahead(-STEP), ahead(STEP)) {
        (Some(a), Some(b)) => std::f64::consts::TAU * a.distance(b) / (2.0 * STEP),
        _ => width as f64,
    }
}

/// Means of 2 × 2 cells, by how much each tells.
fn halved(raster: &Raster, cells: &[(f32, f32)]) -> Vec<(f32, f32)> {
    let (w, h) = (raster.width / 2, raster.height / 2);
    (0..w * h)
        .map(|i| {
            let (x, y) = (2 * (i % w), 2 * (i / w));
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| cells[(y + dy) * raster.width + x + dx]);
            let share: f32 = four.iter().map(|c| c.1).sum();
            let sum: f32 = four.iter().map(|c| c.0 * c.1).sum();
            if share > 0.0 { (sum / share, share / 4.0) } else { (0.0, 0.0) }
        })
        .collect()
}

/// The window that a picture fills; its corner and size are such that windows down to the coarsest level fit.
fn window(full: usize, coarsest: usize, projection: &Projection, w: usize, h: usize) -> Raster {
    if !(projection.is_photograph() || *projection == Projection::Fisheye) {
        return Raster::sphere(full);
    }
    /// Directions round the sphere that are tried for where a picture ends.
    const LOOKED: usize = 256;
    let grid = full / coarsest;
    let coarse = Raster::sphere(LOOKED);
    let scale = full as f32 / LOOKED as f32;
    let (mut low, mut high) = ([usize::MAX; 2], [0usize; 2]);
    for (i, d) in coarse.directions.iter().enumerate() {
        if projection.pixel(w, h, d.as_dvec3()).is_some() {
            for (axis, v) in [i % coarse.width, i / coarse.width].into_iter().enumerate() {
                low[axis] = low[axis].min((v as f32 * scale) as usize);
                high[axis] = high[axis].max(((v + 1) as f32 * scale).ceil() as usize);
            }
        }
    }
    if low[0] > high[0] {
        return Raster::sphere(full);
    }
    let limit = [full, full / 2];
    let corner: [usize; 2] = std::array::from_fn(|k| low[k].saturating_sub(1) / grid * grid);
    let end: [usize; 2] = std::array::from_fn(|k| ((high[k] + 1).div_ceil(grid) * grid).min(limit[k]));
    Raster::new(full, corner, end[0] - corner[0], end[1] - corner[1])
}

/// The value at pixel coordinates from the good ones of the four nearest pixels; `None` where the nearest is not good.
fn bilinear(values: &[f32], good: &[bool], w: usize, h: usize, p: DVec2) -> Option<f32> {
    let nearest = ((p.x as usize).min(w - 1), (p.y as usize).min(h - 1));
    if !good[nearest.1 * w + nearest.0] {
        return None;
    }
    let corner = (p - 0.5).floor();
    let f = (p - 0.5 - corner).as_vec2();
    let (mut sum, mut weight) = (0.0, 0.0);
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let x = (corner.x as i64 + dx).clamp(0, w as i64 - 1) as usize;
        let y = (corner.y as i64 + dy).clamp(0, h as i64 - 1) as usize;
        let k = (1.0 - (f.x - dx as f32).abs()) * (1.0 - (f.y - dy as f32).abs());
        if good[y * w + x] && k > 0.0 {
            sum += k * values[y * w + x];
            weight += k;
        }
    }
    (weight > 0.0).then(|| sum / weight)
}

/// Log-luminance at a direction in the picture's axes, bilinear; `None` where the level tells nothing.
pub(super) fn log_at(level: &Level, d: Vec3) -> Option<f32> {
    let [x, y] = level.raster.place(d)?;
    let (x, y) = (x - 0.5, (y - 0.5).max(0.0));
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let (w, h) = (level.raster.width as isize, level.raster.height as isize);
    let column = |x: isize| if level.raster.wraps() { x.rem_euclid(w) } else { x.clamp(0, w - 1) };
    let at = |dx: isize, dy: isize| ((y0 as isize + dy).clamp(0, h - 1) * w + column(x0 as isize + dx)) as usize;
    let four = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
    if four.iter().any(|&i| level.weight[i] == 0.0) {
        return None;
    }
    let [a, b, c, d] = four.map(|i| level.log[i]);
    let (top, bottom) = (a + (b - a) * fx, c + (d - c) * fx);
    Some(top + (bottom - top) * fy)
}
