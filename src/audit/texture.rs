//! The texture test: the photograph against the model's albedo under smooth irradiance.
//!
//! The irradiance is gathered from what the probes saw all around, not divided out of the surface's own light, so that a
//! wrong texture cannot cancel out. What the photograph has beyond it is the real albedo over the model's.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::bins::Bins;
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

/// Structure is what a blur of this standard deviation takes away, pixels, compared over a window of the second.
pub(super) const BAND: f32 = 3.0;
const WINDOW: f32 = 5.0;

/// Structure is alike over some three or four pixels each way: so many tell as much as one.
pub(super) const ALIKE_PX: f32 = 12.0;

/// A photograph that shows less than this share of the albedo's contrast all over is too soft to be compared.
const SOFTEST: f32 = 0.3;

/// With less than this share of the energy expected there is nothing to compare.
const FAINT: f32 = 0.25;

/// Relative brightness that photograph and albedo may always differ by.
const FLOOR: f32 = 0.02;

/// Colours are compared over windows of this standard deviation, pixels.
const COLOUR_WINDOW: f32 = 4.0;

/// Pieces with fewer tested pixels than this are too small to tell a colour by.
const FEWEST: f64 = 60.0;

/// Contrast of the albedo (standard deviation of its logarithm within the band) that is enough to compare structure.
const LEAST_CONTRAST: f32 = 0.02;

/// Pixels that a texture may be off its place without being wrong.
const SLACK_PX: isize = 1;

/// What structure says is limited to this, so that no few pixels outvote all others.
const MOST_ODDS: f32 = 40.0;

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
                near.unwrap_or_else(|| v.gather(scene, light, p, n, &mut scratch))
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
    let white_balance = colour_of(middle.x - middle.y, middle.z - middle.y);
    let Structure { bands, odds, structured, usual, variance } = structure(joins, &weight, log_photo, albedo);
    let chroma: [Vec<f32>; 2] = [0, 2].map(|c| ratio.iter().map(|r| r[c] - r.y).collect());
    let means = [0, 1].map(|c| joins.mean(&chroma[c], &weight, COLOUR_WINDOW));
    let colour = (0..n)
        .into_par_iter()
        .map(|i| if tested[i] { colour_difference(albedo[i], means[0][i], means[1][i]) } else { 0.0 })
        .collect();
    let piece_colour = by_piece(joins, &chroma, &tested, albedo);
    let foreign = foreign(joins, &chroma, &weight);
    let bright: Vec<f32> = ratio.iter().map(|r| r.element_sum() / 3.0).collect();
    let shading = deviation(joins, &bright, &weight);
    let brightness = joins.mean(&bright, &weight, COLOUR_WINDOW).iter().map(|b| b.abs()).collect();
    Texture {
        ratio,
        odds,
        bands,
        usual,
        variance,
        colour,
        piece_colour,
        foreign,
        shading,
        brightness,
        white_balance,
        tested,
        structured,
    }
}

struct Structure {
    bands: [Vec<f32>; 2],
    odds: Vec<f32>,
    structured: Vec<bool>,
    usual: Vec<[f32; 2]>,
    variance: Vec<f32>,
}

/// Difference of colour over all that is mapped in one piece: coding and noise average out over it.
fn by_piece(joins: &Joins, chroma: &[Vec<f32>; 2], tested: &[bool], albedo: &[Vec3]) -> Vec<f32> {
    let of = joins.labels();
    let mut sums = vec![(0.0f64, DVec2::ZERO, DVec3::ZERO); of.iter().map(|k| *k as usize + 1).max().unwrap_or(0)];
    for i in (0..of.len()).filter(|i| tested[*i]) {
        let (count, sum, colour) = &mut sums[of[i] as usize];
        *count += 1.0;
        *sum += DVec2::new(f64::from(chroma[0][i]), f64::from(chroma[1][i]));
        *colour += albedo[i].as_dvec3();
    }
    let each: Vec<f32> = sums
        .into_par_iter()
        .map(|(count, sum, colour)| {
            let (mean, colour) = ((sum / count.max(1.0)).as_vec2(), (colour / count.max(1.0)).as_vec3());
            if count < FEWEST { 0.0 } else { colour_difference(colour, mean.x, mean.y) }
        })
        .collect();
    (0..of.len()).map(|i| if tested[i] { each[of[i] as usize] } else { 0.0 }).collect()
}

