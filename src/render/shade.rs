//! Shades pixels. Samples of a pixel that lie on one surface make one fragment, which is lit and painted once, as
//! multisampling does.

use glam::Vec3;
use std::f32::consts::PI;

use super::frame::Pixel;
use super::lattice::Lattice;
use super::rays::Cast;
use super::{Irradiance, Lit, PrimaryRays, ShadingPoint, Source};
use crate::scene::{Face, Paint, Ray, Scene, Surface, Texture};
use crate::site::Camera;
use crate::volume::Nearby;

/// Pixels along a tile, whose fragments are found before any of them is lit.
const TILE: usize = 64;

/// Triangles kept ready.
const FACES: usize = 256;

/// How far off a plane its points may lie, as a share of the distance from the camera.
const NEAR: f32 = 2e-3;

/// Shades a view's strips of rows; keeps nothing from one to the next but space.
pub(super) struct Shader<'a> {
    relit: &'a dyn Irradiance,
    rays: &'a PrimaryRays,
    camera: &'a Camera,
    origin: Vec3,
    shares: bool,
    faces: Faces<'a>,
    samples: Vec<Sample>,
    /// The fragments of a tile, those of a pixel next to each other, the largest first.
    fragments: Vec<Fragment>,
    /// The samples of fragments that are not all of a pixel.
    members: Vec<u32>,
    /// Per pixel whether the lens shows it, its first fragment, and what that shows.
    shown: Vec<bool>,
    spots: Vec<Option<ShadingPoint>>,
    firsts: Vec<u32>,
    lits: Vec<Option<Lit>>,
    near: Nearby,
}

/// Samples of one pixel on one surface.
#[derive(Clone, Copy)]
struct Fragment {
    spot: ShadingPoint,
    /// Number of samples.
    count: u32,
    /// Place of the first in [`Shader::members`]; [`ALL`] for all samples of the pixel.
    first: u32,
    /// Mean albedo.
    albedo: Vec3,
    /// Mean distance from the camera.
    distance: f32,
}

const ALL: u32 = u32::MAX;

/// A sample of a pixel that shows more than one surface.
#[derive(Clone, Copy)]
struct Sample {
    index: u32,
    /// Which of the pixel's fragments it is part of.
    fragment: u32,
    surface: Surface,
    distance: f32,
    painted: bool,
}

impl<'a> Shader<'a> {
    pub(super) fn new(scene: &'a Scene, relit: &'a dyn Irradiance, rays: &'a PrimaryRays, camera: &'a Camera) -> Self {
        let origin = scene.local(camera.pose.position);
        let shares = relit.shares();
        let faces = Faces { scene, white_lamps: shares, ready: vec![None; FACES] };
        let (samples, fragments, members) = Default::default();
        let (shown, spots, firsts, lits, near) = Default::default();
        Self {
            relit,
            rays,
            camera,
            origin,
            shares,
            faces,
            samples,
            fragments,
            members,
            shown,
            spots,
            firsts,
            lits,
            near,
        }
    }

    /// Shades whole rows, `top` the first.
    pub(super) fn strip(&mut self, casts: &[Cast], top: usize, pixels: &mut [Pixel]) {
        let width = self.camera.width as usize;
        for left in (0..width).step_by(TILE) {
            self.tile(casts, left..(left + TILE).min(width), top, pixels);
        }
    }

    fn tile(&mut self, casts: &[Cast], columns: std::ops::Range<usize>, top: usize, pixels: &mut [Pixel]) {
        let (width, n) = (self.camera.width as usize, self.rays.offsets.len());
        let (wide, tall) = (columns.len(), pixels.len() / width);
        self.fragments.clear();
        self.members.clear();
        self.spots.clear();
        self.shown.clear();
        self.firsts.clear();
        for y in 0..tall {
            for x in columns.clone() {
                let first = self.fragments.len();
                let shown = self.camera.shows(x as f64 + 0.5, (top + y) as f64 + 0.5);
                if shown {
                    self.collect(&casts[(y * width + x) * n..][..n], (x, top + y));
                }
                self.shown.push(shown);
                self.firsts.push(first as u32);
                self.spots.push(self.fragments.get(first).map(|f| f.spot));
            }
        }
        self.firsts.push(self.fragments.len() as u32);
        self.lits.clear();
        self.lits.resize(self.spots.len(), None);
        // what is kept from point to point must not depend on who shades which tile
        let mut near = std::mem::take(&mut self.near);
        near.clear();
        let relit = self.relit;
        let mut ask = |spot: &ShadingPoint| relit.at(spot, &mut near);
        if self.shares {
            Lattice { wide, tall, spots: &self.spots, lits: &mut self.lits, ask: &mut ask }.fill();
        }
        for y in 0..tall {
            for x in columns.clone() {
                let i = y * wide + x - columns.start;
                let pixel = &mut pixels[y * width + x];
                *pixel = Pixel { depth: f32::INFINITY, agreement: 1.0, ..Pixel::default() };
                let casts = &casts[(y * width + x) * n..][..n];
                let (first, last) = (self.firsts[i] as usize, self.firsts[i + 1] as usize);
                for k in first..last {
                    let fragment = self.fragments[k];
                    let lit = match self.lits[i] {
                        Some(lit) if k == first => lit,
                        _ => self
                            .beside(&fragment.spot, (x - columns.start, y), (wide, tall))
                            .unwrap_or_else(|| ask(&fragment.spot)),
                    };
                    self.add(pixel, &fragment, &lit, casts);
                }
                if self.shown[i] {
                    self.finish(pixel, first, casts);
                }
            }
        }
        self.near = near;
    }

