//! A picture that is still being measured: running sums of two independent halves, and the noise they tell.

use glam::DVec3;
use serde::Serialize;

use crate::panorama::Picture;
use crate::statistics::quantile;

/// Luminance weights of linear Rec. 709.
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// The side, in pixels, of the blocks over which noise is pooled.
const BLOCK: usize = 8;

/// Radiance per pixel as two independent halves (a, b), which share no random number, so that callers can compute
/// error without noise: for a picture x, mean((x−a)(x−b)) is the squared error of x.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Samples a pixel, in each half.
    pub samples_per_half: u32,
    /// Rays cast so far, shadow rays included.
    pub rays: u64,
    /// Per pixel Σ radiance of each half.
    pub(super) pixels: Vec<[DVec3; 2]>,
}

/// How noisy an estimate is: standard errors of the luminance, as a share of the luminance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Noise {
    /// The typical pixel's: the median over blocks of 8 × 8 pixels. 0.018 reads “about 1.8 % noise in the median pixel”.
    pub median: f64,
    /// The worst twentieth of the blocks has more than this.
    pub p95: f64,
    /// Root mean square standard error over the picture, over its mean.
    pub overall: f64,
    /// Standard error of the picture's mean, over that mean.
    pub of_mean: f64,
}

impl Estimate {
    /// Nothing measured yet.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, samples_per_half: 0, rays: 0, pixels: vec![[DVec3::ZERO; 2]; width * height] }
    }

    /// Samples a pixel, both halves together.
    pub fn samples(&self) -> u32 {
        2 * self.samples_per_half
    }

    /// The picture: mean radiance over all samples. Black where nothing has been sampled.
    pub fn mean(&self) -> Picture {
        let n = f64::from(self.samples().max(1));
        self.picture(|[a, b]| (a + b) / n)
    }

    /// One of the two independent halves: 0 or 1.
    pub fn half(&self, index: usize) -> Picture {
        let n = f64::from(self.samples_per_half.max(1));
        self.picture(|halves| halves[index & 1] / n)
    }

    /// Noise as the two halves tell it: half their difference is an unbiased draw of the mean's error, pooled over
    /// blocks of 8 × 8 pixels. All zero for an estimate without samples or without light.
    pub fn noise(&self) -> Noise {
        let n = f64::from(self.samples_per_half.max(1));
        let mut relative = Vec::new();
        let (mut all_squares, mut all_light) = (0.0, 0.0);
        for y0 in (0..self.height).step_by(BLOCK) {
            for x0 in (0..self.width).step_by(BLOCK) {
                let (mut squares, mut light, mut count) = (0.0, 0.0, 0.0);
                for y in y0..(y0 + BLOCK).min(self.height) {
                    for p in &self.pixels[y * self.width..][x0..(x0 + BLOCK).min(self.width)] {
                        let [a, b] = p.map(|h| h.dot(LUMINANCE) / n);
                        squares += (0.5 * (a - b)).powi(2);
                        light += 0.5 * (a + b);
                        count += 1.0;
                    }
                }
                all_squares += squares;
                all_light += light;
                if light > 0.0 {
                    relative.push((squares * count).sqrt() / light);
                }
            }
        }
        let mut at = |share: f64| quantile(&mut relative, share).unwrap_or(0.0);
        let per_light = |v: f64| if all_light > 0.0 { v / all_light } else { 0.0 };
        let pixels = self.pixels.len() as f64;
        Noise {
            median: at(0.5),
            p95: at(0.95),
            overall: per_light((all_squares * pixels).sqrt()),
            of_mean: per_light(all_squares.sqrt()),
        }
    }

    fn picture(&self, value: impl Fn([DVec3; 2]) -> DVec3) -> Picture {
        Picture {
            width: self.width,
            height: self.height,
            pixels: self.pixels.iter().map(|p| value(*p).as_vec3()).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::random::Sampler;
    use glam::Vec3;

    /// Samples of mean 2 and variance 1/3 (uniform on 1..3), independent.
    fn noisy(samples_per_half: u32) -> Estimate {
        let mut e = Estimate::new(64, 48);
        e.samples_per_half = samples_per_half;
        for (i, p) in e.pixels.iter_mut().enumerate() {
            for s in 0..2 * samples_per_half {
                let v = 1.0 + 2.0 * Sampler::new(7, i as u64, s, 1).single(0);
                p[(s & 1) as usize] += Vec3::splat(v).as_dvec3();
            }
        }
        e
    }

    #[test]
    fn noise_is_the_known_standard_error() {
        let e = noisy(8);
        let expected = (1.0_f64 / 3.0 / 16.0).sqrt() / 2.0;
        let noise = e.noise();
        assert!((noise.median / expected - 1.0).abs() < 0.05, "{noise:?} against {expected}");
        assert!((noise.overall / expected - 1.0).abs() < 0.05, "{noise:?} against {expected}");
        let of_mean = expected / f64::from(64 * 48_u32).sqrt();
        assert!((noise.of_mean / of_mean - 1.0).abs() < 0.05);
        assert!(noise.p95 > noise.median && noise.p95 < 1.5 * expected);
    }

    #[test]
    fn mean_is_the_mean_of_the_halves() {
        let e = noisy(4);
        let (m, a, b) = (e.mean(), e.half(0), e.half(1));
        for i in 0..m.pixels.len() {
            assert!(((a.pixels[i] + b.pixels[i]) * 0.5 - m.pixels[i]).abs().max_element() < 1e-6);
        }
    }

    #[test]
    fn nothing_measured_is_black_and_noiseless() {
        let e = Estimate::new(5, 3);
        assert!(e.mean().pixels.iter().all(|&p| p == Vec3::ZERO));
        assert_eq!(e.noise(), Noise { median: 0.0, p95: 0.0, overall: 0.0, of_mean: 0.0 });
    }
}