/// How far the photograph follows the albedo's structure, over windows.
fn structure(joins: &Joins, weight: &[f32], photo: &[Vec3], albedo: &[Vec3]) -> Structure {
    let n = weight.len();
    let log = |p: Vec3| luminance(p).max(1e-6).ln();
    let band = |v: Vec<f32>| -> Vec<f32> {
        let smooth = joins.mean(&v, weight, BAND);
        (0..n).map(|i| if weight[i] > 0.0 { v[i] - smooth[i] } else { 0.0 }).collect()
    };
    let a = band(photo.iter().zip(weight).map(|(p, w)| if *w > 0.0 { log(p.map(f32::exp)) } else { 0.0 }).collect());
    let b = band(albedo.iter().map(|p| log(*p)).collect());
    let smoothed = joins.smoothed(weight, WINDOW);
    let mean = |f: &dyn Fn(usize) -> f32| {
        let values: Vec<f32> = (0..n).map(f).collect();
        joins.mean_with(&values, weight, &smoothed, WINDOW)
    };
    let sums: Vec<Sums> = {
        let (aa, bb, ab) = (mean(&|i| a[i] * a[i]), mean(&|i| b[i] * b[i]), mean(&|i| a[i] * b[i]));
        (0..n).map(|i| Sums { aa: aa[i], bb: bb[i], ab: ab[i] }).collect()
    };
    let structured: Vec<bool> =
        (0..n).map(|i| weight[i] > 0.0 && sums[i].bb > LEAST_CONTRAST * LEAST_CONTRAST).collect();
    // what the picture shows of its texture, and what besides, is what a right texture has; a wrong floor may fill more
    // than half of it, so that a quarter must do
    let slope: Vec<f32> = sums.iter().map(Sums::slope).collect();
    let rest: Vec<f32> = sums.iter().map(Sums::rest).collect();
    // faint structure has less of it than strong structure as bright: the lesser of both
    let contrast: Vec<f32> = (0..n).map(|i| if structured[i] { sums[i].bb } else { f32::NAN }).collect();
    let usually = |bins: &Bins| -> Vec<[f32; 2]> {
        let slope = bins.quantile(&slope, 0.75, |i| structured[i]).map(|s| s.clamp(SOFTEST, 1.0));
        let rest = bins.quantile(&rest, 0.75, |i| structured[i]);
        bins.of.iter().map(|k| [slope[*k], rest[*k]]).collect()
    };
    let both = usually(&Bins::new(photo)).into_iter().zip(usually(&Bins::by(&contrast)));
    let usual: Vec<[f32; 2]> = both.map(|(a, b)| [a[0].min(b[0]), a[1].min(b[1])]).collect();
    // a piece smaller than the window tells no more than its pixels
    let window_px = 4.0 * std::f32::consts::PI * WINDOW * WINDOW;
    let pieces = joins.labels();
    let mut in_piece = vec![0.0f32; n];
    pieces.iter().zip(weight).for_each(|(p, w)| in_piece[*p as usize] += w);
    let odds = (0..n)
        .map(|i| {
            let pixels = (smoothed[i].min(1.0) * window_px).min(in_piece[pieces[i] as usize]);
            if weight[i] > 0.0 { sums[i].log_odds(usual[i], pixels) } else { 0.0 }
        })
        .collect();
    let variance = (0..n).map(|i| sums[i].variance(usual[i])).collect();
    Structure { bands: [a, b], odds, structured, usual, variance }
}