    /// The light that a neighbouring pixel has on the same surface.
    fn beside(&self, spot: &ShadingPoint, (x, y): (usize, usize), (wide, tall): (usize, usize)) -> Option<Lit> {
        if !self.shares {
            return None;
        }
        let around = [(0, 1), (2, 1), (1, 0), (1, 2), (0, 0), (2, 0), (0, 2), (2, 2)];
        around.into_iter().find_map(|(dx, dy)| {
            let (x, y) = ((x + dx).checked_sub(1)?, (y + dy).checked_sub(1)?);
            if x >= wide || y >= tall {
                return None;
            }
            let other = self.spots[y * wide + x].as_ref()?;
            self.lits[y * wide + x].filter(|_| other.joins(spot))
        })
    }

    /// Finds the fragments of a pixel.
    fn collect(&mut self, casts: &[Cast], (x, y): (usize, usize)) {
        let Some(Cast { hit: Some(first), .. }) = casts.first() else { return self.part(casts, (x, y)) };
        let whole = self.shares
            && casts.iter().all(|cast| {
                cast.hit.is_some_and(|hit| {
                    hit.triangle == first.triangle || {
                        let point = self.origin + cast.direction * hit.t;
                        self.faces.carry_on(first.triangle, hit.triangle, point)
                    }
                })
            });
        if !whole {
            return self.part(casts, (x, y));
        }
        let (mut least, mut most) = (f32::INFINITY, 0.0f32);
        for hit in casts.iter().filter_map(|cast| cast.hit) {
            (least, most) = (least.min(hit.t), most.max(hit.t));
        }
        let (face, paint) = self.faces.get(first.triangle);
        let (direction, sides) = self.rays.middle(x, y);
        let ray = Ray { origin: self.origin, direction };
        let distance = face.meet(&ray).max(least).min(most);
        let surface = face.surface(&ray, distance);
        let albedo = paint.patch(face, surface.barycentric, face.covered(direction, sides, distance), Texture::APART);
        let spot = ShadingPoint::new(&surface, NEAR * distance);
        self.fragments.push(Fragment { spot, count: casts.len() as u32, first: ALL, albedo, distance });
    }

    /// Finds the fragments of a pixel whose samples meet several triangles.
    fn part(&mut self, casts: &[Cast], (x, y): (usize, usize)) {
        let start = self.fragments.len();
        self.samples.clear();
        for (i, &Cast { direction, hit }) in casts.iter().enumerate() {
            let Some(hit) = hit else { continue };
            let ray = Ray { origin: self.origin, direction };
            let surface = self.faces.get(hit.triangle).0.surface(&ray, hit.t);
            let spot = ShadingPoint::new(&surface, NEAR * hit.t);
            let mine = &self.fragments[start..];
            let known = mine.iter().position(|f| self.shares && f.spot.joins(&spot));
            let fragment = known.unwrap_or_else(|| {
                let new = Fragment { spot, count: 0, first: 0, albedo: Vec3::ZERO, distance: 0.0 };
                self.fragments.push(new);
                self.fragments.len() - 1 - start
            });
            self.fragments[start + fragment].count += 1;
            let index = i as u32;
            self.samples.push(Sample { index, fragment: fragment as u32, surface, distance: hit.t, painted: false });
        }
        let middle = self.rays.middle(x, y);
        for k in start..self.fragments.len() {
            self.unite(k, (k - start) as u32, middle);
        }
        // the largest first, of equals the first one
        if let Some(largest) = (start..self.fragments.len()).rev().max_by_key(|&k| self.fragments[k].count) {
            self.fragments.swap(start, largest);
        }
    }

