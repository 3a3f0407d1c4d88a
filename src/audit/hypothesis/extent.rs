//! How far something reaches in a place that is unlike the model.
//!
//! How unlike a place is, is told over windows as wide as the structures that are compared, so that such a place is larger than what
//! is wrong in it. What is wrong ends where the albedo that the photograph shows goes on as it is around the place. Gaps in it that are
//! narrower than those windows are of it: there is not enough in them to tell by, or the photograph shows nothing there.

use std::collections::BTreeSet;

use crate::audit::likelihood::agreement::{Unlike, widest};
use crate::audit::picture::regions::{Region, Segments, bounds, closed, dilated, filled, opened};
use crate::audit::view::Observations;
use crate::statistics::quantile;

/// What stands out does so more than this share of what is around its place.
const STANDS_OUT: f64 = 0.9;

/// Places that are unlike the model, and how far each pixel is from what is around them.
pub(crate) struct Places<'a> {
    pub(crate) unlike: &'a Unlike,
    mask: &'a [bool],
    width: usize,
    /// How far the albedo that the photograph shows, over the model's, is from what it is around the places on the same surface: squared
    /// lengths in units of what it differs by within pieces. NaN where it cannot be told.
    apart: Vec<f32>,
}

impl<'a> Places<'a> {
    /// Those of a mask.
    pub(crate) fn new(observed: &Observations, unlike: &'a Unlike, mask: &'a [bool]) -> Self {
        let (s, t) = (&observed.surfaces, &observed.texture);
        let around: Vec<f32> = (0..mask.len()).map(|i| if t.tested[i] && !mask[i] { 1.0 } else { 0.0 }).collect();
        let known = s.shape.smoothed(&around, widest());
        let usual = s.shape.mean_colour_with(&t.ratio, &around, &known, widest());
        let apart = |i: usize| (t.unit * (t.ratio[i] - usual[i])).length_squared();
        let apart = (0..mask.len()).map(|i| if t.tested[i] { apart(i) } else { f32::NAN }).collect();
        Self { unlike, mask, width: s.width, apart }
    }

    /// What of a place stands out more than nearly all that is around it, with all that it encloses. It is the whole place where less than
    /// `least` pixels do, as where only the edges of a picture are beside their places, or where nothing is known around it.
    pub(crate) fn extent(&self, place: &Region, least: usize) -> Region {
        let cut = Cut::around(&place.pixels, self.width, self.apart.len() / self.width);
        let inside = cut.mask(place.pixels.iter().copied());
        let ring = dilated(&inside, cut.width, cut.height, widest() as usize);
        let mut beside: Vec<f32> =
            cut.set(&ring).filter(|i| !self.mask[*i]).map(|i| self.apart[i]).filter(|a| a.is_finite()).collect();
        let usual = quantile(&mut beside, STANDS_OUT).unwrap_or(f32::INFINITY);
        let out = cut.mask(place.pixels.iter().copied().filter(|i| self.apart[*i] > usual));
        let whole = opened(&filled(&closed(&out, cut.width, cut.height, 2), cut.width), cut.width, cut.height, 1);
        let pixels: Vec<usize> = place.pixels.iter().copied().filter(|i| whole[cut.at(*i)]).collect();
        if pixels.len() < least { place.clone() } else { Region { pixels } }
    }
}

/// A region of a picture so wide with its gaps that are narrower than the widest windows, a standard deviation either way, on the pieces
/// of surface that it lies on.
pub(crate) fn without_gaps(region: &Region, segments: &Segments, width: usize) -> Region {
    let of: BTreeSet<u32> = region.pixels.iter().map(|i| segments.of[*i]).collect();
    let cut = Cut::around(&region.pixels, width, segments.of.len() / width);
    let own = cut.mask(region.pixels.iter().copied());
    let whole = closed(&own, cut.width, cut.height, widest() as usize);
    let pixels = cut.set(&whole).filter(|i| of.contains(&segments.of[*i])).collect();
    Region { pixels }
}

/// A piece of a picture around some pixels, as far as they were told over windows, beyond the picture, too.
struct Cut {
    /// Columns and rows of the picture before its own first ones; negative where it begins before the picture.
    left: isize,
    top: isize,
    width: usize,
    height: usize,
    picture: [usize; 2],
}

