//! Relights a view.

use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::PI;
use std::time::Instant;

use super::frame::{Frame, Pixel};
use super::{PrimaryRays, Source};
use crate::scene::{Face, Hit, Paint, Ray, Scene, Surface};
use crate::shoot::Light;
use crate::site::Camera;
use crate::volume::{Nearby, Volume};

/// Nearer surfaces are not shown, metres: a lens that touches a wall.
const NEAREST_M: f32 = 1e-3;

/// Rows of pixels whose rays are cast before any of them is shaded.
const BAND: usize = 64;

/// Rays that are cast together.
const PACKET: usize = 64;

/// Sides of the tiles of pixels whose rays make a packet, greatest first.
const TILE_SIDES: [usize; 4] = [8, 4, 2, 1];

/// What tells irradiance on surfaces, and the radiance behind windows.
pub trait Irradiance: Sync {
    /// Irradiance that several samples of one surface share, each at its own place: calls `put(sample, irradiance)` for
    /// every one of `positions`. Returns where it came from and how far probes agree (0..=1).
    fn irradiance(
        &self,
        normal: Vec3,
        positions: &[Vec3],
        scratch: &mut Nearby,
        put: &mut dyn FnMut(usize, Vec3),
    ) -> (Source, f32);

    /// Radiance of the sky.
    fn sky(&self, direction: Vec3) -> Vec3;

    /// Whether a sample's albedo is averaged over what its pencil of rays sees, or taken at one point.
    fn filters_albedo(&self) -> bool {
        true
    }
}

/// A scene lit by records and, where they end, by a volume.
pub struct Relit<'a> {
    /// The model.
    pub scene: &'a Scene,
    /// The probes' light.
    pub light: &'a Light,
    /// Light where no probe sees; `None` where that is not needed.
    pub volume: Option<&'a Volume<'a>>,
    /// Takes all light from the volume, none from records: to see what the volume alone is worth.
    pub volume_only: bool,
}

impl Irradiance for Relit<'_> {
    fn irradiance(
        &self,
        normal: Vec3,
        positions: &[Vec3],
        scratch: &mut Nearby,
        put: &mut dyn FnMut(usize, Vec3),
    ) -> (Source, f32) {
        let (scene, light) = (self.scene, self.light);
        let middle = positions.iter().sum::<Vec3>() / positions.len() as f32;
        let mut agreement = 1.0;
        if !self.volume_only
            && let Some(o) = light.observe(scene, middle, normal)
        {
            agreement = o.agreement();
            let cos = light.sun_cosine(normal);
            let mut left = 0;
            match light.sunlit(&o) {
                Some(in_sun) => match light.resolve(&o, in_sun, cos) {
                    Some(e) => (0..positions.len()).for_each(|i| put(i, e)),
                    None => left = positions.len(),
                },
                None => {
                    let (shade, sun) = (light.resolve(&o, false, cos), light.resolve(&o, true, cos));
                    let lit = InSun::new(positions, |p| light.sun_reaches(scene, p, normal));
                    for (i, &p) in positions.iter().enumerate() {
                        let e = if lit.at(i) { sun } else { shade };
                        match e {
                            Some(e) => put(i, e),
                            None => {
                                left += 1;
                                put(i, self.unseen(p, normal, scratch));
                            }
                        }
                    }
                    return (if left > positions.len() / 2 { Source::Volume } else { Source::Record }, agreement);
                }
            }
            if left == 0 {
                return (Source::Record, agreement);
            }
        }
        if self.volume.is_none() {
            let e = light.glimpse(scene, middle, normal).unwrap_or_default();
            (0..positions.len()).for_each(|i| put(i, e));
            return (Source::Record, agreement);
        }
        let indirect = self.unseen(middle, normal, scratch);
        let direct = light.unshadowed_sun(normal);
        let lit = InSun::new(positions, |p| direct != Vec3::ZERO && light.sun_reaches(scene, p, normal));
        for i in 0..positions.len() {
            put(i, if lit.at(i) { indirect + direct } else { indirect });
        }
        (Source::Volume, agreement)
    }

    fn sky(&self, direction: Vec3) -> Vec3 {
        self.light.sky(direction)
    }
}

