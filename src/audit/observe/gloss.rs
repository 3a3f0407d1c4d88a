//! Light that a surface may mirror: floors are waxed, stone is polished, paintings are varnished, and no model says so.
//!
//! Everything else here takes surfaces as matt. A smooth dielectric adds to that, towards each eye, what comes from the mirrored
//! direction times its Fresnel reflectance. How much of it a surface shows is told by all that photograph and probes show of it: two eyes
//! differ by as large a share of what it would mirror towards either. What they differ by within these bounds is no fault of the model.

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::collections::BTreeMap;

use crate::audit::observe::geometry_buffer::{GeometryBuffer, NONE};
use crate::audit::observe::probe_view::ProbeView;
use crate::audit::picture::student;
use crate::panorama::{Picture, luminance};
use crate::render::{Irradiance, Relit};
use crate::scene::Ray;
use crate::volume::Nearby;

/// Reflectance of varnish, wax and polished stone seen straight on: refractive index 1.5.
const STRAIGHT: f32 = 0.04;

/// How far from the mirrored direction wax and varnish spread what they mirror, radians.
const LOBE: f32 = 0.1;

/// How far off a smooth surface may mirror, radians: twice what a model's normals are off by, 5 mm over 20 cm.
const OFF: f32 = 0.05;

/// A surface shows no less than this share of its light by scattering.
const LEAST: f32 = 0.05;

/// Sides of the squares of pixels that mirrored light is looked up once for: a streak on a column is not much wider.
const STRIDE: usize = 3;

/// A place mirrors at most so many times as much as the surface does all over: it may spread it less, or be more polished.
const MOST_TIMES: f64 = 2.0;

/// What a probe and the photograph show of one place, as luminances, and the variance of their ratio's logarithm.
pub(crate) struct Pair {
    pub(crate) pixel: usize,
    pub(crate) probe: usize,
    pub(crate) photo: f32,
    pub(crate) here: f32,
    pub(crate) variance: f32,
}

/// How a place looks to the camera beside how it looks to a probe, both over the probe's light.
#[derive(Clone, Copy)]
struct Seen {
    /// How much more it would mirror towards the camera.
    more: f64,
    /// How much brighter the camera saw it, and the variance of that.
    brighter: f64,
    variance: f64,
}

/// What a place mirrors, radiance: the most that the whole lobe may send in the mean, and its middle.
#[derive(Default)]
struct Mirrored {
    spread: Vec3,
    sharp: Vec3,
    /// What the lobe does send in the mean, if all of it is known.
    known: Option<Vec3>,
}

/// Radiance that arrives from a direction: the most that it may be, and what it is, if that is known.
struct Arriving {
    most: Vec3,
    known: Option<Vec3>,
}

/// What a view's surfaces may mirror.
pub(crate) struct Gloss<'a> {
    relit: &'a Relit<'a>,
    probes: &'a [ProbeView],
    /// Light through openings.
    beyond: Vec3,
    /// The most that they may mirror towards the camera, per pixel, radiance.
    pub(crate) to_camera: Vec<Vec3>,
    /// The share of what a smooth dielectric mirrors that a pixel's surface does at most.
    share: Vec<f32>,
}

impl<'a> Gloss<'a> {
    /// Learns how much each material mirrors, from what photograph and probes show of it, of the light that the probes saw; what none of
    /// them did is relit, and what the model does not have at all tells nothing. A scan has one material for all that it holds: there it is each smooth surface.
    pub(crate) fn fit(
        relit: &'a Relit<'a>,
        surfaces: &GeometryBuffer,
        probes: &'a [ProbeView],
        pairs: &[Pair],
    ) -> Self {
        // through an opening may come, from where no probe stands, the sun itself: as much as the brightest that any saw
        let beyond = probes.iter().map(ProbeView::brightest).fold(Vec3::ZERO, Vec3::max);
        let mut this = Self { relit, probes, beyond, to_camera: Vec::new(), share: Vec::new() };
        this.share = this.shares(surfaces, pairs);
        this.to_camera = this.towards(surfaces, surfaces.origin, &|_| true);
        this
    }

