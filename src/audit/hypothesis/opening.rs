//! Openings of the model that the photograph does not have: over their rims it goes on as over one surface.
//!
//! Where the model has a hole one sees past the surface around it something that no probe tells of, or nothing at all. What a real
//! opening shows steps at its rim, in brightness or colour, by more than the surface around it differs from place to place.

use glam::{Mat3, Vec2};
use rayon::prelude::*;
use std::collections::BTreeSet;

use crate::audit::likelihood::agreement::USUAL;
use crate::audit::likelihood::step::{BESIDE, border, steps, usual};
use crate::audit::picture::FEWEST;
use crate::audit::picture::regions::{at_most, bounds, mask_of};
use crate::audit::view::Observations;
use crate::components::{components, members};
use crate::statistics::median;

/// Places of a rim that are tried for its plane.
const PLANES: usize = 100;

/// What the model shows past the rim of an opening, where no probe tells of it.
pub(crate) struct Opening {
    pub(crate) pixels: Vec<usize>,
    /// A pixel beside it, in the plane that most of its rim is in.
    pub(crate) rim: usize,
    /// The photograph's step over half of the rim, as the logarithm of what half of the places of the surface around it differ by, or of
    /// all surfaces, if that is more.
    pub(crate) step: f32,
    /// The share of what is around these pixels that is one plane before them, as far as it is on all sides: what lies past the end of a
    /// surface is on one side of it.
    pub(crate) flat: f32,
}

/// What the model shows past the rims of openings.
pub(crate) fn openings(observed: &Observations, least: usize) -> Vec<Opening> {
    let s = &observed.surfaces;
    let unit = usual(s.width, &observed.log_photo, observed.within_surfaces());
    let surfaces = members(&s.label);
    let rough: Vec<f32> = surfaces.par_iter().map(|surface| observed.roughness(unit, surface)).collect();
    let unseen = |i: &&usize| observed.geometry.able[**i] == 0;
    let beyond =
        |pixels: &Vec<usize>| pixels.len() >= least && 2 * pixels.iter().filter(unseen).count() >= pixels.len();
    let beside = beside(&s.label, s.width, surfaces.len());
    let enclosed = |own: usize| enclosed(&surfaces, &beside, own, s.width, least);
    let mut pieces: Vec<Vec<usize>> = (0..surfaces.len()).into_par_iter().flat_map(enclosed).collect();
    pieces.extend(surfaces.into_iter().filter(beyond));
    pieces.into_par_iter().filter_map(|pixels| opening(observed, unit, &rough, pixels)).collect()
}

impl Observations {
    /// Whether the photograph shows one surface in two pixels.
    fn within_surfaces(&self) -> impl Fn(usize, usize) -> bool {
        let label = &self.surfaces.label;
        move |i, j| label[i] == label[j] && self.shows(i) && self.shows(j)
    }

    /// The squared step that half of a surface's places are smoother than; 0 if it is too small to tell.
    fn roughness(&self, unit: Mat3, surface: &[usize]) -> f32 {
        let all = steps(self.surfaces.width, &self.log_photo, surface.iter().copied(), self.within_surfaces());
        let squared: Vec<f32> = all.map(|step| (unit * step).length_squared()).collect();
        if squared.len() < FEWEST { 0.0 } else { median(squared).unwrap_or(0.0) }
    }
}

/// Per surface, those that touch it along pixels' sides.
fn beside(label: &[u32], width: usize, surfaces: usize) -> Vec<BTreeSet<usize>> {
    let mut beside = vec![BTreeSet::new(); surfaces];
    for i in 0..label.len() {
        let right = (!(i + 1).is_multiple_of(width)).then_some(i + 1);
        let below = Some(i + width).filter(|j| *j < label.len());
        for j in [right, below].into_iter().flatten().filter(|j| label[*j] != label[i]) {
            beside[label[i] as usize].insert(label[j] as usize);
            beside[label[j] as usize].insert(label[i] as usize);
        }
    }
    beside
}

/// What a surface encloses of several others: through an opening one may see more than one.
fn enclosed(
    surfaces: &[Vec<usize>],
    beside: &[BTreeSet<usize>],
    own: usize,
    width: usize,
    least: usize,
) -> Vec<Vec<usize>> {
    let near = &surfaces[own];
    if near.len() < least {
        return Vec::new();
    }
    let [left, top, right, bottom] = bounds(near, width);
    let within = |i: usize| (left..right).contains(&(i % width)) && (top..bottom).contains(&(i / width));
    let enclosed = |group: Vec<usize>| {
        let all = || group.iter().flat_map(|k| &surfaces[*k]).copied();
        let size: usize = group.iter().map(|k| surfaces[*k].len()).sum();
        if group.len() < 2 || !(least..near.len()).contains(&size) || !all().all(within) {
            return None;
        }
        let mut pixels: Vec<usize> = all().collect();
        pixels.sort_unstable();
        Some(pixels)
    };
    let rest = components(surfaces.len(), |k| k != own, |k| beside[k].iter().copied());
    members(&rest).into_iter().filter_map(enclosed).collect()
}

