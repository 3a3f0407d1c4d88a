//! A probe as the audit asks it: radiance by direction, and what the model says it sees.

use glam::{Mat3, Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;

use crate::audit::observe::photo::DARK;
use crate::panorama::{Coding, Picture, latlong, latlong_pixel_fast, neighbours};
use crate::scene::Scene;
use crate::site::Probe;

/// A pixel counts as at least this share of its height wide.
const NARROWEST: f32 = 0.05;

/// A probe's picture and what the model has in front of it.
pub(crate) struct ProbeView {
    pub(crate) name: String,
    /// Local metres.
    pub(crate) origin: Vec3,
    to_probe: Mat3,
    directions: Directions,
    /// The logarithm of radiance, and averaged 2 × 2, 4 × 4, …; NaN where the picture shows nothing valid.
    levels: Vec<Shown<Vec3>>,
    /// Distance to the model through each pixel's middle; infinite where there is none.
    depth: Shown<f32>,
}

/// A latitude/longitude map of which only the rows and columns are kept that show something: a photograph shows a small part of all
/// directions.
struct Shown<T> {
    width: usize,
    height: usize,
    /// First column and row, and how many of each; columns go on at the map's left end.
    from: [usize; 2],
    size: [usize; 2],
    values: Vec<T>,
    nothing: T,
}

/// How a probe sees a point of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sight {
    /// Width of a pixel on the surface, metres: the root of its area.
    pub(crate) footprint: f32,
}

impl ProbeView {
    /// Takes a probe's picture and casts a ray through each of its pixels that shows something.
    pub(crate) fn new(scene: &Scene, probe: &Probe, mut picture: Picture) -> Self {
        // clipped values are taken as they stand
        probe.radiometry(Coding::Linear).develop(&mut picture);
        let picture = latlong(picture, probe.projection);
        let (mut sum, mut count) = (0.0f64, 0u32);
        for p in picture.pixels.iter().filter(|p| Picture::valid(**p)) {
            sum += f64::from(p.element_sum() / 3.0);
            count += 1;
        }
        // the logarithm must not run away
        let floor = (DARK * (sum / f64::from(count.max(1))) as f32).max(1e-30);
        let log = |p: Vec3| if Picture::valid(p) { p.max(Vec3::splat(floor)).map(f32::ln) } else { Vec3::NAN };
        let (width, height) = (picture.width, picture.height);
        let kept = |width: usize, height: usize, pixels: &[Vec3]| {
            let shown = |i: usize| Picture::valid(pixels[i]);
            Shown::of(width, height, Vec3::NAN, shown, |i| log(pixels[i]))
        };
        let mut levels = vec![kept(width, height, &picture.pixels)];
        let (mut w, mut h, mut pixels) = (width, height, picture.pixels);
        while levels.len() < 4 && w >= 32 && h >= 32 {
            (w, h, pixels) = halved(w, h, &pixels);
            levels.push(kept(w, h, &pixels));
        }
        let origin = scene.local(probe.pose.position);
        let to_world = probe.pose.rotation.as_mat3();
        let directions = Directions::new(width, height);
        let fine = &levels[0];
        let mut depth = fine.with(f32::INFINITY);
        depth.values.par_chunks_mut(fine.size[0].max(1)).enumerate().for_each(|(row, depth)| {
            let shown: Vec<usize> =
                (0..depth.len()).filter(|k| !fine.values[row * fine.size[0] + k].is_nan()).collect();
            let column = |k: usize| (fine.from[0] + k) % width;
            let rays: Vec<Vec3> =
                shown.iter().map(|&k| to_world * directions.of(column(k), fine.from[1] + row)).collect();
            let mut hits = vec![None; rays.len()];
            scene.tracer.closest_packet(origin, &rays, 1e-3, &mut hits);
            for (k, hit) in shown.into_iter().zip(hits) {
                depth[k] = hit.map_or(f32::INFINITY, |hit| hit.t);
            }
        });
        Self { name: probe.name.clone(), origin, to_probe: to_world.transpose(), directions, levels, depth }
    }

    /// The brightest light in its picture, over 4 × 4 pixels.
    pub(crate) fn brightest(&self) -> Vec3 {
        let level = &self.levels[2.min(self.levels.len() - 1)];
        let valid = level.values.iter().filter(|l| l.is_finite());
        valid.fold(Vec3::ZERO, |m, l| if l.element_sum().exp() > m.element_product() { l.map(f32::exp) } else { m })
    }

