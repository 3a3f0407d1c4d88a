//! Which textures the photograph shows laid otherwise than the model has them.

use glam::{Mat2, Vec2};
use rayon::prelude::*;

use super::What;
use super::laid::{Laid, Laying};
use super::view::Maps;
use crate::scene::Scene;

/// A correlation from which on a texture counts as found.
const FOUND: f32 = 0.45;

/// Logarithm of the odds from which on another laying is told: many are tried.
pub(super) const TOLD: f32 = 12.0;

/// Logarithm of the odds from which on a less likely transform is preferred: a chequered floor that was turned nearly fits
/// when it is shifted.
const ODDS: f32 = 3.0;

/// A texture may be off its place by so many pixels without being wrong.
const SLACK_PX: f32 = 2.0;

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

/// Another laying of a texture that the photograph shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Relaid {
    pub(super) what: What,
    /// Correlation of structure with the texture as it is, and laid so.
    pub(super) as_is: f32,
    pub(super) best: f32,
    /// Logarithm of the odds of this against the texture as it is.
    pub(super) odds: f32,
}

/// Looks for the laying of the texture on some pixels that the photograph shows; `None` where none fits better than the
/// model's, or no texture is there to be laid.
pub(super) fn relaid(scene: &Scene, maps: &Maps, pixels: &[usize]) -> Option<Relaid> {
    searched(&Laid::of(scene, maps, pixels)?)
}

fn searched(laid: &Laid) -> Option<Relaid> {
    let (as_is, _) = laid.climbed(Laying { turn: Mat2::IDENTITY, shift: Vec2::ZERO }, 0.7, 1);
    let n = laid.independent();
    // with a free variance, twice the logarithm of the likelihood's ratio is that of what each leaves, times the pixels
    let odds = |from: f32, to: f32| {
        let left = |c: f32| 1.0 - c.clamp(0.0, 0.999).powi(2);
        0.5 * n * (left(from) / left(to)).ln()
    };
    // even a perfect fit would not be enough
    if odds(as_is, 0.98) < TOLD {
        return None;
    }
    let candidates = candidates(laid.aspect());
    let coarse: Vec<Vec<(f32, Vec2)>> = candidates.par_iter().map(|(_, m)| laid.shifts(*m)).collect();
    let first = (0.5 * laid.step_px()).max(0.5);
    let found: Vec<f32> = candidates
        .par_iter()
        .zip(&coarse)
        .map(|((_, turn), shifts)| {
            let near = |shift: Vec2| *turn == Mat2::IDENTITY && laid.length_px(shift) < SLACK_PX;
            let climbed = shifts.iter().map(|s| laid.climbed(Laying { turn: *turn, shift: s.1 }, first, 2));
            climbed.filter(|(_, l)| !near(l.shift)).fold(0.0, |best: f32, (c, _)| best.max(c))
        })
        .collect();
    let mut best: Option<(What, f32)> = None;
    for ((what, _), c) in candidates.iter().zip(found) {
        // the likelier comes first, and a less likely one must explain what the likelier cannot
        let better = best.map_or(odds(as_is, c) > TOLD, |(_, b)| odds(b, c) > ODDS);
        if c > FOUND && better {
            best = Some((*what, c));
        }
    }
    best.map(|(what, c)| Relaid { what, as_is, best: c, odds: odds(as_is, c) })
}

/// The pieces of texture, of at least so many pixels, that the photograph shows laid otherwise: each by its number.
pub(super) fn pieces(scene: &Scene, maps: &Maps, least: usize) -> Vec<(usize, Relaid)> {
    let pieces = &maps.surfaces.pieces;
    let large = |k: &usize| pieces.pixels[*k].len() >= least;
    let all: Vec<usize> = (0..pieces.pixels.len()).filter(large).collect();
    all.into_par_iter().filter_map(|k| Some((k, relaid(scene, maps, &pieces.pixels[k])?))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::laid::tests::{blotches, photographed};
    use super::*;

    #[test]
    fn another_laying_is_told_and_the_model_s_is_not() {
        let texture = blotches();
        let found = |turn, shift, noise| searched(&photographed(&texture, Laying { turn, shift }, noise));
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
    }
}
