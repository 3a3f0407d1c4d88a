//! What is wrong with a region, and how likely it is that anything is.

use crate::audit::decide::judged::{By, Judged};
use crate::audit::decide::scores::{COLOUR, ODDS, PIXELS_OFF};
use crate::audit::finding::{Displacement, Evidence, Kind, What};
use crate::audit::hypothesis::other_picture::{as_is, explain};
use crate::audit::hypothesis::plane_sweep::{Swept, sweep};
use crate::audit::hypothesis::second_surface::behind;
use crate::audit::likelihood::structure::odds_of;
use crate::audit::picture::regions::{Region, bounds};
use crate::audit::verdict::Reason;
use crate::audit::view::{AuditScene, Observations};

/// Squared difference to the probe that agrees best, in variances, from which on a region is off; it is at most 6.
const MISMATCH: f32 = 3.5;

/// Where some probe agrees within this, in variances, the surface is in its place, whatever place fits the others better.
const AGREES: f32 = 0.5;

/// Share of a picture that a region which is just off must have, and an opening.
const SIZE: f32 = 2e-3;
const OPENING: f32 = 5e-3;

/// How fast the odds grow with how far off a region is.
const STEEP: f32 = 6.0;

/// How much the model's own picture in its place takes of them.
const VOUCHED: f32 = 10.0;

/// How much it adds to them that what lies behind a region explains the photograph.
const FITS_BEHIND: f32 = 1.5;

/// Regions of even odds in a photograph of a right model, and how fast there are fewer of higher odds.
const ALARMS: [f64; 2] = [0.1, 0.7];

/// Probability from which on a doubt is told.
const DOUBTFUL: f64 = 0.1;

/// ΔE00 of another colour, and the logarithm of brightness from which on light is no light to judge a picture by.
const COLOURED: f32 = 9.0;
const LIGHT: f32 = 0.9;

/// A displacement tells of a fault if it explains so many times what it leaves; it is measured if that is once as much, and it is so
/// many times its own uncertainty.
const EXPLAINS: f32 = 3.0;
const CERTAIN: f64 = 3.0;

/// Correlation with the model's texture from which on a picture is the model's.
const AS_IS: f32 = 0.5;

/// What lies behind a region is what the photograph shows if it differs by at most this share of what the region does.
const BEHIND: f32 = 0.25;

/// A surface goes on over an opening if more than this share of it says so.
const CONTINUED: f32 = 0.4;

/// A region is a whole surface, and not a part of one, if it has more than this share of its pieces.
const WHOLE: f64 = 0.6;

/// Odds from which on a region's structure is another than the model's, and the share of the usual structure that it has less of.
const REGION_ODDS: f32 = 6.0;
const OTHER: f32 = 0.5;

/// Share of the difference that a displacement explains, as a ratio to what it leaves.
fn explains(swept: &Swept) -> f32 {
    (swept.here - swept.least) / (swept.least + 0.3)
}

fn mean(region: &Region, value: impl Fn(usize) -> Option<f32>) -> f32 {
    let told: Vec<f32> = region.pixels.iter().filter_map(|i| value(*i)).collect();
    told.iter().sum::<f32>() / told.len().max(1) as f32
}

fn share(region: &Region, holds: impl Fn(usize) -> bool) -> f32 {
    region.pixels.iter().filter(|i| holds(**i)).count() as f32 / region.pixels.len() as f32
}

/// Area over greatest extent, pixels.
fn thickness(region: &Region, width: usize) -> f32 {
    let [left, top, right, bottom] = bounds(&region.pixels, width);
    region.pixels.len() as f32 / (right - left).max(bottom - top) as f32
}

