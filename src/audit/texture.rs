//! The texture test: the photograph against the model's albedo under smooth irradiance.
//!
//! The irradiance is gathered from what the probes saw all around, not divided out of the surface's own light, so that a
//! wrong texture cannot cancel out. What the photograph has beyond it is the real albedo over the model's.

use glam::Vec3;
use rayon::prelude::*;

use super::surfaces::{NONE, Surfaces};
use super::{Joins, median};
use crate::panorama::luminance;
use crate::scene::Scene;
use crate::shoot::Light;
use crate::volume::{Nearby, Volume};

/// Darker albedo cannot be compared with.
pub(super) const BLACK: f32 = 0.015;

/// Every how many pixels along each side irradiance is gathered.
const STRIDE: usize = 4;

/// Standard deviations, in pixels, of a difference of Gaussians' inner and outer blur and of the window it is compared
/// over.
const SCALES: [[f32; 3]; 3] = [[0.7, 3.0, 6.0], [1.5, 6.0, 9.0], [3.0, 12.0, 14.0]];

/// Colours are compared over windows of this standard deviation, pixels.
const COLOUR_WINDOW: f32 = 4.0;

/// Contrast of the albedo (standard deviation of its logarithm within a scale) that is enough to compare structure.
const LEAST_CONTRAST: f32 = 0.03;

/// What the texture test says of each pixel.
pub(super) struct Texture {
    /// What the albedo would have to be multiplied by, as a logarithm, with exposure and white balance taken out.
    pub(super) ratio: Vec<Vec3>,
    /// How much of the albedo's structure the photograph lacks at the scale that agrees best: 0 all there, 1 nothing.
    pub(super) lacking: Vec<f32>,
    /// How sure that is: (1 − slope) over its standard error.
    pub(super) surety: Vec<f32>,
    /// ΔE00 between the model's albedo and what the photograph says it is, brightness apart, over a window.
    pub(super) colour: Vec<f32>,
    /// Standard deviation over a window of the colour (not brightness) that the albedo does not have.
    pub(super) foreign: Vec<f32>,
    /// Standard deviation over a window of brightness that the albedo does not have.
    pub(super) shading: Vec<f32>,
    /// Brightness over the prediction, as the size of its logarithm, over a window.
    pub(super) brightness: Vec<f32>,
    /// ΔE00 of what was taken out of all the picture's colours together.
    pub(super) white_balance: f32,
    /// Whether the pixel could be tested at all, and whether its albedo has structure enough.
    pub(super) tested: Vec<bool>,
    pub(super) structured: Vec<bool>,
}

/// Irradiance in every pixel, smooth but for the sun; zero where nothing tells it.
pub(super) fn irradiance(scene: &Scene, surfaces: &Surfaces, light: &Light, volume: Option<&Volume>) -> Vec<Vec3> {
    let (w, h) = (surfaces.width, surfaces.height);
    let gathered: Vec<Vec3> = (0..w * h)
        .into_par_iter()
        .map_init(Nearby::default, |scratch, i| {
            let (x, y) = (i % w, i / w);
            if x % STRIDE != STRIDE / 2 || y % STRIDE != STRIDE / 2 || surfaces.triangle[i] == NONE {
                return Vec3::ZERO;
            }
            let (p, n) = (surfaces.position[i], surfaces.normal[i]);
            volume
                .map(|v| v.irradiance(scene, p, n, scratch).unwrap_or_else(|| v.gather(scene, light, p, n, scratch)))
                .unwrap_or_default()
        })
        .collect();
    let weights: Vec<f32> = gathered.iter().map(|e| if e.min_element() > 0.0 { 1.0 } else { 0.0 }).collect();
    let smoothed = surfaces.shape.smoothed(&weights, 6.0);
    let channel = |c: usize| {
        let values: Vec<f32> = gathered.iter().map(|e| e[c]).collect();
        surfaces.shape.mean_with(&values, &weights, &smoothed, 6.0)
    };
    let [r, g, b] = [0, 1, 2].map(channel);
    (0..w * h)
        .into_par_iter()
        .map(|i| {
            let e = Vec3::new(r[i], g[i], b[i]);
            if surfaces.triangle[i] == NONE || e.min_element() <= 0.0 {
                return Vec3::ZERO;
            }
            e + light.direct_sun(scene, surfaces.position[i], surfaces.normal[i])
        })
        .collect()
}

