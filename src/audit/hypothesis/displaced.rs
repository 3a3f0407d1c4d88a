//! Smooth surfaces off their place along their normals: what a surface's parts say of where it is, each by itself, is one number if it has
//! moved. Where nothing but light is off, they fit best here and there.

use rayon::prelude::*;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

use crate::audit::finding::Displacement;
use crate::audit::likelihood::photo_consistency::{PLACES, place};
use crate::audit::likelihood::placement::Part;
use crate::audit::picture::{POSE_PX, student};
use crate::audit::view::Observations;
use crate::components::members;

/// A smooth surface that may be off its place.
pub(crate) struct Displaced {
    /// In order.
    pub(crate) pixels: Vec<usize>,
    pub(crate) displacement: Displacement,
    /// Pixels of parallax that this is.
    pub(crate) parallax_px: f32,
    /// Logarithm of the odds of that place against the model's.
    pub(crate) odds: f32,
    /// The share of what its parts say that agrees on that place.
    pub(crate) agree: f32,
    /// By which share less photograph and probes differ where these fit best.
    pub(crate) explained: f32,
}

/// All smooth surfaces that fit better elsewhere than in the model's place, each as far as its parts agree on where: `least` pixels and more.
pub(crate) fn displaced(observed: &Observations, least: usize) -> Vec<Displaced> {
    let surfaces = members(&observed.surfaces.label);
    let mut parts: Vec<Vec<&Part>> = vec![Vec::new(); surfaces.len()];
    observed.placement.parts.iter().for_each(|p| parts[observed.surfaces.label[p.pixel] as usize].push(p));
    let all = surfaces.into_par_iter().zip(parts).filter(|(pixels, parts)| pixels.len() >= least && !parts.is_empty());
    all.filter_map(|(pixels, parts)| of_surface(observed, &pixels, &parts))
        .filter(|displaced| displaced.pixels.len() >= least)
        .collect()
}

/// A smooth surface, if its parts say that it is off its place.
fn of_surface(observed: &Observations, pixels: &[usize], parts: &[&Part]) -> Option<Displaced> {
    // two standard deviations of what others are off by
    let usual = f64::from(observed.placement.usual_m(pixels)) / 2.0;
    let told: Vec<Told> = parts.iter().map(|part| Told::of(part, usual)).collect();
    let (odds, off_m) = surest(&told)?;
    let agree: Vec<bool> = told.iter().map(|part| part.odds(off_m) > 0.0).collect();
    let mean = |of: fn(&Part) -> f64| {
        weighed(parts.iter().zip(&agree).filter(|(_, agree)| **agree).map(|(part, _)| (part.told_px, of(part))))
    };
    let displacement = mean_place(&told, off_m);
    let parallax_px = displacement.metres.abs() * mean(|part| part.swept.parallax);
    // a pose that is off moves all parts alike: two standard deviations of that are what it may be off by
    let pose = 0.5 * (2.0 * parallax_px / f64::from(POSE_PX)).powi(2);
    let odds = odds.min(pose) + occam(displacement.uncertainty_m);
    if odds.is_nan() || odds <= 0.0 {
        return None;
    }
    let square = |i: usize| {
        let (_, y, x) = observed.surfaces.part(i);
        (y, x)
    };
    let nearest = nearest(pixels.iter().map(|i| square(*i)), parts.iter().map(|part| square(part.pixel)));
    let off = |i: &usize| nearest.get(&square(*i)).is_some_and(|part| agree[*part]);
    let there = mean(|part| part.swept.there) / mean(|part| part.swept.here).max(1e-9);
    Some(Displaced {
        pixels: pixels.iter().copied().filter(off).collect(),
        displacement,
        parallax_px: parallax_px as f32,
        odds: odds as f32,
        agree: weighed(parts.iter().zip(&told).map(|(part, told)| (part.told_px, told.counts(off_m)))) as f32,
        explained: (1.0 - there) as f32,
    })
}

/// The mean of values, each counted by so many pixels.
fn weighed(values: impl Iterator<Item = (usize, f64)>) -> f64 {
    let add = |(sum, total): (f64, f64), (px, value): (usize, f64)| (sum + px as f64 * value, total + px as f64);
    let (sum, total) = values.fold((0.0, 0.0), add);
    sum / total
}

/// Row and column of the square of pixels that a part of a surface is in.
type Square = (usize, usize);

/// The squares around one.
fn around((y, x): Square) -> impl Iterator<Item = Square> {
    let side = |k: usize| k.saturating_sub(1)..=k + 1;
    side(y).flat_map(move |v| side(x).map(move |u| (v, u)))
}

