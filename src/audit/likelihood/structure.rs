//! How far a photograph follows an albedo's structure, over windows and over regions.

use glam::Vec3;

use crate::audit::picture::by_luminance::Bins;
use crate::audit::picture::regions::Segments;
use crate::edge_aware::EdgeAware;
use crate::panorama::luminance;

/// Darker albedo cannot be compared with.
pub(crate) const BLACK: f32 = 0.015;

/// Structure is what a blur of this standard deviation takes away, pixels, compared over a window of the second, as colours are.
pub(crate) const BAND: f32 = 3.0;
pub(crate) const WINDOW: f32 = 5.0;

/// Structure is alike over some three or four pixels each way: so many tell as much as one.
pub(crate) const ALIKE_PX: f32 = 12.0;

/// With less than this share of the energy expected there is nothing to compare.
const FAINT: f32 = 0.25;

/// Relative brightness that photograph and albedo may always differ by. Structure of an albedo is compared if its contrast (standard deviation
/// of its logarithm within the band) is more.
const FLOOR: f32 = 0.02;

/// Pixels that a texture may be off its place without being wrong.
const SLACK_PX: isize = 1;

/// What windows say of the structure of photograph and albedo.
pub(crate) struct Structure {
    /// Logarithm of the odds that the photograph shows none of the albedo's structure and not all of it, over a window, where it
    /// follows most within the slack: above 0 the structure is wrong, below it is right.
    pub(crate) odds: Vec<f32>,
    /// Structure of the photograph and of the albedo: logarithms of brightness without what is smooth.
    pub(crate) bands: [Vec<f32>; 2],
    /// What a right texture has at the pixel's brightness: how much of the albedo's structure, and the variance of what
    /// does not follow it.
    pub(crate) usual: Vec<[f32; 2]>,
    /// Variance of what does not follow the albedo, over a window, with what a right texture has of it.
    pub(crate) variance: Vec<f32>,
    /// Logarithm of what does not follow the albedo, over a window, as a multiple of what three quarters of the picture as bright
    /// have less of: structure that the model lacks, and edges of light.
    pub(crate) lacking: Vec<f32>,
    /// Whether the albedo has structure enough.
    pub(crate) structured: Vec<bool>,
    /// Whether a pixel could be tested at all.
    pub(crate) tested: Vec<bool>,
}

impl Structure {
    /// How much a pixel counts: the less, the more the photograph has around it that does not follow the albedo.
    pub(crate) fn weight(&self, i: usize) -> f32 {
        1.0 / self.variance[i]
    }
}

