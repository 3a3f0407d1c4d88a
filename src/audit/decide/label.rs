//! A verdict for every pixel, and why it is no better.

use crate::audit::finding::Kind;
use crate::audit::likelihood::structure::BLACK;
use crate::audit::observe::geometry_buffer::NONE;
use crate::audit::picture::regions::opened;
use crate::audit::verdict::{Reason, Verdict};
use crate::audit::view::Observations;
use crate::panorama::luminance;

/// A moved surface must raise the cost by this much for its place to count as tested.
pub(crate) const SENSITIVITY: f32 = 15.0;

/// Odds below which a pixel's structure bears the model out.
const BORNE_OUT: f32 = -1.0;

/// Odds of a fault, by all that a pixel shows by itself, from which on it is not right, whether a region tells it or not; logarithm of 3 : 2.
const SUSPECTED: f32 = 0.405;

/// A verdict for each pixel that no region marks, and why it is no better. `own` is what each adds by itself to the logarithm of the odds
/// of a fault.
pub(crate) fn verdicts(observed: &Observations, own: &[f32]) -> (Vec<Verdict>, Vec<Reason>) {
    let (s, t, g) = (&observed.surfaces, &observed.texture, &observed.geometry);
    let n = t.tested.len();
    let mut verdicts = vec![Verdict::Untestable; n];
    let mut reasons = vec![Reason::None; n];
    for i in 0..n {
        let reason = if observed.photo.unusable[i] != Reason::None {
            observed.photo.unusable[i]
        } else if s.triangle[i] == NONE {
            Reason::NoSurface
        } else if g.seen[i] == 0 {
            if s.normal[i].dot(s.ray[i]).abs() < 0.12 { Reason::Grazing } else { Reason::Unseen }
        } else if g.able[i] == 0 {
            Reason::NoParallax
        } else if luminance(observed.albedo[i]) <= BLACK {
            Reason::BlackAlbedo
        } else if !t.tested[i] {
            Reason::Grazing
        } else if g.sensitivity[i] < SENSITIVITY || (t.structure.structured[i] && t.structure.odds[i] > BORNE_OUT) {
            Reason::NoTexture
        } else if own[i] >= SUSPECTED {
            Reason::Usual
        } else {
            Reason::None
        };
        reasons[i] = reason;
        if reason == Reason::None {
            verdicts[i] = Verdict::Ok;
        }
    }
    // a plain place tells too little by itself
    let tested: Vec<bool> = verdicts.iter().map(|v| *v == Verdict::Ok).collect();
    let plain = |i: usize| reasons[i] == Reason::NoTexture && g.sensitivity[i] < SENSITIVITY && own[i] < SUSPECTED;
    let plain: Vec<bool> = (0..n).map(plain).collect();
    let borne_out = with_between(&tested, &plain, &s.label, s.width);
    for i in (0..n).filter(|i| plain[*i] && borne_out[*i]) {
        (verdicts[i], reasons[i]) = (Verdict::Ok, Reason::None);
    }
    (verdicts, reasons)
}

/// What was tested, and what is plain between: in a row, column or diagonal of pixels from one tested place of a smooth surface to another,
/// plain all along. A surface that is in its place at both ends is there between them. What is thinner than a diamond of five pixels is left out.
fn with_between(tested: &[bool], plain: &[bool], label: &[u32], width: usize) -> Vec<bool> {
    let height = tested.len() / width.max(1);
    let (w, h) = (width as isize, height as isize);
    let inside = |x: isize, y: isize| (0..w).contains(&x) && (0..h).contains(&y);
    let mut all = tested.to_vec();
    for (right, down) in [(1, 0), (0, 1), (1, 1), (-1, 1)] {
        for start in (0..w * h).filter(|i| !inside(i % w - right, i / w - down)) {
            let (mut x, mut y) = (start % w, start / w);
            // the last tested place's surface, and what is plain since
            let (mut surface, mut since) = (None, Vec::new());
            while inside(x, y) {
                let i = (y * w + x) as usize;
                let same = surface == Some(label[i]);
                if tested[i] {
                    let between = since.drain(..).filter(|_| same);
                    between.for_each(|i: usize| all[i] = true);
                    surface = Some(label[i]);
                } else if same && plain[i] {
                    since.push(i);
                } else {
                    surface = None;
                    since.clear();
                }
                (x, y) = (x + right, y + down);
            }
        }
    }
    opened(&all, width, height, 2)
}

/// Takes back that pixels are right which are suspected, by what is told near them and by themselves, as much as a doubt is told with.
pub(crate) fn unmark_suspected(verdicts: &mut [Verdict], reasons: &mut [Reason], suspicion: &[f32], least: f64) {
    for ((verdict, reason), suspicion) in verdicts.iter_mut().zip(reasons).zip(suspicion) {
        if *verdict == Verdict::Ok && f64::from(*suspicion) >= least {
            (*verdict, *reason) = (Verdict::Untestable, Reason::Usual);
        }
    }
}

/// Marks a region: as a fault, or, where there is a reason to, as a doubt.
pub(crate) fn mark(verdicts: &mut [Verdict], reasons: &mut [Reason], pixels: &[usize], kind: Kind, reason: Reason) {
    let verdict = match (reason, kind) {
        (Reason::None, Kind::Texture) => Verdict::Texture,
        (Reason::None, Kind::Geometry) => Verdict::Geometry,
        _ => Verdict::Ambiguous,
    };
    for &i in pixels {
        (verdicts[i], reasons[i]) = (verdict, reason);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_suspected_as_much_as_a_doubt_is_not_right() {
        let (mut verdicts, mut reasons) = ([Verdict::Ok, Verdict::Ok, Verdict::Geometry], [Reason::None; 3]);
        unmark_suspected(&mut verdicts, &mut reasons, &[0.05, 0.4, 0.9], 0.1);
        assert_eq!(verdicts, [Verdict::Ok, Verdict::Untestable, Verdict::Geometry]);
        assert_eq!(reasons, [Reason::None, Reason::Usual, Reason::None]);
    }

    #[test]
    fn plain_places_between_tested_ones_of_the_same_surface_are_borne_out() {
        const SIDE: usize = 40;
        let at = |i: usize| (i % SIDE, i / SIDE);
        let picture = |f: &dyn Fn((usize, usize)) -> bool| (0..SIDE * SIDE).map(|i| f(at(i))).collect::<Vec<bool>>();
        // two surfaces side by side; the left one was tested at both sides, the right one at one
        let label: Vec<u32> = (0..SIDE * SIDE).map(|i| u32::from(at(i).0 >= 24)).collect();
        let tested = picture(&|(x, _)| x < 6 || (18..30).contains(&x));
        let plain = picture(&|at| !tested[at.1 * SIDE + at.0]);
        assert!(with_between(&tested, &plain, &label, SIDE) == picture(&|(x, _)| x < 30));
        // what does not agree on the way is no bridge, nor is what is thin
        let broken = picture(&|(x, y)| plain[y * SIDE + x] && (x != 12 || y == 20));
        let all = with_between(&tested, &broken, &label, SIDE);
        assert!((0..SIDE * SIDE).filter(|i| (9..16).contains(&at(*i).0)).all(|i| !all[i]));
    }
}
