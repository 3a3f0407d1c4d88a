//! The texture test: the photograph against the model's albedo under smooth irradiance.
//!
//! The irradiance is gathered from what the probes saw all around, not divided out of the surface's own light, so that a
//! wrong texture cannot cancel out. What the photograph has beyond it is the real albedo over the model's.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use crate::audit::likelihood::structure::{BLACK, Structure, structure};
use crate::audit::observe::geometry_buffer::{GeometryBuffer, NONE};
use crate::audit::picture::colour::{colour_difference, colour_of};
use crate::audit::picture::regions::Segments;
use crate::panorama::luminance;
use crate::scene::Scene;
use crate::shoot::Light;
use crate::statistics::median;
use crate::volume::{Nearby, Volume};

/// Every how many pixels along each side irradiance is gathered.
const STRIDE: usize = 4;

/// Colours are compared over windows of this standard deviation, pixels.
const COLOUR_WINDOW: f32 = 4.0;

/// Logarithm of brightness over the prediction, over a window, from which on the prediction's light is wrong: a factor of 4.
const LIGHT_OFF: f32 = 1.4;

/// Pieces with fewer tested pixels than this are too small to tell a colour by.
const FEWEST: f64 = 60.0;

/// What the texture test says of each pixel.
pub(crate) struct Texture {
    /// What the albedo would have to be multiplied by, as a logarithm, with exposure and white balance taken out.
    pub(crate) ratio: Vec<Vec3>,
    /// How far the photograph follows the albedo's structure.
    pub(crate) structure: Structure,
    /// ΔE00 between the model's albedo and what the photograph says it is, brightness apart, over a window.
    pub(crate) colour: Vec<f32>,
    /// The same over all that is mapped in one piece.
    pub(crate) piece_colour: Vec<f32>,
    /// Brightness over the prediction, as the size of its logarithm, over a window.
    pub(crate) brightness: Vec<f32>,
    /// ΔE00 of what was taken out of all the picture's colours together.
    pub(crate) white_balance: f32,
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

/// Runs the test. `log_photo` is the photograph's logarithm with exposure, white balance and vignetting taken out.
pub(crate) fn test(
    surfaces: &GeometryBuffer,
    log_photo: &[Vec3],
    usable: &[f32],
    albedo: &[Vec3],
    irradiance: &[Vec3],
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
    let white_balance = colour_of(middle.x - middle.y, middle.z - middle.y);
    // what is darker than a camera or a scan can tell apart says little
    let damped = |v: Vec3| (v + Vec3::splat(BLACK)).map(f32::ln);
    let apparent: Vec<Vec3> = apparent.iter().map(|a| damped(a.map(f32::exp))).collect();
    let ratio: Vec<Vec3> =
        (0..n).map(|i| if tested[i] { apparent[i] - damped(albedo[i]) } else { Vec3::ZERO }).collect();
    let structure = structure(filter, segments, &weight, &apparent, albedo);
    let bright: Vec<f32> = ratio.iter().map(|r| r.element_sum() / 3.0).collect();
    let brightness: Vec<f32> = filter.mean(&bright, &weight, COLOUR_WINDOW).iter().map(|b| b.abs()).collect();
    // light that is far off in brightness is none to judge a colour by
    let lit: Vec<bool> = tested.iter().zip(&brightness).map(|(t, b)| *t && *b <= LIGHT_OFF).collect();
    let chroma: [Vec<f32>; 2] = [0, 2].map(|c| ratio.iter().map(|r| r[c] - r.y).collect());
    let means = [0, 1].map(|c| filter.mean(&chroma[c], &weight, COLOUR_WINDOW));
    let colour = (0..n)
        .into_par_iter()
        .map(|i| if lit[i] { colour_difference(albedo[i], means[0][i], means[1][i]) } else { 0.0 })
        .collect();
    let piece_colour = by_piece(segments, &chroma, &lit, albedo);
    Texture { ratio, structure, colour, piece_colour, brightness, white_balance, tested }
}

/// Difference of colour over all that is mapped in one piece: coding and noise average out over it.
fn by_piece(segments: &Segments, chroma: &[Vec<f32>; 2], tested: &[bool], albedo: &[Vec3]) -> Vec<f32> {
    let difference = |pixels: &Vec<usize>| {
        let (mut count, mut sum, mut colour) = (0.0f64, DVec2::ZERO, DVec3::ZERO);
        for &i in pixels.iter().filter(|i| tested[**i]) {
            count += 1.0;
            sum += DVec2::new(f64::from(chroma[0][i]), f64::from(chroma[1][i]));
            colour += albedo[i].as_dvec3();
        }
        let (mean, colour) = ((sum / count.max(1.0)).as_vec2(), (colour / count.max(1.0)).as_vec3());
        if count < FEWEST { 0.0 } else { colour_difference(colour, mean.x, mean.y) }
    };
    let each: Vec<f32> = segments.pixels.par_iter().map(difference).collect();
    segments.of.iter().zip(tested).map(|(k, t)| if *t { each[*k as usize] } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge_aware::EdgeAware;

    const SIDE: usize = 64;

    #[test]
    fn a_piece_s_colour_is_told_where_its_pixels_are_too_noisy() {
        let segments =
            Segments::new(&EdgeAware::new(SIDE, SIDE, |i, j| (i % SIDE < SIDE / 2) == (j % SIDE < SIDE / 2)));
        // blocks of 8 × 8 pixels that are off by a fifth either way; red is off by a tenth in the left half
        let noise = |i: usize| if (i % SIDE / 8 + i / SIDE / 8).is_multiple_of(2) { 0.2 } else { -0.2 };
        let red = (0..SIDE * SIDE).map(|i| noise(i) + if i % SIDE < SIDE / 2 { 0.1 } else { 0.0 }).collect();
        let chroma = [red, vec![0.0; SIDE * SIDE]];
        let told = by_piece(&segments, &chroma, &[true; SIDE * SIDE], &[Vec3::splat(0.3); SIDE * SIDE]);
        let expected = colour_of(0.1, 0.0);
        assert!(expected > 2.0 && (told[0] - expected).abs() < 0.1 && told[SIDE - 1] < 0.1, "{} {expected}", told[0]);
        // what was not tested, or is too small, says nothing
        let few: Vec<bool> = (0..SIDE * SIDE).map(|i| i < 20).collect();
        assert!(by_piece(&segments, &chroma, &few, &[Vec3::splat(0.3); SIDE * SIDE]).iter().all(|d| *d == 0.0));
    }
}
