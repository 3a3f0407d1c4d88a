//! Which textures the photograph shows laid otherwise than the model has them.

use glam::{Mat2, Vec2};
use rayon::prelude::*;

use crate::audit::finding::What;
use crate::audit::hypothesis::FARTHEST_M;
use crate::audit::hypothesis::laying::texture_alignment::{TexturePatch, UvTransform};
use crate::audit::picture::POSE_PX;
use crate::audit::view::Observations;
use crate::scene::Scene;

/// A correlation from which on a texture counts as found.
const FOUND: f32 = 0.45;

/// A correlation from which on a texture is where the model has it.
const FITS: f32 = 0.75;

/// What the odds are called in the evidence.
pub(crate) const EVIDENCE: &str = "odds of another laying";

/// Surfaces are tried off their place in steps of so many pixels, but no more steps than this each way; then in finer ones down to this
/// many pixels.
const STEP_PX: f32 = 0.7;
const MOST_STEPS: i32 = 100;
const FINE_PX: f32 = 0.1;

/// Layings that are looked at closely, of all that a coarse look leaves.
const CLOSE: usize = 8;

/// Scales that are tried, each way, and the ratio between them.
const SCALES: i32 = 10;
const SCALE_STEP: f32 = 1.072;

/// The turns and scales that are tried, with what they are called, the likelier first.
fn candidates(aspect: f32) -> Vec<(What, Mat2)> {
    let turn = |q: f32, s: f32| Mat2::from_cols(Vec2::new(0.0, q * s), Vec2::new(-q / s, 0.0));
    let scale = |s: f32| Mat2::from_diagonal(Vec2::splat(s));
    let mut all = vec![
        (What::Shifted, Mat2::IDENTITY),
        (What::Rotated, turn(1.0, 1.0)),
        (What::Rotated, turn(-1.0, 1.0)),
        (What::Rotated, scale(-1.0)),
        (What::Mirrored, Mat2::from_diagonal(Vec2::new(-1.0, 1.0))),
        (What::Mirrored, Mat2::from_diagonal(Vec2::new(1.0, -1.0))),
    ];
    if (aspect - 1.0).abs() > 0.05 {
        all.extend([1.0, -1.0].map(|q| (What::Rotated, turn(q, aspect))));
        all.extend([1.0, -1.0].map(|q| (What::Rotated, turn(q, 1.0 / aspect))));
    }
    // a surface that is a little nearer than the model has it looks a little larger: less is not told
    let steps = (2..=SCALES).flat_map(|k| [k, -k]);
    all.extend(steps.map(|k| (What::Scaled, scale(SCALE_STEP.powi(k)))));
    all
}

/// Another laying of a texture that the photograph shows; or the same on a surface that is off its place, which is the likelier
/// of the two: few shifts are along the line on which a surface's parallax moves it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Relaid {
    pub(crate) what: What,
    /// Correlation of structure with the texture as it is, and laid so.
    pub(crate) as_is: f32,
    pub(crate) best: f32,
    /// Logarithm of the odds of this against the texture as it is.
    pub(crate) odds: f32,
    /// How it is laid; if the surface moved, how well it is known how far.
    pub(crate) transform: UvTransform,
    pub(crate) uncertainty_m: f32,
}

/// Looks for the laying of the texture on some pixels that the photograph shows; `None` where none fits better than the
/// model's, or nothing is there to be laid.
pub(crate) fn relaid(scene: &Scene, observed: &Observations, pixels: &[usize]) -> Option<Relaid> {
    let texture = TexturePatch::mapped(scene, observed, pixels).or_else(|| TexturePatch::in_plane(observed, pixels))?;
    searched(&texture, tried(&texture, 1), observed.placement.usual_m(pixels))
}

/// Logarithm of how many layings are tried in so many places.
pub(super) fn tried(laid: &TexturePatch, places: usize) -> f32 {
    ((candidates(laid.aspect()).len() * laid.side * laid.side * places) as f32).ln()
}

