//! What differs across a region's border where the surface goes on: there light, and how well a probe can be compared, are
//! the same on both sides.

use std::collections::BTreeMap;

use super::regions::{Region, bounds, dilated};
use super::texture::least_mirrored;
use super::view::Maps;

/// How wide a strip is looked at on either side, pixels, and how far from the border outside of it: tests look at windows.
const WIDE: usize = 8;
const OFF: usize = 4;

/// A surface that holds less than one in so many of the region's pixels is not its own.
const SPILT: usize = 10;

/// Fewer pixels on either side tell nothing.
const FEWEST: usize = 40;

/// A mismatch up to so many times that beside it is no other.
const ALIKE: f32 = 1.5;

/// Strips on either side of a region's border, on the surfaces that the region is on.
pub(super) struct Border {
    inside: Vec<usize>,
    outside: Vec<usize>,
}

impl Border {
    /// `None` where no surface goes on beyond the region. `surface` numbers the smooth surface that each pixel is on.
    pub(super) fn of(maps: &Maps, surface: &[u32], region: &Region) -> Option<Self> {
        let (w, h) = maps.size();
        let (inside, outside) = strips(w, h, surface, &region.pixels);
        (inside.len() >= FEWEST && outside.len() >= FEWEST).then_some(Self { inside, outside })
    }

    /// Whether photograph and probes differ beside the region nearly as much as on it, so that its own shape is not to blame.
    pub(super) fn alike_in_shape(&self, maps: &Maps) -> bool {
        let g = &maps.geometry;
        let mismatch = |side: &[usize]| mean(side.iter().filter(|i| g.able[**i] > 0).map(|i| g.mismatch[*i]));
        mismatch(&self.outside).zip(mismatch(&self.inside)).is_some_and(|(out, inside)| inside <= ALIKE * out)
    }

    /// By how much the colour that the albedo lacks differs between the two sides, whatever they mirror, ΔE00; 0 where it cannot be
    /// told.
    pub(super) fn colour_step(&self, maps: &Maps) -> f32 {
        let tested = |side: &[usize]| side.iter().copied().filter(|i| maps.texture.tested[*i]).collect::<Vec<usize>>();
        let (inside, outside) = (tested(&self.inside), tested(&self.outside));
        if inside.len().min(outside.len()) < FEWEST {
            return 0.0;
        }
        least_mirrored(|share| maps.texture.chroma(maps, &inside, share) - maps.texture.chroma(maps, &outside, share))
    }
}

/// Pixels on either side of a region's border, on surfaces that hold some of it.
fn strips(w: usize, h: usize, surface: &[u32], region: &[usize]) -> (Vec<usize>, Vec<usize>) {
    let [left, top, right, bottom] = bounds(region, w);
    let margin = OFF + WIDE;
    let (left, top) = (left.saturating_sub(margin), top.saturating_sub(margin));
    let (right, bottom) = ((right + margin).min(w), (bottom + margin).min(h));
    let (wide, high) = (right.saturating_sub(left), bottom.saturating_sub(top));
    // only what lies around the region is looked at
    let here = |i: usize| (i / w - top) * wide + i % w - left;
    let there = |k: usize| (k / wide + top) * w + k % wide + left;
    let mut within = vec![false; wide * high];
    let mut held: BTreeMap<u32, usize> = BTreeMap::new();
    for &i in region {
        within[here(i)] = true;
        *held.entry(surface[i]).or_default() += 1;
    }
    // a few pixels that spill over an edge are on no surface of the region's
    let on = |i: usize| held.get(&surface[i]).is_some_and(|n| n * SPILT >= region.len());
    let near = dilated(&within, wide, high, OFF);
    let far = dilated(&near, wide, high, WIDE);
    let beyond: Vec<bool> = (0..wide * high).map(|k| far[k] && !near[k] && on(there(k))).collect();
    let reached = dilated(&beyond, wide, high, WIDE + 2 * OFF);
    let inside = region.iter().copied().filter(|i| reached[here(*i)] && on(*i)).collect();
    (inside, (0..wide * high).filter(|k| beyond[*k]).map(there).collect())
}

fn mean(values: impl Iterator<Item = f32>) -> Option<f32> {
    let (sum, count) = values.fold((0.0f64, 0usize), |(s, n), v| (s + f64::from(v), n + 1));
    (count >= FEWEST).then(|| (sum / count as f64) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_lie_on_the_region_s_surface_only() {
        let (w, h) = (60, 40);
        let surface: Vec<u32> = (0..w * h).map(|i| u32::from(i % w >= 30)).collect();
        let block = |x: std::ops::Range<usize>, y: std::ops::Range<usize>| -> Vec<usize> {
            (0..w * h).filter(|i| x.contains(&(i % w)) && y.contains(&(i / w))).collect()
        };
        let (inside, outside) = strips(w, h, &surface, &block(12..30, 10..30));
        assert!(!outside.is_empty() && outside.iter().all(|i| i % w < 30));
        // windows blur across the border: it is left out
        let apart =
            |i: &usize| 12usize.saturating_sub(i % w) + 10usize.saturating_sub(i / w) + (i / w).saturating_sub(29);
        assert!(outside.iter().all(|i| (OFF + 1..=OFF + WIDE).contains(&apart(i))));
        assert!(!inside.is_empty() && inside.iter().all(|i| (12..30).contains(&(i % w))));
        // nothing of its surface is beside a region that covers all of it, whatever spills over
        let mut all = block(30..60, 0..40);
        all.push(29);
        all.sort_unstable();
        let (inside, outside) = strips(w, h, &surface, &all);
        assert!(inside.is_empty() && outside.is_empty());
    }
}
