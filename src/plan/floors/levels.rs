//! The heights at which a building has floors: an area-weighted histogram of the level surfaces that can be walked on,
//! confirmed by connected area and headroom.
//!
//! What is no floor falls out for a reason of its own: tables and cupboards are small or narrow parts of their own,
//! cornices are narrow, vaults are mostly not level, the inside of a wall shows only backs of triangles, roofs and the
//! ground outside lie in the open, and a landing has more floor above and below it.

use rayon::prelude::*;
use std::collections::BTreeMap;

use super::walkable::{Side, WalkableSpans};
use crate::scene::{Ray, Scene};

/// A floor's surface lies within so much of its elevation, metres; floors lie farther apart.
pub(crate) const SPREAD_M: f32 = 1.2;
/// Half the width of a place that counts: a table or cornice is narrower, metres.
const CORE_M: f64 = 0.35;
/// The least core of a part that may hold a floor, m².
const LEAST_PART_M2: f64 = 1.0;
/// The least core of a floor, m² and as a share of the largest floor's.
const LEAST_LEVEL_M2: f64 = 1.0;
const LEAST_SHARE: f64 = 0.015;
/// A landing's core is smaller than this, m².
const LANDING_M2: f64 = 8.0;
/// Height of a bin of the histogram, metres, and how many make a peak.
const BIN_M: f32 = 0.05;
const PEAK: usize = 5;

/// A height with a floor.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    /// Local metres.
    pub(crate) elevation: f32,
    /// Whether each connected part of the places belongs to it.
    pub(crate) parts: Vec<bool>,
}

/// Finds the levels, from the lowest.
pub(crate) fn find_levels(places: &WalkableSpans, scene: &Scene) -> Vec<Level> {
    let cell_area = places.columns.grid.cell_area();
    let core = core(places);
    let mut parts = vec![Component::default(); places.part_count()];
    for (i, place) in places.list.iter().enumerate().filter(|(_, p)| p.indoors) {
        let part = &mut parts[place.part as usize];
        part.places += 1;
        part.level += usize::from(place.level);
        if core[i] {
            part.core.push(i);
        }
    }
    let mut fit: Vec<bool> =
        parts.iter().map(|p| 2 * p.level >= p.places && p.core.len() as f64 * cell_area >= LEAST_PART_M2).collect();
    drop_insides(&mut fit, &parts, places, scene);
    drop_hollows(&mut fit, &parts, places);
    let counted: Vec<usize> = (0..places.list.len())
        .filter(|i| core[*i] && places.list[*i].level && fit[places.list[*i].part as usize])
        .collect();
    let peaks = without_landings(peaks(places, &counted, cell_area), places, &counted, cell_area);
    peaks.into_iter().map(|elevation| Level { elevation, parts: belonging(elevation, &parts, &fit, places) }).collect()
}

#[derive(Clone, Default)]
struct Component {
    places: usize,
    level: usize,
    core: Vec<usize>,
}

/// Which places have more of the same part all around.
fn core(places: &WalkableSpans) -> Vec<bool> {
    let grid = places.columns.grid;
    let r = (CORE_M / grid.cell_m).round().max(1.0) as isize;
    let d = (0.7 * r as f64).round() as isize;
    let around = [(r, 0), (-r, 0), (0, r), (0, -r), (d, d), (-d, d), (d, -d), (-d, -d)];
    let same = |i: usize, cell: usize| {
        let (part, z) = (places.list[i].part, places.list[i].z);
        places.column(cell).any(|other| places.list[other].part == part && (places.list[other].z - z).abs() < 0.5)
    };
    (0..places.list.len())
        .into_par_iter()
        .map(|i| {
            let place = places.list[i];
            let beside = |(x, y): &(isize, isize)| grid.beside(place.cell as usize, *x, *y);
            place.indoors && around.iter().all(|step| beside(step).is_some_and(|c| same(i, c)))
        })
        .collect()
}

/// Drops parts that lie inside a wall or below a floor: they see backs where the rest sees fronts, or the other way
/// about. Nothing is dropped where the model's winding means nothing.
fn drop_insides(fit: &mut [bool], parts: &[Component], places: &WalkableSpans, scene: &Scene) {
    if places.side == Side::Any {
        return;
    }
    let wrong = |part: &Component| {
        let backs = back_share(&part.core, places, scene);
        if places.side == Side::Front { backs } else { 1.0 - backs }
    };
    let right: Vec<bool> = parts.par_iter().zip(&*fit).map(|(part, fit)| *fit && wrong(part) < 0.8).collect();
    // where all are wrong, winding means something else here
    if right.contains(&true) {
        fit.copy_from_slice(&right);
    }
}

/// Drops hollows beneath floors: parts of their own whose ceiling is a sheet that is itself walked on (unless the largest
/// part has such a ceiling too: there, storeys are sheets), and small pits.
fn drop_hollows(fit: &mut [bool], parts: &[Component], places: &WalkableSpans) {
    let under = |part: &Component| {
        let below = part.core.iter().filter(|i| below_sheet(**i, places)).count();
        below as f64 / part.core.len().max(1) as f64
    };
    let Some(largest) = (0..parts.len()).filter(|p| fit[*p]).max_by_key(|p| parts[*p].core.len()) else { return };
    let sheets = under(&parts[largest]) >= 0.3;
    let known = fit.to_vec();
    for p in (0..parts.len()).filter(|p| *p != largest) {
        let small = 4 * parts[p].core.len() < parts[largest].core.len();
        fit[p] = fit[p] && (sheets || under(&parts[p]) < 0.4) && !(small && pit(p as u32, &known, places));
    }
}

