//! Pictures of a case, to look at.

use clerestory::audit::Verdict;
use clerestory::panorama::{Picture, linear_to_srgb, luminance};
use image::{GrayImage, Luma};
use std::path::Path;

/// Brightness as a screen shows it, with the mean of its logarithm at 18 %.
pub fn tone(p: &Picture) -> Vec<f32> {
    let bright: Vec<f32> = p.pixels.iter().map(|p| luminance(*p)).collect();
    let known = bright.iter().filter(|b| b.is_finite());
    let sum: f64 = known.clone().map(|b| f64::from(b.max(1e-6).ln())).sum();
    let gain = 0.18 / (sum / known.count().max(1) as f64).exp() as f32;
    bright.iter().map(|b| linear_to_srgb((b * gain).clamp(0.0, 1.0))).collect()
}

/// A shade for each verdict.
pub fn verdicts(all: &[Verdict]) -> Vec<f32> {
    all.iter().map(|v| f32::from(*v as u8) / 4.0).collect()
}

/// Writes tiles (values 0..1), four to a row.
pub fn write(path: &Path, w: usize, h: usize, tiles: &[Vec<f32>]) {
    let mut all = GrayImage::new(4 * w as u32, (tiles.len().div_ceil(4) * h) as u32);
    for (k, tile) in tiles.iter().enumerate() {
        for (i, v) in tile.iter().enumerate() {
            let (x, y) = (k % 4 * w + i % w, k / 4 * h + i / w);
            all.put_pixel(x as u32, y as u32, Luma([(v.clamp(0.0, 1.0) * 255.0) as u8]));
        }
    }
    all.save(path).unwrap();
}