    /// Angle of a pixel, radians.
    pub(crate) fn pixel_angle(&self) -> f32 {
        PI / self.levels[0].height as f32
    }

    /// Along which directions a pixel around this unit direction is wide and high, as lengths of its height: rows near a
    /// pole have narrow pixels.
    pub(crate) fn pixel_sides(&self, direction: Vec3) -> (Vec3, Vec3) {
        let across = (self.to_probe.transpose() * Vec3::Z).cross(direction);
        let sin = across.length();
        if sin < NARROWEST {
            let (right, up) = direction.any_orthonormal_pair();
            return (right * NARROWEST, up);
        }
        (across, direction.cross(across) / sin)
    }

    /// Logarithm of the radiance that came from a point, averaged over 2ˡ pixels; NaN where the picture shows none.
    #[inline]
    pub(crate) fn log_radiance(&self, point: Vec3, level: usize) -> Vec3 {
        let level = &self.levels[level.min(self.levels.len() - 1)];
        let d = self.to_probe * (point - self.origin);
        let at = latlong_pixel_fast(d, level.width as f32, level.height as f32);
        level.bilinear(at)
    }

    /// Whether the model has nothing between the probe and a point, which need not be on a surface.
    pub(crate) fn open(&self, point: Vec3) -> bool {
        let p = point - self.origin;
        let (w, h) = (self.levels[0].width, self.levels[0].height);
        let at = latlong_pixel_fast(self.to_probe * p, w as f32, h as f32);
        let (x, y) = ((at.x.max(0.0) as usize).min(w - 1), (at.y.max(0.0) as usize).min(h - 1));
        self.depth.at(x, y) > 0.98 * p.length()
    }

    /// Radiance that the probe saw coming from a point that nothing hides from it, over 4 × 4 pixels.
    pub(crate) fn light_of(&self, point: Vec3) -> Option<Vec3> {
        let log = if self.open(point) { self.log_radiance(point, 2) } else { Vec3::NAN };
        log.is_finite().then(|| log.map(f32::exp))
    }

    /// How the probe sees a point with this normal, if the model puts nothing else in front of or beside it within a
    /// pixel and a half.
    pub(crate) fn sight(&self, point: Vec3, normal: Vec3) -> Option<Sight> {
        let p = point - self.origin;
        let distance = p.length();
        let plane = normal.dot(p);
        let cos = -plane / distance;
        if cos.is_nan() || cos < 0.12 {
            return None;
        }
        let (w, h) = (self.levels[0].width, self.levels[0].height);
        let at = latlong_pixel_fast(self.to_probe * p, w as f32, h as f32);
        let footprint = distance * self.pixel_angle() / cos.sqrt();
        let tolerance = 0.6 * distance * self.pixel_angle() / cos + 2e-3;
        let (cx, cy) = (at.x as isize, at.y as isize);
        let to_world = self.to_probe.transpose();
        for dy in -1..=1 {
            for dx in -1..=1 {
                let y = cy + dy;
                if y < 0 || y >= h as isize {
                    continue;
                }
                let x = (cx + dx).rem_euclid(w as isize) as usize;
                let d = to_world * self.directions.of(x, y as usize);
                let along = normal.dot(d);
                let expected = if along < -0.03 { plane / along } else { return None };
                if (self.depth.at(x, y as usize) - expected).abs() > tolerance * (expected / distance).max(1.0) {
                    return None;
                }
            }
        }
        Some(Sight { footprint })
    }
}

impl<T: Copy> Shown<T> {
    /// Of a map that shows something where `shown` says so, by the pixels' indices.
    fn of(width: usize, height: usize, nothing: T, shown: impl Fn(usize) -> bool, value: impl Fn(usize) -> T) -> Self {
        let mut columns = vec![false; width];
        let (mut top, mut bottom) = (height, 0);
        for i in (0..width * height).filter(|i| shown(*i)) {
            columns[i % width] = true;
            (top, bottom) = (top.min(i / width), bottom.max(i / width + 1));
        }
        let (first, across) = around(&columns);
        let (from, size) = ([first, top], [across, bottom.saturating_sub(top)]);
        let pixel = |k: usize| (top + k / across) * width + (first + k % across) % width;
        let values = (0..size[0] * size[1]).map(|k| value(pixel(k))).collect();
        Self { width, height, from, size, values, nothing }
    }

