//! What is wrong with a region, and what was measured of it.

use crate::audit::decide::judged::Judged;
use crate::audit::decide::odds::{self, ABSENT, BORDER, DISPLACED, OPENING, OUTLINE, PICTURE, SHAPE, UNLIKE};
use crate::audit::decide::scores::{COLOUR, LOW, Scores, lacking};
use crate::audit::finding::{Displacement, Kind, What};
use crate::audit::hypothesis::absent::Absent;
use crate::audit::hypothesis::displaced::Displaced;
use crate::audit::hypothesis::extent::Places;
use crate::audit::hypothesis::laying::retextured::{Relaid, relaid};
use crate::audit::hypothesis::opening::Opening;
use crate::audit::hypothesis::other_picture::{as_is, explain};
use crate::audit::hypothesis::second_surface::behind;
use crate::audit::hypothesis::sideways::Shifted;
use crate::audit::likelihood::plane_sweep::{Swept, sweep};
use crate::audit::likelihood::step::ASIDE;
use crate::audit::likelihood::structure::odds_of;
use crate::audit::picture::regions::{MOST_PX, Region, bounds, dilated, mask_of};
use crate::audit::picture::{FEWEST, ODDS};
use crate::audit::view::{AuditScene, Observations};
use crate::panorama::luminance;

/// Where some probe agrees within this, in variances, the surface is in its place, whatever place fits the others better.
const AGREES: f32 = 0.5;

/// A displacement is measured if it is so many times its own uncertainty.
const CERTAIN: f64 = 3.0;

/// Regions smaller than this share of the picture are left out.
const LEAST_SHARE: f64 = 6e-4;

/// Mean over a region; NaN where less than a quarter of it tells.
fn mean(region: &Region, value: impl Fn(usize) -> Option<f32>) -> f32 {
    let told: Vec<f32> = region.pixels.iter().filter_map(|i| value(*i)).collect();
    if 4 * told.len() < region.pixels.len() { f32::NAN } else { told.iter().sum::<f32>() / told.len() as f32 }
}

fn share(region: &Region, holds: impl Fn(usize) -> bool) -> f32 {
    region.pixels.iter().filter(|i| holds(**i)).count() as f32 / region.pixels.len() as f32
}

/// Area over greatest extent, pixels.
fn thickness(region: &Region, width: usize) -> f32 {
    let [left, top, right, bottom] = bounds(&region.pixels, width);
    region.pixels.len() as f32 / (right - left).max(bottom - top) as f32
}

/// Logarithm of a region's share of the picture.
pub(crate) fn size(observed: &Observations, pixels: usize) -> f32 {
    (pixels as f32 / observed.usable.len() as f32).ln()
}

/// Pixels of the smallest region.
pub(crate) fn least(observed: &Observations) -> usize {
    FEWEST.max((LEAST_SHARE * observed.usable.len() as f64) as usize)
}

/// The share of a region's light that it may mirror.
fn mirrored(observed: &Observations, region: &Region) -> f32 {
    mean(region, |i| {
        let seen = luminance(observed.log_photo[i].map(f32::exp));
        Some((luminance(observed.mirrored[i]) / seen).min(1.0)).filter(|s| s.is_finite())
    })
}

fn mismatch(observed: &Observations, region: &Region) -> f32 {
    mean(region, |i| (observed.geometry.able[i] > 0).then_some(observed.geometry.mismatch[i]))
}

/// A region that photograph and probes do not agree on: off its place, not there, or hidden by something. `None` where they agree, as
/// far as what it may mirror lets one tell: if something is wrong with it, its picture is.
pub(crate) fn shape(
    prepared: &AuditScene,
    observed: &Observations,
    shares: &[(u32, u32)],
    inside: &[bool],
    region: &Region,
) -> Option<Judged> {
    let t = &observed.texture;
    let apart = mismatch(observed, region);
    if apart < AGREES {
        return None;
    }
    let swept = swept(prepared, observed, region);
    let sure = swept.best_m.abs() > CERTAIN * swept.uncertainty_m;
    let thickness = thickness(region, observed.surfaces.width);
    let moved = sure && swept.pixels() <= thickness.into();
    // as far off as others are it is in its place
    if moved && swept.best_m.abs() <= observed.placement.usual_m(&region.pixels).into() {
        return None;
    }
    let gone = gone(prepared, observed, region);
    let (covered, whole) = region
        .pixels
        .iter()
        .map(|i| shares[*i])
        .fold((0.0f64, 0.0f64), |(c, a), (size, part)| (c + f64::from(part), a + f64::from(size)));
    let what = match (moved, gone) {
        (_, true) => What::Extra,
        (true, _) if 2.0 * covered > whole => What::Moved,
        _ => What::Missing,
    };
    // where the photograph shows the model's picture in its place, the place is right and something is in the probes' way
    let vouched = share(region, |i| t.structure.structured[i] && t.structure.odds[i] <= -ODDS);
    let other = share(region, |i| t.structure.structured[i] && t.structure.odds[i] >= ODDS);
    let (log_odds, evidence) = SHAPE.weigh([
        apart,
        vouched,
        thickness.ln(),
        share(region, |i| !inside[i]),
        other,
        // what is wrong with a surface ends where that does
        observed.surfaces.segments.overlap(&region.pixels),
    ]);
    Some(Judged {
        displacement: (moved && !gone)
            .then_some(Displacement { metres: swept.best_m, uncertainty_m: swept.uncertainty_m }),
        ..Judged::new(Kind::Geometry, what, log_odds, evidence, region.clone())
    })
}

