//! How far a picture is from the truth.
//!
//! Pictures are linear RGB. Pixels whose truth is no light (see [`Picture::valid`]) are left out; where only the tested
//! picture is invalid it counts as black.

pub(crate) mod blocks;
pub(crate) mod flip;

use glam::{DVec3, Vec3};

use crate::panorama::{Exposure, Picture, linear_to_srgb, luminance};

/// The share of worst pixels that [`relmse`] leaves out, so that a few fireflies do not decide.
pub(crate) const TRIMMED: f64 = 0.001;

/// Root of the mean squared error over all pixels and channels; 0 where no pixel is left.
pub fn rmse(x: &[Vec3], t: &[Vec3]) -> f64 {
    let pairs = x.iter().zip(t).filter_map(|(x, t)| usable(*x, *t));
    let (sum, count) = pairs.fold((0.0, 0usize), |(s, n), (x, t)| (s + (x - t).length_squared(), n + 1));
    per(sum, 3 * count).sqrt()
}

/// Relative mean squared error: mean over pixels of the mean over channels of (x − t)² / (t² + 0.01·m²), where m is the
/// truth's mean over all pixels and channels; the worst 0.1 % of pixels are dropped (rounded down); 0 where no pixel
/// is left.
pub fn relmse(x: &[Vec3], t: &[Vec3]) -> f64 {
    relmse_where(x, t, |_| true)
}

/// [`relmse`] over the pixels that `chosen` picks by index; m stays that of the whole truth.
pub fn relmse_where(x: &[Vec3], t: &[Vec3], chosen: impl Fn(usize) -> bool) -> f64 {
    let floor = relative_floor(t);
    let error = |(x, t): (DVec3, DVec3)| sum3((x - t) * (x - t) / (t * t + floor)) / 3.0;
    let indexed = x.iter().zip(t).enumerate().filter(|(i, _)| chosen(*i));
    let mut errors: Vec<f64> = indexed.filter_map(|(_, (x, t))| usable(*x, *t)).map(error).collect();
    errors.sort_unstable_by(f64::total_cmp);
    errors.truncate(errors.len() - (errors.len() as f64 * TRIMMED) as usize);
    per(errors.iter().sum(), errors.len())
}

/// 0.01·m² of [`relmse`], above 0: what keeps it from dividing by black.
pub(crate) fn relative_floor(t: &[Vec3]) -> f64 {
    let valid = t.iter().filter(|t| Picture::valid(**t));
    let (sum, count) = valid.fold((0.0, 0usize), |(s, n), t| (s + sum3(t.as_dvec3()), n + 1));
    let mean = per(sum, 3 * count);
    (0.01 * mean * mean).max(f64::MIN_POSITIVE)
}

/// Median over pixels of Σ|x − t| / Σt, sums over channels; pixels whose truth is black are left out; 0 where none is
/// left.
pub fn median_relative_error(x: &[Vec3], t: &[Vec3], chosen: impl Fn(usize) -> bool) -> f64 {
    median(relative_errors(x, t, chosen))
}

/// Per pixel that `chosen` picks Σ|x − t| / Σt, sums over channels; pixels whose truth is black are left out.
pub(crate) fn relative_errors(x: &[Vec3], t: &[Vec3], chosen: impl Fn(usize) -> bool) -> Vec<f64> {
    let indexed = x.iter().zip(t).enumerate().filter(|(i, _)| chosen(*i));
    indexed
        .filter_map(|(_, (x, t))| usable(*x, *t))
        .filter(|(_, t)| *t != DVec3::ZERO)
        .map(|(x, t)| sum3((x - t).abs()) / sum3(t))
        .collect()
}

/// The median of errors, in any order; 0 where there is none.
pub fn median(mut errors: Vec<f64>) -> f64 {
    errors.sort_unstable_by(f64::total_cmp);
    match errors.len() {
        0 => 0.0,
        n => 0.5 * (errors[(n - 1) / 2] + errors[n / 2]),
    }
}

