//! From both tests' maps to regions with a kind, and to a verdict for each pixel.

use glam::Vec3;

use super::border::Border;
use super::explain::explain;
use super::outline::{self, Shifted};
use super::regions::{Region, closed, components, opened};
use super::scores::{COLOUR, LOW, PIXELS_OFF, SHADING, Scores};
use super::surfaces::NONE;
use super::sweep::sweep;
use super::texture::{BLACK, odds_of};
use super::view::{Maps, Prepared};
use super::{Displacement, Evidence, Kind, Reason, Shift, Verdict, What};
use crate::scene::Ray;

/// A moved surface must raise the cost by this much for its place to count as tested.
pub(super) const SENSITIVITY: f32 = 120.0;
/// ΔE00 of all the picture together that makes one doubt the white balance.
pub(super) const WHITE: f32 = 8.0;
/// Regions smaller than this share of the picture are left out.
const LEAST_SHARE: f64 = 6e-4;
/// Nor are fewer pixels than this a region.
const LEAST_PX: usize = 30;

/// A displacement of a region of so many pixels is told although it explains less of the difference.
const LARGE_PX: usize = 1000;

/// Odds from which on a region's structure is another than the model's.
const REGION_ODDS: f32 = 6.0;
/// A colour's strength: its mean ΔE00 times the root of its area over this share of the picture. The light that surfaces
/// throw on each other is known coarsely, and errors of its colour are strong only where they are small.
const COLOUR_SHARE: f32 = 6e-3;
const COLOUR_STRENGTH: f32 = 12.0;
/// Less is a doubt only with this ΔE00.
const COLOUR_DOUBT: f32 = 9.0;
/// A surface of another colour as a whole is one only from this ΔE00 on, unless its structure fits or the colour changes on
/// it by this share.
const COLOUR_SURE: f32 = 18.0;
const PAINT_STEP: f32 = 0.5;
/// Cost from which on one probe is believed where the texture's test marks the region, too.
const STRONG: f32 = 6.0;
/// In a region smaller than this share of the picture, a displacement must explain a difference of more than this, and
/// one probe alone is not believed.
const SMALL_SHARE: f32 = 5e-3;
const SMALL_MISMATCH: f32 = 3.0;
/// What lies behind a region is what the photograph shows if its cost is at most this share of the region's own, and in
/// itself no more than this.
const BEHIND: f32 = 0.25;
const BEHIND_MOST: f32 = 2.0;
/// Odds below which a pixel's structure bears the model out.
const BORNE_OUT: f32 = -1.0;

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
}

impl Judged {
    /// Indices of its pixels at the audit's size.
    pub fn pixels(&self) -> &[usize] {
        &self.region.pixels
    }
}