/// Whether a part has no way out, but a floor higher than a step looks down on a good share of its rim: one can only
/// fall into it.
fn pit(part: u32, fit: &[bool], places: &WalkableSpans) -> bool {
    let (mut rim, mut overlooked) = (0, 0);
    for place in places.list.iter().filter(|p| p.part == part) {
        for beside in places.columns.grid.neighbours(place.cell as usize) {
            let mut others = places.column(beside).map(|i| places.list[i]);
            if others.clone().any(|o| o.part == part) {
                continue;
            }
            rim += 1;
            overlooked += usize::from(others.any(|o| fit[o.part as usize] && (0.3..3.0).contains(&(o.z - place.z))));
        }
    }
    20 * overlooked > rim
}

/// Whether what is next above a place is thin and a place itself.
fn below_sheet(place: usize, places: &WalkableSpans) -> bool {
    let (cell, z) = (places.list[place].cell as usize, places.list[place].z);
    let above = places.columns.column(cell).iter().find(|s| s.low > z + 0.1);
    above.is_some_and(|s| {
        s.high - s.low < 0.12 && places.column(cell).any(|other| (places.list[other].z - s.high).abs() < 0.01)
    })
}

/// The share of hits on backs, seen from 24 places of a part 1.2 m up.
fn back_share(core: &[usize], places: &WalkableSpans, scene: &Scene) -> f64 {
    let (mut backs, mut hits) = (0usize, 0usize);
    for i in core.iter().step_by((core.len() / 24).max(1)) {
        let place = places.list[*i];
        let origin = places.columns.grid.middle(place.cell as usize).as_vec2().extend(place.z + 1.2);
        for direction in crate::sphere::sphere(48) {
            let Some(hit) = scene.tracer.closest(&Ray { origin, direction }, 1e-3) else { continue };
            let normal = scene.mesh.normal(hit.triangle);
            // floor and ceiling run on through walls
            if normal.z.abs() < 0.7 {
                hits += 1;
                backs += usize::from(normal.dot(direction) > 0.0);
            }
        }
    }
    backs as f64 / hits.max(1) as f64
}

/// The histogram's peaks, largest first, no two nearer than [`SPREAD_M`].
fn peaks(places: &WalkableSpans, counted: &[usize], cell_area: f64) -> Vec<f32> {
    let mut bins: BTreeMap<i64, usize> = BTreeMap::new();
    for i in counted {
        *bins.entry((places.list[*i].z / BIN_M).floor() as i64).or_default() += 1;
    }
    let mut peaks: Vec<f32> = Vec::new();
    let mut largest = 0.0;
    loop {
        let free = |bin: i64| {
            let z = (bin as f32 + 0.5) * BIN_M;
            peaks.iter().all(|p: &f32| (p - z).abs() > SPREAD_M)
        };
        let sum =
            |bin: i64| -> usize { bins.range(bin..bin + PEAK as i64).filter(|(b, _)| free(**b)).map(|(_, n)| n).sum() };
        // the lowest of equal ones
        let best = bins.keys().map(|b| (sum(*b), -*b)).max();
        let Some((count, bin)) = best.map(|(count, bin)| (count, -bin)) else { return peaks };
        let area = count as f64 * cell_area;
        if area < LEAST_LEVEL_M2 || area < LEAST_SHARE * largest {
            return peaks;
        }
        largest = f64::max(largest, area);
        // the fullest bin of the window tells the height
        let window = bins.range(bin..bin + PEAK as i64).filter(|(b, _)| free(**b));
        let Some((_, fullest)) = window.map(|(b, n)| (*n, *b)).max_by_key(|(n, b)| (*n, -*b)) else { return peaks };
        let within = |z: &f32| (z / BIN_M).floor() as i64 == fullest;
        let mut heights: Vec<f32> = counted.iter().map(|i| places.list[*i].z).filter(within).collect();
        heights.sort_by(f32::total_cmp);
        peaks.push(heights[heights.len() / 2]);
    }
}

/// Sorts the peaks by height and drops small ones whose part also has larger ones both above and below.
fn without_landings(mut peaks: Vec<f32>, places: &WalkableSpans, counted: &[usize], cell_area: f64) -> Vec<f32> {
    peaks.sort_by(f32::total_cmp);
    // area of each peak in each part
    let mut areas: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); peaks.len()];
    for i in counted {
        let place = places.list[*i];
        if let Some(p) = peaks.iter().position(|e| (e - place.z).abs() < PEAK as f32 * BIN_M) {
            *areas[p].entry(place.part).or_default() += cell_area;
        }
    }
    let keep = |p: usize| {
        let total: f64 = areas[p].values().sum();
        let landing = |part: &u32, own: f64| {
            let larger = |q: usize| areas[q].get(part).is_some_and(|a| *a > 2.0 * own);
            (0..p).any(larger) && (p + 1..areas.len()).any(larger)
        };
        total >= LANDING_M2 || !areas[p].iter().all(|(part, own)| landing(part, *own))
    };
    (0..peaks.len()).filter(|p| keep(*p)).map(|p| peaks[p]).collect()
}

/// The parts that belong to a level: those with core at its very height, and large ones not far off (a dais).
fn belonging(elevation: f32, parts: &[Component], fit: &[bool], places: &WalkableSpans) -> Vec<bool> {
    let near = |i: &&usize, by: f32| (places.list[**i].z - elevation).abs() <= by;
    let belongs = |(part, fit): (&Component, &bool)| {
        *fit && (part.core.iter().filter(|i| near(i, PEAK as f32 * BIN_M)).count() > part.core.len() / 50
            || part.core.iter().filter(|i| near(i, SPREAD_M)).count() > 4000)
    };
    parts.iter().zip(fit).map(belongs).collect()
}