    /// The most that surfaces may mirror towards an eye, per pixel, radiance; zero where it is not wanted.
    pub(crate) fn towards(
        &self,
        surfaces: &GeometryBuffer,
        eye: Vec3,
        wanted: &(dyn Fn(usize) -> bool + Sync),
    ) -> Vec<Vec3> {
        let (w, h) = (surfaces.width, surfaces.height);
        let (wide, high) = (w.div_ceil(STRIDE), h.div_ceil(STRIDE));
        // one pixel stands for all of a square: the middle one
        let at = |cell: usize| {
            let side = |k: usize, most: usize| (k * STRIDE + STRIDE / 2).min(most - 1);
            side(cell / wide, h) * w + side(cell % wide, w)
        };
        let mut cells = vec![Vec3::ZERO; wide * high];
        cells.par_chunks_mut(wide).enumerate().for_each(|(row, cells)| {
            let mut scratch = Nearby::default();
            for (column, cell) in cells.iter_mut().enumerate() {
                let i = at(row * wide + column);
                if surfaces.triangle[i] != NONE && wanted(i) {
                    let mirrored = self.mirrored(surfaces.position[i], surfaces.normal[i], eye, &mut scratch);
                    *cell = brighter(mirrored.spread, mirrored.sharp);
                }
            }
        });
        let label: Vec<u32> = (0..wide * high).map(|cell| surfaces.label[at(cell)]).collect();
        let cells = spread(cells, &label, wide, (OFF * surfaces.focal / STRIDE as f32).ceil() as usize);
        (0..w * h).map(|i| self.share[i] * cells[i / w / STRIDE * wide + i % w / STRIDE]).collect()
    }

    /// The share of what a smooth dielectric mirrors that each pixel's surface does at most.
    fn shares(&self, surfaces: &GeometryBuffer, pairs: &[Pair]) -> Vec<f32> {
        let scene = self.relit.scene;
        let scanned = scene.materials.len() < 2 || !scene.mesh.colours.is_empty();
        let of = |i: usize| (surfaces.material[i], if scanned { surfaces.label[i] } else { 0 });
        // each place by itself: what light is found for it must not depend on which thread asks for which
        let towards = |eye: Vec3, i: usize| {
            let mirrored = self.mirrored(surfaces.position[i], surfaces.normal[i], eye, &mut Nearby::default());
            mirrored.known.map(luminance)
        };
        let mut asked: Vec<usize> = pairs.iter().map(|pair| pair.pixel).collect();
        asked.sort_unstable();
        asked.dedup();
        let to_camera: BTreeMap<usize, f32> =
            asked.par_iter().filter_map(|i| Some((*i, towards(surfaces.origin, *i)?))).collect();
        let seen: Vec<(&Pair, Seen)> = pairs
            .par_iter()
            .filter_map(|pair| {
                let more = to_camera.get(&pair.pixel)? - towards(self.probes[pair.probe].origin, pair.pixel)?;
                let seen = Seen {
                    more: f64::from(more / pair.here),
                    brighter: f64::from(pair.photo / pair.here - 1.0),
                    variance: f64::from(pair.variance),
                };
                Some((pair, seen))
            })
            .collect();
        let mut surface: BTreeMap<(u32, u32), BTreeMap<_, Vec<Seen>>> = BTreeMap::new();
        // what mirrors more than its own light tells where a lamp's image falls, and not how strong it is; what mirrors places that the
        // model does not have tells nothing
        let told = |(_, seen): &(&Pair, Seen)| seen.more.abs() <= 1.0 && seen.brighter.is_finite();
        for (pair, seen) in seen.into_iter().filter(told) {
            surface.entry(of(pair.pixel)).or_default().entry(surfaces.part(pair.pixel)).or_default().push(seen);
        }
        let most = |blocks: BTreeMap<_, Vec<Seen>>| -> f32 {
            let shares: Vec<(f64, f64)> = blocks.values().filter_map(|seen| mirrored_share(seen)).collect();
            (MOST_TIMES * most_of(&shares)).min(1.0) as f32
        };
        let most: BTreeMap<_, f32> = surface.into_iter().map(|(of, blocks)| (of, most(blocks))).collect();
        (0..surfaces.label.len()).into_par_iter().map(|i| most.get(&of(i)).copied().unwrap_or(1.0)).collect()
    }

