//! From both tests' maps to regions with a kind: what they mark is cut into regions, each is judged by itself, and what
//! belongs together is joined.

use crate::audit::decide::decision;
use crate::audit::decide::false_alarms::Field;
use crate::audit::decide::judged::{By, Judged, confidence};
use crate::audit::decide::label;
use crate::audit::decide::scores::{LOW, Scores};
use crate::audit::finding::{Displacement, Evidence, Kind, What};
use crate::audit::hypothesis::retextured;
use crate::audit::hypothesis::sideways::{Shifted, shifted};
use crate::audit::hypothesis::silhouette;
use crate::audit::picture::regions::{Region, closed, components, opened};
use crate::audit::verdict::{Reason, Verdict};
use crate::audit::view::{AuditScene, Observations};

/// ΔE00 of all the picture together that makes one doubt the white balance.
pub(crate) const WHITE: f32 = 8.0;
/// Regions smaller than this share of the picture are left out.
const LEAST_SHARE: f64 = 6e-4;
/// Nor are fewer pixels than this a region.
const LEAST_PX: usize = 30;

impl Observations {
    /// Scores of the geometry test, of the texture test and the greater of both, per pixel; 1 is the threshold.
    pub fn scores(&self) -> [Vec<f32>; 3] {
        let scores = Scores::of(self);
        let both = scores.both();
        [scores.geometry, scores.texture, both]
    }

    /// The regions that both tests end in, and a verdict for each pixel.
    pub fn judged(&self, prepared: &AuditScene) -> (Vec<Judged>, Vec<Verdict>) {
        let (judged, _) = judge(prepared, self, &Scores::of(self));
        let (verdicts, _) = label::verdicts(self, &judged);
        (judged, verdicts)
    }

    /// How much each pixel is suspected, given the regions: what no region bears out ranks below what one does, and
    /// doubts below findings. Only the order means something.
    pub fn suspicion(&self, judged: &[Judged]) -> Vec<f32> {
        let mut ranks: Vec<f32> = Scores::of(self).both().iter().map(|s| s.min(1.0)).collect();
        for j in judged {
            let sure = if j.reason == Reason::None { 2.0 } else { 1.0 };
            for &i in j.pixels() {
                ranks[i] = sure + 0.9 * j.score as f32 + 0.1 * ranks[i];
            }
        }
        ranks
    }
}

/// Finds the regions of a view and judges each.
pub(crate) fn judge(prepared: &AuditScene, observed: &Observations, scores: &Scores) -> (Vec<Judged>, Field) {
    let (w, h) = observed.size();
    let least = least(observed);
    let s = &observed.surfaces;
    let told = |i: usize| if observed.texture.tested[i] { scores.texture[i] } else { f32::NAN };
    let field = Field::new(w, s.position.clone(), (0..w * h).map(told).collect());
    // what the photograph does not show is nobody's fault
    let marked = |scores: &dyn Fn(usize) -> f32| -> (Vec<bool>, Vec<bool>) {
        let over =
            |least: f32| (0..w * h).map(|i| observed.usable[i] > 0.0 && scores(i) >= least).collect::<Vec<bool>>();
        (closed(&opened(&over(LOW), w, h, 1), w, h, 2), opened(&over(1.0), w, h, 2))
    };
    // a place that is wrong looks wrong, too: of the rest, pictures are judged
    let (low, high) = marked(&|i| scores.geometry[i]);
    let shares = s.segments.shares(&low);
    let mut judged: Vec<Judged> = components(&low, &high, w, least, |_, _| true)
        .into_iter()
        .filter_map(|region| decision::shape(prepared, observed, &shares, region))
        .collect();
    let mut taken = vec![false; w * h];
    judged.iter().flat_map(|j| &j.region.pixels).for_each(|&i| taken[i] = true);
    let (low, high) = marked(&|i| if taken[i] { 0.0 } else { scores.texture[i] });
    let same = |i: usize, j: usize| s.material[i] == s.material[j];
    let pictures = components(&low, &high, w, least, same);
    judged.extend(pictures.into_iter().filter_map(|region| decision::picture(prepared, observed, region)));
    let judged = united(with_relaid(judged, prepared, observed), observed);
    let mut judged = with_shifted(judged, shifted(prepared, observed), observed);
    for j in &mut judged {
        j.region.pixels.retain(|i| observed.usable[*i] > 0.0);
    }
    judged.retain(|j| j.region.pixels.len() >= least);
    (judged, field)
}

/// Adds pieces of texture that the photograph shows laid otherwise, but for those whose shape is wrong. They explain what
/// lies mostly within them.
fn with_relaid(mut judged: Vec<Judged>, prepared: &AuditScene, observed: &Observations) -> Vec<Judged> {
    let segments = &observed.surfaces.segments;
    for (k, found) in retextured::segments(prepared.scene, observed, least(observed)) {
        let piece = &segments.pixels[k];
        let within = |j: &Judged| j.region.pixels.iter().filter(|i| segments.of[**i] as usize == k).count();
        let of_shape = |j: &&Judged| j.kind == Kind::Geometry && j.reason == Reason::None;
        let misshapen: usize = judged.iter().filter(of_shape).map(within).sum();
        if 3 * misshapen > piece.len() {
            continue;
        }
        let moved = found.what == What::Moved;
        judged.retain(|j| of_shape(&j) || 2 * within(j) <= j.region.pixels.len());
        judged.push(Judged {
            score: confidence(f64::from(found.odds / retextured::TOLD), piece.len() as f32),
            kind: if moved { Kind::Geometry } else { Kind::Texture },
            what: found.what,
            displacement: moved
                .then_some(Displacement { metres: found.off_m.into(), uncertainty_m: found.uncertainty_m.into() }),
            shift: None,
            reason: Reason::None,
            evidence: vec![
                Evidence::new(retextured::EVIDENCE, found.odds, retextured::TOLD, "logarithm"),
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
fn with_shifted(mut judged: Vec<Judged>, shifted: Vec<Shifted>, observed: &Observations) -> Vec<Judged> {
    for part in shifted {
        if part.pixels.len() < least(observed) {
            continue;
        }
        let within = |j: &Judged| {
            let inside = j.region.pixels.iter().filter(|i| part.pixels.binary_search(i).is_ok()).count();
            2 * inside > j.region.pixels.len()
        };
        judged.retain(|j| !within(j));
        judged.push(Judged {
            score: confidence(f64::from(part.odds / silhouette::ODDS), part.pixels.len() as f32),
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
fn united(judged: Vec<Judged>, observed: &Observations) -> Vec<Judged> {
    /// Metres between planes that count as one.
    const APART_M: f32 = 0.05;
    let s = &observed.surfaces;
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
fn least(observed: &Observations) -> usize {
    LEAST_PX.max((LEAST_SHARE * observed.usable.len() as f64) as usize)
}
