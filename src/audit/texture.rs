//! The texture test: the photograph against the model's albedo under smooth irradiance.
//!
//! The irradiance is gathered from what the probes saw all around, not divided out of the surface's own light, so that a
//! wrong texture cannot cancel out. What the photograph has beyond it is the real albedo over the model's.

use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::colour::{colour_difference, colour_of};
use super::regions::{Pieces, Region, bounds};
use super::structure::{Structure, structure};
use super::surfaces::{NONE, Surfaces};
use super::view::Maps;
use crate::panorama::luminance;
use crate::scene::Scene;
use crate::shoot::Light;
use crate::statistics::{median, quantile};
use crate::volume::{Nearby, Volume};

/// Darker albedo cannot be compared with.
pub(super) const BLACK: f32 = 0.015;

/// Every how many pixels along each side irradiance is gathered.
const STRIDE: usize = 4;

/// Colours are compared over windows of this standard deviation, pixels.
const COLOUR_WINDOW: f32 = 4.0;

/// Logarithm of brightness over the prediction, over a window, from which on the prediction's light is wrong: a factor of 4.
const LIGHT_OFF: f32 = 1.4;

/// Shares of the pixels around a region whose light is less far along the line of lights than all that may fall on it.
const LIGHTS: [f64; 2] = [0.01, 0.99];

/// Pieces with fewer tested pixels than this are too small to tell a colour by.
const FEWEST: f64 = 60.0;

/// What the texture test says of each pixel.
pub(super) struct Texture {
    /// What the albedo would have to be multiplied by, as a logarithm, with exposure and white balance taken out.
    pub(super) ratio: Vec<Vec3>,
    /// Logarithm of the odds that the photograph shows none of the albedo's structure and not all of it, over a window:
    /// above 0 the structure is wrong, below it is right.
    pub(super) odds: Vec<f32>,
    /// Structure of the photograph and of the albedo: logarithms of brightness without what is smooth.
    pub(super) bands: [Vec<f32>; 2],
    /// What a right texture has at the pixel's brightness: how much of the albedo's structure, and the variance of what
    /// does not follow it.
    pub(super) usual: Vec<[f32; 2]>,
    /// Variance of what does not follow the albedo, over a window, with what a right texture has of it.
    pub(super) variance: Vec<f32>,
    /// ΔE00 between the model's albedo and what the photograph says it is, brightness apart, over a window.
    pub(super) colour: Vec<f32>,
    /// The same over all that is mapped in one piece.
    pub(super) piece_colour: Vec<f32>,
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
    let (joins, pieces) = (&surfaces.paint, &surfaces.pieces);
    let inside = joins.inside(1);
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
    let Structure { bands, odds, structured, usual, variance } = structure(joins, pieces, &weight, &apparent, albedo);
    let bright: Vec<f32> = ratio.iter().map(|r| r.element_sum() / 3.0).collect();
    let brightness: Vec<f32> = joins.mean(&bright, &weight, COLOUR_WINDOW).iter().map(|b| b.abs()).collect();
    // light that is far off in brightness is none to judge a colour by
    let lit: Vec<bool> = tested.iter().zip(&brightness).map(|(t, b)| *t && *b <= LIGHT_OFF).collect();
    let chroma: [Vec<f32>; 2] = [0, 2].map(|c| ratio.iter().map(|r| r[c] - r.y).collect());
    let means = [0, 1].map(|c| joins.mean(&chroma[c], &weight, COLOUR_WINDOW));
    let colour = (0..n)
        .into_par_iter()
        .map(|i| if lit[i] { colour_difference(albedo[i], means[0][i], means[1][i]) } else { 0.0 })
        .collect();
    let piece_colour = by_piece(pieces, &chroma, &lit, albedo);
    Texture { ratio, odds, bands, usual, variance, colour, piece_colour, brightness, white_balance, tested, structured }
}

impl Texture {
    /// Mean over pixels of the colour that the albedo lacks, as logarithms of red and blue over green, if a surface mirrors this
    /// share of what it may.
    fn chroma(&self, maps: &Maps, pixels: &[usize], mirrored: f32) -> Vec2 {
        let dull = |i: usize| {
            let light = maps.log_photo[i].map(f32::exp);
            let scattered = (light - maps.gloss.camera[i] * mirrored).max(light * 0.1);
            chroma(self.ratio[i] + (scattered / light).map(f32::ln))
        };
        pixels.iter().map(|i| dull(*i)).sum::<Vec2>() / pixels.len().max(1) as f32
    }

