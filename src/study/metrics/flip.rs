//! ꟻLIP: how different two pictures look when a person flips between them.
//!
//! After Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, *ꟻLIP: A Difference Evaluator for
//! Alternating Images*, HPG 2020. Both pictures are blurred by what the eye resolves at a viewing distance (section
//! 4.1.1) and compared in colour (4.1.2–4.1.3); edges and points are compared apart (4.2); a missed edge amplifies the
//! colour difference (4.3).

use std::f32::consts::PI;

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::mean_where;
use crate::panorama::{Exposure, Picture};

/// Pixels per degree of a 0.7 m wide 3840-pixel screen at 0.7 m, the paper's default.
const PIXELS_PER_DEGREE: f32 = 67.0;

/// Mean ꟻLIP of a picture against the truth, 0 (same) to 1; see [`flip_map`].
pub fn flip(test: &Picture, truth: &Picture) -> f64 {
    mean_where(&flip_map(test, truth), |_| true)
}

/// ꟻLIP per pixel, 0..=1, of two linear pictures of the same size, both seen through the truth's [`Exposure`] and
/// clipped to 0..=1. (Encoding to sRGB, which the published metric undoes first, is left out.) Pixels that are no light
/// count as black. Pictures of different sizes are wholly different: 1 everywhere.
pub fn flip_map(test: &Picture, truth: &Picture) -> Vec<f32> {
    if (test.width, test.height) != (truth.width, truth.height) {
        return vec![1.0; truth.pixels.len()];
    }
    flip_under(Exposure::of(truth), test, truth)
}

/// [`flip_map`] under a given exposure, of pictures that have the same size.
pub(crate) fn flip_under(exposure: Exposure, test: &Picture, truth: &Picture) -> Vec<f32> {
    let seen = |p: &Picture| p.pixels.iter().map(|&p| exposure.clip(p)).collect::<Vec<_>>();
    flip_ldr(&seen(test), &seen(truth), truth.width, truth.height)
}

/// LDR-ꟻLIP per pixel at 67 pixels per degree, of linear Rec. 709 values in 0..=1, `width × height` of them in each.
pub fn flip_ldr(test: &[Vec3], truth: &[Vec3], width: usize, height: usize) -> Vec<f32> {
    debug_assert!(test.len() == width * height && truth.len() == width * height);
    if width == 0 || height == 0 {
        return Vec::new();
    }
    let (test, truth) = (opponent(test, width, height), opponent(truth, width, height));
    let colour = colour_difference(&test, &truth);
    let feature = feature_difference(&test[0], &truth[0]);
    // eq. 13: ΔE = ΔE_c^(1 − ΔE_f)
    colour.par_iter().zip(&feature).map(|(&c, &f)| c.powf(1.0 - f)).collect()
}

/// One channel of a picture.
struct Plane {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

/// The linearised opponent space Y_y C_x C_z, 0..=100 and about ±100.
fn opponent(pixels: &[Vec3], width: usize, height: usize) -> [Plane; 3] {
    let plane = |i: usize| {
        let values = pixels.par_iter().map(|&p| to_opponent(p)[i]).collect();
        Plane { width, height, values }
    };
    [plane(0), plane(1), plane(2)]
}

/// From linear Rec. 709 to XYZ over that of white, from the primaries' chromaticities and D65 (0.3127, 0.3290).
const TO_XYZ: Mat3 = Mat3::from_cols_array(&[
    0.412_390_8 / WHITE.x,
    0.212_639,
    0.019_330_82 / WHITE.z,
    0.357_584_34 / WHITE.x,
    0.715_168_7,
    0.119_194_78 / WHITE.z,
    0.180_480_8 / WHITE.x,
    0.072_192_32,
    0.950_532_15 / WHITE.z,
]);

/// XYZ of D65 white with Y = 1.
const WHITE: Vec3 = Vec3::new(0.950_455_9, 1.0, 1.089_057_8);

fn to_opponent(rgb: Vec3) -> Vec3 {
    let xyz = TO_XYZ * rgb;
    Vec3::new(116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z))
}

