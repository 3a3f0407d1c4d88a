//! Takes the noise out of a path-traced picture of a Lambertian scene.
//!
//! Sun and sky as the camera sees them, and sunlight straight onto what it sees, have next to no noise. What is left is
//! albedo times a light that changes slowly along a surface: that light is averaged over neighbouring pixels which show
//! the same surface, as a ratio of sums, Σw·L / Σw·ρ, so that dark texels do no harm.

use clerestory::panorama::Picture;
use clerestory::reference::Eye;
use clerestory::scene::{Ray, Scene};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::common::eye::{direction, origin};

/// Half the side of the window of neighbours, and the standard deviation of their weights, in pixels.
const WINDOW: isize = 14;
const SIGMA_PX: f32 = 6.0;
/// The same on the surface, in metres: light changes over less than this near contacts.
const SIGMA_M: f32 = 0.2;
/// Rays for a pixel's albedo, per side of a square.
const ALBEDO_GRID: usize = 8;

/// What a ray meets.
#[derive(Clone, Copy)]
struct Spot {
    position: Vec3,
    normal: Vec3,
    albedo: Vec3,
}

/// What a pixel shows.
struct Pixel {
    /// Mean albedo; nothing counts as black.
    albedo: Vec3,
    /// The middle of it.
    centre: Option<Spot>,
    /// The middles of its quarters.
    quarters: [Option<Spot>; 4],
    /// How far all of it shows the surface in its middle, 0..=1.
    purity: f32,
}

/// Smooths two independent halves of a picture of all light except what is seen or arrives directly.
pub fn denoise(scene: &Scene, eye: &Eye, halves: [&Picture; 2]) -> [Picture; 2] {
    let origin = origin(scene, eye);
    let cast = |x: f64, y: f64| {
        let ray = Ray { origin, direction: direction(eye, x, y) };
        let hit = scene.tracer.closest(&ray, 0.0)?;
        let s = scene.surface(&ray, &hit);
        Some(Spot { position: s.position, normal: s.normal, albedo: scene.albedo(s.triangle, s.barycentric) })
    };
    let (w, h) = eye.size();
    let pixels: Vec<Pixel> = (0..w * h).into_par_iter().map(|i| pixel((i % w) as f64, (i / w) as f64, cast)).collect();
    let wrap = matches!(eye, Eye::Panorama { .. });
    // light on a spot in pixel i, by each half
    let light = |i: usize, spot: &Spot| -> [Vec3; 2] {
        let (x, y) = ((i % w) as isize, (i / w) as isize);
        let (mut sums, mut weight) = ([Vec3::ZERO; 2], Vec3::ZERO);
        for dy in (-WINDOW).max(-y)..=WINDOW.min(h as isize - 1 - y) {
            for dx in -WINDOW..=WINDOW {
                let column = if wrap { (x + dx).rem_euclid(w as isize) } else { x + dx };
                if !(0..w as isize).contains(&column) {
                    continue;
                }
                let j = (y + dy) as usize * w + column as usize;
                let away = Vec2::new(dx as f32, dy as f32).length_squared() / (2.0 * SIGMA_PX * SIGMA_PX);
                let Some(centre) = &pixels[j].centre else { continue };
                let k = pixels[j].purity * closeness(centre, spot, away);
                for (sum, half) in sums.iter_mut().zip(halves) {
                    *sum += k * half.pixels[j];
                }
                weight += k * pixels[j].albedo;
            }
        }
        sums.map(|sum| sum / weight.max(Vec3::splat(1e-6)))
    };
    let smooth: Vec<[Vec3; 2]> = (0..w * h)
        .into_par_iter()
        .map(|i| {
            let pixel = &pixels[i];
            let spots = if pixel.purity > 0.95 { std::slice::from_ref(&pixel.centre) } else { &pixel.quarters[..] };
            let (mut sums, mut weight) = ([Vec3::ZERO; 2], Vec3::splat(1e-6));
            for spot in spots.iter().flatten() {
                for (sum, light) in sums.iter_mut().zip(light(i, spot)) {
                    *sum += spot.albedo * light;
                }
                weight += spot.albedo;
            }
            sums.map(|sum| pixel.albedo * sum / weight)
        })
        .collect();
    [0, 1].map(|k| Picture { width: w, height: h, pixels: smooth.iter().map(|s| s[k]).collect() })
}

fn pixel(x: f64, y: f64, cast: impl Fn(f64, f64) -> Option<Spot>) -> Pixel {
    let mut albedo = Vec3::ZERO;
    for k in 0..ALBEDO_GRID * ALBEDO_GRID {
        let sub = |k: usize| (k as f64 + 0.5) / ALBEDO_GRID as f64;
        albedo += cast(x + sub(k % ALBEDO_GRID), y + sub(k / ALBEDO_GRID)).map_or(Vec3::ZERO, |s| s.albedo);
    }
    let quarters = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)].map(|(u, v)| cast(x + u, y + v));
    let centre = cast(x + 0.5, y + 0.5);
    let alike = |c: &Spot| quarters.iter().flatten().map(|q| closeness(q, c, 0.0)).sum::<f32>() / 4.0;
    let purity = centre.as_ref().map_or(0.0, |c| alike(c).powi(4));
    Pixel { albedo: albedo / (ALBEDO_GRID * ALBEDO_GRID) as f32, centre, quarters, purity }
}

/// 1 for the same place on the same surface, falling with distance along it, with height above it and with the angle
/// between normals, and by e^−`away`.
fn closeness(a: &Spot, b: &Spot, away: f32) -> f32 {
    let cosine = a.normal.dot(b.normal);
    if cosine < 0.5 {
        return 0.0;
    }
    let apart = a.position - b.position;
    let square = apart.length_squared();
    let height = apart.dot(b.normal).powi(2) / (0.02 + 0.1 * square.sqrt()).powi(2);
    let fall = square / (2.0 * SIGMA_M * SIGMA_M) + height + away;
    if fall > 9.0 { 0.0 } else { cosine.powi(16) * (-fall).exp() }
}