/// Mean of an error map (such as [`super::flip_map`]'s) over the pixels that `chosen` picks by index; 0 where none is.
pub fn mean_where(map: &[f32], chosen: impl Fn(usize) -> bool) -> f64 {
    let picked = map.iter().enumerate().filter(|(i, _)| chosen(*i));
    let (sum, count) = picked.fold((0.0, 0usize), |(s, n), (_, e)| (s + f64::from(*e), n + 1));
    per(sum, count)
}

/// A sum over its number of parts; 0 where there is none, so that no NaN leaves.
fn per(sum: f64, count: usize) -> f64 {
    if count > 0 { sum / count as f64 } else { 0.0 }
}

/// Structural similarity of luminance, −1..=1, 1 for equal pictures (Wang, Bovik, Sheikh and Simoncelli, *Image Quality
/// Assessment*, 2004): 11 × 11 Gaussian windows of 1.5 pixels that lie wholly inside, K₁ = 0.01, K₂ = 0.03, on luminance
/// under the truth's exposure, clipped and sRGB-encoded to 0..=1. Pictures smaller than a window, or of different sizes,
/// have none: 0.
pub fn ssim(test: &Picture, truth: &Picture) -> f64 {
    let map = ssim_map(test, truth, Exposure::of(truth));
    per(map.iter().sum(), map.len())
}

/// The side of a window of structural similarity.
pub(crate) const WINDOW: usize = 11;

/// [`ssim`] of every window, under a given exposure: `(width − 10) × (height − 10)` of them, row by row; none where there
/// is no window, or the pictures' sizes differ.
pub(crate) fn ssim_map(test: &Picture, truth: &Picture, exposure: Exposure) -> Vec<f64> {
    let (w, h) = (truth.width, truth.height);
    if (test.width, test.height) != (w, h) || w < WINDOW || h < WINDOW {
        return Vec::new();
    }
    let grey = |p: &Picture| -> Vec<f64> {
        p.pixels.iter().map(|&p| f64::from(linear_to_srgb(luminance(exposure.clip(p)).clamp(0.0, 1.0)))).collect()
    };
    let (x, t) = (grey(test), grey(truth));
    let products = |a: &[f64], b: &[f64]| window_means(&a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<_>>(), w, h);
    let (mx, mt) = (window_means(&x, w, h), window_means(&t, w, h));
    let (xx, tt, xt) = (products(&x, &x), products(&t, &t), products(&x, &t));
    let (c1, c2) = (0.01f64.powi(2), 0.03f64.powi(2));
    let index = |i: usize| {
        let (a, b) = (mx[i], mt[i]);
        let structure = (2.0 * (xt[i] - a * b) + c2) / (xx[i] - a * a + tt[i] - b * b + c2);
        (2.0 * a * b + c1) / (a * a + b * b + c1) * structure
    };
    (0..mx.len()).map(index).collect()
}

/// Gaussian means over every 11 × 11 window that lies wholly inside.
fn window_means(values: &[f64], w: usize, h: usize) -> Vec<f64> {
    let taps: Vec<f64> = (-5..=5).map(|i| (-f64::from(i * i) / (2.0 * 1.5 * 1.5)).exp()).collect();
    let total: f64 = taps.iter().sum();
    let side = taps.len();
    let weighted = |at: &dyn Fn(usize) -> f64| taps.iter().enumerate().map(|(k, t)| t * at(k)).sum::<f64>() / total;
    let columns = w + 1 - side;
    let rows: Vec<f64> = (0..columns * h).map(|i| weighted(&|k| values[i / columns * w + i % columns + k])).collect();
    (0..columns * (h + 1 - side)).map(|i| weighted(&|k| rows[i + k * columns])).collect()
}

/// Both in f64, what is no light as black; `None` where the truth is no light.
pub(crate) fn usable(x: Vec3, t: Vec3) -> Option<(DVec3, DVec3)> {
    let x = if Picture::valid(x) { x } else { Vec3::ZERO };
    Picture::valid(t).then(|| (x.as_dvec3(), t.as_dvec3()))
}