/// Mean squares and product of the photograph's structure a and the albedo's b.
struct Sums {
    aa: f32,
    bb: f32,
    ab: f32,
}

impl Sums {
    fn slope(&self) -> f32 {
        self.ab / self.bb.max(1e-12)
    }

    fn rest(&self) -> f32 {
        (self.aa - self.ab * self.slope()).max(0.0)
    }

    fn variance(&self, [_, usual_rest]: [f32; 2]) -> f32 {
        self.rest() + usual_rest + FLOOR * FLOOR
    }

    /// Logarithm of the odds of “nothing of the albedo's structure is in the photograph” against “as much as usual”.
    ///
    /// Under a = βb + rest with a Gaussian rest of variance v, the hypotheses β = 0 and β = s differ by
    /// m(s²⟨b²⟩ − 2s⟨ab⟩) / 2v over m independent pixels. Shadows, whose edges do not follow the albedo, only add to the
    /// rest: they make the odds less, but do not turn them. A photograph with much less structure than expected is
    /// blurred, dark or coarsely coded there, and speaks for nothing.
    fn log_odds(&self, [slope, rest]: [f32; 2], pixels: f32) -> f32 {
        let expected = slope * slope * self.bb;
        let odds = pixels / ALIKE_PX * (expected - 2.0 * slope * self.ab) / (2.0 * self.variance([slope, rest]));
        let odds = if self.aa < FAINT * expected { odds.min(0.0) } else { odds };
        odds.clamp(-MOST_ODDS, MOST_ODDS)
    }
}