fn opponent_to_xyz(c: Vec3) -> Vec3 {
    let y = (c.x + 16.0) / 116.0;
    Vec3::new(y + c.y / 500.0, y, y - c.z / 200.0)
}

/// Colour difference per pixel, 0..=1 (section 4.1).
fn colour_difference(test: &[Plane; 3], truth: &[Plane; 3]) -> Vec<f32> {
    let seen = |planes: &[Plane; 3]| {
        let [y, x, z] = [0, 1, 2].map(|i| planes[i].seen_by_the_eye(SENSITIVITY[i]));
        let from_xyz = TO_XYZ.inverse();
        let lab = |i: usize| {
            let rgb = from_xyz * opponent_to_xyz(Vec3::new(y[i], x[i], z[i]));
            hunt_lab(rgb.clamp(Vec3::ZERO, Vec3::ONE))
        };
        (0..y.len()).into_par_iter().map(lab).collect::<Vec<_>>()
    };
    let (test, truth) = (seen(test), seen(truth));
    let most = hyab(hunt_lab(Vec3::Y), hunt_lab(Vec3::Z)).powf(COLOUR_POWER);
    test.par_iter().zip(&truth).map(|(&a, &b)| redistribute(hyab(a, b).powf(COLOUR_POWER), most)).collect()
}

/// q_c of section 4.1.3.
const COLOUR_POWER: f32 = 0.7;

/// Contrast sensitivity of the achromatic, red–green and blue–yellow channels as sums of two Gaussians: (a₁, b₁, a₂, b₂)
/// of table 1.
const SENSITIVITY: [[f32; 4]; 3] = [[1.0, 0.0047, 0.0, 1e-5], [1.0, 0.0053, 0.0, 1e-5], [34.1, 0.04, 13.5, 0.025]];

/// CIELAB with a and b scaled by the Hunt effect: colours are less vivid in the dark (eq. 5).
fn hunt_lab(rgb: Vec3) -> Vec3 {
    let f = (TO_XYZ * rgb).to_array().map(|t| {
        let delta: f32 = 6.0 / 29.0;
        if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 }
    });
    let l = 116.0 * f[1] - 16.0;
    Vec3::new(l, 0.01 * l * 500.0 * (f[0] - f[1]), 0.01 * l * 200.0 * (f[1] - f[2]))
}

/// The HyAB distance: city-block in lightness, Euclidean in chroma (eq. 6).
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// Gives the lower 40 % of the differences 95 % of the range (eq. 8).
fn redistribute(difference: f32, most: f32) -> f32 {
    const SPLIT: f32 = 0.4;
    const SHARE: f32 = 0.95;
    let knee = SPLIT * most;
    if difference < knee {
        difference * SHARE / knee
    } else {
        (SHARE + (difference - knee) / (most - knee) * (1.0 - SHARE)).min(1.0)
    }
}

/// Difference of edges and points per pixel, 0..=1 (section 4.2).
fn feature_difference(test: &Plane, truth: &Plane) -> Vec<f32> {
    let (test, truth) = (features(test), features(truth));
    let difference = |((t, r), (tp, rp)): ((&f32, &f32), (&f32, &f32))| {
        let most = (t - r).abs().max((tp - rp).abs());
        (std::f32::consts::FRAC_1_SQRT_2 * most).sqrt()
    };
    let edges = test.0.par_iter().zip(&truth.0);
    edges.zip(test.1.par_iter().zip(&truth.1)).map(difference).collect()
}