/// How far the photograph follows the albedo's structure, over windows. Both are logarithms of albedo and of as much as cannot be
/// told apart.
pub(crate) fn structure(
    filter: &EdgeAware,
    segments: &Segments,
    weight: &[f32],
    photo: &[Vec3],
    albedo: &[Vec3],
) -> Structure {
    let n = weight.len();
    let band = |levels: &[Vec3]| -> Vec<f32> {
        let v: Vec<f32> = (0..n)
            .map(|i| if weight[i] > 0.0 { luminance(levels[i].map(f32::exp)).max(1e-6).ln() } else { 0.0 })
            .collect();
        let smooth = filter.mean(&v, weight, BAND);
        (0..n).map(|i| if weight[i] > 0.0 { v[i] - smooth[i] } else { 0.0 }).collect()
    };
    let (a, b) = (band(photo), band(albedo));
    let smoothed = filter.smoothed(weight, WINDOW);
    let mean = |f: &dyn Fn(usize) -> f32| {
        let values: Vec<f32> = (0..n).map(f).collect();
        filter.mean_with(&values, weight, &smoothed, WINDOW)
    };
    let (aa, bb, ab) = (mean(&|i| a[i] * a[i]), mean(&|i| b[i] * b[i]), mean(&|i| a[i] * b[i]));
    let sums: Vec<Sums> = (0..n).map(|i| Sums { aa: aa[i], bb: bb[i], ab: ab[i] }).collect();
    // registration leaves about a pixel: each window is judged where it follows the albedo most
    let followed = slack().filter(|by| *by != [0, 0]).fold(ab, |most, by| {
        let beside = |i: usize| beside(i, by, filter.width, n).filter(|j| weight[*j] > 0.0).unwrap_or(i);
        let there = mean(&|i| a[i] * b[beside(i)]);
        most.into_iter().zip(there).map(|(most, there)| most.max(there)).collect()
    });
    let structured: Vec<bool> = (0..n).map(|i| weight[i] > 0.0 && sums[i].bb > FLOOR * FLOOR).collect();
    // what the picture shows of its texture, and what besides, is what a right texture has; a wrong floor may fill more
    // than half of it, so that a quarter must do
    let slope: Vec<f32> = sums.iter().map(Sums::slope).collect();
    let rest: Vec<f32> = sums.iter().map(Sums::rest).collect();
    // faint structure has less of it than strong structure as bright: the lesser of both
    let contrast: Vec<f32> = (0..n).map(|i| if structured[i] { sums[i].bb } else { f32::NAN }).collect();
    let usually = |bins: &Bins| -> Vec<[f32; 2]> {
        let slope = bins.quantile(&slope, 0.75, |i| structured[i]).map(|s| s.clamp(0.0, 1.0));
        let rest = bins.quantile(&rest, 0.75, |i| structured[i]);
        bins.of.iter().map(|k| [slope[*k], rest[*k]]).collect()
    };
    let both = usually(&Bins::new(photo)).into_iter().zip(usually(&Bins::by(&contrast)));
    let usual: Vec<[f32; 2]> = both.map(|(a, b)| [a[0].min(b[0]), a[1].min(b[1])]).collect();
    let all_rest = Bins::new(photo);
    let most_rest = all_rest.quantile(&rest, 0.75, |i| weight[i] > 0.0);
    let over = |i: usize| ((rest[i] + FLOOR * FLOOR) / (most_rest[all_rest.of[i]] + FLOOR * FLOOR)).ln();
    let lacking = (0..n).map(|i| if weight[i] > 0.0 { over(i) } else { f32::NEG_INFINITY }).collect();
    // a piece smaller than the window tells no more than its pixels
    let window_px = 4.0 * std::f32::consts::PI * WINDOW * WINDOW;
    let in_piece: Vec<f32> = segments.pixels.iter().map(|p| p.iter().map(|i| weight[*i]).sum()).collect();
    let odds = (0..n)
        .map(|i| {
            let pixels = (smoothed[i].min(1.0) * window_px).min(in_piece[segments.of[i] as usize]);
            if weight[i] > 0.0 { Sums { ab: followed[i], ..sums[i] }.log_odds(usual[i], pixels) } else { 0.0 }
        })
        .collect();
    let variance = (0..n).map(|i| sums[i].variance(usual[i])).collect();
    let tested = weight.iter().map(|w| *w > 0.0).collect();
    Structure { bands: [a, b], odds, structured, usual, variance, lacking, tested }
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
        if self.aa < FAINT * expected { odds.min(0.0) } else { odds }
    }
}

/// The same over those of a set of pixels where the albedo has structure, for the place within the slack where the photograph agrees best, and how much
/// of the albedo's structure is there then (1: as much as usual). Each pixel counts by the variance around it, so that a
/// shadow's edge does not drown what the rest of the set says.
pub(crate) fn odds_of(of: &Structure, width: usize, pixels: &[usize]) -> (f32, f32) {
    let [a, b] = &of.bands;
    let n = a.len();
    let all: Vec<usize> = pixels.iter().copied().filter(|i| of.structured[*i]).collect();
    let mut best: Option<(f32, f32)> = None;
    for by in slack() {
        let [mut seen, mut expected, mut followed] = [0.0f64; 3];
        for &i in &all {
            let Some(j) = beside(i, by, width, n).filter(|j| of.tested[*j]) else { continue };
            let (a, b) = (f64::from(a[i]), f64::from(b[j]));
            let (slope, weight) = (f64::from(of.usual[i][0]), f64::from(of.weight(i)));
            seen += weight * a * a;
            expected += weight * slope * slope * b * b;
            followed += weight * slope * a * b;
        }
        let odds = (expected - 2.0 * followed) / f64::from(2.0 * ALIKE_PX);
        let faint = seen < f64::from(FAINT) * expected;
        let odds = if faint { odds.min(0.0) } else { odds } as f32;
        if best.is_none_or(|(o, _)| odds < o) {
            best = Some((odds, (followed / expected.max(1e-9)) as f32));
        }
    }
    best.unwrap_or((0.0, 0.0))
}

