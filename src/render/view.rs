//! Casts a camera's rays and has what they find shaded.

use glam::Vec3;
use rayon::prelude::*;
use std::time::Instant;

use super::frame::{Frame, Pixel};
use super::rays::Cast;
use super::shade::Shader;
use super::{Irradiance, PrimaryRays};
use crate::scene::{Ray, Scene};
use crate::shoot::Light;
use crate::site::Camera;

/// Nearer surfaces are not shown, metres: a lens that touches a wall.
const NEAREST_M: f32 = 1e-3;

/// Rows of pixels whose rays are cast before any of them is shaded.
const BAND: usize = 128;

/// Rows that are shaded together.
const STRIP: usize = 16;

/// Rays that are cast together.
const PACKET: usize = 64;

/// Sides of the tiles of pixels whose rays make a packet, greatest first.
const TILE_SIDES: [usize; 4] = [8, 4, 2, 1];

/// Renders a view with so many samples a pixel (box filter); black where its lens shows nothing. Rows of `done` so far
/// and in all are told to `progress`.
pub fn render(
    scene: &Scene,
    relit: &dyn Irradiance,
    camera: &Camera,
    samples: u32,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Frame {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let rays = PrimaryRays::new(camera, samples);
    let origin = scene.local(camera.pose.position);
    let n = rays.offsets.len();
    let mut frame = Frame::new(width, height);
    // a band at a time: what shading needs of a pixel is as large as what is kept of it
    let mut band = vec![Pixel::default(); width * BAND.min(height)];
    let mut casts = vec![Cast::default(); band.len() * n];
    let (mut surface, mut recorded) = (0u64, 0u64);
    for top in (0..height).step_by(BAND) {
        let pixels = &mut band[..width * BAND.min(height - top)];
        let casts = &mut casts[..pixels.len() * n];
        let start = Instant::now();
        cast_band(scene, &rays, origin, width, top, casts);
        frame.rays_s += start.elapsed().as_secs_f64();
        let start = Instant::now();
        let shader = || Shader::new(scene, relit, &rays, camera);
        let strips = pixels.par_chunks_mut(STRIP * width).zip(casts.par_chunks(STRIP * width * n));
        strips.enumerate().for_each_init(shader, |shader, (strip, (pixels, casts))| {
            shader.strip(casts, top + strip * STRIP, pixels);
        });
        surface += pixels.iter().map(|p| u64::from(p.surface)).sum::<u64>();
        recorded += pixels.iter().map(|p| u64::from(p.recorded)).sum::<u64>();
        frame.extend(pixels);
        frame.shade_s += start.elapsed().as_secs_f64();
        progress((top + BAND).min(height) as u64, height as u64);
    }
    if surface > 0 {
        frame.covered_fraction = recorded as f64 / surface as f64;
    }
    frame
}

/// What the ray through the middle of each of a camera's pixels meets first.
pub(crate) fn first_hits(scene: &Scene, camera: &Camera) -> Vec<Cast> {
    let width = camera.width as usize;
    let mut casts = vec![Cast::default(); width * camera.height as usize];
    cast_band(scene, &PrimaryRays::new(camera, 1), scene.local(camera.pose.position), width, 0, &mut casts);
    casts
}

/// Casts the rays of a band of rows, a pixel's samples next to each other.
fn cast_band(scene: &Scene, rays: &PrimaryRays, origin: Vec3, width: usize, top: usize, casts: &mut [Cast]) {
    let n = rays.offsets.len();
    // packets want rays that stay together: square tiles of pixels, each pixel's samples in a row
    let side = TILE_SIDES.into_iter().find(|s| s * s * n <= PACKET).unwrap_or(1);
    casts.par_chunks_mut(width * n * side).enumerate().for_each_init(
        Vec::new,
        |directions: &mut Vec<Vec3>, (i, casts)| {
            let tall = casts.len() / (width * n);
            let mut found = [None; PACKET];
            for left in (0..width).step_by(side) {
                let wide = side.min(width - left);
                directions.clear();
                for y in 0..tall {
                    for x in left..left + wide {
                        directions.extend((0..n).map(|sample| rays.direction(x, top + i * side + y, sample)));
                    }
                }
                for (chunk, directions) in directions.chunks(PACKET).enumerate() {
                    let found = &mut found[..directions.len()];
                    found.fill(None);
                    scene.tracer.closest_packet(origin, directions, NEAREST_M, found);
                    for (k, (&direction, &hit)) in directions.iter().zip(&*found).enumerate() {
                        let (pixel, sample) = ((chunk * PACKET + k) / n, (chunk * PACKET + k) % n);
                        casts[((pixel / wide) * width + left + pixel % wide) * n + sample] = Cast { direction, hit };
                    }
                }
            }
        },
    );
}

/// The surface points (position, normal) that cameras show on a coarse grid of pixels; without those that the probes
/// of `seen` see, where that is given.
pub fn shown_points(scene: &Scene, seen: Option<&Light>, cameras: &[Camera]) -> Vec<(Vec3, Vec3)> {
    /// Points along a picture's longer side.
    const ALONG: usize = 256;
    /// Points along the side of a tile.
    const TILE: usize = 8;
    let look = |camera: &Camera| -> Vec<(Vec3, Vec3)> {
        let rays = PrimaryRays::new(camera, 1);
        let origin = scene.local(camera.pose.position);
        let (width, height) = (camera.width as usize, camera.height as usize);
        let step = width.max(height).div_ceil(ALONG);
        let lines = |side: usize| (step / 2..side).step_by(step).collect::<Vec<_>>();
        let (columns, rows) = (lines(width), lines(height));
        rows.par_chunks(TILE)
            .flat_map_iter(|rows| {
                let rays = &rays;
                columns.chunks(TILE).flat_map(move |columns| {
                    let places = rows.iter().flat_map(|&y| columns.iter().map(move |&x| (x, y)));
                    let places = places.filter(|&(x, y)| camera.shows(x as f64 + 0.5, y as f64 + 0.5));
                    let directions: Vec<Vec3> = places.map(|(x, y)| rays.direction(x, y, 0)).collect();
                    let mut hits = vec![None; directions.len()];
                    scene.tracer.closest_packet(origin, &directions, NEAREST_M, &mut hits);
                    directions.into_iter().zip(hits).filter_map(move |(direction, hit)| {
                        let s = scene.surface(&Ray { origin, direction }, &hit?);
                        let unseen = seen.is_none_or(|light| light.observe(scene, s.position, s.normal).is_none());
                        unseen.then_some((s.position, s.normal))
                    })
                })
            })
            .collect()
    };
    cameras.iter().flat_map(look).collect()
}
