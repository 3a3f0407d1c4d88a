//! What is wrong with a region: an opening that is not there, its shape, or its picture. The first that its figures bear
//! out is what it is.

use super::alarm::Statistic;
use super::behind::{behind, picture_behind};
use super::explain::explain;
use super::figures::{Figures, REGION_ODDS, TEXTURED};
use super::judge::{Judged, confidence};
use super::regions::Region;
use super::scores::{COLOUR, PIXELS_OFF, Scores};
use super::view::{Maps, Prepared};
use super::{Displacement, Evidence, Kind, Reason, What};

/// Cost, in units of what a right model has, from which on a region's place is contradicted.
const MISMATCH: f32 = 2.5;
/// The same where the texture's test marks the region, too.
const TORN: f32 = 1.7;
/// A displacement must explain so much of the difference, as a ratio to what it leaves, in a region of at least so many
/// pixels less; where one probe alone is asked more, and without the other test all.
const EXPLAINS: f32 = 1.0;
const EXPLAINS_LARGE: f32 = 0.6;
const LARGE_PX: usize = 1000;
const EXPLAINS_ALONE: f32 = 1.5;
const EXPLAINS_ALL: f32 = 3.0;
/// And so much of the cost at least, and be so many times its own uncertainty.
const GAINED: f32 = 0.5;
const CERTAIN: f64 = 3.0;
/// In a small region, a displacement must explain a difference of more than this, and one probe alone is not believed.
const SMALL_MISMATCH: f32 = 3.0;
/// A surface further off its place than so many times its thickness in the picture is not told to be moved: what a probe
/// sees of something in its way fits everywhere beside that.
const THICKNESS: f32 = 1.0;
/// Cost from which on one probe is believed where the texture's test marks a small region, too.
const STRONG: f32 = 5.0;
/// Coding makes differences of its own. In a coded photograph a shape is told that no displacement explains by so much, and
/// nothing behind it, only with so much from the texture's test or its odds …
const CODED_EXPLAINS: f32 = 0.3;
const CODED_TEXTURE: f32 = 1.5;
const CODED_ODDS: f32 = 8.0;
/// … and a colour only over so many pixels: two blocks of coarse colour.
const CODED_PX: usize = 512;
/// What lies behind a region is what the photograph shows if its cost is at most this share of the region's own, and in
/// itself no more than this.
const BEHIND: f32 = 0.25;
const BEHIND_MOST: f32 = 2.0;
/// Where no probe can be asked, it is if the photograph follows its albedo so closely, and by so much more than the
/// region's own.
const FOLLOWS: f32 = 0.6;
const FOLLOWS_MORE: f32 = 0.35;
/// A surface goes on over an opening if more than this share of it says so, and is known by what it shows if this one does.
const BRIDGED: f64 = 0.4;
const DISTINCT: f32 = 0.25;
/// Without the texture's test, a shape is contradicted by the geometry test on this share of a region, at this cost, where
/// the texture's score is at least so much.
const MARKED: f32 = 0.3;
const PLAIN: f32 = 3.5;
const PLAIN_TEXTURE: f32 = 0.5;
/// A region is a whole surface, and not a part of one, if it has more than this share of its pieces.
const WHOLE: f64 = 0.6;
/// What lies behind fits better than the region at any place: this share of the least cost there.
const BEHIND_BETTER: f32 = 0.6;
/// A colour's strength: its mean ΔE00 times the root of its area over this share of the picture. The light that surfaces
/// throw on each other is known coarsely, and errors of its colour are strong only where they are small.
const COLOUR_SHARE: f32 = 6e-3;
const COLOUR_STRENGTH: f32 = 12.0;
/// Less is a doubt only with this ΔE00.
const COLOUR_DOUBT: f32 = 9.0;
/// Paint ends where the colour changes by this share of its difference.
const PAINT_STEP: f32 = 0.5;
/// Correlation with the model's texture from which on a structure is the model's.
const AS_IS: f32 = 0.6;
/// Share of a region that must be of a foreign picture, or of another colour, for all of it to be.
const SHARE: f32 = 0.3;

/// What is wrong with a region, how surely, and why.
struct Decision {
    kind: Kind,
    what: What,
    strength: f32,
    displacement: Option<Displacement>,
    reason: Reason,
    evidence: Vec<Evidence>,
    statistic: Option<Statistic>,
}

/// Judges a region; `None` where its sum does not bear out what its pixels say. `shares` are of each pixel's piece, see
/// [`super::regions::Pieces`]; regions have at least `least` pixels.
pub(super) fn judged(
    prepared: &Prepared,
    maps: &Maps,
    scores: &Scores,
    shares: &[(u32, u32)],
    region: Region,
    least: usize,
) -> Option<Judged> {
    let f = Figures::of(prepared, maps, scores, &region, least);
    let mut evidence = vec![
        Evidence::new("geometry mismatch", f.swept.dull, MISMATCH, "× variance"),
        Evidence::new("texture", f.texture, 1.0, "× threshold"),
        Evidence::new("odds of another structure", f.odds, REGION_ODDS, "logarithm"),
    ];
    let decision = opening(&f).or_else(|| shape(&f, shares)).or_else(|| absent(&f)).or_else(|| picture(&f))?;
    evidence.extend(decision.evidence);
    Some(Judged {
        score: confidence(f64::from(decision.strength), f.size()),
        kind: decision.kind,
        what: decision.what,
        displacement: decision.displacement,
        shift: None,
        reason: decision.reason,
        evidence,
        statistic: decision.statistic,
        region,
    })
}

