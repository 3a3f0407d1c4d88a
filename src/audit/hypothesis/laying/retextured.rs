//! Which textures the photograph shows laid otherwise than the model has them.

use glam::{Mat2, Vec2};
use rayon::prelude::*;

use crate::audit::finding::What;
use crate::audit::hypothesis::texture_alignment::{TexturePatch, UvTransform};
use crate::audit::view::Observations;
use crate::scene::Scene;

/// A correlation from which on a texture counts as found.
const FOUND: f32 = 0.45;

/// A correlation from which on a texture is where the model has it.
const FITS: f32 = 0.75;

/// Logarithm of the odds from which on another laying is told: many are tried.
const TOLD: f32 = 24.0;

/// Logarithm of the odds from which on a less likely transform is preferred: a chequered floor that was turned nearly fits
/// when it is shifted.
const ODDS: f32 = 3.0;

/// What the odds are called in the evidence.
pub(crate) const EVIDENCE: &str = "odds of another laying";

/// A texture may be off its place by so many pixels without being wrong.
const SLACK_PX: f32 = 2.0;

/// Surfaces are tried so far off their place, metres, in steps of so many pixels, but no more steps than this each way;
/// then in finer ones down to this many pixels.
const FARTHEST_M: f32 = 0.3;
const STEP_PX: f32 = 0.7;
const MOST_STEPS: i32 = 100;
const FINE_PX: f32 = 0.1;

/// A close look finds at most so many times the correlation of a coarse one, and so much more.
const COARSE: f32 = 1.6;
const COARSE_MORE: f32 = 0.15;

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
    /// If the surface moved: how far, metres towards the camera's side, and how well that is known.
    pub(crate) off_m: f32,
    pub(crate) uncertainty_m: f32,
}

/// Looks for the laying of the texture on some pixels that the photograph shows; `None` where none fits better than the
/// model's, or nothing is there to be laid.
pub(crate) fn relaid(scene: &Scene, observed: &Observations, pixels: &[usize]) -> Option<Relaid> {
    let texture = TexturePatch::mapped(scene, observed, pixels).or_else(|| TexturePatch::in_plane(observed, pixels))?;
    let tried = candidates(texture.aspect()).len() * texture.side * texture.side;
    searched(&texture, (tried as f32).ln())
}

/// The laying that the photograph shows, if its odds are better than `told`.
fn searched(laid: &TexturePatch, told: f32) -> Option<Relaid> {
    let (as_is, _) = laid.climbed(UvTransform::AS_IS, 0.7, 1);
    // a texture that fits is not laid otherwise
    if as_is > FITS {
        return None;
    }
    let n = laid.independent();
    // with a free variance, twice the logarithm of the likelihood's ratio is that of what each leaves, times the pixels
    let odds = |from: f32, to: f32| {
        let left = |c: f32| 1.0 - c.clamp(0.0, 0.999).powi(2);
        0.5 * n * (left(from) / left(to)).ln()
    };
    // even a perfect fit may not be enough
    if odds(as_is, 0.98) < told {
        return None;
    }
    // most can be left after a coarse look, which sees somewhat less than a close one
    let worth = |coarse: f32| odds(as_is, (COARSE * coarse + COARSE_MORE).min(0.98)) > told;
    let turns = candidates(laid.aspect());
    let shifts: Vec<Vec<(f32, Vec2)>> = turns.par_iter().map(|(_, turn)| laid.shifts(*turn)).collect();
    let promising = |k: usize| shifts[k].iter().filter(|s| worth(s.0)).map(|s| s.1);
    let fits: Vec<f32> = (0..turns.len()).into_par_iter().map(|k| best_shift(laid, turns[k].1, promising(k))).collect();
    // a surface off its place shows its texture about shifted, but not all of it by the same way
    let elsewhere = as_is < FOUND || promising(0).next().is_some();
    let (moved, off_m) = if elsewhere { best_place(laid) } else { (0.0, 0.0) };
    let names = std::iter::once(What::Moved).chain(turns.iter().map(|t| t.0));
    let mut best: Option<(What, f32)> = None;
    for (what, c) in names.zip(std::iter::once(moved).chain(fits)) {
        // the likelier comes first, and a less likely one must explain what the likelier cannot
        let better = best.is_none_or(|(_, b)| odds(b, c) > ODDS);
        if c > FOUND && odds(as_is, c) > told && better {
            best = Some((what, c));
        }
    }
    best.map(|(what, c)| Relaid {
        what,
        as_is,
        best: c,
        odds: odds(as_is, c),
        off_m,
        uncertainty_m: FINE_PX / laid.parallax_px(),
    })
}