/// A region that photograph and probes do not agree on: off its place, not there, or hidden by something.
pub(crate) fn shape(
    prepared: &AuditScene,
    observed: &Observations,
    shares: &[(u32, u32)],
    region: Region,
) -> Option<Judged> {
    let size = size(observed, &region)?;
    let g = &observed.geometry;
    let swept = sweep(prepared, observed, &region);
    let apart = mean(&region, |i| (g.able[i] > 0).then_some(g.mismatch[i]));
    let continued = share(&region, |i| observed.continued.score[i] >= 1.0);
    let explains = explains(&swept);
    let sure = swept.best_m.abs() > CERTAIN * swept.uncertainty_m;
    let thickness = thickness(&region, observed.surfaces.width);
    let moved = apart >= AGREES
        && explains > 1.0
        && sure
        && swept.pixels > PIXELS_OFF
        && swept.pixels <= thickness
        && swept.twin.is_none();
    let (here, there) = behind(prepared, observed, &region).unwrap_or((1.0, f32::INFINITY));
    let gone = there < BEHIND * here;
    let (covered, whole) = region
        .pixels
        .iter()
        .map(|i| shares[*i])
        .fold((0.0f64, 0.0f64), |(c, a), (size, part)| (c + f64::from(part), a + f64::from(size)));
    let what = match (moved, gone) {
        (_, true) => What::Extra,
        _ if continued > CONTINUED => What::Missing,
        (true, _) if covered / whole.max(1.0) > WHOLE => What::Moved,
        _ => What::Missing,
    };
    // where the photograph shows the model's picture in its place, the place is right and something is in the probes' way
    let vouched =
        share(&region, |i| observed.texture.structure.structured[i] && observed.texture.structure.odds[i] <= -ODDS);
    let surely = [
        log_odds(apart / MISMATCH, size / SIZE) - VOUCHED * (vouched - 0.1).max(0.0)
            + if gone { FITS_BEHIND } else { 0.0 },
        if moved { log_odds(explains / EXPLAINS, size / SIZE) } else { f32::NEG_INFINITY },
        log_odds(continued / CONTINUED, size / OPENING),
    ];
    let surely = surely.into_iter().fold(f32::NEG_INFINITY, f32::max);
    let mut evidence = vec![
        Evidence::new("geometry mismatch", apart, MISMATCH, "× variance"),
        Evidence::new("explained by a displacement", explains, EXPLAINS, "× what is left"),
        Evidence::new("the model's picture in its place", vouched, 0.1, "share"),
    ];
    if there.is_finite() {
        evidence.push(Evidence::new("fit of what lies behind", there / here, BEHIND, "× the surface's"));
    }
    if continued > 0.0 {
        evidence.push(Evidence::new("the surface around goes on", continued, CONTINUED, "share"));
    }
    let by = By::Figure(surely);
    Some(Judged {
        score: probability(surely)?,
        kind: Kind::Geometry,
        what,
        displacement: (moved && !gone)
            .then_some(Displacement { metres: swept.best_m, uncertainty_m: swept.uncertainty_m }),
        shift: None,
        reason: reason(observed, by),
        evidence,
        by,
        region,
    })
}

/// A region's share of the picture; `None` if it is too small for anything to be told of it.
fn size(observed: &Observations, region: &Region) -> Option<f32> {
    let share = region.pixels.len() as f32 / observed.usable.len() as f32;
    (share / SIZE >= 1.0).then_some(share)
}

/// Logarithm of the odds of a fault: by how many times its threshold a region is off, if it is large enough.
fn log_odds(times: f32, size: f32) -> f32 {
    if size < 1.0 { f32::NEG_INFINITY } else { STEEP * (times.min(2.0) - 1.0) + 0.5 * size.min(20.0).ln() }
}

/// Regions of at least these odds that right models give in a photograph: an exponential of the odds' logarithm, fitted to what the
/// rooms that the audit was made on give (`docs/audit.md`).
pub(crate) fn false_alarms(log_odds: f32) -> f64 {
    ALARMS[0] * (-ALARMS[1] * f64::from(log_odds)).exp()
}

/// The probability of a fault of these odds; `None` if it is not worth telling.
fn probability(log_odds: f32) -> Option<f64> {
    Some(f64::from(1.0 / (1.0 + (-log_odds).exp()))).filter(|p| *p >= DOUBTFUL)
}

/// Why it is a doubt, if right models give as much too often.
fn reason(observed: &Observations, by: By) -> Reason {
    match by {
        By::Figure(log_odds) if false_alarms(log_odds) > observed.false_alarms => Reason::Usual,
        _ => Reason::None,
    }
}

/// A region whose picture is not the model's.
pub(crate) fn picture(prepared: &AuditScene, observed: &Observations, region: Region) -> Option<Judged> {
    let size = size(observed, &region)?;
    let t = &observed.texture;
    let (odds, slope) = odds_of(&t.structure, observed.surfaces.width, &region.pixels);
    let structural = odds >= REGION_ODDS && slope < OTHER;
    let colour = t.mean_colour(observed, &region);
    let as_is = as_is(observed, &region);
    let bright = mean(&region, |i| t.tested[i].then_some(t.brightness[i]));
    let other = structural && as_is < AS_IS && bright < LIGHT;
    // light that is far off in brightness may as well be so in colour
    let coloured = log_odds(colour / (COLOURED * (1.0 + bright)), size / SIZE);
    let surely = if other { log_odds(odds / REGION_ODDS, size / SIZE).max(coloured) } else { coloured };
    let by = if coloured < surely { By::Structure } else { By::Figure(surely) };
    // before the search for another laying, which takes long
    let score = probability(surely)?;
    let what = match explain(prepared.scene, observed, &region, as_is, colour / COLOUR) {
        _ if odds <= -REGION_ODDS => What::Recoloured,
        What::Rotated | What::Mirrored | What::Shifted | What::Scaled if !structural => What::Changed,
        what => what,
    };
    let apart = mean(&region, |i| (observed.geometry.able[i] > 0).then_some(observed.geometry.mismatch[i]));
    let evidence = vec![
        Evidence::new("odds of another structure", odds, REGION_ODDS, "logarithm"),
        Evidence::new("correlation with the model's texture", as_is, 0.5, "correlation"),
        Evidence::new("colour difference", colour, COLOURED, "ΔE00"),
        Evidence::new("geometry mismatch", apart, MISMATCH, "× variance"),
        Evidence::new("brightness", bright, LIGHT, "logarithm"),
    ];
    Some(Judged {
        score,
        kind: Kind::Texture,
        what,
        displacement: None,
        shift: None,
        reason: reason(observed, by),
        evidence,
        by,
        region,
    })
}