/// Runs the test. `log_photo` is the photograph's logarithm with exposure, white balance and vignetting taken out.
pub(super) fn test(
    surfaces: &Surfaces,
    log_photo: &[Vec3],
    usable: &[f32],
    albedo: &[Vec3],
    irradiance: &[Vec3],
) -> Texture {
    let n = albedo.len();
    let joins = &surfaces.paint;
    let inside = joins.inside(1);
    let tested: Vec<bool> = (0..n)
        .map(|i| {
            inside[i]
                && usable[i] > 0.0
                && surfaces.triangle[i] != NONE
                && albedo[i].min_element() > BLACK
                && irradiance[i].min_element() > 0.0
                && log_photo[i].is_finite()
        })
        .collect();
    let weight: Vec<f32> = tested.iter().map(|t| if *t { 1.0 } else { 0.0 }).collect();
    let ln = |v: Vec3| v.max(Vec3::splat(1e-6)).map(f32::ln);
    let mut ratio: Vec<Vec3> =
        (0..n).map(|i| if tested[i] { log_photo[i] - ln(albedo[i]) - ln(irradiance[i]) } else { Vec3::ZERO }).collect();
    // what is left of exposure and white balance
    let middle = Vec3::from([0, 1, 2].map(|c| {
        let mut all: Vec<f32> = (0..n).filter(|i| tested[*i]).map(|i| ratio[i][c]).collect();
        median(&mut all)
    }));
    for (r, t) in ratio.iter_mut().zip(&tested) {
        *r = if *t { *r - middle } else { Vec3::ZERO };
    }
    let white_balance = colour_difference(Vec3::splat(0.3), middle.x - middle.y, middle.z - middle.y);
    let (lacking, surety, structured) = structure(joins, &weight, log_photo, albedo);
    let chroma: [Vec<f32>; 2] = [0, 2].map(|c| ratio.iter().map(|r| r[c] - r.y).collect());
    let means = [0, 1].map(|c| joins.mean(&chroma[c], &weight, COLOUR_WINDOW));
    let colour = (0..n)
        .into_par_iter()
        .map(|i| if tested[i] { colour_difference(albedo[i], means[0][i], means[1][i]) } else { 0.0 })
        .collect();
    let foreign = foreign(joins, &chroma, &weight);
    let bright: Vec<f32> = ratio.iter().map(|r| r.element_sum() / 3.0).collect();
    let shading = deviation(joins, &bright, &weight);
    let brightness = joins.mean(&bright, &weight, COLOUR_WINDOW).iter().map(|b| b.abs()).collect();
    Texture { ratio, lacking, surety, colour, foreign, shading, brightness, white_balance, tested, structured }
}