/// Per square of a surface, the part nearest to it along the surface; `told` has each part's own square.
fn nearest(squares: impl Iterator<Item = Square>, told: impl Iterator<Item = Square>) -> BTreeMap<Square, usize> {
    let squares: BTreeSet<Square> = squares.collect();
    let mut nearest: BTreeMap<Square, usize> = told.enumerate().map(|(k, square)| (square, k)).collect();
    let mut next: VecDeque<Square> = nearest.keys().copied().collect();
    while let Some(square) = next.pop_front() {
        let part = nearest[&square];
        for other in around(square).filter(|other| squares.contains(other)) {
            if let Entry::Vacant(free) = nearest.entry(other) {
                free.insert(part);
                next.push_back(other);
            }
        }
    }
    nearest
}

/// Logarithm of the odds of the likeliest other place, of those that parts are at, and metres.
fn surest(told: &[Told]) -> Option<(f64, f64)> {
    let of = |metres: f64| (told.iter().map(|part| part.odds(metres)).sum(), metres);
    told.iter().map(|part| of(part.off_m)).max_by(|a: &(f64, f64), b| a.0.total_cmp(&b.0))
}

/// What a part says of its surface's place, metres along its normal, and the variance of that: of how well it is known, and of what right
/// surfaces are off by.
struct Told {
    off_m: f64,
    variance: f64,
}

impl Told {
    fn of(part: &Part, usual_m: f64) -> Self {
        Self { off_m: part.swept.best_m, variance: part.swept.uncertainty_m.powi(2) + usual_m * usual_m }
    }

    /// The square of how far it is from a place, in variances.
    fn off_by(&self, metres: f64) -> f64 {
        (self.off_m - metres).powi(2) / self.variance
    }

    /// How much it counts for a place, 0..=1, as Student's distribution has it: the less, the farther it is from there.
    fn counts(&self, metres: f64) -> f64 {
        student::weight(self.off_by(metres))
    }

    /// Logarithm of the odds that its surface is so far off its place, against its being in it, by Student's distribution: some parts are
    /// wrong.
    fn odds(&self, metres: f64) -> f64 {
        let of = |place: f64| student::unlikeliness(self.off_by(place), 1.0);
        of(0.0) - of(metres)
    }
}

/// The mean of where parts are, as much as each counts for a place, and how well it is known.
fn mean_place(parts: &[Told], metres: f64) -> Displacement {
    let weighed = parts.iter().map(|part| (part.counts(metres) / part.variance, part.off_m));
    let (sum, total) = weighed.fold((0.0, 0.0), |(sum, total), (w, off_m)| (sum + w * off_m, total + w));
    Displacement { metres: sum / total, uncertainty_m: total.sqrt().recip() }
}

/// What the logarithm of the odds of a place loses since it could have been any other that is tried (Occam's factor; `MacKay`, *Information
/// Theory, Inference, and Learning Algorithms*, 2003, section 28.1).
fn occam(uncertainty_m: f64) -> f64 {
    let tried = f64::from(place(PLACES - 1) - place(0));
    ((2.0 * std::f64::consts::PI).sqrt() * uncertainty_m / tried).min(1.0).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(places: &[f64]) -> Vec<Told> {
        places.iter().map(|off_m| Told { off_m: *off_m, variance: 1e-4 }).collect()
    }

    #[test]
    fn parts_that_agree_tell_a_place_and_parts_that_do_not_tell_none() {
        let moved = told(&[0.1, 0.105, 0.098, 0.102, -0.3]);
        let (odds, metres) = surest(&moved).unwrap();
        assert!(odds > 10.0, "{odds}");
        let place = mean_place(&moved, metres);
        assert!((place.metres - 0.101).abs() < 0.003 && (0.003..0.01).contains(&place.uncertainty_m), "{place:?}");
        let (apart, _) = surest(&told(&[0.1, -0.3, 0.25, -0.12, 0.0, 0.01])).unwrap();
        let (right, _) = surest(&told(&[0.01, -0.01, 0.0, 0.015, 0.4])).unwrap();
        assert!(apart < 6.0 && right < 1.0, "{apart} {right}");
        assert!(occam(0.01) < -3.0 && occam(2.0) == 0.0);
    }

    #[test]
    fn what_tells_nothing_is_of_the_part_nearest_to_it() {
        let squares = (0..9).map(|x| (0, x)).chain([(5, 5)]);
        let nearest = nearest(squares, [(0, 1), (0, 8)].into_iter());
        let of: Vec<usize> = (0..9).map(|x| nearest[&(0, x)]).collect();
        assert_eq!(of, [0, 0, 0, 0, 0, 1, 1, 1, 1]);
        assert!(!nearest.contains_key(&(5, 5)), "no way leads there");
    }
}