/// Share of a region over which the surface beside it goes on.
fn bridged(f: &Figures) -> f64 {
    f.share(|i| f.maps.bridged.score[i] >= 1.0).into()
}

/// Share of the difference that a displacement explains, as a ratio to what it leaves.
fn explains(f: &Figures) -> f32 {
    (f.swept.here - f.swept.least) / (f.swept.least + 0.3)
}

/// Whether the surface fits at another place, and only there.
fn moved(f: &Figures) -> bool {
    let (swept, explains) = (&f.swept, explains(f));
    // one probe alone may be at fault itself, unless the other test bears it out or a displacement explains all
    let explained = if f.several {
        explains > if f.region.pixels.len() >= LARGE_PX { EXPLAINS_LARGE } else { EXPLAINS }
    } else {
        (explains > EXPLAINS_ALONE && f.structural) || explains > EXPLAINS_ALL
    };
    let strong = !f.small || swept.here > SMALL_MISMATCH;
    let sure = swept.best_m.abs() > CERTAIN * swept.uncertainty_m;
    let far = swept.pixels > THICKNESS * f.thickness;
    f.able && strong && swept.here - swept.least > GAINED && explained && sure && swept.pixels > PIXELS_OFF && !far
}

/// An opening of the model that the photograph does not have.
fn opening(f: &Figures) -> Option<Decision> {
    let bridged = bridged(f);
    if bridged <= BRIDGED || moved(f) {
        return None;
    }
    let distinct = f.share(|i| f.maps.bridged.distinct[i]) > DISTINCT;
    Some(Decision {
        strength: f.upper(&f.maps.bridged.score),
        kind: Kind::Geometry,
        what: What::Missing,
        displacement: None,
        // what one probe alone saw past the rim may be that probe's own, unless it fits there and nowhere else or the
        // photograph shows another picture than the model's; and few pixels fit something by chance
        reason: if (f.several || distinct || f.texture >= 1.0) && !f.small {
            Reason::None
        } else {
            Reason::ProbesDisagree
        },
        evidence: vec![Evidence::new("the surface around goes on", bridged, BRIDGED, "share")],
        statistic: None,
    })
}

/// A surface that is off its place, not there, or hidden by something.
fn shape(f: &Figures, shares: &[(u32, u32)]) -> Option<Decision> {
    let swept = &f.swept;
    let moved = moved(f);
    // a surface whose picture alone is wrong agrees with the probes no less than beside it, and nowhere better than in
    // its place
    let beside = f.border.as_ref().is_some_and(|b| b.alike_in_shape(f.maps));
    let torn =
        f.textured >= TEXTURED && !beside && (swept.dull > MISMATCH || (swept.dull > TORN && explains(f) > 0.05));
    let wrong = f.able && (torn || (f.marked > MARKED && swept.dull > PLAIN && f.texture > PLAIN_TEXTURE));
    if !moved && !wrong {
        return None;
    }
    let behind = behind(f.prepared, f.maps, f.region);
    let (covered, whole) = f
        .region
        .pixels
        .iter()
        .map(|i| shares[*i])
        .fold((0.0f64, 0.0f64), |(c, a), (size, part)| (c + f64::from(part), a + f64::from(size)));
    let whole_surface = covered / whole.max(1.0) > WHOLE;
    let gone = behind
        .is_some_and(|(here, there)| there < BEHIND * here && there < BEHIND_BETTER * swept.least.max(BEHIND_MOST));
    let what = match (moved, gone, whole_surface) {
        (_, true, _) => What::Extra,
        _ if bridged(f) > BRIDGED => What::Missing,
        (true, _, true) => What::Moved,
        _ => What::Missing,
    };
    let fit =
        behind.map(|(here, there)| Evidence::new("fit of what lies behind", there / here, BEHIND, "× the surface's"));
    let explained = Evidence::new("explained by a displacement", explains(f), 1.0, "× what is left");
    let borne_out = f.texture >= 1.0 && swept.here > if f.small { STRONG } else { TORN };
    let coding = f.maps.photo.coding.is_some()
        && !moved
        && !gone
        && explains(f) < CODED_EXPLAINS
        && f.texture < CODED_TEXTURE
        && f.odds < CODED_ODDS;
    Some(Decision {
        strength: f.geometry.max(swept.dull / MISMATCH).max(f.texture),
        kind: Kind::Geometry,
        what,
        displacement: (moved && !gone)
            .then_some(Displacement { metres: swept.best_m, uncertainty_m: swept.uncertainty_m }),
        reason: match swept.twin {
            Some(_) if moved && swept.here < MISMATCH => Reason::Periodic,
            // the photograph shows the model's structure in its place: what differs is in the probes' way
            _ if !moved && !gone && f.odds <= -REGION_ODDS && !borne_out => Reason::ProbesDisagree,
            _ if coding => Reason::Undecided,
            // but what the same probe saw behind it, and the other test bears out, is no fault of the probe
            _ if f.small && !f.several && !(gone && f.texture >= 1.0) => Reason::ProbesDisagree,
            // a picture that is not the model's, either, cannot be the probe's fault
            _ if moved || gone || f.several || f.structural || borne_out => Reason::None,
            _ => Reason::ProbesDisagree,
        },
        evidence: fit.into_iter().chain([explained]).collect(),
        // what fits at another place, and only there, is told by that; but few pixels fit somewhere by chance
        statistic: (!moved || f.small).then_some(Statistic::Place),
    })
}

