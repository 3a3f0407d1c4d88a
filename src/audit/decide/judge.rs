//! From both tests' maps to regions with a kind: what they mark is cut into regions, each is judged by itself, and what
//! belongs together is joined.

use rayon::prelude::*;

use crate::audit::decide::decision::{self, least};
use crate::audit::decide::false_alarms::Field;
use crate::audit::decide::judged::Judged;
use crate::audit::decide::label;
use crate::audit::decide::odds::{self, LAYING};
use crate::audit::decide::scores::{self, LOW, Scores};
use crate::audit::finding::{Displacement, Kind, What};
use crate::audit::hypothesis::absent::absent;
use crate::audit::hypothesis::displaced::displaced;
use crate::audit::hypothesis::extent::{Places, without_gaps};
use crate::audit::hypothesis::laying::{parts, retextured};
use crate::audit::hypothesis::opening::openings;
use crate::audit::hypothesis::sideways::{Shifted, shifted};
use crate::audit::picture::regions::{Region, closed, components, mask_of, opened};
use crate::audit::verdict::{Reason, Verdict};
use crate::audit::view::{AuditScene, Observations};

/// ΔE00 of all the picture together that makes one doubt the white balance.
pub(crate) const WHITE: f32 = 8.0;
/// Where photograph and model differ by so much more than they have in common, as a logarithm, the model's picture is not there.
const UNLIKE: f32 = 1.1;

impl Observations {
    /// Scores of the geometry test and of the texture test per pixel; 1 is the threshold.
    pub fn scores(&self) -> [Vec<f32>; 2] {
        let scores = Scores::of(self);
        [scores.geometry, scores.texture]
    }

    /// The regions that both tests end in, and a verdict for each pixel.
    pub fn judged(&self, prepared: &AuditScene) -> (Judgement, Vec<Verdict>) {
        let judgement = judge(prepared, self);
        let (mut verdicts, mut reasons) = label::verdicts(self, &judgement.own);
        let least = self.settings.least_probability;
        label::unmark_suspected(&mut verdicts, &mut reasons, &judgement.suspicion(least), least);
        for j in &judgement.regions {
            label::mark(&mut verdicts, &mut reasons, j.pixels(), j.kind, j.reason(self.settings.false_alarms));
        }
        (judgement, verdicts)
    }

    /// Whether a region is a fault of shape and not a doubt, as far as this view tells.
    fn calls_misshapen(&self, judged: &Judged) -> bool {
        judged.kind == Kind::Geometry && judged.reason(self.settings.false_alarms) == Reason::None
    }
}

/// What a view tells.
pub struct Judgement {
    /// The regions that may be faults.
    pub regions: Vec<Judged>,
    /// How much the texture test suspects each pixel that it can tell of.
    pub(crate) field: Field,
    /// What each pixel adds by itself to the logarithm of the odds of a fault.
    pub(crate) own: Vec<f32>,
    width: usize,
}

impl Judgement {
    /// How much each pixel is suspected, 0..=1, as far as its view tells; by itself alone in regions that are less likely faults than `least`.
    pub fn suspicion(&self, least: f64) -> Vec<f32> {
        let told = self.regions.iter().filter(|j| j.score() >= least);
        scores::suspicion(&self.own, self.width, told.map(|j| (j.pixels(), j.log_odds)), least)
    }
}