    /// What a dielectric mirrors towards an eye, radiance.
    fn mirrored(&self, point: Vec3, normal: Vec3, eye: Vec3, scratch: &mut Nearby) -> Mirrored {
        let along = (point - eye).normalize_or_zero();
        let cos = -normal.dot(along);
        if cos.is_nan() || cos <= 0.0 {
            return Mirrored { known: Some(Vec3::ZERO), ..Mirrored::default() };
        }
        // Schlick, An inexpensive BRDF model for physically-based rendering, 1994
        let share = STRAIGHT + (1.0 - STRAIGHT) * (1.0 - cos.min(1.0)).powi(5);
        let middle = along + normal * (2.0 * cos);
        let (right, up) = middle.any_orthonormal_pair();
        let (mut sum, mut sharp, mut known, mut rays) = (Vec3::ZERO, Vec3::ZERO, Some(Vec3::ZERO), 0.0f32);
        for aside in lobe() {
            let direction = (middle + LOBE * (aside.x * right + aside.y * up)).normalize();
            if direction.dot(normal) > 0.0 {
                let light = self.radiance(point, direction, scratch);
                (sum, rays) = (sum + light.most, rays + 1.0);
                known = known.zip(light.known).map(|(sum, light)| sum + light);
                if aside == Vec2::ZERO {
                    sharp = light.most;
                }
            }
        }
        let mean = share / rays.max(1.0);
        Mirrored { spread: mean * sum, sharp: share * sharp, known: known.map(|sum| mean * sum) }
    }

    /// Radiance that arrives at a point from a direction: what the nearest probe saw there, and where none did, what is relit.
    fn radiance(&self, point: Vec3, direction: Vec3, scratch: &mut Nearby) -> Arriving {
        let (relit, scene) = (self.relit, self.relit.scene);
        let ray = Ray { origin: point, direction };
        let Some(hit) = scene.tracer.closest(&ray, 1e-3) else {
            let known = relit.light.told_sky(direction);
            return Arriving {
                most: known.unwrap_or_else(|| relit.light.beyond(scene, direction)).max(self.beyond),
                known,
            };
        };
        let known = |light| Arriving { most: light, known: Some(light) };
        let at = point + direction * hit.t;
        // the nearest first, as few as need be
        let mut nearest: SmallVec<[(f32, u32); 32]> =
            self.probes.iter().enumerate().map(|(i, p)| (p.origin.distance_squared(at), i as u32)).collect();
        nearest.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if let Some(light) = nearest.iter().find_map(|(_, i)| self.probes[*i as usize].light_of(at)) {
            return known(light);
        }
        let s = scene.surface(&ray, &hit);
        let lit = relit.lit(s.position, s.normal, scratch);
        let e = if lit.needs_shadow_ray && relit.in_sun(s.position, s.normal) { lit.sun } else { lit.shade };
        let light = scene.filtered_albedo(s.triangle, s.barycentric, LOBE * hit.t) * e / std::f32::consts::PI;
        known(if Picture::valid(light) { light } else { Vec3::ZERO })
    }
}

/// The share of what a smooth dielectric mirrors that a part of a surface does, and its variance: the slope of a line through how its places
/// look.
fn mirrored_share(seen: &[Seen]) -> Option<(f64, f64)> {
    const ROUNDS: usize = 20;
    let (mut slope, mut offset, mut error) = (0.0, 0.0, f64::INFINITY);
    for _ in 0..ROUNDS {
        let [mut sum, mut x1, mut y1, mut xx, mut xy, mut rest] = [0.0; 6];
        for &Seen { more: x, brighter: y, variance } in seen {
            let off = (y - offset - slope * x).powi(2) / variance;
            let weight = student::weight(off) / variance;
            (sum, x1, y1) = (sum + weight, x1 + weight * x, y1 + weight * y);
            (xx, xy, rest) = (xx + weight * x * x, xy + weight * x * y, rest + weight * off * variance);
        }
        let spread = sum * xx - x1 * x1;
        slope = (sum * xy - x1 * y1) / spread;
        offset = (y1 - slope * x1) / sum;
        error = sum / spread * (rest / seen.len() as f64).max(1.0);
    }
    (slope.is_finite() && error.is_finite() && error > 0.0).then_some((slope, error))
}

/// The most that a surface may mirror by the shares of its parts, as the sum of one number and what parts differ by (DerSimonian and Laird,
/// *Meta-analysis in clinical trials*, 1986): two standard deviations above it.
fn most_of(parts: &[(f64, f64)]) -> f64 {
    let weighed = |more: f64| {
        let weights = parts.iter().map(move |(share, variance)| (share, 1.0 / (variance + more)));
        weights.fold([0.0; 3], |[sum, squares, mean], (share, w)| [sum + w, squares + w * w, mean + w * share])
    };
    let [sum, squares, total] = weighed(0.0);
    let mean = total / sum;
    let q: f64 = parts.iter().map(|(share, variance)| (share - mean).powi(2) / variance).sum();
    let between = ((q - (parts.len() as f64 - 1.0)) / (sum - squares / sum)).max(0.0);
    let between = if between.is_finite() { between } else { 0.0 };
    let [sum, _, total] = weighed(between);
    let most = (total / sum).max(0.0) + 2.0 * (between + 1.0 / sum).sqrt();
    if most.is_finite() { most } else { 1.0 }
}

