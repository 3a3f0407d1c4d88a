//! Scores against ground truth.

use clerestory::panorama::{self, Picture, luminance};
use clerestory::study;
use glam::Vec3;

/// Area under the precision-recall curve as average precision: pixels ranked by score, ties as one step.
pub fn average_precision(scores: &[f32], truth: &[bool], counted: &[bool]) -> f64 {
    let mut all: Vec<(f32, bool)> = (0..scores.len()).filter(|i| counted[*i]).map(|i| (scores[i], truth[i])).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let positives = all.iter().filter(|p| p.1).count().max(1) as f64;
    let (mut hits, mut seen, mut area, mut last) = (0.0, 0.0, 0.0, 0.0);
    let mut i = 0;
    while i < all.len() {
        let value = all[i].0;
        while i < all.len() && all[i].0 == value {
            hits += f64::from(u8::from(all[i].1));
            seen += 1.0;
            i += 1;
        }
        let recall = hits / positives;
        area += (recall - last) * hits / seen;
        last = recall;
    }
    area
}

/// One minus SSIM of two pictures' brightness per pixel, 11 × 11 box windows.
pub fn dissimilarity(a: &[f32], b: &[f32], w: usize, h: usize) -> Vec<f32> {
    let blur = |v: &[f32]| -> Vec<f32> {
        let r = 5isize;
        let pass = |v: &[f32], n: usize, stride: usize, lines: usize, line: usize| {
            let mut out = vec![0.0; v.len()];
            for l in 0..lines {
                for i in 0..n {
                    let (mut s, mut c) = (0.0, 0.0);
                    for k in -r..=r {
                        let j = i as isize + k;
                        if j >= 0 && (j as usize) < n {
                            s += v[l * line + j as usize * stride];
                            c += 1.0;
                        }
                    }
                    out[l * line + i * stride] = s / c;
                }
            }
            out
        };
        let across = pass(v, w, 1, h, w);
        pass(&across, h, w, w, 1)
    };
    let times = |x: &[f32], y: &[f32]| -> Vec<f32> { x.iter().zip(y).map(|(x, y)| x * y).collect() };
    let (ma, mb) = (blur(a), blur(b));
    let (aa, bb, ab) = (blur(&times(a, a)), blur(&times(b, b)), blur(&times(a, b)));
    let (c1, c2) = (1e-4, 9e-4);
    (0..a.len())
        .map(|i| {
            let (va, vb, c) = (aa[i] - ma[i] * ma[i], bb[i] - mb[i] * mb[i], ab[i] - ma[i] * mb[i]);
            let s = (2.0 * ma[i] * mb[i] + c1) * (2.0 * c + c2)
                / ((ma[i] * ma[i] + mb[i] * mb[i] + c1) * (va.max(0.0) + vb.max(0.0) + c2));
            1.0 - s
        })
        .collect()
}

/// A region's pixels against a fault's: intersection over union.
pub fn overlap(region: &[usize], fault: &[bool], size: usize) -> f64 {
    let both = region.iter().filter(|i| fault[**i]).count();
    both as f64 / (region.len() + size - both).max(1) as f64
}

pub fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { f64::NAN } else { values.iter().sum::<f64>() / values.len() as f64 }
}

pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    if values.is_empty() { f64::NAN } else { values[values.len() / 2] }
}

/// Difference of logarithms after an exposure fit, 1 − SSIM and FLIP.
pub fn baselines(render: &Picture, photo: &Picture) -> [Vec<f32>; 3] {
    let valid = photo.pixels.iter().filter(|p| Picture::valid(**p));
    let white = Vec3::splat(valid.fold(0.0f32, |m, p| m.max(p.max_element())));
    let pixels = photo.pixels.iter().map(|p| if Picture::valid(*p) { *p } else { white }).collect();
    let photo = &Picture { pixels, ..photo.clone() };
    let log = |p: &Picture| -> Vec<f32> { p.pixels.iter().map(|v| luminance(*v).max(1e-6).ln()).collect() };
    let (a, b) = (log(render), log(photo));
    let mut d: Vec<f32> = a.iter().zip(&b).map(|(a, b)| b - a).collect();
    let at = d.len() / 2;
    let fit = *d.select_nth_unstable_by(at, f32::total_cmp).1;
    let difference = a.iter().zip(&b).map(|(a, b)| (b - a - fit).abs()).collect();
    let exposed = Picture { pixels: render.pixels.iter().map(|p| *p * fit.exp()).collect(), ..render.clone() };
    let mut all: Vec<f32> = photo.pixels.iter().map(|p| luminance(*p)).collect();
    let at = all.len() * 9 / 10;
    let white = *all.select_nth_unstable_by(at, f32::total_cmp).1;
    let shown = |p: &Picture| -> Vec<f32> {
        p.pixels.iter().map(|v| panorama::linear_to_srgb((luminance(*v) / white).clamp(0.0, 1.0))).collect()
    };
    let ssim = dissimilarity(&shown(&exposed), &shown(photo), photo.width, photo.height);
    [difference, ssim, study::flip_map(&exposed, photo)]
}