/// A surface that no probe can tell the place of, and through which the photograph shows what the model has behind it.
fn absent(f: &Figures) -> Option<Decision> {
    if f.able || f.texture < 1.0 || f.textured < TEXTURED || f.odds <= -REGION_ODDS {
        return None;
    }
    let [own, behind] = picture_behind(f.prepared, f.maps, f.region)?;
    (behind >= FOLLOWS && behind >= own + FOLLOWS_MORE).then(|| Decision {
        kind: Kind::Geometry,
        what: What::Extra,
        strength: f.texture,
        displacement: None,
        reason: Reason::None,
        evidence: vec![Evidence::new("correlation with the texture behind", behind, FOLLOWS, "correlation")],
        statistic: Some(Statistic::Picture),
    })
}

/// A picture that is not the model's.
fn picture(f: &Figures) -> Option<Decision> {
    let (maps, n) = (f.maps, f.size());
    // only the geometry test marks it, and its sum does not bear it out
    if f.textured < TEXTURED {
        return None;
    }
    let colour = f.upper(&maps.texture.colour);
    let explained = explain(f.prepared.scene, maps, f.region, colour / COLOUR);
    let found = explained.odds > 0.0;
    let size = (n / (COLOUR_SHARE * maps.usable.len() as f32)).sqrt();
    let unseen = f.share(|i| maps.geometry.seen[i] == 0) > 0.5;
    // a texture that is blurred or a little off lacks colour of its own; its structure is still borne out
    let foreign = f.odds > -REGION_ODDS && f.share(|i| f.scores.foreign[i] >= 1.0) >= SHARE;
    let tinted = f.share(|i| f.scores.colour[i] >= 1.0) >= SHARE;
    // where structure says nothing, coding or darkness may have spoilt colour, too
    let told = f.structural || f.odds <= -REGION_ODDS || explained.as_is > AS_IS;
    // light of another colour falls on whole surfaces; paint ends anywhere
    let mean = maps.texture.mean_colour(maps, f.region, false);
    let stepped = f.border.as_ref().is_some_and(|b| b.colour_step(maps) >= PAINT_STEP * mean);
    let mean = if stepped { mean } else { maps.texture.mean_colour(maps, f.region, true) };
    let coding = maps.photo.coding.is_some() && f.region.pixels.len() < CODED_PX;
    let strong = mean * size >= if told { COLOUR_STRENGTH } else { 2.0 * COLOUR_STRENGTH };
    let coloured = tinted && strong && !coding;
    // a surface that is off its place would not show the model's structure in another colour
    let recoloured = coloured && (explained.as_is > AS_IS || f.odds <= -REGION_ODDS);
    let doubtful = f.odds >= 0.5 * REGION_ODDS || mean >= COLOUR_DOUBT || (f.able && f.swept.here > TORN);
    if !coloured && !foreign && !f.structural && !doubtful {
        return None;
    }
    Some(Decision {
        strength: f.texture,
        kind: Kind::Texture,
        what: match explained.what {
            // structure that is borne out was not turned
            _ if f.odds <= -REGION_ODDS => What::Recoloured,
            // that it fits better when turned is not enough: it must fit, and not fit as it is
            What::Rotated | What::Mirrored | What::Shifted | What::Scaled if !(found && f.structural) => What::Changed,
            what => what,
        },
        displacement: None,
        reason: if !coloured && !foreign && !f.structural {
            Reason::Undecided
        } else if f.able || recoloured || (found && f.structural) {
            // a texture that fits when turned is a texture's fault, wherever the surface may be
            Reason::None
        } else if unseen {
            Reason::Unseen
        } else {
            Reason::NoParallax
        },
        evidence: vec![
            Evidence::new("correlation with the model's texture", explained.as_is, 0.5, "correlation"),
            Evidence::new("colour difference", colour, COLOUR_STRENGTH / size, "ΔE00"),
        ],
        // what no other light explains is told by that
        statistic: (!recoloured).then_some(Statistic::Picture),
    })
}
