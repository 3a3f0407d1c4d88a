//! A probe as the audit asks it: radiance by direction, and what the model says it sees.

use glam::{Mat3, Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;

use crate::panorama::{Coding, Picture, latlong, latlong_pixel_fast, neighbours};
use crate::scene::Scene;
use crate::site::Probe;

/// Radiance below this share of a probe's mean counts as this much: the logarithm must not run away.
const DARKEST: f32 = 1e-4;

/// A pixel counts as at least this share of its height wide.
const NARROWEST: f32 = 0.05;

/// A probe's picture and what the model has in front of it.
pub(crate) struct ProbeView {
    pub(crate) name: String,
    /// Local metres.
    pub(crate) origin: Vec3,
    to_probe: Mat3,
    directions: Directions,
    /// The logarithm of radiance, and averaged 2 × 2, 4 × 4, …
    levels: Vec<Level>,
    /// Distance to the model through each pixel's middle; infinite where there is none.
    depth: Vec<f32>,
}

struct Level {
    width: usize,
    height: usize,
    /// NaN where the picture shows nothing valid.
    log: Vec<Vec3>,
}

/// How a probe sees a point of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sight {
    /// Distance, metres.
    pub(crate) distance: f32,
    /// Width of a pixel on the surface, metres: the root of its area.
    pub(crate) footprint: f32,
}

impl ProbeView {
    /// Takes a probe's picture and casts a ray through each of its pixels that shows something.
    pub(crate) fn new(scene: &Scene, probe: &Probe, picture: &Picture) -> Self {
        let mut light = picture.clone();
        // clipped values are taken as they stand
        probe.radiometry(Coding::Linear).develop(&mut light);
        let picture = latlong(light, probe.projection);
        let (mut sum, mut count) = (0.0f64, 0u32);
        for p in picture.pixels.iter().filter(|p| Picture::valid(**p)) {
            sum += f64::from(p.element_sum() / 3.0);
            count += 1;
        }
        let floor = (DARKEST * (sum / f64::from(count.max(1))) as f32).max(1e-30);
        let mut levels = vec![(picture.width, picture.height, picture.pixels)];
        while levels.len() < 4 && levels[levels.len() - 1].0 >= 32 && levels[levels.len() - 1].1 >= 32 {
            let last = &levels[levels.len() - 1];
            levels.push(halved(last.0, last.1, &last.2));
        }
        let log = |p: &Vec3| {
            if Picture::valid(*p) { p.max(Vec3::splat(floor)).map(f32::ln) } else { Vec3::NAN }
        };
        let levels: Vec<Level> = levels
            .into_iter()
            .map(|(width, height, pixels)| Level { width, height, log: pixels.iter().map(log).collect() })
            .collect();
        let origin = scene.local(probe.pose.position);
        let to_world = probe.pose.rotation.as_mat3();
        let (width, height) = (levels[0].width, levels[0].height);
        let directions = Directions::new(width, height);
        let mut depth = vec![f32::INFINITY; width * height];
        depth.par_chunks_mut(width).enumerate().for_each(|(y, depth)| {
            let shown: Vec<usize> = (0..width).filter(|x| !levels[0].log[y * width + x].is_nan()).collect();
            let rays: Vec<Vec3> = shown.iter().map(|&x| to_world * directions.of(x, y)).collect();
            let mut hits = vec![None; rays.len()];
            scene.tracer.closest_packet(origin, &rays, 1e-3, &mut hits);
            for (x, hit) in shown.into_iter().zip(hits) {
                depth[x] = hit.map_or(f32::INFINITY, |hit| hit.t);
            }
        });
        Self { name: probe.name.clone(), origin, to_probe: to_world.transpose(), directions, levels, depth }
    }

    /// The brightest light in its picture, over 4 × 4 pixels.
    pub(crate) fn brightest(&self) -> Vec3 {
        let level = &self.levels[2.min(self.levels.len() - 1)];
        let valid = level.log.iter().filter(|l| l.is_finite());
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
        self.depth[y * w + x] > 0.98 * p.length()
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
                let i = y as usize * w + x;
                let d = to_world * self.directions.of(x, y as usize);
                let along = normal.dot(d);
                let expected = if along < -0.03 { plane / along } else { return None };
                if (self.depth[i] - expected).abs() > tolerance * (expected / distance).max(1.0) {
                    return None;
                }
            }
        }
        Some(Sight { distance, footprint })
    }
}

impl Level {
    fn bilinear(&self, at: Vec2) -> Vec3 {
        let ([top, bottom], fraction) = neighbours(self.width, self.height, at);
        let at = |[x, y]: [usize; 2]| self.log[y * self.width + x];
        let between = |[left, right]: [[usize; 2]; 2]| at(left) + (at(right) - at(left)) * fraction.x;
        let (top, bottom) = (between(top), between(bottom));
        top + (bottom - top) * fraction.y
    }
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