impl Cut {
    fn around(pixels: &[usize], width: usize, height: usize) -> Self {
        let [left, top, right, bottom] = bounds(pixels, width);
        let margin = widest() as usize + 1;
        let [left, top, right, bottom] = [left, top, right + 2 * margin, bottom + 2 * margin];
        let before = |side: usize| side as isize - margin as isize;
        Self {
            left: before(left),
            top: before(top),
            width: right - left,
            height: bottom - top,
            picture: [width, height],
        }
    }

    /// Where one of the picture's pixels is in it.
    fn at(&self, i: usize) -> usize {
        let [x, y] = [(i % self.picture[0]) as isize - self.left, (i / self.picture[0]) as isize - self.top];
        y as usize * self.width + x as usize
    }

    /// Which of the picture's pixels are set in one of its masks, in order.
    fn set<'a>(&'a self, mask: &'a [bool]) -> impl Iterator<Item = usize> + 'a {
        let [width, height] = self.picture;
        let of = move |k: usize| {
            let x = (k % self.width).checked_add_signed(self.left).filter(|x| *x < width)?;
            let y = (k / self.width).checked_add_signed(self.top).filter(|y| *y < height)?;
            Some(y * width + x)
        };
        (0..mask.len()).filter(|k| mask[*k]).filter_map(of)
    }

    fn mask(&self, pixels: impl Iterator<Item = usize>) -> Vec<bool> {
        let mut mask = vec![false; self.width * self.height];
        pixels.for_each(|i| mask[self.at(i)] = true);
        mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 80;

    fn square(low: usize, high: usize) -> Vec<bool> {
        let within = |v: usize| (low..high).contains(&v);
        (0..SIDE * SIDE).map(|i| within(i % SIDE) && within(i / SIDE)).collect()
    }

    fn region(mask: &[bool]) -> Region {
        Region { pixels: (0..mask.len()).filter(|i| mask[*i]).collect() }
    }

    #[test]
    fn gaps_narrower_than_the_windows_are_closed_on_the_surfaces_that_a_region_lies_on() {
        // two surfaces side by side; the region has two strips on the left one, and touches nothing of the right one
        let of: Vec<u32> = (0..SIDE * SIDE).map(|i| u32::from(i % SIDE >= 50)).collect();
        let segments = Segments { pixels: crate::components::members(&of), of };
        let strips = |apart: usize| {
            let on = |i: usize| {
                (10..50).contains(&(i % SIDE))
                    && [20..24, 24 + apart..28 + apart].iter().any(|y| y.contains(&(i / SIDE)))
            };
            Region { pixels: (0..SIDE * SIDE).filter(|i| on(*i)).collect() }
        };
        let whole = without_gaps(&strips(10), &segments, SIDE);
        let within = |y: usize| whole.pixels.iter().filter(|i| **i / SIDE == y).count();
        assert!(
            whole.pixels.is_sorted()
                && whole.pixels.iter().all(|i| segments.of[*i] == 0 && (20..38).contains(&(i / SIDE)))
        );
        assert!((20..38).all(|y| within(y) >= 30), "{:?}", (20..38).map(within).collect::<Vec<_>>());
        // a wide gap is none
        assert_eq!(without_gaps(&strips(40), &segments, SIDE), strips(40));
    }

    #[test]
    fn a_thing_reaches_as_far_as_its_outline_and_holds_what_it_encloses() {
        let (place, thing, within) = (square(20, 60), square(28, 50), square(35, 43));
        let unlike = Unlike::default();
        let usual = |i: usize| (i * 7919 % 997) as f32 / 997.0;
        let of = |thing: &dyn Fn(usize) -> bool| -> Vec<f32> {
            (0..SIDE * SIDE).map(|i| if thing(i) { 50.0 + usual(i) } else { usual(i) }).collect()
        };
        // a frame, within which the wall is as it is around
        let places = Places { unlike: &unlike, mask: &place, width: SIDE, apart: of(&|i| thing[i] && !within[i]) };
        let extent = places.extent(&region(&place), 30);
        // all of it, and of the wall no more than stands out around the place, too
        let both = extent.pixels.iter().filter(|i| thing[**i]).count();
        let (whole, wall) = (region(&thing).pixels.len(), region(&place).pixels.len() - region(&thing).pixels.len());
        let beside = extent.pixels.len() - both;
        assert!(both == whole && 8 * beside < wall, "{both} of {whole}, {beside} of {wall}");
        // it is too small to be all that is meant
        assert_eq!(places.extent(&region(&place), 1000), region(&place));
        // nothing is known of what is around it
        let places = Places { apart: vec![f32::NAN; SIDE * SIDE], ..places };
        assert_eq!(places.extent(&region(&place), 30), region(&place));
    }
}
