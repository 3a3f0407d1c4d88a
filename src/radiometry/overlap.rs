//! Points that several pictures see.

use glam::Vec3;
use rayon::prelude::*;

use super::shot::{Shot, Stored};
use crate::panorama::Picture;
use crate::scene::{Ray, Scene};

/// A small patch of surface that two pictures see.
#[derive(Clone, Copy, Debug)]
pub(super) struct Comparison {
    /// The two pictures, and what each stores.
    pub(super) of: [(u32, Stored); 2],
    /// How far to trust it: less where the patch is not even.
    pub(super) weight: f32,
    /// The channels that both are bright enough in.
    pub(super) channels: [bool; 3],
}

/// Rays that make a patch: its middle and a ring around it.
const RING: usize = 8;

/// Radius of a patch in pixels, and the least one as an angle: poses are off by some.
const RADIUS_PX: f32 = 2.0;
const LEAST_RADIUS: f32 = 0.012;

/// A patch whose points lie off a plane by more than this share of its radius straddles an edge.
const UNEVEN: f32 = 0.5;

/// Surfaces seen at a lower cosine are left out: gloss, and a pixel sees too much of them.
const LEAST_COS: f32 = 0.2;

/// A patch whose contrast is so large counts half.
const CONTRAST: f32 = 0.15;

/// Linear value below which an 8-bit file's steps are wide: code 10, in sRGB's straight part. Other files are dark below
/// this share of their mean.
const DARK_CODED: f32 = 10.0 / 255.0 / 12.92;
const DARK_SHARE: f32 = 1e-3;

/// Finds patches that two pictures see, by rays from each picture along evenly spread directions. In the pictures' order.
pub(super) fn find(scene: &Scene, shots: &[Shot], samples: usize) -> Vec<Comparison> {
    let eyes: Vec<Vec3> = shots.iter().map(|s| scene.local(s.pose.position)).collect();
    let dark: Vec<f32> = shots.iter().map(dark).collect();
    let angles: Vec<f32> = shots.iter().map(Shot::pixel_angle).collect();
    let one = |i: usize, direction: Vec3| -> Vec<Comparison> {
        let Some(patch) = Patch::meet(scene, eyes[i], direction, (RADIUS_PX * angles[i]).max(LEAST_RADIUS)) else {
            return Vec::new();
        };
        let Some(here) = shots[i].stored(&patch.directions(eyes[i])) else { return Vec::new() };
        let bright = |stored: &Stored, j: usize| stored.value.cmpge(Vec3::splat(dark[j]));
        let others = (0..shots.len()).filter(|&j| j != i && patch.is_fine_from(eyes[j], angles[j]));
        others
            .filter_map(|j| {
                let there = shots[j].stored(&patch.directions(eyes[j]))?;
                let channels = (bright(&here, i) & bright(&there, j)).into();
                let contrast = here.contrast.max(there.contrast) / CONTRAST;
                let weight = 1.0 / (1.0 + contrast * contrast);
                let found = Comparison { of: [(i as u32, here), (j as u32, there)], weight, channels };
                (channels.contains(&true) && patch.seen_from(scene, eyes[j])).then_some(found)
            })
            .collect()
    };
    (0..shots.len())
        .flat_map(|i| {
            let found: Vec<Vec<Comparison>> =
                shots[i].directions(samples).into_par_iter().map(|direction| one(i, direction)).collect();
            found.concat()
        })
        .collect()
}

/// The value below which a picture is too dark to be compared.
fn dark(shot: &Shot) -> f32 {
    if shot.guess.clipped.is_finite() {
        return DARK_CODED;
    }
    let valid = shot.picture.pixels.iter().filter(|p| Picture::valid(**p));
    let (sum, count) = valid.fold((0.0f64, 0usize), |(s, n), p| (s + f64::from(p.element_sum() / 3.0), n + 1));
    DARK_SHARE * (sum / count.max(1) as f64) as f32
}

/// Points of a surface close together, the middle first.
struct Patch {
    points: [Vec3; RING + 1],
    normal: Vec3,
    radius: f32,
}

impl Patch {
    /// What a cone of rays meets, if that is about even.
    fn meet(scene: &Scene, eye: Vec3, direction: Vec3, angle: f32) -> Option<Self> {
        let (right, up) = direction.any_orthonormal_pair();
        let mut points = [Vec3::ZERO; RING + 1];
        let mut normal = Vec3::ZERO;
        for (k, point) in points.iter_mut().enumerate() {
            let (sin, cos) = (k as f32 * std::f32::consts::TAU / RING as f32).sin_cos();
            let off = if k == 0 { Vec3::ZERO } else { (right * cos + up * sin) * angle };
            let ray = Ray { origin: eye, direction: (direction + off).normalize() };
            let surface = scene.surface(&ray, &scene.tracer.closest(&ray, 1e-3)?);
            *point = surface.position;
            normal += surface.normal;
        }
        let normal = normal.try_normalize()?;
        let (distance, cos) = (points[0].distance(eye), -normal.dot(direction));
        let radius = angle * distance;
        let even = points.iter().all(|p| normal.dot(*p - points[0]).abs() < UNEVEN * radius);
        (cos > LEAST_COS && even).then_some(Self { points, normal, radius })
    }

    /// The directions of all points from a place.
    fn directions(&self, eye: Vec3) -> [Vec3; RING + 1] {
        self.points.map(|p| (p - eye).normalize())
    }

    /// Whether it faces a place, from where it is not small against a pixel.
    fn is_fine_from(&self, eye: Vec3, pixel_angle: f32) -> bool {
        let way = eye - self.points[0];
        let distance = way.length();
        self.normal.dot(way) > LEAST_COS * distance && self.radius > 0.75 * RADIUS_PX * pixel_angle * distance
    }

    /// Whether all points are seen from a place.
    fn seen_from(&self, scene: &Scene, eye: Vec3) -> bool {
        self.points.iter().all(|p| {
            let way = *p - eye;
            let distance = way.length();
            let ray = Ray { origin: eye, direction: way / distance };
            !scene.tracer.occluded(&ray, 1e-3, distance - UNEVEN * self.radius)
        })
    }
}