    /// ΔE00 over a region between the model's colours and what the photograph says they are, brightness apart, whatever the
    /// surface mirrors, and without what other light would do: around the region, the light's colours go along a line from one
    /// light to another.
    pub(super) fn mean_colour(&self, maps: &Maps, region: &Region) -> f32 {
        let tested: Vec<usize> = region.pixels.iter().copied().filter(|i| self.tested[*i]).collect();
        let (line, [low, high]) = lights(maps, region, &tested);
        least_mirrored(|share| {
            let mean = self.chroma(maps, &tested, share);
            mean - line * mean.dot(line).clamp(low, high)
        })
    }
}

/// Logarithms of red and blue over green.
fn chroma(log: Vec3) -> Vec2 {
    Vec2::new(log.x - log.y, log.z - log.y)
}

/// The least ΔE00 of a change of chroma that hangs on how much of what a surface may mirror it does.
fn least_mirrored(change: impl Fn(f32) -> Vec2) -> f32 {
    let shares = (0..=4).map(|k| k as f32 / 4.0);
    shares.map(&change).map(|c| colour_of(c.x, c.y)).fold(f32::INFINITY, f32::min)
}

/// The line along which the light's colours lie in and around a region, and how far along it light from around would change what
/// falls on the region's pixels.
fn lights(maps: &Maps, region: &Region, pixels: &[usize]) -> (Vec2, [f32; 2]) {
    let (w, e) = (maps.surfaces.width, &maps.irradiance);
    let of = |i: usize| chroma(e[i].map(f32::ln));
    let [left, top, right, bottom] = bounds(&region.pixels, w);
    let (wide, high) = (right.saturating_sub(left), bottom.saturating_sub(top));
    let columns = left.saturating_sub(wide / 2)..(right + wide / 2).min(w);
    let rows = top.saturating_sub(high / 2)..(bottom + high / 2).min(e.len() / w);
    let around = rows.flat_map(|y| columns.clone().map(move |x| y * w + x));
    let all: Vec<Vec2> = around.filter(|i| e[*i].min_element() > 0.0).map(of).collect();
    let line = principal_axis(&all);
    let mut along: Vec<f32> = all.iter().map(|l| l.dot(line)).collect();
    let here = pixels.iter().map(|i| of(*i).dot(line)).sum::<f32>() / pixels.len().max(1) as f32;
    let [low, high] = LIGHTS.map(|q| quantile(&mut along, q).unwrap_or(here) - here);
    (line, [low.min(0.0), high.max(0.0)])
}

/// Direction in which points are spread most; of length 1.
fn principal_axis(points: &[Vec2]) -> Vec2 {
    let n = points.len().max(1) as f32;
    let middle = points.iter().sum::<Vec2>() / n;
    let [xx, xy, yy] = points
        .iter()
        .map(|p| *p - middle)
        .fold([0.0f32; 3], |[xx, xy, yy], d| [xx + d.x * d.x / n, xy + d.x * d.y / n, yy + d.y * d.y / n]);
    Vec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy))
}

/// Difference of colour over all that is mapped in one piece: coding and noise average out over it.
fn by_piece(pieces: &Pieces, chroma: &[Vec<f32>; 2], tested: &[bool], albedo: &[Vec3]) -> Vec<f32> {
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
    let each: Vec<f32> = pieces.pixels.par_iter().map(difference).collect();
    pieces.of.iter().zip(tested).map(|(k, t)| if *t { each[*k as usize] } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::super::EdgeAware;
    use super::*;

    const SIDE: usize = 64;

    #[test]
    fn a_piece_s_colour_is_told_where_its_pixels_are_too_noisy() {
        let pieces = Pieces::new(&EdgeAware::new(SIDE, SIDE, |i, j| (i % SIDE < SIDE / 2) == (j % SIDE < SIDE / 2)));
        // blocks of 8 × 8 pixels that are off by a fifth either way; red is off by a tenth in the left half
        let noise = |i: usize| if (i % SIDE / 8 + i / SIDE / 8).is_multiple_of(2) { 0.2 } else { -0.2 };
        let red = (0..SIDE * SIDE).map(|i| noise(i) + if i % SIDE < SIDE / 2 { 0.1 } else { 0.0 }).collect();
        let chroma = [red, vec![0.0; SIDE * SIDE]];
        let told = by_piece(&pieces, &chroma, &[true; SIDE * SIDE], &[Vec3::splat(0.3); SIDE * SIDE]);
        let expected = colour_of(0.1, 0.0);
        assert!(expected > 2.0 && (told[0] - expected).abs() < 0.1 && told[SIDE - 1] < 0.1, "{} {expected}", told[0]);
        // what was not tested, or is too small, says nothing
        let few: Vec<bool> = (0..SIDE * SIDE).map(|i| i < 20).collect();
        assert!(by_piece(&pieces, &chroma, &few, &[Vec3::splat(0.3); SIDE * SIDE]).iter().all(|d| *d == 0.0));
    }
}