/// What is around some pixels, where each surface is so rough.
fn opening(observed: &Observations, unit: Mat3, rough: &[f32], pixels: Vec<usize>) -> Option<Opening> {
    let s = &observed.surfaces;
    let mask = mask_of(&pixels, s.label.len());
    let inside = |i: usize| mask[i];
    let all: Vec<_> = border([s.width, s.height], &pixels, &inside).collect();
    let before = all.iter().filter(|p| s.distance[p.next] < (1.0 - BESIDE) * s.distance[p.last]);
    let rim: Vec<[usize; 2]> = before
        .filter_map(|p| Some([p.own?, p.other.filter(|j| s.label[*j] == s.label[p.next])?]))
        .filter(|[own, other]| observed.shows(*own) && observed.shows(*other))
        .collect();
    let places: Vec<usize> = rim.iter().map(|[_, other]| *other).collect();
    let count = |i: usize| places.iter().filter(|j| s.coplanar(i, **j)).count();
    let plane = at_most(&places, PLANES).max_by_key(|i| count(*i))?;
    let over: Vec<&[usize; 2]> = rim.iter().filter(|[_, other]| s.coplanar(plane, *other)).collect();
    let steps: Vec<f32> = over
        .iter()
        .map(|[own, other]| unit * (observed.log_photo[*own] - observed.log_photo[*other]))
        .map(|s| s.length_squared())
        .collect();
    if steps.len() < FEWEST {
        return None;
    }
    let around = median(over.iter().map(|[_, other]| rough[s.label[*other] as usize])).unwrap_or(0.0);
    let step = 0.5 * (median(steps).unwrap_or(0.0) / around.max(USUAL)).max(1e-6).ln();
    let flat = on_all_sides(s.width, over.into_iter()) / all.len() as f32;
    Some(Opening { pixels, rim: plane, step, flat })
}

/// How many of some places on a rim, each a pixel inside and one outside, have another that faces it: all around an opening, none at the
/// end of a surface.
fn on_all_sides<'a>(width: usize, rim: impl Iterator<Item = &'a [usize; 2]>) -> f32 {
    let at = |i: usize| Vec2::new((i % width) as f32, (i / width) as f32);
    let outwards = rim.map(|[own, other]| (at(*other) - at(*own)).normalize_or_zero());
    let (count, sum) = outwards.fold((0.0, Vec2::ZERO), |(count, sum), d| (count + 1.0, sum + d));
    count - sum.length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_is_surrounded_and_the_end_of_a_surface_is_not() {
        const SIDE: usize = 60;
        let rim = |inside: &dyn Fn(usize, usize) -> bool| -> (usize, f32) {
            let inside = |i: usize| inside(i % SIDE, i / SIDE);
            let pixels: Vec<usize> = (0..SIDE * SIDE).filter(|i| inside(*i)).collect();
            let across = border([SIDE, SIDE], &pixels, &inside).map(|p| Some([p.own?, p.other?]));
            let all: Vec<[usize; 2]> = across.flatten().collect();
            (all.len(), on_all_sides(SIDE, all.iter()))
        };
        let (places, facing) = rim(&|x, y| (20..40).contains(&x) && (20..40).contains(&y));
        assert_eq!((places, facing), (80, 80.0));
        // the picture ends below a window: three sides are left, and the one above has none that faces it
        let (places, facing) = rim(&|x, y| (20..40).contains(&x) && y >= 30);
        assert!(places > 70 && (facing - (places - 20) as f32).abs() < 1e-3, "{facing} of {places}");
        // past the edge of a table
        let (places, facing) = rim(&|_, y| y >= 40);
        assert_eq!((places, facing), (SIDE, 0.0));
    }

    #[test]
    fn a_surface_encloses_what_does_not_reach_past_it() {
        // a wall (1) that stands on a floor (0), with a picture (4), around two surfaces beyond its opening (2, 3)
        let of = |last: &str, least: usize| {
            let rows = ["0111111", "0122141", "0133111", last, "0000000"];
            let label: Vec<u32> = rows.concat().bytes().map(|b| u32::from(b - b'0')).collect();
            let surfaces = members(&label);
            enclosed(&surfaces, &beside(&label, 7, surfaces.len()), 1, 7, least)
        };
        assert_eq!(of("0111111", 2), [[9, 10, 16, 17]]);
        assert!(of("0111111", 5).is_empty());
        // down to the floor it is a door, and the floor goes on
        assert!(of("0133111", 2).is_empty());
    }
}