    /// The same pixels with another value.
    fn with<U: Copy>(&self, value: U) -> Shown<U> {
        let Self { width, height, from, size, .. } = *self;
        Shown { width, height, from, size, values: vec![value; self.values.len()], nothing: value }
    }

    #[inline]
    fn at(&self, x: usize, y: usize) -> T {
        let column = if x >= self.from[0] { x - self.from[0] } else { x + self.width - self.from[0] };
        let row = y.wrapping_sub(self.from[1]);
        if column < self.size[0] && row < self.size[1] {
            self.values[row * self.size[0] + column]
        } else {
            self.nothing
        }
    }
}

impl Shown<Vec3> {
    fn bilinear(&self, at: Vec2) -> Vec3 {
        let ([top, bottom], fraction) = neighbours(self.width, self.height, at);
        let at = |[x, y]: [usize; 2]| self.at(x, y);
        let between = |[left, right]: [[usize; 2]; 2]| at(left) + (at(right) - at(left)) * fraction.x;
        let (top, bottom) = (between(top), between(bottom));
        top + (bottom - top) * fraction.y
    }
}

/// The shortest run of columns, around the end and on at the start, that holds all that show something: its first and its length.
fn around(columns: &[bool]) -> (usize, usize) {
    let shown: Vec<usize> = (0..columns.len()).filter(|x| columns[*x]).collect();
    let (Some(first), Some(last)) = (shown.first(), shown.last()) else { return (0, 0) };
    // what is left out is the widest gap between two
    let gaps = shown.windows(2).map(|w| (w[1] - w[0], w[1]));
    let end = (first + columns.len() - last, *first);
    let (gap, from) = gaps.fold(end, |widest, gap| if gap.0 > widest.0 { gap } else { widest });
    (from, columns.len() + 1 - gap)
}

/// Unit directions of the middles of pixels in the probe's axes.
struct Directions {
    /// Per column and per row the sine and the cosine of its longitude, or of its angle from above.
    columns: Vec<(f32, f32)>,
    rows: Vec<(f32, f32)>,
}

impl Directions {
    fn new(width: usize, height: usize) -> Self {
        let at = |i: usize, of: usize| (i as f32 + 0.5) / of as f32;
        Self {
            columns: (0..width).map(|x| ((at(x, width) - 0.5) * 2.0 * PI).sin_cos()).collect(),
            rows: (0..height).map(|y| (at(y, height) * PI).sin_cos()).collect(),
        }
    }

    #[inline]
    fn of(&self, x: usize, y: usize) -> Vec3 {
        let ((sin_phi, cos_phi), (sin_theta, cos_theta)) = (self.columns[x], self.rows[y]);
        Vec3::new(sin_theta * sin_phi, sin_theta * cos_phi, cos_theta)
    }
}

/// Means of 2 × 2 pixels; invalid ones spoil theirs.
fn halved(width: usize, height: usize, pixels: &[Vec3]) -> (usize, usize, Vec<Vec3>) {
    let (w, h) = (width / 2, height / 2);
    let at = |x: usize, y: usize| pixels[y * width + x];
    let mean = |i: usize| {
        let (x, y) = (2 * (i % w), 2 * (i / w));
        (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)) * 0.25
    };
    (w, h, (0..w * h).map(mean).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_map_shows_is_kept_and_nothing_else() {
        let run = |shown: &[usize]| around(&(0..10).map(|x| shown.contains(&x)).collect::<Vec<_>>());
        assert_eq!((run(&[]), run(&[3]), run(&[2, 3, 5])), ((0, 0), (3, 1), (2, 4)));
        assert_eq!((run(&[9, 0, 1]), run(&[0, 9])), ((9, 3), (9, 2)));
        assert_eq!(run(&(0..10).collect::<Vec<_>>()), (0, 10));
        for shown in [vec![(8, 1), (9, 2), (1, 2)], vec![(4, 0), (5, 3)], vec![]] {
            let is_shown = |i: usize| shown.contains(&(i % 10, i / 10));
            let map = Shown::of(10, 4, usize::MAX, is_shown, |i| i);
            assert!(map.values.len() <= 8, "{}", map.values.len());
            for i in (0..40).filter(|i| is_shown(*i)) {
                assert_eq!(map.at(i % 10, i / 10), i);
            }
            let beyond = (0..40).filter(|i| map.at(i % 10, i / 10) == usize::MAX).count();
            assert_eq!(beyond, 40 - map.values.len());
        }
    }
}
