//! From both tests' maps to regions with a kind: what they mark is cut into regions, each is judged by itself, and what
//! belongs together is joined.

use crate::audit::decide::decision;
use crate::audit::decide::false_alarms::Field;
use crate::audit::decide::judged::Judged;
use crate::audit::decide::label;
use crate::audit::decide::odds::{self, LAYING};
use crate::audit::decide::scores::{LOW, Scores};
use crate::audit::finding::{Displacement, Kind, What};
use crate::audit::hypothesis::retextured;
use crate::audit::hypothesis::sideways::{Shifted, shifted};
use crate::audit::picture::regions::{Region, closed, components, mask_of, opened};
use crate::audit::verdict::{Reason, Verdict};
use crate::audit::view::{AuditScene, Observations};

/// ΔE00 of all the picture together that makes one doubt the white balance.
pub(crate) const WHITE: f32 = 8.0;
/// Where a fault of shape is at least so likely, none of the picture is looked for.
const LIKELY: f64 = 0.5;
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
        let (mut verdicts, mut reasons) = label::verdicts(self);
        for j in &judged {
            let mask = mask_of(j.pixels(), verdicts.len());
            label::mark(&mut verdicts, &mut reasons, &mask, j.kind, j.reason(self.settings.false_alarms));
        }
        (judged, verdicts)
    }

    /// Whether a region is a fault and not a doubt, as far as this view tells.
    fn calls_fault(&self, judged: &Judged) -> bool {
        judged.reason(self.settings.false_alarms) == Reason::None
    }

    /// How much each pixel is suspected, given the regions: what no region bears out ranks below what one does, and
    /// doubts below findings. Only the order means something.
    pub fn suspicion(&self, judged: &[Judged]) -> Vec<f32> {
        let mut ranks: Vec<f32> = Scores::of(self).both().iter().map(|s| s.min(1.0)).collect();
        for j in judged {
            let sure = if self.calls_fault(j) { 2.0 } else { 1.0 };
            for &i in j.pixels() {
                ranks[i] = sure + 0.9 * j.score() as f32 + 0.1 * ranks[i];
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
    let inside = decision::inside(observed);
    let least_likely = observed.settings.least_probability;
    let mut judged: Vec<Judged> = components(&low, &high, w, least, |_, _| true)
        .into_iter()
        .map(|region| decision::shape(prepared, observed, &shares, &inside, region))
        .filter(|j| j.score() >= least_likely)
        .collect();
    let mut taken = vec![false; w * h];
    let likely = judged.iter().filter(|j| j.score() >= LIKELY);
    likely.flat_map(|j| &j.region.pixels).for_each(|&i| taken[i] = true);
    let (low, high) = marked(&|i| if taken[i] { 0.0 } else { scores.texture[i] });
    let same = |i: usize, j: usize| s.material[i] == s.material[j];
    let pictures = components(&low, &high, w, least, same);
    judged.extend(
        pictures
            .into_iter()
            .map(|region| decision::picture(prepared, observed, region))
            .filter(|j| odds::may_reach(j.log_odds, least_likely)),
    );
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
        let of_shape = |j: &&Judged| j.kind == Kind::Geometry && observed.calls_fault(j);
        let misshapen: usize = judged.iter().filter(of_shape).map(within).sum();
        if 3 * misshapen > piece.len() {
            continue;
        }
        let moved = found.what == What::Moved;
        judged.retain(|j| of_shape(&j) || 2 * within(j) <= j.region.pixels.len());
        let (log_odds, evidence) =
            LAYING.weigh([found.odds, found.as_is, found.best, decision::size(observed, piece.len())]);
        let kind = if moved { Kind::Geometry } else { Kind::Texture };
        let region = Region { pixels: piece.clone() };
        judged.push(Judged {
            displacement: moved
                .then_some(Displacement { metres: found.off_m.into(), uncertainty_m: found.uncertainty_m.into() }),
            ..Judged::new(kind, found.what, log_odds, evidence, region)
        });
    }
    judged
}

/// Adds parts that stand beside their place. Regions of shape that lie mostly within one are of it, and all of it is as sure as
/// the surest of them; where a picture within it is surer to be wrong, the part may well be in its place.
fn with_shifted(mut judged: Vec<Judged>, shifted: Vec<Shifted>, observed: &Observations) -> Vec<Judged> {
    for part in shifted {
        let part = decision::outline(part);
        let within = |j: &Judged| {
            let inside = j.region.pixels.iter().filter(|i| part.region.pixels.binary_search(i).is_ok()).count();
            2 * inside > j.region.pixels.len()
        };
        let repainted = |j: &Judged| j.kind == Kind::Texture && j.log_odds > part.log_odds && within(j);
        if part.score() < observed.settings.least_probability
            || part.region.pixels.len() < least(observed)
            || judged.iter().any(repainted)
        {
            continue;
        }
        let (own, others): (Vec<Judged>, Vec<Judged>) = judged.into_iter().partition(within);
        judged = others;
        let surer = own.into_iter().filter(|j| j.log_odds > part.log_odds);
        let surest = surer.max_by(|a, b| a.log_odds.total_cmp(&b.log_odds));
        judged.push(match surest {
            Some(surest) => Judged { region: part.region, ..surest },
            None => part,
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
    let sure = |j: &Judged| observed.calls_fault(j);
    let alike = |a: &Judged, b: &Judged| {
        let mapped = matches!(a.what, What::Rotated | What::Mirrored | What::Shifted | What::Scaled);
        let (i, k) = (middle(a), middle(b));
        let offset = s.normal[i].dot(s.position[k] - s.position[i]).abs();
        a.kind == Kind::Texture
            && b.kind == Kind::Texture
            && mapped
            && (a.what == b.what || (b.what == What::Changed && !sure(b)))
            && sure(a)
            && s.material[i] == s.material[k]
            && s.normal[i].dot(s.normal[k]) > 0.99
            && offset < APART_M
    };
    let mut all: Vec<Judged> = Vec::new();
    let (findings, doubts): (Vec<_>, Vec<_>) = judged.into_iter().partition(sure);
    for j in findings.into_iter().chain(doubts) {
        match all.iter_mut().find(|whole| alike(whole, &j)) {
            Some(whole) => {
                whole.region.pixels.extend(j.region.pixels);
                whole.region.pixels.sort_unstable();
                whole.log_odds = whole.log_odds.max(j.log_odds);
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
