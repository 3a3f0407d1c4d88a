//! Pictures by path tracing: cameras and panoramas, tile by tile, sample by sample.

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU64, Ordering};

use super::estimate::Estimate;
use super::lights::Lights;
use super::path::{Paths, Strategy};
use super::random::Sampler;
use crate::scene::{Ray, Scene};
use crate::site::{Camera, Pose};

/// Side of the tiles that are handed to threads, in pixels.
const TILE: usize = 16;

/// Most samples that are stratified together.
const MAX_BLOCK: u32 = 1024;

/// Pixels of irradiance probes and of pictures must not share random numbers.
const IRRADIANCE_STREAM: u64 = 1 << 40;

/// How to trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceSettings {
    /// Samples a pixel, both halves together; odd numbers count as the next even one.
    pub samples: u32,
    /// Bounces after which a path is cut off. This is the only bias: a closed room of albedo ρ loses the share ρⁿ of
    /// its light, 3·10⁻⁵ at ρ = 0.99 and n = 1024.
    pub max_bounces: u32,
    /// Another seed, other noise.
    pub seed: u64,
    /// Which ways to find the lights count.
    pub strategy: Strategy,
}

impl Default for ReferenceSettings {
    fn default() -> Self {
        Self { samples: 64, max_bounces: 1024, seed: 0, strategy: Strategy::Both }
    }
}

/// Told how many of how many parts are done; may stop the work by `ControlFlow::Break`.
pub type Progress<'a> = dyn Fn(u64, u64) -> ControlFlow<()> + Sync + 'a;

/// The work was stopped by its [`Progress`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped before the picture was done")]
pub struct Stopped;

/// Where the rays of a picture start and look.
#[derive(Clone, Copy, Debug)]
pub enum Eye {
    /// A camera; a pixel is the mean over its square (box filter).
    Camera(Camera),
    /// A latitude/longitude panorama; a pixel is the mean over its solid angle.
    Panorama {
        /// Where it stands and looks.
        pose: Pose,
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
    },
}

impl Eye {
    /// Width and height in pixels.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Self::Camera(camera) => (camera.width as usize, camera.height as usize),
            Self::Panorama { width, height, .. } => (*width, *height),
        }
    }

    fn position(&self) -> DVec3 {
        match self {
            Self::Camera(camera) => camera.pose.position,
            Self::Panorama { pose, .. } => pose.position,
        }
    }

    /// A direction within pixel (x, y); `u` in the unit square.
    fn direction(&self, x: usize, y: usize, u: Vec2) -> Vec3 {
        let u = u.as_dvec2();
        match self {
            Self::Camera(camera) => camera.direction(x as f64 + u.x, y as f64 + u.y).as_vec3(),
            Self::Panorama { pose, width, height } => {
                // Uniform over the solid angle: uniform in longitude and in the cosine of the polar angle
                let polar = |row: usize| (row as f64 / *height as f64 * PI).cos();
                let z = polar(y) + (polar(y + 1) - polar(y)) * u.y;
                let (sin, cos) = (((x as f64 + u.x) / *width as f64 - 0.5) * TAU).sin_cos();
                let r = (1.0 - z * z).max(0.0).sqrt();
                (pose.rotation * DVec3::new(r * sin, r * cos, z)).as_vec3().normalize()
            }
        }
    }
}

/// Path-traces what an eye sees.
pub fn trace(scene: &Scene, lights: &Lights, eye: &Eye, settings: &ReferenceSettings) -> Estimate {
    let (width, height) = eye.size();
    let mut estimate = Estimate::new(width, height);
    // nobody stops it
    let _ = add_samples(scene, lights, eye, settings, &mut estimate, &|_, _| ControlFlow::Continue(()));
    estimate
}