/// Whether the photograph shows what the model has behind a region: that differs by less than half of what the region does.
fn gone(prepared: &AuditScene, observed: &Observations, region: &Region) -> bool {
    behind(prepared, observed, region).is_some_and(|(here, there)| 2.0 * there < here)
}

/// A smooth surface whose parts fit better off their places; `None` where that is known to too little, or where it is farther off than it is
/// wide and the photograph does not show what is behind it: another surface looks alike there.
pub(crate) fn displaced(prepared: &AuditScene, observed: &Observations, surface: Displaced) -> Option<Judged> {
    let Displaced { pixels, displacement, parallax_px, odds, agree, explained } = surface;
    if displacement.metres.abs() <= CERTAIN * displacement.uncertainty_m {
        return None;
    }
    let region = Region { pixels };
    let moved = parallax_px <= thickness(&region, observed.surfaces.width);
    if !moved && !gone(prepared, observed, &region) {
        return None;
    }
    let what = if moved { What::Moved } else { What::Extra };
    let (log_odds, evidence) = DISPLACED.weigh([odds, agree, explained]);
    Some(Judged {
        displacement: moved.then_some(displacement),
        ..Judged::new(Kind::Geometry, what, log_odds, evidence, region)
    })
}

/// Where a region fits best, with what is just beside it.
fn swept(prepared: &AuditScene, observed: &Observations, region: &Region) -> Swept {
    let (w, h) = observed.size();
    let wide = dilated(&mask_of(&region.pixels, w * h), w, h, 2);
    sweep(&observed.surfaces, &observed.geometry, &prepared.probes, (0..w * h).filter(|i| wide[*i]), MOST_PX)
}

/// Per pixel, whether it is well within an outline of the model.
pub(crate) fn inside(observed: &Observations) -> Vec<bool> {
    observed.surfaces.shape.inside(ASIDE)
}

/// A region whose picture is not the model's.
pub(crate) fn picture(prepared: &AuditScene, observed: &Observations, region: Region) -> Judged {
    let laid = |region: &Region| relaid(prepared.scene, observed, &region.pixels);
    picture_or_laid(observed, region, f32::NEG_INFINITY, laid)
}

/// The same; how else it may be laid is asked for only if its log odds are at least `least`.
fn picture_or_laid(
    observed: &Observations,
    region: Region,
    least: f32,
    laid: impl FnOnce(&Region) -> Option<Relaid>,
) -> Judged {
    let t = &observed.texture;
    let (odds, slope) = odds_of(&t.structure, observed.surfaces.width, &region.pixels);
    // what is mirrored has colours of its own
    let matt = 1.0 - mirrored(observed, &region);
    let colour = matt * t.mean_colour(observed, &region);
    let as_is = as_is(observed, &region);
    let bright = mean(&region, |i| t.tested[i].then_some(t.brightness[i]));
    // light that is far off in brightness may as well be so in colour
    let unexplained = colour * (-bright).exp();
    let size = size(observed, region.pixels.len());
    let borders = observed.borders(&region.pixels);
    // where nothing else meets its outline that says nothing against it
    let step = observed.colour_step(&observed.outline(&region.pixels)).map_or(unexplained, |step| matt * step);
    let by_colours = PICTURE.weigh([
        slope,
        size,
        unexplained,
        step.min(unexplained),
        step.min(colour),
        (step - odds::COLOURED) * (size - odds::SMALL).clamp(0.0, odds::LARGE - odds::SMALL),
        mismatch(observed, &region),
        lacking(t, &region.pixels),
        // is learnt when all photographs are known
        f32::NAN,
    ]);
    // borders that step as the model's do speak of its brightness more than of its hue
    let no_border = observed.no_border(&borders);
    let by_borders = (!no_border.is_nan()).then(|| BORDER.weigh([no_border, slope, size]));
    let (log_odds, evidence) = by_borders.filter(|b| b.0 > by_colours.0).unwrap_or(by_colours);
    let structural = odds >= ODDS;
    // the search takes long
    let worth = log_odds >= least && odds::may_be_found(log_odds, observed.settings.false_alarms);
    let what = match explain(as_is, colour / COLOUR, || if worth { laid(&region) } else { None }) {
        _ if odds <= -ODDS => What::Recoloured,
        What::Recoloured if structural => What::Changed,
        What::Rotated | What::Mirrored | What::Shifted | What::Scaled if !structural => What::Changed,
        what => what,
    };
    Judged::new(Kind::Texture, what, log_odds, evidence, region)
}