/// Finds the regions of a view and judges each.
pub(crate) fn judge(prepared: &AuditScene, observed: &Observations) -> Judgement {
    let scores = &Scores::of(observed);
    let (w, h) = observed.size();
    let least = least(observed);
    let s = &observed.surfaces;
    let told = |i: usize| if observed.texture.tested[i] { scores.texture[i] } else { f32::NAN };
    let field = Field::new(w, (0..w * h).map(told).collect());
    // what the photograph does not show is nobody's fault
    let over = |scores: &dyn Fn(usize) -> f32, least: f32| -> Vec<bool> {
        (0..w * h).map(|i| observed.usable[i] > 0.0 && scores(i) >= least).collect()
    };
    let extended = |mask: &[bool]| closed(&opened(mask, w, h, 1), w, h, 2);
    let marked = |scores: &dyn Fn(usize) -> f32| (extended(&over(scores, LOW)), opened(&over(scores, 1.0), w, h, 2));
    // a place that is wrong looks wrong, too: of the rest, pictures are judged
    let (low, high) = marked(&|i| scores.geometry[i]);
    let shares = s.segments.shares(&low);
    let inside = decision::inside(observed);
    let may_reach = |j: &Judged| odds::may_reach(j.log_odds, observed.settings.least_probability);
    let mut judged: Vec<Judged> = components(&low, &high, w, least, |_, _| true)
        .into_iter()
        .filter_map(|region| decision::shape(prepared, observed, &shares, &inside, &region))
        .filter(may_reach)
        .collect();
    let mut taken = vec![false; w * h];
    let likely = judged.iter().filter(|j| j.is_likely());
    likely.flat_map(|j| &j.region.pixels).for_each(|&i| taken[i] = true);
    let (low, high) = marked(&|i| if taken[i] { 0.0 } else { scores.texture[i] });
    let same = |i: usize, j: usize| s.material[i] == s.material[j];
    let pictures = components(&low, &high, w, least, same);
    let picture = |region| decision::picture(prepared, observed, region);
    judged.extend(pictures.into_iter().map(picture).filter(may_reach));
    // however little of it looks wrong, all that is mapped in one piece may tell together
    let told = |i: &&usize| observed.texture.tested[**i] && !taken[**i];
    let tested = |pixels: &&Vec<usize>| pixels.iter().filter(told).count() >= least.max(pixels.len() / 2);
    let pieces = s.segments.pixels.par_iter().filter(tested).map(|pixels| Region { pixels: pixels.clone() });
    let pieces: Vec<Judged> = pieces.map(picture).filter(may_reach).collect();
    let openings = openings(observed, least).into_iter().map(|o| decision::opening(observed, o));
    let openings: Vec<Judged> = openings.filter(may_reach).collect();
    let absent = absent(prepared, observed, least).into_iter().map(|a| decision::absent(observed, a));
    let absent: Vec<Judged> = absent.filter(may_reach).collect();
    let displaced = displaced(observed, least).into_iter();
    let displaced = displaced.filter_map(|d| decision::displaced(prepared, observed, d)).filter(may_reach);
    let displaced: Vec<Judged> = displaced.collect();
    let relaid = relaid(prepared, observed, &judged);
    // structures that the model does not have, whole: the tests mark their edges, here and there. What is around a piece that is
    // wrong is unlike the model, too
    let all = pieces.iter().chain(&openings).chain(&absent).chain(&displaced).chain(&relaid);
    let likely = all.filter(|j| j.is_likely()).flat_map(|j| j.pixels());
    let unlike = observed.unlike(&mask_of(&likely.copied().collect::<Vec<_>>(), w * h));
    let most = |i: usize| unlike.iter().map(|band| band[i]).fold(f32::NEG_INFINITY, f32::max);
    let mask = extended(&over(&most, UNLIKE));
    let places = Places::new(observed, &unlike, &mask);
    let wholes: Vec<(Judged, Region)> = components(&mask, &mask, w, least, |_, _| true)
        .into_par_iter()
        .filter_map(|place| {
            let whole = decision::unlike(prepared, observed, scores, &shares, &inside, &places, &place)?;
            Some((whole, place))
        })
        .collect();
    let judged = pieces.into_iter().fold(judged, with_piece);
    let judged = wholes.into_iter().fold(judged, |judged, (whole, place)| with_place(judged, whole, &place));
    let judged = openings.into_iter().chain(displaced).fold(judged, with_whole);
    let judged = relaid.into_iter().fold(judged, |judged, piece| with_relaid(judged, piece, observed));
    let judged = absent.into_iter().fold(judged, with_part);
    let mut judged = with_shifted(judged, shifted(prepared, observed), observed);
    judged.retain(|j| j.pixels().iter().filter(|i| observed.usable[**i] > 0.0).count() >= least);
    judged.par_iter_mut().for_each(|j| {
        // a part is known by its own outline
        if j.part.is_none() {
            j.region = without_gaps(&j.region, &s.segments, w);
        }
        j.region.pixels.retain(|i| observed.pictures(*i));
    });
    Judgement { regions: judged, field, own: scores.own(&unlike), width: w }
}

