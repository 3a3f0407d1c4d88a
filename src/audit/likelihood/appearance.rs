//! The texture test: the photograph against the model's albedo under smooth irradiance.
//!
//! The irradiance is gathered from what the probes saw all around, not divided out of the surface's own light, so that a
//! wrong texture cannot cancel out. What the photograph has beyond it is the real albedo over the model's.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use crate::audit::likelihood::step::usual;
use crate::audit::likelihood::structure::{BLACK, Structure, WINDOW, structure};
use crate::audit::likelihood::warped::damped;
use crate::audit::observe::geometry_buffer::{GeometryBuffer, NONE};
use crate::audit::picture::colour::colour_difference;
use crate::panorama::luminance;
use crate::scene::Scene;
use crate::shoot::Light;
use crate::statistics::median;
use crate::volume::{Nearby, Volume};

/// Every how many pixels along each side irradiance is gathered.
const STRIDE: usize = 4;

/// What the texture test says of each pixel.
pub(crate) struct Texture {
    /// Logarithm of the model's albedo and of as much as cannot be told apart.
    pub(crate) paint: Vec<Vec3>,
    /// What the albedo would have to be multiplied by, as a logarithm, with exposure and white balance taken out.
    pub(crate) ratio: Vec<Vec3>,
    /// Makes the ratio's steps within pieces of one size in all channels.
    pub(crate) unit: Mat3,
    /// How far the photograph follows the albedo's structure.
    pub(crate) structure: Structure,
    /// ΔE00 between the model's albedo and what the photograph says it is, brightness apart, over a window.
    pub(crate) colour: Vec<f32>,
    /// Brightness over the prediction, as the size of its logarithm, over a window.
    pub(crate) brightness: Vec<f32>,
    /// What was left of exposure and white balance in all the picture together, and is taken out; logarithm.
    pub(crate) offset: Vec3,
    /// Whether the pixel could be tested at all.
    pub(crate) tested: Vec<bool>,
}

/// Irradiance in every pixel, smooth but for the sun; zero where nothing tells it.
pub(crate) fn irradiance(
    scene: &Scene,
    surfaces: &GeometryBuffer,
    light: &Light,
    volume: Option<&Volume>,
) -> Vec<Vec3> {
    let (w, h) = (surfaces.width, surfaces.height);
    // a look-up starts from what the last one found: from the left in each row, however many rows go at a time
    let gathered: Vec<Vec3> = (0..h)
        .into_par_iter()
        .flat_map_iter(|y| {
            let mut scratch = Nearby::default();
            (0..w).map(move |x| {
                let i = y * w + x;
                if x % STRIDE != STRIDE / 2 || y % STRIDE != STRIDE / 2 || surfaces.triangle[i] == NONE {
                    return Vec3::ZERO;
                }
                let (p, n) = (surfaces.position[i], surfaces.normal[i]);
                let Some(v) = volume else { return Vec3::ZERO };
                let near = v.irradiance(scene, p, n, &mut scratch);
                near.unwrap_or_else(|| v.gather(scene, light, p, n, &mut scratch)).irradiance
            })
        })
        .collect();
    let weights: Vec<f32> = gathered.iter().map(|e| if e.min_element() > 0.0 { 1.0 } else { 0.0 }).collect();
    let smoothed = surfaces.shape.smoothed(&weights, 6.0);
    let around = surfaces.shape.mean_colour_with(&gathered, &weights, &smoothed, 6.0);
    (0..w * h)
        .into_par_iter()
        .map(|i| {
            let e = around[i];
            if surfaces.triangle[i] == NONE || e.min_element() <= 0.0 {
                return Vec3::ZERO;
            }
            e + light.direct_sun(scene, surfaces.position[i], surfaces.normal[i])
        })
        .collect()
}

/// Runs the test. `log_photo` is the photograph's logarithm with exposure, white balance and vignetting taken out; what is darker than `dark` it
/// does not tell apart.
pub(crate) fn test(
    surfaces: &GeometryBuffer,
    log_photo: &[Vec3],
    usable: &[f32],
    albedo: &[Vec3],
    irradiance: &[Vec3],
    dark: Vec3,
) -> Texture {
    let n = albedo.len();
    let (filter, segments) = (&surfaces.paint, &surfaces.segments);
    let inside = filter.inside(1);
    let tested: Vec<bool> = (0..n)
        .map(|i| {
            inside[i]
                && usable[i] > 0.0
                && surfaces.triangle[i] != NONE
                && luminance(albedo[i]) > BLACK
                && irradiance[i].min_element() > 0.0
                && log_photo[i].is_finite()
        })
        .collect();
    let weight: Vec<f32> = tested.iter().map(|t| if *t { 1.0 } else { 0.0 }).collect();
    let ln = |v: Vec3| v.max(Vec3::splat(1e-6)).map(f32::ln);
    // what the photograph says the albedo is
    let mut apparent: Vec<Vec3> = (0..n)
        .map(|i| if tested[i] { log_photo[i] - ln(irradiance[i] / std::f32::consts::PI) } else { Vec3::ZERO })
        .collect();
    // what is left of exposure and white balance
    let channel =
        |c: usize| median((0..n).filter(|i| tested[*i]).map(|i| apparent[i][c] - ln(albedo[i])[c])).unwrap_or(0.0);
    let middle = Vec3::from([0, 1, 2].map(channel));
    apparent.iter_mut().for_each(|a| *a -= middle);
    // what is darker than a scan, or the photograph in that light, can tell apart says little
    let photo_black = dark * middle.map(|m| std::f32::consts::PI * (-m).exp());
    let black = |i: usize| Vec3::splat(BLACK) + if tested[i] { photo_black / irradiance[i] } else { Vec3::ZERO };
    let apparent: Vec<Vec3> = (0..n).map(|i| damped(apparent[i], black(i))).collect();
    let paint: Vec<Vec3> = (0..n).map(|i| (albedo[i] + black(i)).map(f32::ln)).collect();
    let ratio: Vec<Vec3> = (0..n).map(|i| if tested[i] { apparent[i] - paint[i] } else { Vec3::ZERO }).collect();
    let unit = usual(surfaces.width, &ratio, |i, j| segments.of[i] == segments.of[j] && tested[i] && tested[j]);
    let structure = structure(filter, segments, &weight, &apparent, &paint);
    let bright: Vec<f32> = ratio.iter().map(|r| r.element_sum() / 3.0).collect();
    let brightness: Vec<f32> = filter.mean(&bright, &weight, WINDOW).iter().map(|b| b.abs()).collect();
    let chroma: [Vec<f32>; 2] = [0, 2].map(|c| ratio.iter().map(|r| r[c] - r.y).collect());
    let means = [0, 1].map(|c| filter.mean(&chroma[c], &weight, WINDOW));
    let colour = (0..n)
        .into_par_iter()
        .map(|i| if tested[i] { colour_difference(albedo[i], means[0][i], means[1][i]) } else { 0.0 })
        .collect();
    Texture { paint, ratio, unit, structure, colour, brightness, offset: middle, tested }
}
