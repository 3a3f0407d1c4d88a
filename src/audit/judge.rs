//! From both tests' maps to regions with a kind: what they mark is cut into regions, each is judged by itself, and what
//! belongs together is joined.

use super::alarm::Field;
use super::outline::{self, Shifted};
use super::regions::{Region, closed, components, opened};
use super::scores::{LOW, Scores};
use super::view::{Maps, Prepared};
use super::{Displacement, Evidence, Kind, Reason, Shift, What, decision, relaid};

/// ΔE00 of all the picture together that makes one doubt the white balance.
pub(super) const WHITE: f32 = 8.0;
/// Regions smaller than this share of the picture are left out.
const LEAST_SHARE: f64 = 6e-4;
/// Nor are fewer pixels than this a region.
const LEAST_PX: usize = 30;

/// What says that a region is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum By {
    /// A figure whose logarithm of odds is this.
    Figure(f32),
    /// That its structure is not the albedo's, as it is nowhere else.
    Structure,
    /// That something else fits, so surely that no right model gives it.
    Fit,
}

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
    /// What says that it is wrong, and how often that is said of a right model.
    pub(super) by: By,
}

impl Judged {
    /// Indices of its pixels at the audit's size.
    pub fn pixels(&self) -> &[usize] {
        &self.region.pixels
    }
}

/// Finds the regions of a view and judges each.
pub(super) fn judge(prepared: &Prepared, maps: &Maps, scores: &Scores) -> (Vec<Judged>, Field) {
    let (w, h) = maps.size();
    let least = least(maps);
    let s = &maps.surfaces;
    let told = |i: usize| if maps.texture.tested[i] { scores.texture[i] } else { f32::NAN };
    let field = Field::new(w, s.position.clone(), (0..w * h).map(told).collect());
    // what the photograph does not show is nobody's fault
    let marked = |scores: &dyn Fn(usize) -> f32| -> (Vec<bool>, Vec<bool>) {
        let over = |least: f32| (0..w * h).map(|i| maps.usable[i] > 0.0 && scores(i) >= least).collect::<Vec<bool>>();
        (closed(&opened(&over(LOW), w, h, 1), w, h, 2), opened(&over(1.0), w, h, 2))
    };
    // a place that is wrong looks wrong, too: of the rest, pictures are judged
    let (low, high) = marked(&|i| scores.geometry[i]);
    let shares = s.pieces.shares(&low);
    let mut judged: Vec<Judged> = components(&low, &high, w, least, |_, _| true)
        .into_iter()
        .filter_map(|region| decision::shape(prepared, maps, &shares, region))
        .collect();
    let mut taken = vec![false; w * h];
    judged.iter().flat_map(|j| &j.region.pixels).for_each(|&i| taken[i] = true);
    let (low, high) = marked(&|i| if taken[i] { 0.0 } else { scores.texture[i] });
    let same = |i: usize, j: usize| s.material[i] == s.material[j];
    let pictures = components(&low, &high, w, least, same);
    judged.extend(pictures.into_iter().filter_map(|region| decision::picture(prepared, maps, region)));
    let judged = united(with_relaid(judged, prepared, maps), maps);
    let mut judged = with_shifted(judged, outline::shifted(prepared, maps), maps);
    for j in &mut judged {
        j.region.pixels.retain(|i| maps.usable[*i] > 0.0);
    }
    judged.retain(|j| j.region.pixels.len() >= least);
    (judged, field)
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
            by: By::Fit,
            region: Region { pixels: piece.clone() },
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
            by: By::Fit,
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