    /// Makes a fragment of its samples: their middle, and an albedo for those on one triangle together.
    fn unite(&mut self, k: usize, number: u32, (direction, sides): (Vec3, [Vec3; 2])) {
        let share = 1.0 / (self.rays.offsets.len() as f32);
        let (mut position, mut distance, mut albedo) = (Vec3::ZERO, 0.0, Vec3::ZERO);
        self.fragments[k].first = self.members.len() as u32;
        for i in 0..self.samples.len() {
            let sample = self.samples[i];
            if sample.fragment != number {
                continue;
            }
            self.members.push(sample.index);
            position += sample.surface.position;
            distance += sample.distance;
            if sample.painted {
                continue;
            }
            let (mut middle, mut count) = (Vec3::ZERO, 0.0);
            let (triangle, faces) = (sample.surface.triangle, &mut self.faces);
            for other in self.samples[i..].iter_mut().filter(|other| other.fragment == number && !other.painted) {
                if other.surface.triangle == triangle
                    || self.shares && faces.carry_on(triangle, other.surface.triangle, other.surface.position)
                {
                    other.painted = true;
                    middle += other.surface.position;
                    count += 1.0;
                    if !self.shares {
                        break;
                    }
                }
            }
            let (face, paint) = self.faces.get(sample.surface.triangle);
            let at = face.barycentric(middle / count);
            albedo += count
                * if self.shares {
                    let size = sample.distance * f32::sqrt(count * share);
                    paint.patch(face, at, face.covered(direction, sides, size), Texture::APART)
                } else {
                    paint.albedo(at, 0.0)
                };
        }
        let fragment = &mut self.fragments[k];
        let share = 1.0 / fragment.count as f32;
        fragment.spot.position = position * share;
        fragment.distance = distance * share;
        fragment.albedo = albedo * share;
    }

    /// Adds a fragment's light to its pixel; sums, not means.
    fn add(&self, pixel: &mut Pixel, f: &Fragment, lit: &Lit, casts: &[Cast]) {
        let sun = if lit.needs_shadow_ray { self.sun_share(f, casts) } else { 1.0 };
        let e = if sun < 1.0 { lit.shade.lerp(lit.sun, sun) } else { lit.sun };
        let count = f.count as f32;
        pixel.radiance += f.albedo * e * (count / PI);
        pixel.albedo += f.albedo * count;
        pixel.agreement = pixel.agreement.min(lit.agreement);
        pixel.surface += f.count;
        let source = if sun < 0.5 { lit.shade_source } else { lit.source };
        match source {
            Source::Record => pixel.recorded += f.count,
            Source::Neighbour => pixel.neighboured += f.count,
            Source::None | Source::Volume => {}
        }
    }

    /// The share of a fragment's samples that the sun reaches; asks a few, and all only where they differ.
    fn sun_share(&self, f: &Fragment, casts: &[Cast]) -> f32 {
        let sample = |k: u32| if f.first == ALL { k as usize } else { self.members[(f.first + k) as usize] as usize };
        let reached = |k: u32| {
            let Cast { direction, hit } = casts[sample(k)];
            let t = hit.map_or(f.distance, |h| h.t);
            self.relit.in_sun(self.origin + direction * t, f.spot.normal)
        };
        let last = f.count - 1;
        let first = reached(0);
        if last == 0 || (reached(last) == first && (last < 3 || reached(last / 2) == first)) && last != 1 {
            return if first { 1.0 } else { 0.0 };
        }
        let lit = (0..f.count).filter(|&k| reached(k)).count();
        lit as f32 / f.count as f32
    }

    /// Turns sums into means, and adds the sky.
    fn finish(&self, pixel: &mut Pixel, first: usize, casts: &[Cast]) {
        if (pixel.surface as usize) < casts.len() {
            for cast in casts.iter().filter(|cast| cast.hit.is_none()) {
                pixel.radiance += self.relit.sky(cast.direction);
            }
        }
        pixel.radiance *= 1.0 / casts.len() as f32;
        if pixel.surface > 0 {
            let fragments = &self.fragments[first..];
            pixel.normal = fragments[0].spot.normal;
            pixel.albedo *= 1.0 / pixel.surface as f32;
            let (mut distance, mut count) = (0.0, 0);
            for f in fragments {
                if count == pixel.surface {
                    break;
                }
                distance += f.distance * f.count as f32;
                count += f.count;
            }
            pixel.depth = distance / pixel.surface as f32;
        }
    }
}

/// Triangles made ready, found again by the end of their number.
struct Faces<'a> {
    scene: &'a Scene,
    white_lamps: bool,
    ready: Vec<Option<(Face, Paint<'a>)>>,
}

impl<'a> Faces<'a> {
    /// Whether a triangle carries another one on at a point of it.
    fn carry_on(&mut self, first: u32, other: u32, point: Vec3) -> bool {
        let (other, theirs) = *self.get(other);
        let (face, paint) = self.get(first);
        paint.carried_on(face, (&other, &theirs), point)
    }

    #[inline]
    fn get(&mut self, triangle: u32) -> &(Face, Paint<'a>) {
        let slot = &mut self.ready[triangle as usize % FACES];
        match slot {
            Some(ready) if ready.0.triangle == triangle => {}
            _ => *slot = None,
        }
        slot.get_or_insert_with(|| {
            let face = self.scene.face(triangle);
            (face, self.scene.paint(&face, self.white_lamps))
        })
    }
}
