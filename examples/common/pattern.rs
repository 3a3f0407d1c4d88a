//! Patterns for painting finishes: seeded noise, masonry, stars, and how a picture becomes a JPEG file.
//!
//! u runs right and v up, both 0..1 over the picture; colours are linear albedos.

use glam::{DVec2, DVec3, dvec2};
use image::codecs::jpeg::JpegEncoder;
use image::{ImageResult, Rgb, RgbImage};
use std::f64::consts::TAU;

/// A picture of `size` pixels, the mean of `side` × `side` points of each pixel.
pub fn painted(size: [u32; 2], side: u32, paint: impl Fn(DVec2) -> DVec3) -> RgbImage {
    let n = f64::from(side);
    RgbImage::from_fn(size[0], size[1], |x, y| {
        let mut sum = DVec3::ZERO;
        for k in 0..side * side {
            let sub = dvec2(f64::from(k % side), f64::from(k / side)) / n + 0.5 / n;
            let at = (dvec2(f64::from(x), f64::from(y)) + sub) / dvec2(f64::from(size[0]), f64::from(size[1]));
            sum += paint(dvec2(at.x, 1.0 - at.y));
        }
        Rgb((sum / (n * n)).to_array().map(encode))
    })
}

/// The picture as a JPEG file.
///
/// # Errors
/// When it cannot be encoded.
pub fn jpeg(picture: &RgbImage, quality: u8) -> ImageResult<Vec<u8>> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality).encode_image(picture).map(|()| bytes)
}

/// sRGB code of a linear value (IEC 61966-2-1).
pub fn encode(v: f64) -> u8 {
    let v = v.clamp(0.0, 1.0);
    let s = if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (s * 255.0).round() as u8
}

/// A number in 0..1 from a lattice point and a seed.
pub fn hash(x: i64, y: i64, seed: u64) -> f64 {
    let mut h = seed ^ (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
    for _ in 0..2 {
        h = (h ^ (h >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        h = (h ^ (h >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        h ^= h >> 31;
    }
    (h >> 11) as f64 / (1u64 << 53) as f64
}

/// Smooth noise in 0..1 that repeats every `cells` lattice cells over the unit square.
pub fn noise(p: DVec2, cells: [i64; 2], seed: u64) -> f64 {
    let q = p * dvec2(cells[0] as f64, cells[1] as f64);
    let (cell, f) = (q.floor(), q - q.floor());
    let w = f * f * (3.0 - 2.0 * f);
    let at = |dx: i64, dy: i64| {
        hash((cell.x as i64 + dx).rem_euclid(cells[0]), (cell.y as i64 + dy).rem_euclid(cells[1]), seed)
    };
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    mix(mix(at(0, 0), at(1, 0), w.x), mix(at(0, 1), at(1, 1), w.x), w.y)
}

/// Octaves of noise, around 0, about −1..1.
pub fn cloud(p: DVec2, cells: [i64; 2], octaves: u32, seed: u64) -> f64 {
    (0..octaves)
        .map(|k| (noise(p, cells.map(|c| c << k), seed + u64::from(k)) - 0.5) * 2.0 * 0.6f64.powi(k as i32))
        .sum::<f64>()
        * 0.6
}

/// Masonry: which block a point is in, and how far it is from the block's edge in metres. `block` is its size in
/// metres, `tile` the picture's; rows are shifted by half a block in turn.
pub fn bond(p: DVec2, tile: DVec2, block: DVec2) -> ([i64; 2], f64) {
    let q = p * tile / block;
    let row = q.y.floor();
    let x = q.x + if row as i64 % 2 == 0 { 0.0 } else { 0.5 };
    let column = x.floor().rem_euclid((tile.x / block.x).round());
    let f = dvec2(x - x.floor(), q.y - row);
    let edge = f.min(1.0 - f) * block;
    ([column as i64, row as i64], edge.min_element())
}

/// Whether a point is inside a polygon (even–odd rule).
pub fn inside_polygon(p: DVec2, points: &[[f64; 2]]) -> bool {
    let mut inside = false;
    for i in 0..points.len() {
        let (a, b) = (points[i], points[(i + 1) % points.len()]);
        if (a[1] > p.y) != (b[1] > p.y) && p.x < (b[0] - a[0]) * (p.y - a[1]) / (b[1] - a[1]) + a[0] {
            inside = !inside;
        }
    }
    inside
}

/// Radius of a star with `points` points of depth `depth` (0..1), relative to its tips, at an angle.
pub fn star(angle: f64, points: f64, depth: f64) -> f64 {
    let phase = (angle * points / TAU).rem_euclid(1.0);
    let t = (2.0 * phase - 1.0).abs();
    1.0 - depth + depth * t * t
}

/// The polar form of `p` around `centre`, in a field `size` wide and high.
pub fn polar(p: DVec2, centre: DVec2, size: DVec2) -> (f64, f64) {
    let d = (p - centre) * size;
    (d.length(), d.y.atan2(d.x))
}
