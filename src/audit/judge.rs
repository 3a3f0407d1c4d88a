//! From both tests' maps to regions with a kind: what they mark is cut into regions, each is judged by itself, and what
//! belongs together is joined.

use super::absent::{self, Silhouette};
use super::alarm::{Fields, Statistic};
use super::outline::{self, Shifted};
use super::regions::{Region, closed, components, opened};
use super::scores::{LOW, Scores};
use super::surfaces::NONE;
use super::view::{Maps, Prepared};
use super::{Displacement, Evidence, Kind, Reason, Shift, What, decision, extent, relaid};

/// ΔE00 of all the picture together that makes one doubt the white balance.
pub(super) const WHITE: f32 = 8.0;
/// Regions smaller than this share of the picture are left out.
const LEAST_SHARE: f64 = 6e-4;
/// Nor are fewer pixels than this a region.
const LEAST_PX: usize = 30;

/// A region that both tests have had their say on.
pub struct Judged {
    pub(super) region: Region,
    /// Texture or geometry.
    pub kind: Kind,
    /// What is wrong.
    pub what: What,
    /// Confidence, 0..=1.
    pub score: f64,
    /// How far the surface is off, where that could be measured.
    pub displacement: Option<Displacement>,
    /// How far a part stands beside its place.
    pub shift: Option<Shift>,
    /// Why it is a doubt; [`Reason::None`] for a finding.
    pub reason: Reason,
    /// The figures behind it.
    pub evidence: Vec<Evidence>,
    /// What tells it from what is right elsewhere; `None` where the test behind it has odds of its own.
    pub(super) statistic: Option<Statistic>,
}

impl Judged {
    /// Indices of its pixels at the audit's size.
    pub fn pixels(&self) -> &[usize] {
        &self.region.pixels
    }
}

/// Finds the regions of a view and judges each.
pub(super) fn judge(prepared: &Prepared, maps: &Maps, scores: &Scores) -> (Vec<Judged>, Fields) {
    let (w, h) = maps.size();
    let least = least(maps);
    let mut taken = vec![false; w * h];
    let mut judged = Vec::new();
    // what both mark is one thing: regions are cut from the union, then told apart
    let both = scores.both();
    let high: Vec<bool> = both.iter().map(|s| *s >= 1.0).collect();
    let low: Vec<bool> = both.iter().map(|s| *s >= LOW).collect();
    let high = opened(&high, w, h, 2);
    let low = closed(&opened(&low, w, h, 1), w, h, 2);
    let s = &maps.surfaces;
    let shares = s.pieces.shares(&low);
    let same = |i: usize, j: usize| s.material[i] == s.material[j];
    for region in components(&low, &high, w, least, same) {
        let judged_one = decision::judged(prepared, maps, scores, &shares, region, least);
        // of a doubt behind a window or door nobody could say where it is
        let nowhere = |j: &Judged| {
            let off = j.region.pixels.iter().filter(|i| s.triangle[**i] == NONE).count();
            j.reason != Reason::None && 2 * off > j.region.pixels.len()
        };
        if let Some(j) = judged_one.filter(|j| !nowhere(j)) {
            for &i in &j.region.pixels {
                taken[i] = true;
            }
            judged.push(j);
        }
    }
    let judged = united(with_relaid(judged, prepared, maps), maps);
    let judged = extent::grown(prepared, maps, with_shifted(judged, outline::shifted(prepared, maps), maps));
    let (silhouettes, brightness) = absent::silhouettes(prepared, maps, least);
    let told = |values: &[f32], of: &dyn Fn(usize) -> bool| -> Vec<f32> {
        values.iter().enumerate().map(|(i, v)| if of(i) { *v } else { f32::NAN }).collect()
    };
    let place = told(&maps.geometry.mismatch, &|i| maps.geometry.able[i] > 0);
    let picture = told(&scores.texture, &|i| maps.texture.tested[i]);
    let fields = Fields::new(w, maps.surfaces.position.clone(), [place, picture, brightness]);
    let mut judged = with_absent(judged, silhouettes, maps);
    // what the photograph does not show is nobody's fault
    for j in &mut judged {
        j.region.pixels.retain(|i| maps.usable[*i] > 0.0);
    }
    judged.retain(|j| j.region.pixels.len() >= least);
    (judged, fields)
}

/// Adds pieces of texture that the photograph shows laid otherwise, but for those whose shape is wrong. They explain what
/// lies mostly within them.
fn with_relaid(mut judged: Vec<Judged>, prepared: &Prepared, maps: &Maps) -> Vec<Judged> {
    let pieces = &maps.surfaces.pieces;
    for (k, found) in relaid::pieces(prepared.scene, maps, least(maps)) {
        let piece = &pieces.pixels[k];
        let within = |j: &Judged| j.region.pixels.iter().filter(|i| pieces.of[**i] as usize == k).count();
        let of_shape = |j: &&Judged| j.kind == Kind::Geometry && j.reason == Reason::None;
        let misshapen: usize = judged.iter().filter(of_shape).map(within).sum();
        if 3 * misshapen > piece.len() {
            continue;
        }
        let moved = found.what == What::Moved;
        judged.retain(|j| of_shape(&j) || 2 * within(j) <= j.region.pixels.len());
        judged.push(Judged {
            score: confidence(f64::from(found.odds / relaid::TOLD), piece.len() as f32),
            kind: if moved { Kind::Geometry } else { Kind::Texture },
            what: found.what,
            displacement: moved
                .then_some(Displacement { metres: found.off_m.into(), uncertainty_m: found.uncertainty_m.into() }),
            shift: None,
            reason: Reason::None,
            evidence: vec![
                Evidence::new(relaid::EVIDENCE, found.odds, relaid::TOLD, "logarithm"),
                Evidence::new("correlation with the model's texture", found.as_is, 0.5, "correlation"),
                Evidence::new("correlation when laid otherwise", found.best, 0.0, "correlation"),
            ],
            statistic: None,
            region: Region { pixels: piece.clone() },
        });
    }
    judged
}

