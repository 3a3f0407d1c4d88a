//! From maps of scores to regions.

use std::collections::BTreeMap;

use crate::components::{components as connected, members};
use crate::edge_aware::EdgeAware;

/// A connected set of pixels, in the picture's order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Region {
    pub(crate) pixels: Vec<usize>,
}

/// The box around pixels: left, top, and one past its right and bottom.
pub(crate) fn bounds(pixels: &[usize], width: usize) -> [usize; 4] {
    let places = pixels.iter().map(|i| (i % width, i / width));
    places.fold([usize::MAX, usize::MAX, 0, 0], |[left, top, right, bottom], (x, y)| {
        [left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1)]
    })
}

/// More pixels than this say no more of a region than some of them.
pub(crate) const MOST_PX: usize = 6000;

/// Some of a set of pixels, spread evenly over it: at most so many.
pub(crate) fn at_most(pixels: &[usize], most: usize) -> impl Iterator<Item = usize> {
    pixels.iter().copied().step_by(pixels.len().div_ceil(most).max(1))
}

/// Pixels within `radius` (a diamond's steps) of a set one: by their distance from the nearest, found in two passes
/// (Rosenfeld and Pfaltz, *Sequential operations in digital picture processing*, 1966).
pub(crate) fn dilated(mask: &[bool], width: usize, height: usize, radius: usize) -> Vec<bool> {
    let far = width + height;
    let mut steps: Vec<usize> = mask.iter().map(|m| if *m { 0 } else { far }).collect();
    for i in 0..steps.len() {
        let left = if i % width > 0 { steps[i - 1] + 1 } else { far };
        let above = if i >= width { steps[i - width] + 1 } else { far };
        steps[i] = steps[i].min(left).min(above);
    }
    for i in (0..steps.len()).rev() {
        let right = if i % width + 1 < width { steps[i + 1] + 1 } else { far };
        let below = if i + width < steps.len() { steps[i + width] + 1 } else { far };
        steps[i] = steps[i].min(right).min(below);
    }
    steps.iter().map(|s| *s < far && *s <= radius).collect()
}

/// Whether each of so many pixels is one of some.
pub(crate) fn mask_of(pixels: &[usize], count: usize) -> Vec<bool> {
    let mut mask = vec![false; count];
    pixels.iter().for_each(|i| mask[*i] = true);
    mask
}

fn inverted(mask: &[bool]) -> Vec<bool> {
    mask.iter().map(|m| !m).collect()
}

/// What is left of a mask when everything thinner than `2 × radius` is taken away.
pub(crate) fn opened(mask: &[bool], width: usize, height: usize, radius: usize) -> Vec<bool> {
    let eroded = inverted(&dilated(&inverted(mask), width, height, radius));
    dilated(&eroded, width, height, radius)
}

/// The mask with gaps narrower than `2 × radius` and small holes filled.
pub(crate) fn closed(mask: &[bool], width: usize, height: usize, radius: usize) -> Vec<bool> {
    let grown = dilated(mask, width, height, radius);
    inverted(&dilated(&inverted(&grown), width, height, radius))
}

/// Whether two neighbours share a side, and not only a corner.
fn along_sides(width: usize) -> impl Fn(usize, usize) -> bool {
    move |i, j| i % width == j % width || i / width == j / width
}

/// The mask with all that it encloses.
pub(crate) fn filled(mask: &[bool], width: usize) -> Vec<bool> {
    let (outside, height) = (inverted(mask), mask.len() / width);
    let at_end = |i: usize, side: usize| i == 0 || i + 1 == side;
    let border = |i: usize| at_end(i % width, width) || at_end(i / width, height);
    let seeds: Vec<bool> = (0..mask.len()).map(border).collect();
    let open = components(&outside, &seeds, width, 1, along_sides(width));
    let open: Vec<usize> = open.into_iter().flat_map(|r| r.pixels).collect();
    inverted(&mask_of(&open, mask.len()))
}

/// Connected components (along rows, columns and diagonals) of a mask that hold at least one of `seeds` and have at
/// least `least` pixels, in the order of their first pixel. `joined` says whether two neighbours may be connected.
pub(crate) fn components(
    mask: &[bool],
    seeds: &[bool],
    width: usize,
    least: usize,
    joined: impl Fn(usize, usize) -> bool,
) -> Vec<Region> {
    let height = mask.len() / width;
    let around = |i: usize| {
        let (x, y) = (i % width, i / width);
        let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
        let all = rows.flat_map(move |y| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |x| y * width + x));
        let joined = &joined;
        all.filter(move |j| joined(i, *j))
    };
    let regions = members(&connected(mask.len(), |i| mask[i], around));
    let kept = regions.into_iter().filter(|pixels| pixels.len() >= least && pixels.iter().any(|i| seeds[*i]));
    kept.map(|pixels| Region { pixels }).collect()
}

