//! How far something reaches in a place that is unlike the model.
//!
//! How unlike a place is, is told over windows as wide as the structures that are compared, so that such a place is larger than what
//! is wrong in it. What is wrong ends where the albedo that the photograph shows goes on as it is around the place.

use crate::audit::likelihood::agreement::{Unlike, widest};
use crate::audit::picture::regions::{Region, closed, dilated, filled, mask_of, opened};
use crate::audit::view::Observations;
use crate::statistics::quantile;

/// What stands out does so more than this share of what is around its place.
const STANDS_OUT: f64 = 0.9;

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

    /// What of a place stands out from what is around it, with all that it encloses; the whole place where that is too small a share
    /// of it or less than `least` pixels, as where only the edges of a picture are beside their places, or where nothing is known around it.
    pub(crate) fn extent(&self, place: &Region, least: usize) -> Region {
        let (w, h) = (self.width, self.apart.len() / self.width);
        let inside = mask_of(&place.pixels, self.apart.len());
        let ring = dilated(&inside, w, h, widest() as usize);
        let beside = (0..inside.len()).filter(|i| ring[*i] && !self.mask[*i]).map(|i| self.apart[i]);
        let mut beside: Vec<f32> = beside.filter(|a| a.is_finite()).collect();
        let usual = quantile(&mut beside, STANDS_OUT).unwrap_or(f32::INFINITY);
        let out: Vec<bool> = (0..inside.len()).map(|i| inside[i] && self.apart[i] > usual).collect();
        let whole = opened(&filled(&closed(&out, w, h, 2), w), w, h, 1);
        let pixels: Vec<usize> = place.pixels.iter().copied().filter(|i| whole[*i]).collect();
        if pixels.len() < least.max((LEAST * place.pixels.len() as f32) as usize) {
            place.clone()
        } else {
            Region { pixels }
        }
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
    fn a_thing_reaches_as_far_as_it_stands_out_and_holds_what_it_encloses() {
        let (place, thing, within) = (square(20, 60), square(28, 50), square(35, 43));
        let unlike = Unlike::default();
        let usual = |i: usize| (i * 7919 % 997) as f32 / 997.0;
        let of = |thing: &dyn Fn(usize) -> bool| -> Vec<f32> {
            (0..SIDE * SIDE).map(|i| if thing(i) { 50.0 } else { usual(i) }).collect()
        };
        // a frame, within which the wall is as it is around
        let places = Places { unlike: &unlike, mask: &place, width: SIDE, apart: of(&|i| thing[i] && !within[i]) };
        let extent = places.extent(&region(&place), 30).pixels;
        let both = extent.iter().filter(|i| thing[**i]).count();
        // some of what is usual stands out, too
        assert!(both == region(&thing).pixels.len() && extent.len() * 3 < both * 4, "{} of {both}", extent.len());
        // too little stands out
        let places = Places { apart: of(&|_| false), ..places };
        assert_eq!(places.extent(&region(&place), 200), region(&place));
        // nothing is known around it
        let places = Places { apart: vec![f32::NAN; SIDE * SIDE], ..places };
        assert_eq!(places.extent(&region(&place), 30), region(&place));
    }
}