/// By how much a photograph's logarithm may be below and above that of a probe's light, where the surface may mirror so much
/// towards the camera and towards the probe; per channel.
pub(crate) fn bounds(to_camera: Vec3, to_probe: Vec3, light: Vec3) -> [Vec3; 2] {
    let light = light.max(Vec3::splat(1e-30));
    [(Vec3::ONE - to_probe / light).max(Vec3::splat(LEAST)).map(f32::ln), (Vec3::ONE + to_camera / light).map(f32::ln)]
}

/// A surface's light less as much of what it may mirror as leaves it nearest to what it would be without.
pub(crate) fn without(light: Vec3, mirrored: Vec3, matt: Vec3) -> Vec3 {
    let share = ((light - matt).dot(mirrored) / mirrored.length_squared()).clamp(0.0, 1.0);
    if share > 0.0 { (light - share * mirrored).max(LEAST * light) } else { light }
}

/// Directions within a lobe of radius 1: the middle and two rings of six.
fn lobe() -> impl Iterator<Item = Vec2> {
    let all = (-2i32..=2).flat_map(|j| (-2i32..=2).map(move |i| (i, j))).filter(|(i, j)| i * i + i * j + j * j <= 3);
    all.map(|(i, j)| Vec2::new((i as f32 + 0.5 * j as f32) / 3f32.sqrt(), 0.5 * j as f32))
}

/// The brightest of what the squares around show up to so many away, on the same surface: on a smooth one neighbours mirror directions
/// beside.
fn spread(mut cells: Vec<Vec3>, label: &[u32], wide: usize, far: usize) -> Vec<Vec3> {
    let high = cells.len() / wide.max(1);
    for _ in 0..far {
        let of = |(i, own): (usize, &Vec3)| {
            let (x, y) = (i % wide, i / wide);
            let rows = y.saturating_sub(1)..(y + 2).min(high);
            let around = rows.flat_map(|v| (x.saturating_sub(1)..(x + 2).min(wide)).map(move |u| v * wide + u));
            around.filter(|j| label[*j] == label[i]).fold(*own, |most, j| brighter(most, cells[j]))
        };
        cells = cells.par_iter().enumerate().map(of).collect();
    }
    cells
}

/// The brighter of two lights.
fn brighter(a: Vec3, b: Vec3) -> Vec3 {
    if luminance(b) > luminance(a) { b } else { a }
}

#[cfg(test)]
mod tests {
    use glam::Mat3;
    use std::sync::Arc;

    use super::*;
    use crate::panorama::Radiometry;
    use crate::scene::testing::{grey, parallelograms};
    use crate::shoot::{Chart, Hits, Light};

    #[test]
    fn a_lobe_is_asked_evenly() {
        let all: Vec<Vec2> = lobe().collect();
        assert!(all.len() == 13 && all.iter().all(|p| p.length() < 1.001));
        assert_eq!(all.iter().filter(|p| **p == Vec2::ZERO).count(), 1);
        assert!(all.iter().sum::<Vec2>().length() < 1e-5);
    }

    #[test]
    fn what_comes_from_beyond_the_model_is_not_known() {
        let floor = (Vec3::new(-5.0, -5.0, 0.0), Vec3::X * 10.0, Vec3::Y * 10.0);
        let wall = (Vec3::new(5.0, -5.0, 0.0), Vec3::Z * 5.0, Vec3::Y * 10.0);
        let scene = grey(parallelograms(&[floor, wall]), 0.5);
        // a probe that sees the floor alone
        let down = Mat3::from_rotation_x(-0.5 * std::f32::consts::PI);
        let hits = Hits::shoot(&scene, Vec3::new(0.0, 0.0, 2.0), down, Chart::perspective(32, 32, 1.0));
        let picture = Picture { width: 32, height: 32, pixels: vec![Vec3::ONE; 32 * 32] };
        let light = Light::new(&scene, [(Arc::new(hits), &picture, Radiometry::default())], None, None);
        let relit = Relit { scene: &scene, light: &light, volume: None, volume_only: false };
        let beyond = Vec3::splat(9.0);
        let gloss = Gloss { relit: &relit, probes: &[], beyond, to_camera: vec![], share: vec![] };
        let towards =
            |x: f32| gloss.mirrored(Vec3::new(2.0, 0.0, 0.0), Vec3::Z, Vec3::new(x, 0.0, 1.0), &mut Nearby::default());
        // the wall, and the side that is open
        let (to_wall, to_open) = (towards(0.0), towards(4.0));
        assert_eq!(to_wall.known, Some(to_wall.spread));
        assert!(to_open.known.is_none() && to_open.sharp.min_element() > STRAIGHT * beyond.x, "{}", to_open.sharp);
    }