impl Relit<'_> {
    /// Irradiance without direct sun where no record tells.
    fn unseen(&self, point: Vec3, normal: Vec3, scratch: &mut Nearby) -> Vec3 {
        let Some(volume) = self.volume else {
            return self.light.glimpse(self.scene, point, normal).unwrap_or_default();
        };
        volume
            .irradiance(self.scene, point, normal, scratch)
            .or_else(|| self.light.glimpse(self.scene, point, normal).filter(|_| self.light.sun.is_none()))
            .unwrap_or_else(|| volume.gather(self.scene, self.light, point, normal, scratch))
    }
}

/// Which of several points close together the sun reaches.
enum InSun {
    All(bool),
    Each(Vec<bool>),
}

impl InSun {
    /// Asks of a few points, spread evenly; only where they disagree of all.
    fn new(points: &[Vec3], reaches: impl Fn(Vec3) -> bool) -> Self {
        const ASKED: usize = 4;
        let last = points.len() - 1;
        let first = reaches(points[0]);
        if (1..ASKED).all(|k| reaches(points[k * last / (ASKED - 1)]) == first) {
            return Self::All(first);
        }
        Self::Each(points.iter().map(|&p| reaches(p)).collect())
    }

    fn at(&self, point: usize) -> bool {
        match self {
            Self::All(lit) => *lit,
            Self::Each(lit) => lit[point],
        }
    }
}

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
    let (mut rays_s, mut shade_s) = (0.0, 0.0);
    let mut pixels = vec![Pixel::default(); width * height];
    let mut hits = vec![None; width * BAND.min(height) * n];
    for (band, pixels) in pixels.chunks_mut(BAND * width).enumerate() {
        let top = band * BAND;
        let hits = &mut hits[..pixels.len() * n];
        let start = Instant::now();
        cast_band(scene, &rays, origin, width, top, hits);
        rays_s += start.elapsed().as_secs_f64();
        let start = Instant::now();
        let shader = || Shader::new(scene, relit, &rays, origin);
        let rows = pixels.par_chunks_mut(width).zip(hits.par_chunks(width * n));
        rows.enumerate().for_each_init(shader, |shader, (row, (pixels, hits))| {
            // what is kept from pixel to pixel must not depend on who shades which rows
            shader.scratch = Nearby::default();
            for (x, (pixel, hits)) in pixels.iter_mut().zip(hits.chunks(n)).enumerate() {
                if !camera.shows(x as f64 + 0.5, (top + row) as f64 + 0.5) {
                    *pixel = Pixel { depth: f32::INFINITY, agreement: 1.0, ..Pixel::default() };
                    continue;
                }
                *pixel = shader.shade(hits, (x, top + row));
            }
        });
        shade_s += start.elapsed().as_secs_f64();
        progress((top + BAND).min(height) as u64, height as u64);
    }
    Frame::from_pixels(width, height, &pixels, rays_s, shade_s)
}

/// Finds the hits of a band of rows, a pixel's samples next to each other.
fn cast_band(scene: &Scene, rays: &PrimaryRays, origin: Vec3, width: usize, top: usize, hits: &mut [Option<Hit>]) {
    let n = rays.offsets.len();
    // packets want rays that stay together: square tiles of pixels, each pixel's samples in a row
    let side = TILE_SIDES.into_iter().find(|s| s * s * n <= PACKET).unwrap_or(1);
    hits.par_chunks_mut(width * n * side).enumerate().for_each_init(
        Vec::new,
        |directions: &mut Vec<Vec3>, (i, hits)| {
            let tall = hits.len() / (width * n);
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
                    for (k, hit) in found.iter().enumerate() {
                        let (pixel, sample) = ((chunk * PACKET + k) / n, (chunk * PACKET + k) % n);
                        hits[((pixel / wide) * width + left + pixel % wide) * n + sample] = *hit;
                    }
                }
            }
        },
    );
}