/// Magnitudes of edges and of points: first and second derivatives of a Gaussian 0.082° wide (eq. 9–11).
fn features(achromatic: &Plane) -> (Vec<f32>, Vec<f32>) {
    let sd = 0.5 * 0.082 * PIXELS_PER_DEGREE;
    let radius = (3.0 * sd).ceil() as i32;
    let taps = |f: &dyn Fn(f32) -> f32| (-radius..=radius).map(|x| f(x as f32)).collect::<Vec<_>>();
    let gauss = |x: f32| (-x * x / (2.0 * sd * sd)).exp();
    let smooth = balanced(taps(&gauss));
    let edge = balanced(taps(&|x| -x * gauss(x)));
    let point = balanced(taps(&|x| (x * x / (sd * sd) - 1.0) * gauss(x)));

    let grey = Plane { values: achromatic.values.par_iter().map(|y| (y + 16.0) / 116.0).collect(), ..*achromatic };
    let smoothed = grey.along_rows(&smooth);
    let magnitude = |kernel: &[f32]| {
        let across = grey.along_rows(kernel).along_columns(&smooth);
        let down = smoothed.along_columns(kernel);
        across.values.par_iter().zip(&down.values).map(|(x, y)| x.hypot(*y)).collect()
    };
    (magnitude(&edge), magnitude(&point))
}

/// Scales positive taps to sum to 1 and negative ones to −1.
fn balanced(mut kernel: Vec<f32>) -> Vec<f32> {
    let positive: f32 = kernel.iter().filter(|k| **k > 0.0).sum();
    let negative: f32 = kernel.iter().filter(|k| **k < 0.0).sum();
    for k in &mut kernel {
        *k /= if *k > 0.0 { positive } else { -negative.min(-f32::MIN_POSITIVE) };
    }
    kernel
}

impl Plane {
    /// Filtered by a contrast sensitivity function: Σ aᵢ √(π/bᵢ) exp(−π² r²/bᵢ), r in degrees, normalised (eq. 2–3).
    fn seen_by_the_eye(&self, [a1, b1, a2, b2]: [f32; 4]) -> Vec<f32> {
        // one radius for all channels, three standard deviations of the widest
        let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
        let gauss = |b: f32| {
            let at = |x: i32| (-(PI * x as f32 / PIXELS_PER_DEGREE).powi(2) / b).exp();
            (-radius..=radius).map(at).collect::<Vec<_>>()
        };
        // each Gaussian is separable; in two dimensions it sums to the square of its row
        let term = |a: f32, b: f32| {
            let kernel = gauss(b);
            let sum: f32 = kernel.iter().sum();
            let normal: Vec<_> = kernel.iter().map(|k| k / sum).collect();
            (a * (PI / b).sqrt() * sum * sum, normal)
        };
        let ((w1, k1), (w2, k2)) = (term(a1, b1), term(a2, b2));
        let mut out = self.along_rows(&k1).along_columns(&k1).values;
        if w2 > 0.0 {
            let second = self.along_rows(&k2).along_columns(&k2).values;
            let share = w2 / (w1 + w2);
            out.par_iter_mut().zip(&second).for_each(|(a, b)| *a += (b - *a) * share);
        }
        out
    }

    /// Convolved along rows; beyond the edge the edge's value goes on.
    fn along_rows(&self, kernel: &[f32]) -> Self {
        let radius = kernel.len() / 2;
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_mut(self.width).zip(self.values.par_chunks(self.width)).for_each(|(out, row)| {
            let mut padded = vec![row[0]; self.width + 2 * radius];
            padded[radius..radius + self.width].copy_from_slice(row);
            padded[radius + self.width..].fill(row[self.width - 1]);
            for (i, &k) in kernel.iter().rev().enumerate() {
                add_scaled(out, &padded[i..i + self.width], k);
            }
        });
        Self { values, ..*self }
    }

    /// Convolved along columns; beyond the edge the edge's value goes on.
    fn along_columns(&self, kernel: &[f32]) -> Self {
        let radius = kernel.len() as i64 / 2;
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_mut(self.width).enumerate().for_each(|(y, out)| {
            for (i, &k) in kernel.iter().rev().enumerate() {
                let from = (y as i64 + i as i64 - radius).clamp(0, self.height as i64 - 1) as usize;
                add_scaled(out, &self.values[from * self.width..(from + 1) * self.width], k);
            }
        });
        Self { values, ..*self }
    }
}