/// A place that shows little of what the model makes there, if it may be a fault: of its shape or of its picture, whichever is likelier
/// by what stands out there.
pub(crate) fn unlike(
    prepared: &AuditScene,
    observed: &Observations,
    scores: &Scores,
    shares: &[(u32, u32)],
    inside: &[bool],
    places: &Places,
    place: &Region,
) -> Option<Judged> {
    let [_, middle, _] = places.unlike;
    let over = |values: &[f32], most: f32| mean(place, |i| Some(values[i].min(most)));
    let region = places.extent(place, least(observed));
    // what is mirrored has structure and colours of its own
    let matt = 1.0 - mirrored(observed, place);
    let off = over(&scores.geometry, 3.0);
    let (log_odds, evidence) = UNLIKE.weigh([
        over(middle, f32::MAX),
        size(observed, place.pixels.len()),
        thickness(place, observed.surfaces.width).ln(),
        off,
        matt * over(&scores.texture, 3.0),
        matt * over(&observed.texture.structure.odds, f32::MAX),
        observed.own_outline(&region.pixels),
    ]);
    if !odds::may_reach(log_odds, observed.settings.least_probability) {
        return None;
    }
    // the model's own picture, laid otherwise, is no thing that it lacks, if the probes saw it on that surface, too; but a thing that has
    // moved looks shifted, too
    let search = |region: &Region| relaid(prepared.scene, observed, &region.pixels);
    let worth = off < LOW && odds::may_be_found(log_odds, observed.settings.false_alarms);
    let searched = worth.then(|| search(&region));
    if let Some(laid) = searched.flatten().filter(|r| !matches!(r.what, What::Moved | What::Shifted)) {
        return Some(Judged::new(Kind::Texture, laid.what, log_odds, evidence, region));
    }
    let of_shape = shape(prepared, observed, shares, inside, &region);
    let to_beat = of_shape.as_ref().map_or(f32::NEG_INFINITY, |s| s.log_odds);
    let of_picture = picture_or_laid(observed, region, to_beat, |region| searched.unwrap_or_else(|| search(region)));
    let mut judged = of_shape.filter(|s| s.log_odds > of_picture.log_odds).unwrap_or(of_picture);
    if judged.kind == Kind::Texture && observed.outlined(judged.pixels()) {
        (judged.kind, judged.what) = (Kind::Geometry, What::Missing);
    }
    Some(Judged { log_odds, evidence, ..judged })
}

/// An opening of the model over which a surface may go on.
pub(crate) fn opening(observed: &Observations, opening: Opening) -> Judged {
    let Opening { pixels, rim, step, flat } = opening;
    let (log_odds, evidence) = OPENING.weigh([step, flat, size(observed, pixels.len())]);
    let judged = Judged::new(Kind::Geometry, What::Missing, log_odds, evidence, Region { pixels });
    Judged { rim: Some(rim), ..judged }
}

/// A part over whose contours the photograph may go on.
pub(crate) fn absent(observed: &Observations, part: Absent) -> Judged {
    let (log_odds, evidence) = ABSENT.weigh([part.odds, size(observed, part.pixels.len())]);
    Judged::new(Kind::Geometry, What::Extra, log_odds, evidence, Region { pixels: part.pixels })
}

/// A part whose outline is beside its place.
pub(crate) fn outline(part: Shifted) -> Judged {
    let Shifted { part, pixels, shift, odds } = part;
    let (log_odds, evidence) = OUTLINE.weigh([odds]);
    let judged = Judged::new(Kind::Geometry, What::Moved, log_odds, evidence, Region { pixels });
    Judged { shift: Some(shift), part: Some((part, odds)), ..judged }
}
