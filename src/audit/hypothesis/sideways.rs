//! Parts of the model that stand beside their place: their outlines are in the photograph, but shifted.
//!
//! Near an outline no probe can be asked, since it sees past it, and a sideways move leaves the surface in its own plane.
//! But the outline itself is an edge of render and photograph alike. So each part's outline is laid over the photograph at
//! small shifts, and compared by correlation where it is with the place where it fits best. How much such a shift says is
//! fitted (`decide/odds.rs`).

use rayon::prelude::*;

use crate::audit::finding::Shift;
use crate::audit::hypothesis::silhouette::{FOUND, Fit, Small, registration};
use crate::audit::picture::FEWEST;
use crate::audit::view::{AuditScene, Observations};

/// A part larger than this share of the picture is its room.
pub(crate) const LARGEST: f32 = 0.35;

/// A part whose outline the photograph shows elsewhere.
pub(crate) struct Shifted {
    /// Its number.
    pub(crate) part: u32,
    /// The part's pixels and those that it is shifted to, in order.
    pub(crate) pixels: Vec<usize>,
    /// Where it really stands, as far as the photograph shows it.
    pub(crate) shift: Shift,
    /// Logarithm of the odds against the model's place.
    pub(crate) odds: f32,
}

/// Looks for parts whose outlines are shifted against the others'.
pub(crate) fn shifted(prepared: &AuditScene, observed: &Observations) -> Vec<Shifted> {
    let small = Small::new(prepared, observed);
    let members = small.members();
    let largest = (LARGEST * small.part.len() as f32) as usize;
    let thing = |m: &&Vec<usize>| (FEWEST..=largest).contains(&m.len());
    let fits = members.par_iter().filter(thing).filter_map(|m| small.fit(m));
    let fits: Vec<Fit> = fits.filter(|f| f.best >= FOUND).collect();
    let (common, least) = registration(&fits.iter().map(|f| f.shift).collect::<Vec<_>>());
    let beside = |f: &&Fit| (f.shift[0] - common[0]).hypot(f.shift[1] - common[1]) > least && f.odds > 0.0;
    let parts = fits.iter().filter(beside).map(|f| whole(&small, observed, f));
    parts.filter(|p| p.shift.words().1 > observed.placement.usual_m(&p.pixels).into()).collect()
}

/// The part at the audit's size.
fn whole(small: &Small, observed: &Observations, fit: &Fit) -> Shifted {
    let mut pixels = small.at_full_size(observed, fit.members, [0, 0]);
    pixels.extend(small.at_full_size(observed, fit.members, fit.shift.map(|d| d.round() as isize)));
    pixels.sort_unstable();
    pixels.dedup();
    let distance = fit.members.iter().map(|i| small.distance[*i]).sum::<f32>() / fit.members.len() as f32;
    let [right_m, down_m] = fit.shift.map(|d| f64::from(d * small.by as f32 * distance / observed.surfaces.focal));
    Shifted { part: small.part[fit.members[0]], pixels, shift: Shift { right_m, down_m }, odds: fit.odds }
}