fn add_scaled(out: &mut [f32], row: &[f32], k: f32) {
    for (o, v) in out.iter_mut().zip(row) {
        *o += k * v;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3Swizzles;

    const W: usize = 48;
    const H: usize = 32;

    fn truth_at(x: usize, y: usize) -> Vec3 {
        let blue = ((x / 8 + y / 8) % 2) as f32 * 0.8;
        Vec3::new(((x * 7 + y * 3) % 32) as f32 / 31.0, ((x * x + y * 5) % 29) as f32 / 28.0, blue)
    }

    fn filled(f: impl Fn(usize, usize) -> Vec3) -> Vec<Vec3> {
        (0..W * H).map(|i| f(i % W, i / W)).collect()
    }

    /// Mean and the values at (0, 0), (24, 16) and (47, 31) as NVIDIA's own `flip-evaluator` 1.7 (Python) gives them for
    /// the same pictures, sRGB-encoded, as LDR at its default 67 pixels per degree.
    #[test]
    fn agrees_with_the_authors_own_program() {
        let truth = filled(truth_at);
        let noisy = filled(|x, y| (truth_at(x, y) * 0.8 + Vec3::splat((x * y % 5) as f32 / 40.0)).min(Vec3::ONE));
        let moved = filled(|x, y| truth_at((x + W - 3) % W, y));
        let flat = filled(|_, _| Vec3::splat(0.5));
        let cases = [
            (noisy, [0.246_857, 0.267_846, 0.205_587, 0.432_153]),
            (moved, [0.489_540, 0.964_940, 0.467_977, 0.526_895]),
            (flat, [0.494_187, 0.977_283, 0.316_477, 0.962_413]),
        ];
        for (test, expected) in cases {
            let map = flip_ldr(&test, &truth, W, H);
            let mean = map.iter().sum::<f32>() / map.len() as f32;
            let got = [mean, map[0], map[16 * W + 24], map[31 * W + 47]];
            for (g, e) in got.iter().zip(expected) {
                assert!((g - e).abs() < 1e-3, "{got:?} for {expected:?}");
            }
            assert!((got[0] - expected[0]).abs() < 3e-4, "{got:?} for {expected:?}");
        }
    }

    #[test]
    fn equals_do_not_differ_and_opposites_do() {
        let truth = filled(truth_at);
        assert!(flip_ldr(&truth, &truth, W, H).iter().all(|e| *e == 0.0));
        let (black, white) = (filled(|_, _| Vec3::ZERO), filled(|_, _| Vec3::ONE));
        let map = flip_ldr(&black, &white, W, H);
        assert!(map.iter().all(|e| *e > 0.9 && *e <= 1.0), "{}", map[0]);
        assert!(flip_ldr(&[], &[], 0, 0).is_empty());
    }

    #[test]
    fn exposure_makes_units_of_light_irrelevant_and_ill_pixels_stay_finite() {
        let picture = |scale: f32| Picture { width: W, height: H, pixels: filled(|x, y| truth_at(x, y) * scale) };
        let mut other = picture(1.0);
        other.pixels.iter_mut().for_each(|p| *p = p.yzx());
        let once = flip(&other, &picture(1.0));
        other.pixels.iter_mut().for_each(|p| *p *= 1e4);
        let again = flip(&other, &picture(1e4));
        assert!(once > 0.1 && (once - again).abs() < 1e-4, "{once} {again}");
        other.pixels[7] = Vec3::splat(f32::NAN);
        other.pixels[8] = Vec3::splat(-1.0);
        assert!(flip_map(&other, &picture(1e4)).iter().all(|e| (0.0..=1.0).contains(e)));
        assert_eq!(flip(&Picture::new(2, 2), &picture(1.0)), 1.0);
    }
}