/// The pieces of a picture that joins connect.
#[derive(Default)]
pub(crate) struct Segments {
    /// The piece that each pixel is in.
    pub(crate) of: Vec<u32>,
    /// Per piece, its pixels in order.
    pub(crate) pixels: Vec<Vec<usize>>,
}

impl Segments {
    pub(crate) fn new(filter: &EdgeAware) -> Self {
        let of = filter.labels();
        Self { pixels: members(&of), of }
    }

    /// For each pixel the size of its piece and how much of it a mask covers.
    pub(crate) fn shares(&self, mask: &[bool]) -> Vec<(u32, u32)> {
        let of_piece: Vec<(u32, u32)> =
            self.pixels.iter().map(|p| (p.len() as u32, p.iter().filter(|i| mask[**i]).count() as u32)).collect();
        self.of.iter().map(|k| of_piece[*k as usize]).collect()
    }

    /// Intersection over union of some pixels and the piece that they fit best, 0..=1.
    pub(crate) fn overlap(&self, pixels: &[usize]) -> f32 {
        let mut within: BTreeMap<u32, usize> = BTreeMap::new();
        pixels.iter().for_each(|i| *within.entry(self.of[*i]).or_default() += 1);
        let of =
            |(piece, n): (&u32, &usize)| *n as f32 / (pixels.len() + self.pixels[*piece as usize].len() - n) as f32;
        within.iter().map(of).fold(0.0, f32::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask(rows: &[&str]) -> Vec<bool> {
        rows.iter().flat_map(|r| r.bytes().map(|b| b == b'#')).collect()
    }

    #[test]
    fn components_are_apart_and_need_a_seed() {
        let m = mask(&["##..#", "##..#", ".....", "..#..", "#...."]);
        let all = vec![true; 25];
        let sizes = |least| -> Vec<usize> {
            components(&m, &all, 5, least, |_, _| true).iter().map(|r| r.pixels.len()).collect()
        };
        assert_eq!(sizes(1), [4, 2, 1, 1]);
        assert_eq!(sizes(2), [4, 2]);
        let mut seeds = vec![false; 25];
        seeds[9] = true;
        let found = components(&m, &seeds, 5, 1, |_, _| true);
        assert_eq!(found, [Region { pixels: vec![4, 9] }]);
    }

    #[test]
    fn what_is_within_so_many_steps_is_a_diamond() {
        let (w, h) = (13, 9);
        for (radius, set) in [(0, vec![40]), (2, vec![0, 60]), (3, vec![12, 104, 58]), (40, vec![5]), (7, vec![])] {
            let mask: Vec<bool> = (0..w * h).map(|i| set.contains(&i)).collect();
            let near = |i: usize, j: usize| (i % w).abs_diff(j % w) + (i / w).abs_diff(j / w) <= radius;
            let expected: Vec<bool> = (0..w * h).map(|i| set.iter().any(|j| near(i, *j))).collect();
            assert_eq!(dilated(&mask, w, h, radius), expected, "{radius} {set:?}");
        }
        assert_eq!(bounds(&[14, 40, 28], w), [1, 1, 3, 4]);
    }

    #[test]
    fn opening_takes_lines_away_and_closing_fills_gaps() {
        let m = mask(&[".......", ".#####.", ".#####.", ".#####.", ".......", "#######", "......."]);
        let o = opened(&m, 7, 7, 1);
        assert!(!o[5 * 7 + 3] && o[2 * 7 + 3]);
        let gap = mask(&[".......", ".##.##.", ".##.##.", ".##.##.", "......."]);
        assert!(closed(&gap, 7, 5, 1)[2 * 7 + 3]);
    }

    #[test]
    fn what_a_mask_encloses_is_filled() {
        let ring = mask(&[".......", "..###..", "..#.#..", "..###..", "...#...", "####...", "...#..."]);
        let whole = mask(&[".......", "..###..", "..###..", "..###..", "...#...", "####...", "...#..."]);
        assert_eq!(filled(&ring, 7), whole);
    }

    #[test]
    fn a_surface_knows_how_much_of_it_is_covered() {
        let filter = EdgeAware::new(4, 2, |i, j| (i % 4 < 2) == (j % 4 < 2));
        let shares = Segments::new(&filter).shares(&mask(&["#...", "...."]));
        assert_eq!((shares[0], shares[7]), ((4, 1), (4, 0)));
    }

    #[test]
    fn pixels_fit_the_piece_whose_outline_they_have() {
        // two pieces, side by side
        let filter = EdgeAware::new(4, 2, |i, j| (i % 4 < 2) == (j % 4 < 2));
        let pieces = Segments::new(&filter);
        let overlaps = [&[0, 1, 4, 5][..], &[0, 1], &[0, 1, 2, 4, 5], &[1, 2]].map(|pixels| pieces.overlap(pixels));
        assert_eq!(overlaps, [1.0, 0.5, 0.8, 0.2]);
    }
}