/// Logarithm of the odds, an independent pixel, of a laying by whose correlation the photograph's structure is told so, against another.
pub(super) fn laying_odds(from: f32, to: f32) -> f32 {
    // with a free variance, twice the logarithm of the likelihood's ratio is that of what each leaves, times the pixels
    let left = |c: f32| 1.0 - c.clamp(0.0, 0.999).powi(2);
    0.5 * (left(from) / left(to)).ln()
}

/// How well a laying fits that is known but for what the camera's pose is off by, and which that is.
pub(super) fn near(laid: &TexturePatch, transform: UvTransform) -> (f32, UvTransform) {
    laid.climbed(transform, POSE_PX, 1)
}

/// The laying that the photograph shows, if its odds are better than `told`, of a surface that may be so many metres off its place without
/// being wrong.
pub(super) fn searched(laid: &TexturePatch, told: f32, usual_m: f32) -> Option<Relaid> {
    // and so may its texture, beside what a pose is off by
    let slack_px = POSE_PX.max(usual_m * laid.parallax_px());
    let (as_is, _) = near(laid, UvTransform::AS_IS);
    // a texture that fits is not laid otherwise
    if as_is > FITS {
        return None;
    }
    let n = laid.independent();
    let odds = |from: f32, to: f32| n * laying_odds(from, to);
    // even a perfect fit may not be enough
    if odds(as_is, 0.98) < told {
        return None;
    }
    let turns = candidates(laid.aspect());
    let shifts: Vec<Vec<(f32, Vec2)>> = turns.par_iter().map(|(_, turn)| laid.shifts(*turn)).collect();
    let mut close: Vec<(f32, usize, Vec2)> = shifts
        .into_iter()
        .enumerate()
        .flat_map(|(k, all)| all.into_iter().map(move |(c, shift)| (c, k, shift)))
        .collect();
    close.sort_by(|a, b| b.0.total_cmp(&a.0));
    close.truncate(CLOSE);
    let climbed: Vec<(f32, UvTransform)> =
        close.par_iter().map(|(_, k, shift)| climbed(laid, turns[*k].1, *shift, slack_px)).collect();
    // a surface off its place shows its texture about shifted, but not all of it by the same way
    let elsewhere = as_is < FOUND || close.iter().any(|(_, k, _)| *k == 0);
    let moved = if elsewhere { best_place(laid, slack_px) } else { nothing() };
    let of_turn =
        |k: usize| close.iter().zip(&climbed).filter(|(c, _)| c.1 == k).map(|(_, l)| *l).fold(nothing(), better);
    let laid_so = turns.iter().enumerate().map(|(k, (what, _))| (*what, of_turn(k)));
    let mut best: Option<(What, f32, UvTransform)> = None;
    for (what, (c, transform)) in std::iter::once((What::Moved, moved)).chain(laid_so) {
        // of two that fit as well the likelier, which comes first
        let better = best.is_none_or(|(_, b, _)| c > b);
        if c > FOUND && odds(as_is, c) > told && better {
            best = Some((what, c, transform));
        }
    }
    best.map(|(what, c, transform)| Relaid {
        what,
        as_is,
        best: c,
        odds: odds(as_is, c),
        transform,
        uncertainty_m: FINE_PX / laid.parallax_px(),
    })
}

/// No laying.
fn nothing() -> (f32, UvTransform) {
    (0.0, UvTransform::AS_IS)
}

/// The one that fits better.
fn better(a: (f32, UvTransform), b: (f32, UvTransform)) -> (f32, UvTransform) {
    if b.0 > a.0 { b } else { a }
}

/// How well the texture fits where it fits best near a shift, turned and scaled so; nothing where that is within so many pixels of how the
/// model has it.
fn climbed(laid: &TexturePatch, turn: Mat2, shift: Vec2, slack_px: f32) -> (f32, UvTransform) {
    let climbed = laid.climbed(UvTransform { turn, shift, off_m: 0.0 }, (0.5 * laid.step_px()).max(0.5), 2);
    let as_is = turn == Mat2::IDENTITY && laid.length_px(climbed.1.shift) < slack_px;
    if as_is { nothing() } else { climbed }
}