/// Columns and rows that a texture may be off its place by.
fn slack() -> impl Iterator<Item = [isize; 2]> {
    let each = || -SLACK_PX..=SLACK_PX;
    each().flat_map(move |dy| each().map(move |dx| [dx, dy]))
}

/// The pixel so many columns and rows from one, of as many as there are.
fn beside(i: usize, [dx, dy]: [isize; 2], width: usize, pixels: usize) -> Option<usize> {
    i.checked_add_signed(dy * width as isize + dx).filter(|j| *j < pixels)
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
        let filter = EdgeAware::open(SIDE, SIDE);
        let photo: Vec<Vec3> = photo.iter().map(|v| Vec3::splat(v.ln())).collect();
        let albedo: Vec<Vec3> = albedo.iter().map(|v| Vec3::splat((*v + BLACK).ln())).collect();
        let odds = structure(&filter, &Segments::new(&filter), &[1.0; SIDE * SIDE], &photo, &albedo).odds;
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
        assert!((0.09..0.35).contains(&wrong), "{wrong}");
    }

    #[test]
    fn a_picture_a_pixel_beside_its_place_is_right_and_farther_off_it_is_not() {
        let albedo = blotches(1);
        let shifted = |by: usize| -> Vec<f32> { (0..SIDE * SIDE).map(|i| albedo[(i + by) % (SIDE * SIDE)]).collect() };
        for by in [1, SIDE, SIDE + 1] {
            let borne_out = share(&shifted(by), &albedo, -1.0);
            assert!(borne_out > 0.8, "{borne_out} by {by}");
        }
        let far = shifted(6);
        let third: Vec<f32> = (0..SIDE * SIDE).map(|i| if i % SIDE < SIDE / 3 { far[i] } else { albedo[i] }).collect();
        let wrong = share(&third, &albedo, 3.0);
        assert!((0.05..0.35).contains(&wrong), "{wrong}");
    }

    #[test]
    fn structure_that_the_model_lacks_is_told_all_over_it() {
        let filter = EdgeAware::open(SIDE, SIDE);
        let albedo = vec![Vec3::splat(0.4f32.ln()); SIDE * SIDE];
        let other = blotches(2);
        let within = |i: usize| (20..44).contains(&(i % SIDE)) && (20..44).contains(&(i / SIDE));
        // even light around it, as bright and as dark
        let light = |i: usize| 0.3 + 0.2 * (i / SIDE) as f32 / SIDE as f32;
        let photo: Vec<Vec3> =
            (0..SIDE * SIDE).map(|i| Vec3::splat(if within(i) { other[i] } else { light(i) }.ln())).collect();
        let told = structure(&filter, &Segments::new(&filter), &[1.0; SIDE * SIDE], &photo, &albedo).lacking;
        let share = |of: &dyn Fn(usize) -> bool| {
            let all: Vec<usize> = (0..SIDE * SIDE).filter(|i| of(*i)).collect();
            all.iter().filter(|i| told[**i] > 1.0).count() as f32 / all.len() as f32
        };
        assert!(share(&within) > 0.6 && share(&|i| !within(i)) < 0.1, "{} {}", share(&within), share(&|i| !within(i)));
    }

    #[test]
    fn a_photograph_without_structure_speaks_for_nothing() {
        let grey = vec![0.4; SIDE * SIDE];
        assert_eq!(share(&grey, &blotches(1), 1.0), 0.0);
        assert_eq!(share(&blotches(1), &grey, 1.0), 0.0);
    }
}