/// Shades pixels: samples on one surface share a look-up of irradiance; each has its own albedo and, near a shadow's
/// edge, its own sun.
struct Shader<'a> {
    scene: &'a Scene,
    relit: &'a dyn Irradiance,
    rays: &'a PrimaryRays,
    origin: Vec3,
    /// The last triangle: the next sample is mostly on it too.
    face: Option<(Face, Paint<'a>)>,
    samples: Vec<Sample>,
    positions: Vec<Vec3>,
    chosen: Vec<usize>,
    scratch: Nearby,
}

struct Sample {
    surface: Surface,
    albedo: Vec3,
    distance: f32,
    taken: bool,
}

impl<'a> Shader<'a> {
    fn new(scene: &'a Scene, relit: &'a dyn Irradiance, rays: &'a PrimaryRays, origin: Vec3) -> Self {
        let (samples, positions, chosen, scratch) = Default::default();
        Self { scene, relit, rays, origin, face: None, samples, positions, chosen, scratch }
    }

    fn shade(&mut self, hits: &[Option<Hit>], (x, y): (usize, usize)) -> Pixel {
        let mut pixel = Pixel { agreement: 1.0, depth: f32::INFINITY, ..Pixel::default() };
        self.look(&mut pixel, hits, (x, y));
        for first in 0..self.samples.len() {
            if !self.samples[first].taken {
                self.light(&mut pixel, first);
            }
        }
        pixel.radiance *= 1.0 / hits.len() as f32;
        if let Some(first) = self.samples.first() {
            let n = self.samples.len() as f32;
            pixel.surface = self.samples.len() as u32;
            pixel.normal = first.surface.normal;
            pixel.depth = self.samples.iter().map(|s| s.distance).sum::<f32>() / n;
            pixel.albedo = self.samples.iter().map(|s| s.albedo).sum::<Vec3>() / n;
        }
        pixel
    }

    /// Finds the surfaces of a pixel's samples, and adds the sky's light.
    fn look(&mut self, pixel: &mut Pixel, hits: &[Option<Hit>], (x, y): (usize, usize)) {
        let filters = self.relit.filters_albedo();
        self.samples.clear();
        for (i, hit) in hits.iter().enumerate() {
            let direction = self.rays.direction(x, y, i);
            let Some(hit) = hit else {
                pixel.radiance += self.relit.sky(direction);
                continue;
            };
            let (face, paint) = match &self.face {
                Some(last) if last.0.triangle == hit.triangle => last,
                _ => {
                    let face = self.scene.face(hit.triangle);
                    &*self.face.insert((face, self.scene.paint(&face, filters)))
                }
            };
            let surface = face.surface(&Ray { origin: self.origin, direction }, hit.t);
            let albedo = if filters {
                paint.pencil(face, &surface, direction, hit.t * self.rays.spread())
            } else {
                paint.albedo(surface.barycentric, 0.0)
            };
            self.samples.push(Sample { surface, albedo, distance: hit.t, taken: false });
        }
    }

    /// Lights the samples that share the surface of the first.
    fn light(&mut self, pixel: &mut Pixel, first: usize) {
        let Surface { position, normal, triangle, .. } = self.samples[first].surface;
        let near = 2e-3 * self.samples[first].distance;
        self.positions.clear();
        self.chosen.clear();
        for (i, sample) in self.samples.iter_mut().enumerate().skip(first) {
            let s = &sample.surface;
            if !sample.taken && (s.triangle == triangle || on_one_surface(s, position, normal, near)) {
                sample.taken = true;
                self.positions.push(s.position);
                self.chosen.push(i);
            }
        }
        let (samples, chosen) = (&self.samples, &self.chosen);
        let mut put = |i: usize, e: Vec3| pixel.radiance += samples[chosen[i]].albedo * e * (1.0 / PI);
        let (source, agreement) = self.relit.irradiance(normal, &self.positions, &mut self.scratch, &mut put);
        pixel.agreement = pixel.agreement.min(agreement);
        if source == Source::Record {
            pixel.recorded += self.positions.len() as u32;
        }
    }
}

/// Whether a sample lies on the plane through a position, within a tolerance in metres.
fn on_one_surface(s: &Surface, position: Vec3, normal: Vec3, near_m: f32) -> bool {
    s.normal.dot(normal) > 0.995 && normal.dot(s.position - position).abs() < near_m
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
