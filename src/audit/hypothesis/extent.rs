//! How far something reaches in a place that is unlike the model.
//!
//! How unlike a place is, is told over windows as wide as the structures that are compared, so that such a place is larger than what
//! is wrong in it. What is wrong ends where the albedo that the photograph shows goes on as it is around the place.

use crate::audit::likelihood::agreement::{Unlike, widest};
use crate::audit::picture::regions::{Region, bounds, closed, dilated, filled, opened};
use crate::audit::view::Observations;
use crate::statistics::quantile;

/// What stands out does so more than this share of what is around its place.
const STANDS_OUT: f64 = 0.9;

/// Level lines cut the pixels of a place into so many parts of one size.
const LEVELS: u8 = 8;

/// The share of the steepest outline's step from which on a wider one is preferred.
const STEEP: f32 = 0.7;

/// Where less than this share of a place stands out, all of it is meant.
const LEAST: f32 = 0.25;

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

    /// What of a place stands out from what is around it, with all that it encloses, and how much its steepest outline steps; `outline` tells
    /// that of some pixels. It is what stands out more than nearly all that is around. But where another level line of how far it
    /// stands out is much steeper, it is the widest nearly as steep as the steepest: people see things as bounded by such lines
    /// (Desolneux, Moisan and Morel, *Edge detection by Helmholtz principle*, 2001). It is the whole place where too small a share of it, or
    /// less than `least` pixels, stand out, as where only the edges of a picture are beside their places, or where nothing is known around it.
    pub(crate) fn extent(&self, place: &Region, least: usize, outline: impl Fn(&[usize]) -> f32) -> (Region, f32) {
        let cut = Cut::around(&place.pixels, self.width, self.apart.len() / self.width);
        let least = least.max((LEAST * place.pixels.len() as f32) as usize);
        let over = |level: f32| {
            let out = cut.mask(place.pixels.iter().copied().filter(|i| self.apart[*i] > level));
            let whole = opened(&filled(&closed(&out, cut.width, cut.height, 2), cut.width), cut.width, cut.height, 1);
            let pixels: Vec<usize> = place.pixels.iter().copied().filter(|i| whole[cut.at(*i)]).collect();
            (pixels.len() >= least).then(|| (outline(&pixels), Region { pixels }))
        };
        let inside = cut.mask(place.pixels.iter().copied());
        let ring = dilated(&inside, cut.width, cut.height, widest() as usize);
        let beside = (0..ring.len()).filter(|k| ring[*k]).map(|k| cut.of(k)).filter(|i| !self.mask[*i]);
        let usual = quantile(&mut self.known(beside), STANDS_OUT).unwrap_or(f32::INFINITY);
        let first = over(usual).unwrap_or_else(|| (outline(&place.pixels), place.clone()));
        let mut apart = self.known(place.pixels.iter().copied());
        let levels = (1..LEVELS).filter_map(|k| quantile(&mut apart, f64::from(k) / f64::from(LEVELS)));
        let mut all: Vec<(f32, Region)> = std::iter::once(first).chain(levels.map_while(over)).collect();
        let most = all.iter().map(|(step, _)| *step).fold(0.0, f32::max);
        let at = all.iter().position(|(step, _)| *step >= STEEP * most).unwrap_or(0);
        (all.swap_remove(at).1, most)
    }

    /// How far those of some pixels stand out of which it is known.
    fn known(&self, pixels: impl Iterator<Item = usize>) -> Vec<f32> {
        pixels.map(|i| self.apart[i]).filter(|a| a.is_finite()).collect()
    }
}

/// A piece cut out of a picture.
struct Cut {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
    /// Width of the picture.
    picture: usize,
}

impl Cut {
    /// Some pixels of a picture and what is around them, as far as they were told over windows.
    fn around(pixels: &[usize], width: usize, height: usize) -> Self {
        let [left, top, right, bottom] = bounds(pixels, width);
        let margin = widest() as usize + 1;
        let [left, top] = [left, top].map(|side| side.saturating_sub(margin));
        let [right, bottom] = [(right + margin).min(width), (bottom + margin).min(height)];
        Self { left, top, width: right - left, height: bottom - top, picture: width }
    }

    /// Where one of the picture's pixels is in it.
    fn at(&self, i: usize) -> usize {
        (i / self.picture - self.top) * self.width + i % self.picture - self.left
    }

    /// Which of the picture's pixels one of its own is.
    fn of(&self, k: usize) -> usize {
        (k / self.width + self.top) * self.picture + k % self.width + self.left
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
    use crate::audit::likelihood::step::{Place, border};
    use crate::audit::picture::regions::mask_of;

    const SIDE: usize = 80;

    fn square(low: usize, high: usize) -> Vec<bool> {
        let within = |v: usize| (low..high).contains(&v);
        (0..SIDE * SIDE).map(|i| within(i % SIDE) && within(i / SIDE)).collect()
    }

    fn region(mask: &[bool]) -> Region {
        Region { pixels: (0..mask.len()).filter(|i| mask[*i]).collect() }
    }

    #[test]
    fn a_thing_reaches_as_far_as_its_outline_and_holds_what_it_encloses() {
        let (place, thing, within) = (square(20, 60), square(28, 50), square(35, 43));
        let unlike = Unlike::default();
        let usual = |i: usize| (i * 7919 % 997) as f32 / 997.0;
        let of = |thing: &dyn Fn(usize) -> bool| -> Vec<f32> {
            (0..SIDE * SIDE).map(|i| if thing(i) { 50.0 + usual(i) } else { usual(i) }).collect()
        };
        // the share of an outline that is the thing's
        let outline = |pixels: &[usize]| {
            let mask = mask_of(pixels, SIDE * SIDE);
            let inside = |i: usize| mask[i];
            let own = |p: Place| thing[p.last] != thing[p.next];
            let all: Vec<bool> = border([SIDE, SIDE], pixels, &inside).map(own).collect();
            all.iter().filter(|own| **own).count() as f32 / all.len() as f32
        };
        // a frame, within which the wall is as it is around
        let places = Places { unlike: &unlike, mask: &place, width: SIDE, apart: of(&|i| thing[i] && !within[i]) };
        let (extent, step) = places.extent(&region(&place), 30, outline);
        // all of it but for its corners
        let both = extent.pixels.iter().filter(|i| thing[**i]).count();
        let whole = region(&thing).pixels.len();
        assert!(both == extent.pixels.len() && both * 20 > whole * 19 && step > 0.7, "{both} of {whole}, {step}");
        // it is too small a share of the place for being all that is meant
        assert_eq!(places.extent(&region(&place), 1000, outline).0, region(&place));
        // nothing is known of what is around it
        let places = Places { apart: vec![f32::NAN; SIDE * SIDE], ..places };
        assert_eq!(places.extent(&region(&place), 30, outline).0, region(&place));
    }
}
