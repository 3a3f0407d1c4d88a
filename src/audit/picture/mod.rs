//! Pictures as such: regions, colour and waves, and what they are off by.

pub(crate) mod by_luminance;
pub(crate) mod colour;
pub(crate) mod fourier;
pub(crate) mod regions;
pub(crate) mod student;

use glam::Vec3;

use crate::panorama::luminance;

/// Of fewer samples than this nothing is told.
pub(crate) const FEWEST: usize = 20;

/// Logarithm of the odds, 20 : 1, from which on one thing is told from another.
pub(crate) const ODDS: f32 = 3.0;

/// Pixels that a camera's pose may be off by when it is fitted: less is no displacement.
pub(crate) const POSE_PX: f32 = 0.7;

/// Pictures of less variance than this are even.
pub(crate) const EVEN: f32 = 1e-6;

/// Logarithm of a brightness; black counts as 10⁻⁴.
pub(crate) fn log_luminance(rgb: Vec3) -> f32 {
    luminance(rgb).max(1e-4).ln()
}

/// Pearson's correlation of pairs, and how many there are; 0 where either side is even.
pub(crate) fn correlation(pairs: impl Iterator<Item = (f32, f32)>) -> (f32, f64) {
    let [mut n, mut a, mut b, mut aa, mut bb, mut ab] = [0.0f64; 6];
    for (p, q) in pairs {
        let (p, q) = (f64::from(p), f64::from(q));
        n += 1.0;
        a += p;
        b += q;
        aa += p * p;
        bb += q * q;
        ab += p * q;
    }
    let m = n.max(1.0);
    let (va, vb) = (aa / m - (a / m).powi(2), bb / m - (b / m).powi(2));
    let c = if va.min(vb) < f64::from(EVEN) { 0.0 } else { (ab / m - a * b / m / m) / (va * vb).sqrt() };
    (c as f32, n)
}
