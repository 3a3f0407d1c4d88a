//! A photograph as the audit works with it: reduced, with what can be used of it, its noise, and blurred.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::audit::verdict::Reason;
use crate::edge_aware::EdgeAware;
use crate::panorama::{Picture, luminance};
use crate::photograph::{Fitness, Photograph};
use crate::statistics::{median, quantile};

/// The linear photograph and what cannot be used of it.
pub struct Photo {
    /// Linear radiance.
    pub picture: Picture,
    /// Why a pixel cannot be used; [`Reason::None`] where it can. As long as the picture, or empty where all can.
    pub unusable: Vec<Reason>,
    /// Linear value below which the file's steps or the sensor's noise are wider than a tenth of the light; 0 where nothing is known of that.
    pub dark: f32,
}

/// A photograph at the audit's size.
pub(crate) struct Reduced {
    pub(crate) pixels: Vec<Vec3>,
    pub(crate) unusable: Vec<Reason>,
    /// As [`Photo::dark`].
    pub(crate) dark: f32,
    /// Relative noise of a pixel, as a robust standard deviation.
    pub(crate) noise: f32,
}

impl From<Photograph> for Photo {
    fn from(photograph: Photograph) -> Self {
        let reason = |f: &Fitness| match f {
            Fitness::Good => Reason::None,
            Fitness::Clipped | Fitness::Invalid => Reason::Clipped,
            Fitness::Dark => Reason::Dark,
            Fitness::Masked => Reason::Masked,
        };
        let unusable = photograph.fitness.iter().map(reason).collect();
        Self { unusable, dark: photograph.dark(), picture: photograph.picture }
    }
}

impl Photo {
    /// Takes a linear picture: what is no light cannot be used, nor what a sensor clipped.
    pub fn new(picture: Picture) -> Self {
        let health = picture.health();
        let valid = picture.pixels.iter().filter(|p| Picture::valid(**p));
        let largest = valid.fold(0.0f32, |m, p| m.max(p.max_element()));
        // neighbours of a clipped pixel hold some of its light
        let clipped = if health.clipped > 0 { 0.97 * largest } else { f32::INFINITY };
        let unusable = picture
            .pixels
            .iter()
            .map(|p| match p {
                p if !Picture::valid(*p) || p.max_element() >= clipped => Reason::Clipped,
                p if p.max_element() <= 0.0 => Reason::Dark,
                _ => Reason::None,
            })
            .collect();
        Self { picture, unusable, dark: 0.0 }
    }

    /// Averages `n` × `n` pixels to one; one that cannot be used spoils its block.
    pub(crate) fn reduced(&self, n: usize) -> Reduced {
        let source = &self.picture;
        let (width, height) = (source.width.div_ceil(n), source.height.div_ceil(n));
        let block = |i: usize| {
            let (left, top) = (i % width * n, i / width * n);
            let (mut sum, mut count, mut worst) = (Vec3::ZERO, 0.0f32, Reason::None);
            for y in top..(top + n).min(source.height) {
                for x in left..(left + n).min(source.width) {
                    let at = y * source.width + x;
                    let reason = self.unusable.get(at).copied().unwrap_or_default();
                    worst = worst.max(reason);
                    if Picture::valid(source.pixels[at]) {
                        sum += source.pixels[at];
                        count += 1.0;
                    }
                }
            }
            (sum / count.max(1.0), if count > 0.0 { worst } else { worst.max(Reason::Clipped) })
        };
        let blocks: Vec<(Vec3, Reason)> = (0..width * height).into_par_iter().map(block).collect();
        let pixels: Vec<Vec3> = blocks.iter().map(|b| b.0).collect();
        let mut unusable: Vec<Reason> = blocks.iter().map(|b| b.1).collect();
        let noise = noise(width, height, &pixels, &unusable);
        mark_dark(&pixels, &mut unusable);
        Reduced { pixels, unusable, dark: self.dark, noise }
    }
}

/// Pixels this far below the picture's median show nothing but the sensor's floor.
pub(crate) const DARK: f32 = 2e-3;

fn mark_dark(pixels: &[Vec3], unusable: &mut [Reason]) {
    let median = median(pixels.iter().map(|p| luminance(*p))).unwrap_or(0.0);
    for (p, reason) in pixels.iter().zip(unusable) {
        if *reason == Reason::None && p.min_element() <= DARK * median {
            *reason = Reason::Dark;
        }
    }
}

/// Relative noise: of the size of second differences of the logarithm of luminance (kernel 1 −2 1 ⊗ 1 −2 1, whose norm is 6; Immerkær, *Fast
/// noise variance estimation*, 1996) the lower quartile, over that of a bell curve.
fn noise(width: usize, height: usize, pixels: &[Vec3], unusable: &[Reason]) -> f32 {
    let log = |i: usize| luminance(pixels[i]).max(1e-30).ln();
    let mut all = Vec::new();
    for y in (1..height.saturating_sub(1)).step_by(2) {
        for x in (1..width.saturating_sub(1)).step_by(2) {
            let i = y * width + x;
            if unusable[i] != Reason::None {
                continue;
            }
            let row = |i: usize| log(i - 1) - 2.0 * log(i) + log(i + 1);
            all.push((row(i - width) - 2.0 * row(i) + row(i + width)).abs() / 6.0);
        }
    }
    // the lower quartile: texture only adds
    quantile(&mut all, 0.25).unwrap_or(0.0) / 0.3186
}

/// Standard deviations of the blurred photographs, pixels.
const BLURS: [f32; 6] = [0.0, 0.6, 1.2, 2.4, 4.8, 9.6];

/// The logarithm of a photograph under several blurs that cross no edge of the model.
pub(crate) struct Blurred {
    logs: Vec<Vec<Vec3>>,
}

impl Blurred {
    pub(crate) fn new(pixels: &[Vec3], usable: &[f32], filter: &EdgeAware) -> Self {
        let logs = BLURS
            .into_par_iter()
            .map(|sigma| {
                if sigma == 0.0 {
                    return pixels.iter().map(|p| ln(*p)).collect();
                }
                let within = filter.smoothed(usable, sigma);
                filter.mean_colour_with(pixels, usable, &within, sigma).into_iter().map(ln).collect()
            })
            .collect();
        Self { logs }
    }

    /// The logarithm of the photograph in a pixel, blurred with about this standard deviation.
    #[inline]
    pub(crate) fn at(&self, i: usize, sigma: f32) -> Vec3 {
        let upper = BLURS.iter().position(|b| *b > sigma).unwrap_or(BLURS.len() - 1).max(1);
        let f = ((sigma - BLURS[upper - 1]) / (BLURS[upper] - BLURS[upper - 1])).clamp(0.0, 1.0);
        self.logs[upper - 1][i].lerp(self.logs[upper][i], f)
    }
}

impl Blurred {
    /// The same between pixels: `at` in pixels from the middle of the first one, within the picture.
    #[inline]
    pub(crate) fn between(&self, at: Vec2, width: usize, sigma: f32) -> Vec3 {
        let (x, y) = (at.x as usize, at.y as usize);
        let f = at - Vec2::new(x as f32, y as f32);
        let i = y * width + x;
        let top = self.at(i, sigma).lerp(self.at(i + 1, sigma), f.x);
        let bottom = self.at(i + width, sigma).lerp(self.at(i + width + 1, sigma), f.x);
        top.lerp(bottom, f.y)
    }
}

fn ln(p: Vec3) -> Vec3 {
    p.max(Vec3::splat(1e-30)).map(f32::ln)
}
