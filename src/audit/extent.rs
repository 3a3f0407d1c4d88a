//! How far a fault of shape reaches in the photograph.
//!
//! The geometry test speaks only where a probe can be asked. What stands before the model's surface hides places that no
//! probe sees, and a step's side is seen by none. But around a fault that is told, the photograph differs from what the
//! model makes of it as far as the fault reaches.

use std::collections::BTreeMap;

use super::regions::{Region, dilated};
use super::surfaces::NONE;
use super::sweep::sweep;
use super::verdict::verdicts;
use super::view::{Maps, Prepared};
use super::{Displacement, EdgeAware, Judged, Kind, Verdict, What};
use crate::panorama::{Picture, luminance};
use crate::statistics::median;

/// Differences are averaged over windows of this standard deviation, pixels.
const WINDOW: f32 = 1.2;

/// A pixel differs if it does so this many times as much as half of the picture …
const TIMES: f32 = 3.5;

/// … and by this much of a logarithm.
const LEAST: f32 = 0.12;

/// More tells no more.
const MOST: f32 = 1.5;

/// Differences over fewer than this many pixels each way are edges, and a window reaches as far over its own.
const EDGE_PX: usize = 1;

/// A region may be so many pixels away from what it reaches.
const GAP_PX: usize = 2;

/// It reaches at most this share of its size beyond itself.
const REACH: f32 = 1.5;

/// Places count as one displacement if they differ by less than this share of it …
const ALIKE: f32 = 0.4;

/// … and explain the difference at least this much better than the model's place, as a ratio to what is left.
const EXPLAINED: f32 = 0.25;

/// A part of the model is as wrong as this share of it, unless it is more than the second share of the picture: its room.
const SHARE: f32 = 0.15;
const ROOM: f32 = 0.35;

/// Adds to faults of shape what belongs to them around them: of what the model has too much, the part of the model; of a
/// surface off its place, what is as far off; of the others, where the photograph is not what the model makes.
pub(super) fn grown(prepared: &Prepared, maps: &Maps, mut judged: Vec<Judged>) -> Vec<Judged> {
    // a part that its outline tells of is as large as that
    let outlined = |j: &Judged| j.shift.is_some() || (j.what == What::Moved && j.displacement.is_none());
    let grows = |j: &Judged| j.kind == Kind::Geometry && !outlined(j);
    if !judged.iter().any(grows) {
        return judged;
    }
    let (right, _) = verdicts(maps, &[]);
    let mut free = vec![true; right.len()];
    judged.iter().flat_map(|j| &j.region.pixels).for_each(|&i| free[i] = false);
    let differs = differs(maps, &right);
    for j in judged.iter_mut().filter(|j| grows(j)) {
        if j.what == What::Extra {
            if let Some(part) = part_of(prepared, maps, &j.region) {
                spread(&mut j.region, &mut free, maps, |i| part[i] && right[i] != Verdict::Ok);
            }
            continue;
        }
        if let Some(d) = j.displacement {
            spread(&mut j.region, &mut free, maps, |i| displaced(maps, i, d.metres as f32));
            let swept = sweep(prepared, maps, &j.region);
            if swept.best_m * d.metres > 0.0 {
                j.displacement = Some(Displacement { metres: swept.best_m, uncertainty_m: swept.uncertainty_m });
            }
        }
        spread(&mut j.region, &mut free, maps, |i| differs[i]);
    }
    judged
}

/// Adds the free pixels that belong to a region and hang together with it.
fn spread(region: &mut Region, free: &mut [bool], maps: &Maps, belongs: impl Fn(usize) -> bool) {
    let (w, h) = maps.size();
    let mut inside = vec![false; w * h];
    region.pixels.iter().for_each(|&i| inside[i] = true);
    let reach = (REACH * (region.pixels.len() as f32).sqrt()) as usize;
    let within = dilated(&inside, w, h, reach);
    let near = dilated(&inside, w, h, GAP_PX);
    let mut stack: Vec<usize> = (0..w * h).filter(|i| near[*i] && free[*i] && belongs(*i)).collect();
    stack.iter().for_each(|&i| free[i] = false);
    while let Some(i) = stack.pop() {
        region.pixels.push(i);
        let (x, y) = (i % w, i / w);
        let around = [(x > 0, i.wrapping_sub(1)), (x + 1 < w, i + 1), (y > 0, i.wrapping_sub(w)), (y + 1 < h, i + w)];
        for (is, k) in around {
            if is && free[k] && within[k] && belongs(k) {
                free[k] = false;
                stack.push(k);
            }
        }
    }
    region.pixels.sort_unstable();
}

/// Whether a pixel's own best place is about as far off.
fn displaced(maps: &Maps, i: usize, metres: f32) -> bool {
    let g = &maps.geometry;
    (g.best_m[i] - metres).abs() < ALIKE * metres.abs() && g.ratio[i] > EXPLAINED
}

/// The pixels of the part of the model that most of a region is on, if it is not the room.
fn part_of(prepared: &Prepared, maps: &Maps, region: &Region) -> Option<Vec<bool>> {
    let s = &maps.surfaces;
    let part = |i: usize| prepared.part(s.triangle[i]);
    let mut votes: BTreeMap<u32, usize> = BTreeMap::new();
    region.pixels.iter().for_each(|&i| *votes.entry(part(i)).or_default() += 1);
    let (most, count) = votes.into_iter().max_by_key(|(_, n)| *n)?;
    let all: Vec<bool> = (0..s.triangle.len()).map(|i| part(i) == most).collect();
    let size = all.iter().filter(|a| **a).count() as f32;
    (most != NONE && count as f32 >= SHARE * size && size <= ROOM * all.len() as f32).then_some(all)
}

/// Where the photograph is not what the model makes in the probes' light, and no test bears the model out.
fn differs(maps: &Maps, right: &[Verdict]) -> Vec<bool> {
    let (w, h) = maps.size();
    let known: Vec<bool> = (0..w * h)
        .map(|i| maps.usable[i] > 0.0 && maps.log_photo[i].is_finite() && Picture::valid(maps.render.pixels[i]))
        .collect();
    let ln = |v: f32| v.max(1e-6).ln();
    let difference: Vec<f32> = (0..w * h)
        .map(|i| {
            if !known[i] {
                return 0.0;
            }
            ln(luminance(maps.log_photo[i].map(f32::exp))) - ln(luminance(maps.render.pixels[i]))
        })
        .collect();
    let of_known = |values: &[f32]| median(values.iter().zip(&known).filter(|v| *v.1).map(|v| *v.0)).unwrap_or(0.0);
    let middle = of_known(&difference);
    let square: Vec<f32> = difference.iter().map(|d| (d - middle).clamp(-MOST, MOST).powi(2)).collect();
    let weight: Vec<f32> = known.iter().map(|k| if *k { 1.0 } else { 0.0 }).collect();
    let local: Vec<f32> =
        EdgeAware::open(w, h).mean(&square, &weight, WINDOW).iter().map(|s| s.max(0.0).sqrt()).collect();
    let least = (TIMES * of_known(&local)).max(LEAST);
    let same: Vec<bool> = (0..w * h).map(|i| !known[i] || local[i] <= least || right[i] == Verdict::Ok).collect();
    // edges go, and the window's reach with them
    let core = dilated(&same, w, h, 2 * EDGE_PX);
    dilated(&core.iter().map(|c| !c).collect::<Vec<_>>(), w, h, EDGE_PX)
}