pub(crate) fn sum3(v: DVec3) -> f64 {
    v.x + v.y + v.z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_a_constant_offset_have_closed_forms() {
        let t = vec![Vec3::splat(2.0); 2000];
        let mut x = vec![Vec3::splat(3.0); 2000];
        assert!((rmse(&x, &t) - 1.0).abs() < 1e-12);
        // (3 − 2)² / (2² + 0.01·2²)
        assert!((relmse(&x, &t) - 1.0 / 4.04).abs() < 1e-12);
        assert!((median_relative_error(&x, &t, |_| true) - 0.5).abs() < 1e-12);
        // 0.1 % of 2000 are two fireflies; a third one counts
        x[0] = Vec3::splat(1e9);
        x[1] = Vec3::splat(f32::NAN);
        x[2] = Vec3::splat(22.0);
        let with_nan = (1997.0 / 4.04 + 4.0 / 4.04) / 1998.0;
        assert!((relmse(&x, &t) - with_nan).abs() < 1e-12, "{} {with_nan}", relmse(&x, &t));
        let chosen = |i: usize| i >= 1000;
        assert!((relmse_where(&x, &t, chosen) - 1.0 / 4.04).abs() < 1e-12);
    }

    #[test]
    fn channels_are_averaged_within_a_pixel() {
        let t = vec![Vec3::new(1.0, 2.0, 3.0); 10];
        let x = vec![Vec3::new(2.0, 2.0, 3.0); 10];
        // m = 2: only red errs, by 1/(1 + 0.04)
        assert!((relmse(&x, &t) - 1.0 / 1.04 / 3.0).abs() < 1e-12);
        assert!((rmse(&x, &t) - (1.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((median_relative_error(&x, &t, |_| true) - 1.0 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn invalid_truth_and_black_truth_do_not_poison() {
        let t = vec![Vec3::splat(f32::NAN), Vec3::splat(-1.0), Vec3::ONE];
        let x = vec![Vec3::ONE, Vec3::ONE, Vec3::ONE];
        assert_eq!(relmse(&x, &t), 0.0);
        assert_eq!(rmse(&x, &t), 0.0);
        assert!(relmse(&x[..1], &[Vec3::ZERO]).is_finite());
        assert_eq!(median_relative_error(&x[..1], &[Vec3::ZERO], |_| true), 0.0);
        assert!((mean_where(&[1.0, 2.0, 6.0], |i| i > 0) - 4.0).abs() < 1e-12);
    }

    fn waves(phase: f32, contrast: f32) -> Picture {
        let mut picture = Picture::new(40, 30);
        for (i, p) in picture.pixels.iter_mut().enumerate() {
            let (x, y) = ((i % 40) as f32, (i / 40) as f32);
            *p = Vec3::splat(1.0 + contrast * (0.7 * x + phase).sin() * (0.5 * y).cos());
        }
        picture
    }

    #[test]
    fn ssim_is_one_for_equals_and_falls_with_difference() {
        let truth = waves(0.0, 0.5);
        assert!((ssim(&truth, &truth) - 1.0).abs() < 1e-9);
        let (near, far) = (ssim(&waves(0.1, 0.5), &truth), ssim(&waves(1.0, 0.5), &truth));
        assert!(1.0 > near && near > far && far > 0.0, "{near} {far}");
        assert!(ssim(&waves(std::f32::consts::PI, 0.5), &truth) < 0.0);
        assert_eq!(ssim(&Picture::new(5, 5), &Picture::new(5, 5)), 0.0);
    }

    #[test]
    fn ssim_of_flat_pictures_has_a_closed_form() {
        let (mut a, mut b) = (Picture::new(20, 20), Picture::new(20, 20));
        a.pixels.fill(Vec3::splat(2.0));
        b.pixels.fill(Vec3::splat(1.0));
        // the truth lands at 0.18, the other at 0.36; only the luminance term differs from 1
        let (x, t) = (f64::from(linear_to_srgb(0.36)), f64::from(linear_to_srgb(0.18)));
        let expected = (2.0 * x * t + 1e-4) / (x * x + t * t + 1e-4);
        assert!((ssim(&a, &b) - expected).abs() < 1e-6, "{} {expected}", ssim(&a, &b));
    }
}