/// How well the texture fits where it fits best near one of these shifts, turned and scaled so.
fn best_shift(laid: &TexturePatch, turn: Mat2, shifts: impl Iterator<Item = Vec2>) -> f32 {
    let first = (0.5 * laid.step_px()).max(0.5);
    let near = |shift: Vec2| turn == Mat2::IDENTITY && laid.length_px(shift) < SLACK_PX;
    let climbed = shifts.map(|shift| laid.climbed(UvTransform { turn, shift, off_m: 0.0 }, first, 2));
    climbed.filter(|(_, l)| !near(l.shift)).fold(0.0, |best, (c, _)| best.max(c))
}

/// How well the texture fits where it fits best if the surface is off its place, and how far that is.
fn best_place(laid: &TexturePatch) -> (f32, f32) {
    let per_m = laid.parallax_px().max(1e-6);
    let steps = ((FARTHEST_M * per_m / STEP_PX) as i32).min(MOST_STEPS);
    let at = |off_m: f32| (laid.fit(UvTransform { off_m, ..UvTransform::AS_IS }), off_m);
    let better = |a: (f32, f32), b: (f32, f32)| if b.0 > a.0 { b } else { a };
    let least = (SLACK_PX / STEP_PX).ceil() as i32;
    let tried: Vec<i32> = (least..=steps).flat_map(|k| [k, -k]).collect();
    let all: Vec<(f32, f32)> = tried.par_iter().map(|k| at(*k as f32 * STEP_PX / per_m)).collect();
    let (mut best, mut step) = (all.into_iter().fold((0.0, 0.0), better), 0.5 * STEP_PX / per_m);
    while best.0 > 0.0 && step * per_m >= FINE_PX {
        best = better(better(best, at(best.1 - step)), at(best.1 + step));
        step *= 0.5;
    }
    best
}

/// The pieces of texture, of at least so many pixels, that the photograph shows laid otherwise: each by its number.
pub(crate) fn segments(scene: &Scene, observed: &Observations, least: usize) -> Vec<(usize, Relaid)> {
    let segments = &observed.surfaces.segments;
    let large = |k: &usize| segments.pixels[*k].len() >= least;
    let all: Vec<usize> = (0..segments.pixels.len()).filter(large).collect();
    let relaid = |k: usize| Some((k, searched(&TexturePatch::mapped(scene, observed, &segments.pixels[k])?, TOLD)?));
    all.into_par_iter().filter_map(relaid).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::hypothesis::texture_alignment::tests::{blotches, photographed};

    #[test]
    fn another_laying_is_told_and_the_model_s_is_not() {
        let texture = blotches();
        let found = |turn, shift, noise| {
            searched(&photographed(&texture, UvTransform { turn, shift, off_m: 0.0 }, noise), TOLD)
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
            assert!(told.what == what && told.odds > 2.0 * TOLD && told.best > told.as_is, "{told:?} for {what:?}");
        }
        for off_m in [0.15, -0.08] {
            let told =
                searched(&photographed(&texture, UvTransform { off_m, ..UvTransform::AS_IS }, 0.1), TOLD).unwrap();
            assert!(told.what == What::Moved && (told.off_m - off_m).abs() < 3.0 * told.uncertainty_m, "{told:?}");
        }
    }
}