/// The same over a set of pixels, for the place within a pixel's slack where the photograph agrees best, and how much
/// of the albedo's structure is there then (1: as much as usual). Each pixel counts by the variance around it, so that a
/// shadow's edge does not drown what the rest of the set says.
pub(super) fn odds_of(texture: &Texture, width: usize, pixels: &[usize]) -> (f32, f32) {
    let [a, b] = &texture.bands;
    let n = a.len();
    let all: Vec<usize> = pixels.iter().copied().filter(|i| texture.tested[*i]).collect();
    let mut best: Option<(f32, f32)> = None;
    for dy in -SLACK_PX..=SLACK_PX {
        for dx in -SLACK_PX..=SLACK_PX {
            let [mut seen, mut expected, mut followed] = [0.0f64; 3];
            for &i in &all {
                let j = i as isize + dy * width as isize + dx;
                if j < 0 || j >= n as isize || !texture.tested[j as usize] {
                    continue;
                }
                let (a, b) = (f64::from(a[i]), f64::from(b[j as usize]));
                let (slope, weight) = (f64::from(texture.usual[i][0]), 1.0 / f64::from(texture.variance[i]));
                seen += weight * a * a;
                expected += weight * slope * slope * b * b;
                followed += weight * slope * a * b;
            }
            let odds = (expected - 2.0 * followed) / f64::from(2.0 * ALIKE_PX);
            let faint = seen < f64::from(FAINT) * expected;
            let odds = if faint { odds.min(0.0) } else { odds } as f32;
            if best.is_none_or(|(o, _)| odds < o) {
                best = Some((odds.clamp(-MOST_ODDS, MOST_ODDS), (followed / expected.max(1e-9)) as f32));
            }
        }
    }
    best.unwrap_or((0.0, 0.0))
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

/// ΔE00 between mid grey and the same with its red and blue over green changed by these logarithms.
pub(super) fn colour_of(red: f32, blue: f32) -> f32 {
    colour_difference(Vec3::splat(0.3), red, blue)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 64;

    /// Blotches of a few pixels, another picture for each seed.
    fn blotches(seed: usize) -> Vec<f32> {
        let hash = |x: usize, y: usize| (((x * 7919 + y * 104_729 + seed * 15_485_863) * 2_654_435_761) >> 7) % 1000;
        (0..SIDE * SIDE).map(|i| 0.3 + 0.2 * hash(i % SIDE / 3, i / SIDE / 3) as f32 / 1000.0).collect()
    }

    /// Share of the inner pixels whose odds are above (or below, if negative) a threshold.
    fn share(photo: &[f32], albedo: &[f32], threshold: f32) -> f32 {
        let joins = Joins::open(SIDE, SIDE);
        let photo: Vec<Vec3> = photo.iter().map(|v| Vec3::splat(v.ln())).collect();
        let albedo: Vec<Vec3> = albedo.iter().map(|v| Vec3::splat(*v)).collect();
        let odds = structure(&joins, &[1.0; SIDE * SIDE], &photo, &albedo).odds;
        let inner = |i: &usize| (8..SIDE - 8).contains(&(i % SIDE)) && (8..SIDE - 8).contains(&(i / SIDE));
        let all: Vec<usize> = (0..SIDE * SIDE).filter(inner).collect();
        let beyond = |i: &&usize| odds[**i] / threshold >= 1.0;
        all.iter().filter(beyond).count() as f32 / all.len() as f32
    }

    #[test]
    fn a_shadow_leaves_the_structure_right_and_another_picture_does_not() {
        let albedo = blotches(1);
        let lit = |i: usize| if (i % SIDE + i / SIDE) % 40 < 20 { 1.0 } else { 0.4 };
        let shadowed: Vec<f32> = albedo.iter().enumerate().map(|(i, v)| v * lit(i)).collect();
        assert_eq!(share(&shadowed, &albedo, 1.0), 0.0);
        // off the shadow's edge
        let one = |i: usize| if i % SIDE + i / SIDE < SIDE / 2 { 0.4 } else { 1.0 };
        let shadowed: Vec<f32> = albedo.iter().enumerate().map(|(i, v)| v * one(i)).collect();
        let borne_out = share(&shadowed, &albedo, -1.0);
        assert!(borne_out > 0.7, "{borne_out}");
        // half of the photograph shows another picture
        let other = blotches(2);
        let half: Vec<f32> = (0..SIDE * SIDE).map(|i| if i % SIDE < SIDE / 3 { other[i] } else { albedo[i] }).collect();
        let wrong = share(&half, &albedo, 3.0);
        assert!((0.1..0.35).contains(&wrong), "{wrong}");
    }

    #[test]
    fn a_photograph_without_structure_speaks_for_nothing() {
        let grey = vec![0.4; SIDE * SIDE];
        assert_eq!(share(&grey, &blotches(1), 1.0), 0.0);
        assert_eq!(share(&blotches(1), &grey, 1.0), 0.0);
    }

    #[test]
    fn a_piece_s_colour_is_told_where_its_pixels_are_too_noisy() {
        let joins = Joins::new(SIDE, SIDE, |i, j| (i % SIDE < SIDE / 2) == (j % SIDE < SIDE / 2));
        // blocks of 8 × 8 pixels that are off by a fifth either way; red is off by a tenth in the left half
        let noise = |i: usize| if (i % SIDE / 8 + i / SIDE / 8).is_multiple_of(2) { 0.2 } else { -0.2 };
        let red = (0..SIDE * SIDE).map(|i| noise(i) + if i % SIDE < SIDE / 2 { 0.1 } else { 0.0 }).collect();
        let chroma = [red, vec![0.0; SIDE * SIDE]];
        let told = by_piece(&joins, &chroma, &[true; SIDE * SIDE], &[Vec3::splat(0.3); SIDE * SIDE]);
        let expected = colour_of(0.1, 0.0);
        assert!(expected > 2.0 && (told[0] - expected).abs() < 0.1 && told[SIDE - 1] < 0.1, "{} {expected}", told[0]);
        // what was not tested, or is too small, says nothing
        let few: Vec<bool> = (0..SIDE * SIDE).map(|i| i < 20).collect();
        assert!(by_piece(&joins, &chroma, &few, &[Vec3::splat(0.3); SIDE * SIDE]).iter().all(|d| *d == 0.0));
    }
}