/// How far the photograph follows the albedo's structure.
///
/// At each scale the photograph's contrast a is regressed on the albedo's b over a window: a = βb + rest. A right
/// texture has β = 1, whatever shadows fall on it, since these do not follow the albedo; a wrong one has β ≈ 0.
fn structure(joins: &Joins, weight: &[f32], photo: &[Vec3], albedo: &[Vec3]) -> (Vec<f32>, Vec<f32>, Vec<bool>) {
    let n = weight.len();
    let log = |p: Vec3| luminance(p).max(1e-6).ln();
    let a: Vec<f32> =
        photo.iter().zip(weight).map(|(p, w)| if *w > 0.0 { log(p.map(f32::exp)) } else { 0.0 }).collect();
    let b: Vec<f32> = albedo.iter().map(|p| log(*p)).collect();
    let scales: Vec<[Vec<f32>; 4]> = SCALES
        .par_iter()
        .map(|&[inner, outer, window]| {
            let band = |v: &[f32]| -> Vec<f32> {
                let (fine, coarse) = (joins.mean(v, weight, inner), joins.mean(v, weight, outer));
                fine.iter().zip(&coarse).map(|(f, c)| f - c).collect()
            };
            let (a, b) = (band(&a), band(&b));
            let smoothed = joins.smoothed(weight, window);
            let mean = |f: &dyn Fn(usize) -> f32| {
                let values: Vec<f32> = (0..n).map(f).collect();
                joins.mean_with(&values, weight, &smoothed, window)
            };
            let (aa, bb, ab) = (mean(&|i| a[i] * a[i]), mean(&|i| b[i] * b[i]), mean(&|i| a[i] * b[i]));
            // independent places in the window: its area over that of the inner blur's correlation
            let places = smoothed.iter().map(|s| s * (window / (inner + 1.0)).powi(2) * 2.0);
            let floor = 0.25 * LEAST_CONTRAST * LEAST_CONTRAST;
            let slope: Vec<f32> = (0..n).map(|i| (ab[i] + floor) / (bb[i] + floor)).collect();
            let error: Vec<f32> = places
                .enumerate()
                .map(|(i, places)| {
                    let rest = (aa[i] - 2.0 * slope[i] * ab[i] + slope[i] * slope[i] * bb[i]).max(0.0);
                    ((rest + floor) / ((bb[i] + floor) * (places - 1.0).max(0.3))).sqrt()
                })
                .collect();
            [slope, error, bb, aa]
        })
        .collect();
    let mut lacking = vec![0.0; n];
    let mut surety = vec![0.0; n];
    let mut structured = vec![false; n];
    for i in 0..n {
        // the scale that speaks best for the texture
        let mut best: Option<(f32, f32)> = None;
        for [slope, error, bb, aa] in &scales {
            // a photograph that shows no structure at all is blurred, dark or coarsely coded
            if bb[i] < LEAST_CONTRAST * LEAST_CONTRAST || aa[i] < 0.25 * bb[i] || weight[i] == 0.0 {
                continue;
            }
            structured[i] = true;
            let lack = (1.0 - slope[i]).clamp(0.0, 1.5);
            if best.is_none_or(|(l, _)| lack < l) {
                best = Some((lack, lack / error[i]));
            }
        }
        if let Some((lack, sure)) = best {
            (lacking[i], surety[i]) = (lack, sure);
        }
    }
    (lacking, surety, structured)
}

/// Standard deviation over a window of chroma that is not smooth.
fn foreign(joins: &Joins, chroma: &[Vec<f32>; 2], weight: &[f32]) -> Vec<f32> {
    let [x, y] = [0, 1].map(|c| deviation(joins, &chroma[c], weight));
    x.iter().zip(&y).map(|(x, y)| (x * x + y * y).sqrt()).collect()
}

/// Standard deviation over a window of the difference of Gaussians 1 to 8 pixels.
fn deviation(joins: &Joins, values: &[f32], weight: &[f32]) -> Vec<f32> {
    let (fine, coarse) = (joins.mean(values, weight, 1.0), joins.mean(values, weight, 8.0));
    let square: Vec<f32> = fine.iter().zip(&coarse).map(|(f, c)| (f - c) * (f - c)).collect();
    joins.mean(&square, weight, 6.0).iter().map(|v| v.max(0.0).sqrt()).collect()
}

/// ΔE00 between an albedo and the same with its red and blue over green changed by these logarithms, brightness kept.
fn colour_difference(albedo: Vec3, red: f32, blue: f32) -> f32 {
    let other = albedo * Vec3::new(red.clamp(-3.0, 3.0).exp(), 1.0, blue.clamp(-3.0, 3.0).exp());
    let other = other * (luminance(albedo) / luminance(other).max(1e-9));
    // seen at the lightness of a mid grey, so that dark and light surfaces count alike
    let scale = 0.3 / luminance(albedo).max(1e-6);
    super::colour::ciede2000(super::colour::lab(albedo * scale), super::colour::lab(other * scale))
}