/// Pieces of texture that the photograph shows laid otherwise, but for those whose shape is wrong.
fn relaid(prepared: &AuditScene, observed: &Observations, judged: &[Judged]) -> Vec<Judged> {
    let mut pieces = Vec::new();
    let segments = retextured::segments(prepared.scene, observed, least(observed));
    for (piece, found) in segments.into_iter().chain(parts::parts(prepared.scene, observed)) {
        let within = |j: &Judged| j.pixels().iter().filter(|i| piece.binary_search(i).is_ok()).count();
        let misshapen: usize = judged.iter().filter(|j| observed.calls_misshapen(j)).map(within).sum();
        if 3 * misshapen > piece.len() {
            continue;
        }
        let moved = found.what == What::Moved;
        // what has moved by little still shows the model's picture about where it was
        let as_is = if moved { f32::NAN } else { found.as_is };
        let size = decision::size(observed, piece.len());
        let (log_odds, evidence) = LAYING.weigh([found.odds, as_is, found.best, size]);
        let kind = if moved { Kind::Geometry } else { Kind::Texture };
        let region = Region { pixels: piece };
        pieces.push(Judged {
            displacement: moved.then_some(Displacement {
                metres: found.transform.off_m.into(),
                uncertainty_m: found.uncertainty_m.into(),
            }),
            ..Judged::new(kind, found.what, log_odds, evidence, region)
        });
    }
    pieces
}

/// Adds a piece that is laid otherwise: it explains what lies mostly within it, but for faults of shape.
fn with_relaid(mut judged: Vec<Judged>, piece: Judged, observed: &Observations) -> Vec<Judged> {
    judged.retain(|j| observed.calls_misshapen(j) || !mostly_within(&j.region, &piece.region));
    judged.push(piece);
    judged
}

/// Adds parts that stand beside their place; where a picture within one is surer to be wrong, the part may well be in its place.
fn with_shifted(mut judged: Vec<Judged>, shifted: Vec<Shifted>, observed: &Observations) -> Vec<Judged> {
    for part in shifted {
        let part = decision::outline(part);
        let repainted = |j: &Judged| {
            j.kind == Kind::Texture && j.log_odds > part.log_odds && mostly_within(&j.region, &part.region)
        };
        if part.score() >= observed.settings.least_probability
            && part.region.pixels.len() >= least(observed)
            && !judged.iter().any(repainted)
        {
            judged = if part.is_likely() { with_moved(judged, part) } else { absorbed(judged, part) };
        }
    }
    judged
}

/// Adds a part that likely stands beside its place: what is wrong with the shape of either place is of it, and as sure.
fn with_moved(judged: Vec<Judged>, mut part: Judged) -> Vec<Judged> {
    let of_it = |j: &Judged| j.kind == Kind::Geometry && mostly_within(&j.region, &part.region);
    let (own, others): (Vec<Judged>, Vec<Judged>) = judged.into_iter().partition(of_it);
    part.log_odds = own.iter().map(|j| j.log_odds).fold(part.log_odds, f32::max);
    absorbed(others, part)
}

/// Adds a region that is judged as a whole.
fn with_whole(judged: Vec<Judged>, whole: Judged) -> Vec<Judged> {
    let place = whole.region.clone();
    with_place(judged, whole, &place)
}

/// Adds what stands out in a place. A surer fault of shape stays as it is, since what tells it was measured of its own
/// pixels; the region is what they leave of it, if that is half or more.
fn with_place(judged: Vec<Judged>, mut whole: Judged, place: &Region) -> Vec<Judged> {
    let surer = |j: &Judged| j.kind == Kind::Geometry && j.is_likely() && j.log_odds > whole.log_odds;
    let (mut judged, others): (Vec<Judged>, Vec<Judged>) = judged.into_iter().partition(surer);
    let size = whole.pixels().len();
    whole.region.pixels.retain(|i| !judged.iter().any(|j| j.pixels().binary_search(i).is_ok()));
    judged.extend(if 2 * whole.pixels().len() < size { others } else { absorbed_in(others, whole, place) });
    judged
}

/// Adds a piece of paint; if it is unlikely to be wrong as a whole, only where nothing surer is a part of it, nor it of that.
fn with_piece(judged: Vec<Judged>, piece: Judged) -> Vec<Judged> {
    let surer = |j: &Judged| {
        j.log_odds >= piece.log_odds
            && (mostly_within(&j.region, &piece.region) || mostly_within(&piece.region, &j.region))
    };
    if !piece.is_likely() && judged.iter().any(surer) { judged } else { with_whole(judged, piece) }
}

/// Adds a part that may not be there: what is wrong in it is of it, if it is likely gone.
fn with_part(judged: Vec<Judged>, part: Judged) -> Vec<Judged> {
    if !part.is_likely() { with_piece(judged, part) } else { absorbed(judged, part) }
}

/// Whether more than half of a region lies within another, whose pixels are in order.
fn mostly_within(region: &Region, whole: &Region) -> bool {
    let inside = region.pixels.iter().filter(|i| whole.pixels.binary_search(i).is_ok()).count();
    2 * inside > region.pixels.len()
}

