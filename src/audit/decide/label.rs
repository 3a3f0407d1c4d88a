//! A verdict for every pixel, and why it is no better.

use crate::audit::finding::Kind;
use crate::audit::likelihood::structure::BLACK;
use crate::audit::observe::geometry_buffer::NONE;
use crate::audit::verdict::{Reason, Verdict};
use crate::audit::view::Observations;
use crate::panorama::luminance;

/// A moved surface must raise the cost by this much for its place to count as tested.
pub(crate) const SENSITIVITY: f32 = 120.0;

/// Odds below which a pixel's structure bears the model out.
const BORNE_OUT: f32 = -1.0;

/// A verdict for each pixel that no region marks, and why it is no better.
pub(crate) fn verdicts(observed: &Observations) -> (Vec<Verdict>, Vec<Reason>) {
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
        } else {
            Reason::None
        };
        reasons[i] = reason;
        if reason == Reason::None {
            verdicts[i] = Verdict::Ok;
        }
    }
    (verdicts, reasons)
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