/// How well the texture fits where it fits best if the surface is more than so many pixels off its place, and how it lies there; the pose may
/// be off as much as where the model has it.
fn best_place(laid: &TexturePatch, slack_px: f32) -> (f32, UvTransform) {
    let per_m = laid.parallax_px().max(1e-6);
    let steps = ((FARTHEST_M * per_m / STEP_PX) as i32).min(MOST_STEPS);
    let at = |off_m: f32| {
        let place = UvTransform { off_m, ..UvTransform::AS_IS };
        (laid.fit(place), place)
    };
    let least = (slack_px / STEP_PX).ceil() as i32;
    let tried: Vec<i32> = (least..=steps).flat_map(|k| [k, -k]).collect();
    let all: Vec<(f32, UvTransform)> = tried.par_iter().map(|k| at(*k as f32 * STEP_PX / per_m)).collect();
    let (mut best, mut step) = (all.into_iter().fold(nothing(), better), 0.5 * STEP_PX / per_m);
    while best.0 > 0.0 && step * per_m >= FINE_PX {
        best = better(better(best, at(best.1.off_m - step)), at(best.1.off_m + step));
        step *= 0.5;
    }
    if best.0 > 0.0 { near(laid, best.1) } else { nothing() }
}

/// The pieces of texture, of at least so many pixels, that the photograph shows laid otherwise: their pixels, and how.
pub(crate) fn segments(scene: &Scene, observed: &Observations, least: usize) -> Vec<(Vec<usize>, Relaid)> {
    let segments = &observed.surfaces.segments;
    let large: Vec<&Vec<usize>> = segments.pixels.iter().filter(|pixels| pixels.len() >= least).collect();
    let relaid = |pixels: &Vec<usize>| {
        let texture = TexturePatch::mapped(scene, observed, pixels)?;
        let told = tried(&texture, large.len());
        let found = searched(&texture, told, observed.placement.usual_m(pixels))?;
        Some((pixels.clone(), found))
    };
    large.par_iter().copied().filter_map(relaid).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::hypothesis::laying::texture_alignment::tests::{blotches, photographed};

    #[test]
    fn another_laying_is_told_and_the_model_s_is_not() {
        let texture = blotches();
        let found = |turn, shift, noise| {
            let patch = photographed(&texture, UvTransform { turn, shift, off_m: 0.0 }, noise);
            searched(&patch, tried(&patch, 100), 0.0)
        };
        let as_it_is = |noise| found(Mat2::IDENTITY, Vec2::ZERO, noise);
        assert!(as_it_is(0.0).is_none() && as_it_is(0.3).is_none() && as_it_is(3.0).is_none());
        let cases = [
            (What::Shifted, Mat2::IDENTITY),
            (What::Rotated, Mat2::from_diagonal(Vec2::NEG_ONE)),
            (What::Rotated, Mat2::from_cols(Vec2::NEG_Y, Vec2::X)),
            (What::Mirrored, Mat2::from_diagonal(Vec2::new(1.0, -1.0))),
            (What::Scaled, Mat2::from_diagonal(Vec2::splat(1.0 / 1.5))),
        ];
        for (what, turn) in cases {
            let told = found(turn, Vec2::new(0.21, 0.47), 0.3).unwrap();
            assert!(told.what == what && told.odds > 50.0 && told.best > told.as_is, "{told:?} for {what:?}");
        }
        for off_m in [0.15, -0.08] {
            let told =
                searched(&photographed(&texture, UvTransform { off_m, ..UvTransform::AS_IS }, 0.1), 24.0, 0.0).unwrap();
            assert!(
                told.what == What::Moved && (told.transform.off_m - off_m).abs() < 3.0 * told.uncertainty_m,
                "{told:?}"
            );
        }
    }
}