/// Adds a region that may be the whole of what others are pieces of: those that lie mostly within its place are of it, and all of it is
/// as sure as the surest of them, and what that is if it is of one kind. It adds nothing where its place lies mostly within a surer one.
fn absorbed_in(judged: Vec<Judged>, whole: Judged, place: &Region) -> Vec<Judged> {
    if judged.iter().any(|j| j.log_odds >= whole.log_odds && mostly_within(place, &j.region)) {
        return judged;
    }
    let (own, mut others): (Vec<Judged>, Vec<Judged>) =
        judged.into_iter().partition(|j| mostly_within(&j.region, place));
    let surer = own.into_iter().filter(|j| j.log_odds > whole.log_odds);
    let surest = surer.max_by(|a, b| a.log_odds.total_cmp(&b.log_odds));
    others.push(match surest {
        Some(surest) if surest.kind == whole.kind => Judged { region: whole.region, ..surest },
        Some(surest) => Judged { log_odds: surest.log_odds, evidence: surest.evidence, ..whole },
        None => whole,
    });
    others
}

/// The same of a region that is its own place.
fn absorbed(judged: Vec<Judged>, whole: Judged) -> Vec<Judged> {
    let place = whole.region.clone();
    absorbed_in(judged, whole, &place)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(kind: Kind, log_odds: f32, pixels: std::ops::Range<usize>) -> Judged {
        Judged::new(kind, What::Missing, log_odds, vec![], Region { pixels: pixels.collect() })
    }

    fn told(all: &[Judged]) -> Vec<(Kind, f32, usize)> {
        all.iter().map(|j| (j.kind, j.log_odds, j.pixels().len())).collect()
    }

    #[test]
    fn pieces_are_of_the_whole_and_a_surer_region_says_what_it_is() {
        let pieces = || vec![judged(Kind::Texture, 3.0, 10..30), judged(Kind::Texture, -1.0, 35..50)];
        // another kind: as sure, but not what the piece is
        let joined = absorbed(pieces(), judged(Kind::Geometry, 1.0, 0..60));
        assert_eq!(told(&joined), [(Kind::Geometry, 3.0, 60)]);
        let joined = absorbed(pieces(), judged(Kind::Texture, 1.0, 0..60));
        assert_eq!(told(&joined), [(Kind::Texture, 3.0, 60)]);
        // a surer fault of shape is of a part that is off, but stays as it is in what is unlike the model; a doubt does not
        let misshapen = |log_odds| vec![judged(Kind::Geometry, log_odds, 5..25)];
        let joined = absorbed(misshapen(2.0), judged(Kind::Geometry, 1.0, 0..60));
        assert_eq!(told(&joined), [(Kind::Geometry, 2.0, 60)]);
        let joined = with_whole(misshapen(2.0), judged(Kind::Texture, 1.0, 0..60));
        assert_eq!(told(&joined), [(Kind::Geometry, 2.0, 20), (Kind::Texture, 1.0, 40)]);
        let joined = with_whole(misshapen(-0.5), judged(Kind::Geometry, -1.0, 0..60));
        assert_eq!(told(&joined), [(Kind::Geometry, -0.5, 60)]);
        let joined = with_whole(misshapen(2.0), judged(Kind::Texture, 1.0, 0..30));
        assert_eq!(told(&joined), [(Kind::Geometry, 2.0, 20)]);
        // what lies mostly beside it stays
        let joined = absorbed(pieces(), judged(Kind::Geometry, 1.0, 25..50));
        assert_eq!(told(&joined), [(Kind::Texture, 3.0, 20), (Kind::Geometry, 1.0, 25)]);
        // a piece of paint that is unlikely to be wrong as a whole does not take what is wrong in it along
        let joined = with_piece(pieces(), judged(Kind::Texture, -0.5, 0..60));
        assert_eq!(told(&joined), told(&pieces()));
        let joined = with_piece(pieces(), judged(Kind::Texture, 0.5, 0..60));
        assert_eq!(told(&joined), [(Kind::Texture, 3.0, 60)]);
        // what has moved says what it is
        let moved = Judged { what: What::Moved, ..judged(Kind::Geometry, 1.0, 0..60) };
        let joined = with_moved(misshapen(2.0), moved);
        assert!(told(&joined) == [(Kind::Geometry, 2.0, 60)] && joined[0].what == What::Moved);
        // within a surer one it adds nothing
        let joined = absorbed(pieces(), judged(Kind::Geometry, 1.0, 12..30));
        assert_eq!(told(&joined), told(&pieces()));
    }
}