/// Adds what stands before the model's surfaces, unless another finding explains most of it already. It explains doubts that
/// lie mostly within it, and a surface beside it that is hidden by something: the probes saw that thing, too, each on what is
/// behind it from there.
fn with_absent(mut judged: Vec<Judged>, silhouettes: Vec<Silhouette>, maps: &Maps) -> Vec<Judged> {
    for s in silhouettes {
        let pixels = &s.region.pixels;
        let within = |j: &Judged| j.region.pixels.iter().filter(|i| pixels.binary_search(i).is_ok()).count();
        let hidden = |j: &Judged| j.what == What::Missing && j.displacement.is_none();
        let few = |j: &Judged| (pixels.len() as f32) < absent::FEW * j.region.pixels.len() as f32;
        let evidence = Evidence::new(absent::EVIDENCE, s.excess, s.threshold, "logarithm");
        if let Some(j) = judged.iter_mut().find(|j| hidden(j) && few(j) && 2 * within(j) > pixels.len()) {
            // two tests in different light, unless one probe alone is behind both
            j.reason = if s.several { Reason::None } else { j.reason };
            j.evidence.push(evidence);
            continue;
        }
        let told = |j: &&Judged| j.reason == Reason::None && !hidden(j);
        let explained: usize = judged.iter().filter(told).map(within).sum();
        if 2 * explained > pixels.len() {
            continue;
        }
        let strength = s.excess / s.threshold;
        let share = strength * strength * pixels.len() as f32 / maps.usable.len() as f32;
        if share < absent::DOUBT_SHARE {
            continue;
        }
        // what one probe alone saw elsewhere may be that probe's own
        let sure = s.several && share >= absent::SURE_SHARE;
        if sure {
            judged.retain(|j| {
                let inside = within(j);
                told(&j) || (2 * inside <= j.region.pixels.len() && (inside == 0 || !hidden(j)))
            });
        }
        judged.push(Judged {
            score: confidence(f64::from(strength), pixels.len() as f32),
            kind: Kind::Geometry,
            what: What::Missing,
            displacement: None,
            shift: None,
            reason: if sure { Reason::None } else { Reason::Undecided },
            evidence: vec![evidence],
            statistic: Some(Statistic::Brightness),
            region: s.region,
        });
    }
    judged
}

/// Adds parts that stand beside their place. They explain what lies mostly within them.
fn with_shifted(mut judged: Vec<Judged>, shifted: Vec<Shifted>, maps: &Maps) -> Vec<Judged> {
    for part in shifted {
        if part.pixels.len() < least(maps) {
            continue;
        }
        let within = |j: &Judged| {
            let inside = j.region.pixels.iter().filter(|i| part.pixels.binary_search(i).is_ok()).count();
            2 * inside > j.region.pixels.len()
        };
        judged.retain(|j| !within(j));
        judged.push(Judged {
            score: confidence(f64::from(part.odds / outline::ODDS), part.pixels.len() as f32),
            kind: Kind::Geometry,
            what: What::Moved,
            displacement: None,
            shift: part.shift(),
            reason: Reason::None,
            evidence: part.evidence(),
            statistic: None,
            region: Region { pixels: part.pixels },
        });
    }
    judged
}

/// Makes one of regions whose texture is wrong in one way on one material in one plane: a turned floor shows in pieces
/// where grout or shadow between them speaks for nothing. A doubt joins a finding.
fn united(judged: Vec<Judged>, maps: &Maps) -> Vec<Judged> {
    /// Metres between planes that count as one.
    const APART_M: f32 = 0.05;
    let s = &maps.surfaces;
    let middle = |j: &Judged| j.region.pixels[j.region.pixels.len() / 2];
    let alike = |a: &Judged, b: &Judged| {
        let mapped = matches!(a.what, What::Rotated | What::Mirrored | What::Shifted | What::Scaled);
        let (i, k) = (middle(a), middle(b));
        let offset = s.normal[i].dot(s.position[k] - s.position[i]).abs();
        a.kind == Kind::Texture
            && b.kind == Kind::Texture
            && mapped
            && (a.what == b.what || (b.what == What::Changed && b.reason != Reason::None))
            && a.reason == Reason::None
            && s.material[i] == s.material[k]
            && s.normal[i].dot(s.normal[k]) > 0.99
            && offset < APART_M
    };
    let mut all: Vec<Judged> = Vec::new();
    let (findings, doubts): (Vec<_>, Vec<_>) = judged.into_iter().partition(|j| j.reason == Reason::None);
    for j in findings.into_iter().chain(doubts) {
        match all.iter_mut().find(|whole| alike(whole, &j)) {
            Some(whole) => {
                whole.region.pixels.extend(j.region.pixels);
                whole.region.pixels.sort_unstable();
                whole.score = whole.score.max(j.score);
            }
            None => all.push(j),
        }
    }
    all
}

/// Pixels of the smallest region.
fn least(maps: &Maps) -> usize {
    LEAST_PX.max((LEAST_SHARE * maps.usable.len() as f64) as usize)
}

/// Confidence from strength over threshold and from size: one half at the threshold for a small region.
pub(super) fn confidence(strength: f64, pixels: f32) -> f64 {
    let odds = strength.max(0.1).powf(1.5) * (f64::from(pixels) / 100.0).max(0.3).powf(0.3);
    odds / (1.0 + odds)
}