    #[test]
    fn a_streak_may_show_beside_its_place_on_the_same_surface() {
        const SIDE: usize = 20;
        let cells: Vec<Vec3> =
            (0..SIDE * SIDE).map(|i| if i == 8 * SIDE + 8 { Vec3::ONE } else { Vec3::ZERO }).collect();
        let label: Vec<u32> = (0..SIDE * SIDE).map(|i| u32::from(i % SIDE > 9)).collect();
        let all = spread(cells, &label, SIDE, 3);
        let lit = |i: usize| (5..10).contains(&(i % SIDE)) && (5..12).contains(&(i / SIDE));
        assert!((0..SIDE * SIDE).all(|i| (all[i] == Vec3::ONE) == lit(i)));
    }

    #[test]
    fn what_is_mirrored_is_taken_from_a_surface_as_far_as_it_makes_it_another() {
        let (matt, mirrored) = (Vec3::new(0.3, 0.2, 0.1), Vec3::new(0.1, 0.1, 0.2));
        let left = |share: f32| without(matt + share * mirrored, mirrored, matt);
        assert!(left(0.0) == matt && left(0.5).distance(matt) < 1e-6 && left(1.0).distance(matt) < 1e-6);
        assert!(left(2.0).distance(matt + mirrored) < 1e-6);
        // less light is none that is mirrored
        assert_eq!(without(0.5 * matt, mirrored, matt), 0.5 * matt);
        assert_eq!(without(matt, Vec3::ZERO, matt), matt);
    }

    /// Places of a surface that mirrors a share, each as a camera and a probe saw it, a fifth of them hidden by something.
    fn seen(share: f64, first: u32) -> Vec<Seen> {
        let unit = |k: u32| (f64::from(k.wrapping_mul(2_654_435_769) >> 8) / f64::from(1u32 << 24)) - 0.5;
        let place = |k: u32| {
            let more = 0.8 * unit(3 * k);
            let apart = if k.is_multiple_of(5) { 2.0 * unit(3 * k + 1) } else { 0.1 * unit(3 * k + 2) };
            Seen { more, brighter: share * more + 0.02 + apart, variance: 0.001 }
        };
        (first..first + 100).map(place).collect()
    }

    #[test]
    fn how_much_a_surface_mirrors_is_told_by_what_two_eyes_see_of_it() {
        for share in [0.0, 0.25] {
            let (told, variance) = mirrored_share(&seen(share, 7)).unwrap();
            assert!(
                (told - share).abs() < 2.5 * variance.sqrt() && variance.sqrt() < 0.05,
                "{told} ± {}",
                variance.sqrt()
            );
        }
        // where both would see as much of it, or nothing is seen, nothing is told
        let alike = Seen { more: 0.1, brighter: 0.0, variance: 1.0 };
        assert_eq!(mirrored_share(&[alike; 30]), None);
        assert_eq!(mirrored_share(&[]), None);
    }

    #[test]
    fn parts_that_differ_may_mirror_as_much_as_those_that_mirror_most() {
        let most = |shares: [f64; 2]| {
            let parts = (0..20).filter_map(|k| mirrored_share(&seen(shares[k as usize % 2], 100 * k)));
            most_of(&parts.collect::<Vec<_>>())
        };
        let (matt, mirrors, both) = (most([0.0; 2]), most([0.25; 2]), most([0.0, 0.25]));
        assert!(matt < 0.05 && (0.22..0.35).contains(&mirrors) && both > 0.25, "{matt} {mirrors} {both}");
        assert_eq!(most_of(&[]), 1.0);
    }

    #[test]
    fn what_may_be_mirrored_widens_what_a_right_model_shows() {
        let [below, above] = bounds(Vec3::splat(1.0), Vec3::splat(0.5), Vec3::splat(1.0));
        assert!((below.x - 0.5f32.ln()).abs() < 1e-6 && (above.x - 2.0f32.ln()).abs() < 1e-6);
        // what is mirrored may be all that is there, nearly
        assert!(bounds(Vec3::splat(1.0), Vec3::splat(0.5), Vec3::splat(0.1))[0].is_finite());
    }
}