/// Finds the regions of a view and judges each.
pub(super) fn judge(prepared: &Prepared, maps: &Maps, scores: &Scores) -> Vec<Judged> {
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
    let shares = scores.pieces.shares(&low);
    let same = |i: usize, j: usize| s.material[i] == s.material[j];
    for region in components(&low, &high, w, least, same) {
        let judged_one = judge_one(prepared, maps, scores, &shares, region);
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
    with_shifted(united(judged, maps), outline::shifted(prepared, maps), maps)
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
        let evidence = |test: &str, value: f32, threshold: f32, unit: &str| Evidence {
            test: test.into(),
            value: f64::from(value),
            threshold: f64::from(threshold),
            unit: unit.into(),
        };
        judged.push(Judged {
            score: confidence(f64::from(part.odds / outline::ODDS), part.pixels.len() as f32),
            kind: Kind::Geometry,
            what: What::Moved,
            displacement: None,
            shift: Some(part.shift()),
            reason: Reason::None,
            evidence: vec![
                evidence("outline shifted to the right", part.by_px[0], 2.0, "pixels"),
                evidence("outline shifted down", part.by_px[1], 2.0, "pixels"),
                evidence("outline shifted, on the part", part.metres, 0.0, "metres"),
                evidence("odds of another place", part.odds, outline::ODDS, "logarithm"),
            ],
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

fn judge_one(
    prepared: &Prepared,
    maps: &Maps,
    scores: &Scores,
    shares: &[(u32, u32)],
    region: Region,
) -> Option<Judged> {
    let n = region.pixels.len() as f32;
    let share = |f: &dyn Fn(usize) -> bool| region.pixels.iter().filter(|i| f(**i)).count() as f32 / n;
    let upper = |v: &[f32]| {
        let mut all: Vec<f32> = region.pixels.iter().map(|i| v[*i]).collect();
        let at = (all.len() * 3 / 4).min(all.len().saturating_sub(1));
        *all.select_nth_unstable_by(at, f32::total_cmp).1
    };
    let (t, g) = (upper(&scores.texture), upper(&scores.geometry));
    let swept = sweep(prepared, maps, &region);
    let explains = (swept.here - swept.least) / (swept.least + 0.3);
    let sure = swept.best_m.abs() > 3.0 * swept.uncertainty_m;
    // a part that is large enough speaks for all of it
    let able = swept.able >= 0.3 || swept.able * n >= 5.0 * least(maps) as f32;
    let (odds, slope) = odds_of(&maps.texture, maps.surfaces.width, &region.pixels);
    let structural = odds >= REGION_ODDS && slope < 0.5;
    let marked = share(&|i| scores.geometry[i] >= LOW);
    let textured = share(&|i| scores.texture[i] >= LOW);
    let several = region.pixels.iter().map(|i| f32::from(maps.geometry.able[*i])).sum::<f32>() / n >= 1.5;
    // one probe alone may be at fault itself, unless the other test bears it out or a displacement explains all
    let explained = if several {
        explains > if region.pixels.len() >= LARGE_PX { 0.6 } else { 1.0 }
    } else {
        (explains > 1.5 && structural) || explains > 3.0
    };
    let small = n < SMALL_SHARE * maps.usable.len() as f32;
    let strong = !small || swept.here > SMALL_MISMATCH;
    let moved = able && strong && swept.here - swept.least > 0.5 && explained && sure && swept.pixels > PIXELS_OFF;
    let bridged = share(&|i| maps.bridged.score[i] >= 1.0) > 0.4;
    let distinct = share(&|i| maps.bridged.distinct[i]) > 0.25;
    // the probes agree with the photograph on a surface whose picture alone is wrong, or no better beside it
    let border = if textured >= 0.25 { Border::of(maps, &scores.surface, &region) } else { None };
    let beside = border.as_ref().is_some_and(|b| b.alike_in_shape(maps));
    let torn = textured >= 0.25 && swept.here > 1.7 && !beside;
    let borne_out = t >= 1.0 && swept.here > STRONG;
    let wrong = able && (torn || (marked > 0.3 && swept.here > 3.5 && t > 0.5));
    let mut evidence = vec![
        Evidence {
            test: "geometry mismatch".into(),
            value: f64::from(swept.here),
            threshold: 2.5,
            unit: "× variance".into(),
        },
        Evidence { test: "texture".into(), value: f64::from(t), threshold: 1.0, unit: "× threshold".into() },
    ];
    if bridged && !moved {
        evidence.push(Evidence {
            test: "the surface around goes on".into(),
            value: f64::from(share(&|i| maps.bridged.score[i] >= 1.0)),
            threshold: 0.4,
            unit: "share".into(),
        });
        return Some(Judged {
            score: confidence(f64::from(upper(&maps.bridged.score)), n),
            kind: Kind::Geometry,
            what: What::Missing,
            displacement: None,
            shift: None,
            // what one probe alone saw past the rim may be that probe's own, unless it fits there and nowhere else;
            // and few pixels fit something by chance
            reason: if (several || distinct) && !small { Reason::None } else { Reason::ProbesDisagree },
            evidence,
            region,
        });
    }
    if moved || wrong {
        let behind = beyond(prepared, maps, &region);
        let (covered, whole) = region
            .pixels
            .iter()
            .map(|i| shares[*i])
            .fold((0.0f64, 0.0f64), |(c, a), (size, part)| (c + f64::from(part), a + f64::from(size)));
        let whole_surface = covered / whole.max(1.0) > 0.6;
        let gone =
            behind.is_some_and(|(here, there)| there < BEHIND * here && there < 0.6 * swept.least.max(BEHIND_MOST));
        let what = match (moved, gone, whole_surface) {
            (_, true, _) => What::Extra,
            _ if bridged => What::Missing,
            (true, _, true) => What::Moved,
            _ => What::Missing,
        };
        let displacement =
            (moved && !gone).then_some(Displacement { metres: swept.best_m, uncertainty_m: swept.uncertainty_m });
        if let Some((here, there)) = behind {
            evidence.push(Evidence {
                test: "fit of what lies behind".into(),
                value: f64::from(there / here),
                threshold: f64::from(BEHIND),
                unit: "× the surface's".into(),
            });
        }
        evidence.push(Evidence {
            test: "explained by a displacement".into(),
            value: f64::from(explains),
            threshold: 1.0,
            unit: "× what is left".into(),
        });
        let reason = match swept.twin {
            Some(_) if moved && swept.here < 2.5 => Reason::Periodic,
            _ if small && !several => Reason::ProbesDisagree,
            // a picture that is not the model's, either, cannot be the probe's fault
            _ if moved || gone || several || structural || borne_out => Reason::None,
            _ => Reason::ProbesDisagree,
        };
        let strength = f64::from(g.max(swept.here / 2.5).max(t));
        return Some(Judged {
            score: confidence(strength, n),
            kind: Kind::Geometry,
            what,
            displacement,
            shift: None,
            reason,
            evidence,
            region,
        });
    }
    // only the geometry test marks it, and its sum does not bear it out
    if textured < 0.25 {
        return None;
    }
    let colour = upper(&maps.texture.colour) / COLOUR;
    let explained = explain(prepared.scene, maps, &region, colour);
    evidence.push(Evidence {
        test: "correlation with the model's texture".into(),
        value: f64::from(explained.as_is),
        threshold: 0.5,
        unit: "correlation".into(),
    });
    evidence.push(Evidence {
        test: "colour difference".into(),
        value: f64::from(upper(&maps.texture.colour)),
        threshold: f64::from(COLOUR_STRENGTH / (n / (COLOUR_SHARE * maps.usable.len() as f32)).sqrt()),
        unit: "ΔE00".into(),
    });
    let unseen = share(&|i| maps.geometry.seen[i] == 0) > 0.5;
    let foreign = share(&|i| scores.foreign[i] >= 1.0) >= 0.3;
    let tinted = share(&|i| scores.colour[i] >= 1.0) >= 0.3;
    let seen = region.pixels.iter().filter(|i| maps.texture.tested[**i]);
    let (sum, tested) = seen.fold((0.0, 0.0f32), |(s, n), i| (s + maps.texture.colour[*i], n + 1.0));
    let mean = sum / tested.max(1.0);
    let strength = mean * (n / (COLOUR_SHARE * maps.usable.len() as f32)).sqrt();
    // where structure says nothing, coding or darkness may have spoilt colour, too
    let told = structural || odds <= -REGION_ODDS || explained.as_is > 0.6;
    // light of another colour falls on whole surfaces, paint ends anywhere and leaves the structure as it is
    let stepped = border.as_ref().is_some_and(|b| b.colour_step(maps) >= PAINT_STEP * mean);
    let paint = stepped || mean >= COLOUR_SURE || explained.as_is > 0.6;
    let coloured = tinted && paint && strength >= if told { COLOUR_STRENGTH } else { 2.0 * COLOUR_STRENGTH };
    let found = explained.best > explained.as_is + 0.35 && explained.best > 0.55;
    // a surface that is off its place would not show the model's structure in another colour
    let recoloured = coloured && (explained.as_is > 0.6 || odds <= -REGION_ODDS);
    if !coloured && !foreign && !structural && odds < 0.5 * REGION_ODDS && mean < COLOUR_DOUBT {
        return None;
    }
    evidence.push(Evidence {
        test: "odds of another structure".into(),
        value: f64::from(odds),
        threshold: f64::from(REGION_ODDS),
        unit: "logarithm".into(),
    });
    let reason = if !coloured && !foreign && !structural {
        Reason::Undecided
    } else if able || recoloured || (found && structural) {
        // a texture that fits when turned is a texture's fault, wherever the surface may be
        Reason::None
    } else if unseen {
        Reason::Unseen
    } else {
        Reason::NoParallax
    };
    Some(Judged {
        score: confidence(f64::from(t), n),
        kind: Kind::Texture,
        what: match explained.what {
            // structure that is borne out was not turned
            _ if odds <= -REGION_ODDS => What::Recoloured,
            // that it fits better when turned is not enough: it must fit, and not fit as it is
            What::Rotated | What::Mirrored | What::Shifted | What::Scaled if !(found && structural) => What::Changed,
            what => what,
        },
        displacement: None,
        shift: None,
        reason,
        evidence,
        region,
    })
}

/// Confidence from strength over threshold and from size: one half at the threshold for a small region.
fn confidence(strength: f64, pixels: f32) -> f64 {
    let odds = strength.max(0.1).powf(1.5) * (f64::from(pixels) / 100.0).max(0.3).powf(0.3);
    odds / (1.0 + odds)
}

/// Mean cost of the region as it is and of what the model has behind it, if it has anything there: small behind means
/// that the region's surface is not there at all.
fn beyond(prepared: &Prepared, maps: &Maps, region: &Region) -> Option<(f32, f32)> {
    /// Surfaces behind that are tried: a box has a back, too.
    const LAYERS: usize = 3;
    let s = &maps.surfaces;
    let (mut here, mut behind, mut count) = (0.0f64, 0.0f64, 0u32);
    let step = region.pixels.len().div_ceil(2000).max(1);
    for &i in region.pixels.iter().step_by(step) {
        if s.triangle[i] == NONE {
            continue;
        }
        // where the photograph has edges, half a pixel beside is no difference
        let variance = 0.01 + 0.25 * slope(&maps.log_photo, i, s.width);
        let cost = |point: Vec3, all: bool| {
            let costs = prepared.probes.iter().enumerate().filter_map(|(k, probe)| {
                if all && maps.sights.of[k][i].is_none() {
                    return None;
                }
                let l = probe.log_radiance(point, 0) + maps.radiometry.gains[k];
                let d = (l - maps.log_photo[i]).length_squared() / 3.0;
                d.is_finite().then_some((d / variance).min(16.0))
            });
            costs.fold(None, |best: Option<f32>, c| Some(best.map_or(c, |b| b.min(c))))
        };
        let Some(mine) = cost(s.position[i], true) else { continue };
        let mut best: Option<f32> = None;
        let mut t = s.distance[i];
        for _ in 0..LAYERS {
            let ray = Ray { origin: s.origin, direction: s.ray[i] };
            let Some(hit) = prepared.scene.tracer.closest(&ray, t + 1e-3 + 1e-4 * t) else { break };
            t = hit.t;
            if let Some(c) = cost(s.origin + s.ray[i] * t, false) {
                best = Some(best.map_or(c, |b| b.min(c)));
            }
        }
        if let Some(best) = best {
            here += f64::from(mine);
            behind += f64::from(best);
            count += 1;
        }
    }
    (count > 20).then(|| ((here / f64::from(count)) as f32, (behind / f64::from(count)) as f32))
}

/// Mean squared difference of a pixel's logarithm from its neighbours'.
fn slope(log: &[Vec3], i: usize, width: usize) -> f32 {
    let around = [i.wrapping_sub(1), i + 1, i.wrapping_sub(width), i + width];
    let squares = around.iter().filter_map(|j| log.get(*j)).map(|o| (*o - log[i]).length_squared() / 3.0);
    squares.filter(|d| d.is_finite()).sum::<f32>() / 4.0
}

/// A verdict for each pixel, and why it is no better.
pub(super) fn verdicts(maps: &Maps, judged: &[Judged]) -> (Vec<Verdict>, Vec<Reason>) {
    let (s, t, g) = (&maps.surfaces, &maps.texture, &maps.geometry);
    let n = t.tested.len();
    let mut verdicts = vec![Verdict::Untestable; n];
    let mut reasons = vec![Reason::None; n];
    for i in 0..n {
        let reason = if maps.photo.unusable[i] != Reason::None {
            maps.photo.unusable[i]
        } else if s.triangle[i] == NONE {
            Reason::NoSurface
        } else if g.seen[i] == 0 {
            if s.normal[i].dot(s.ray[i]).abs() < 0.12 { Reason::Grazing } else { Reason::Unseen }
        } else if g.able[i] == 0 {
            Reason::NoParallax
        } else if maps.albedo[i].min_element() <= BLACK {
            Reason::BlackAlbedo
        } else if !t.tested[i] {
            Reason::Grazing
        } else if g.sensitivity[i] < SENSITIVITY || (t.structured[i] && t.odds[i] > BORNE_OUT) {
            Reason::NoTexture
        } else {
            Reason::None
        };
        reasons[i] = reason;
        if reason == Reason::None {
            let shaded = t.shading[i] > SHADING && !t.structured[i];
            verdicts[i] = if shaded { Verdict::Ambiguous } else { Verdict::Ok };
            reasons[i] = if shaded { Reason::Shadow } else { Reason::None };
        }
    }
    for j in judged {
        for &i in &j.region.pixels {
            (verdicts[i], reasons[i]) = match (j.reason, j.kind) {
                (Reason::None, Kind::Texture) => (Verdict::Texture, Reason::None),
                (Reason::None, Kind::Geometry) => (Verdict::Geometry, Reason::None),
                (reason, _) => (Verdict::Ambiguous, reason),
            };
        }
    }
    (verdicts, reasons)
}