/// Adds `settings.samples` samples a pixel to an estimate of the same eye, as if it had had them from the start.
///
/// The sum is the same, bit for bit, on any number of threads.
///
/// # Errors
/// [`Stopped`] when `progress` says so; the estimate is left as it was.
///
/// # Panics
/// When the estimate is of another size than the eye.
pub fn add_samples(
    scene: &Scene,
    lights: &Lights,
    eye: &Eye,
    settings: &ReferenceSettings,
    estimate: &mut Estimate,
    progress: &Progress,
) -> Result<(), Stopped> {
    let (width, height) = eye.size();
    assert_eq!((width, height), (estimate.width, estimate.height), "an estimate of another picture");
    let paths = Paths { scene, lights, max_bounces: settings.max_bounces, strategy: settings.strategy };
    let origin = scene.local(eye.position());
    let samples = settings.samples.div_ceil(2);
    let block = block(samples);
    let indices = estimate.samples_per_half..estimate.samples_per_half + samples;
    let tiles: Vec<(usize, usize)> =
        (0..height).step_by(TILE).flat_map(|y| (0..width).step_by(TILE).map(move |x| (x, y))).collect();
    let done = AtomicU64::new(0);

    let traced: Result<Vec<(Vec<_>, u64)>, Stopped> = tiles
        .par_iter()
        .map(|&(x0, y0)| {
            let mut rays = 0;
            let mut sums = Vec::with_capacity(TILE * TILE);
            for (x, y) in tile(x0, y0, width, height) {
                let mut pixel = [DVec3::ZERO; 2];
                for (half, sum) in pixel.iter_mut().enumerate() {
                    let seed = settings.seed.wrapping_mul(2).wrapping_add(half as u64);
                    for index in indices.clone() {
                        let sampler = Sampler::new(seed, (y * width + x) as u64, index, block);
                        let ray = Ray { origin, direction: eye.direction(x, y, sampler.pair(0)) };
                        *sum += paths.radiance(ray, &sampler, &mut rays).as_dvec3();
                    }
                }
                sums.push(pixel);
            }
            match progress(done.fetch_add(1, Ordering::Relaxed) + 1, tiles.len() as u64) {
                ControlFlow::Continue(()) => Ok((sums, rays)),
                ControlFlow::Break(()) => Err(Stopped),
            }
        })
        .collect();

    for (&(x0, y0), (sums, rays)) in tiles.iter().zip(&traced?) {
        estimate.rays += rays;
        for ((x, y), pixel) in tile(x0, y0, width, height).zip(sums) {
            estimate.pixels[y * width + x].iter_mut().zip(pixel).for_each(|(sum, more)| *sum += *more);
        }
    }
    estimate.samples_per_half += samples;
    Ok(())
}

/// How many samples are stratified together when `samples` are taken.
fn block(samples: u32) -> u32 {
    (1 << samples.max(1).ilog2()).min(MAX_BLOCK)
}

/// The pixels of a tile, row by row.
fn tile(x0: usize, y0: usize, width: usize, height: usize) -> impl Iterator<Item = (usize, usize)> {
    let xs = x0..(x0 + TILE).min(width);
    (y0..(y0 + TILE).min(height)).flat_map(move |y| xs.clone().map(move |x| (x, y)))
}

/// Irradiance at a point (local metres) on the side that the unit vector `normal` points to, W/m² in the site's units of
/// light: mean over `settings.samples` samples, and its standard error per channel.
pub fn irradiance(
    scene: &Scene,
    lights: &Lights,
    point: Vec3,
    normal: Vec3,
    settings: &ReferenceSettings,
) -> (Vec3, Vec3) {
    let paths = Paths { scene, lights, max_bounces: settings.max_bounces, strategy: settings.strategy };
    let n = settings.samples.max(2);
    let block = block(n);
    let (mut sum, mut square) = (DVec3::ZERO, DVec3::ZERO);
    for index in 0..n {
        let sampler = Sampler::new(settings.seed, IRRADIANCE_STREAM, index, block);
        let e = paths.irradiance(point, normal, &sampler, &mut 0).as_dvec3();
        (sum, square) = (sum + e, square + e * e);
    }
    let n = f64::from(n);
    let mean = sum / n;
    let variance = ((square / n - mean * mean) / (n - 1.0)).max(DVec3::ZERO);
    (mean.as_vec3(), variance.map(f64::sqrt).as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::Sky;
    use crate::scene::testing::{boxes, grey};

    #[test]
    fn any_seed_will_do() {
        let scene = grey(boxes(&[(Vec3::ZERO, Vec3::ONE)]), 0.5);
        let lights = Lights::new(&scene, Some(Sky::Uniform(Vec3::ONE)), None);
        let eye = Eye::Panorama { pose: Pose::look_at(DVec3::splat(0.5), DVec3::ONE), width: 2, height: 1 };
        for seed in [1 << 63, u64::MAX] {
            let settings = ReferenceSettings { samples: 2, seed, ..ReferenceSettings::default() };
            assert_eq!(trace(&scene, &lights, &eye, &settings).samples(), 2);
        }
    }
}
