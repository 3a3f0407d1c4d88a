//! Light on points as rendering finds it, to hold products against.

use clerestory::render::{Irradiance, Relit, Source};
use clerestory::transfer::{LOT, Point};
use clerestory::volume::Nearby;
use glam::Vec3;
use rayon::prelude::*;

/// Irradiance as rendering finds it, and where it comes from.
pub(crate) fn direct(relit: &Relit, points: &[Point]) -> Vec<(Vec3, Source)> {
    let lot = |points: &[Point]| {
        let mut near = Nearby::default();
        let one = |&(p, n): &Point| {
            let lit = relit.lit(p, n, &mut near);
            let shaded = lit.needs_shadow_ray && !relit.in_sun(p, n);
            if shaded { (lit.shade, lit.shade_source) } else { (lit.sun, lit.source) }
        };
        points.iter().map(one).collect::<Vec<_>>()
    };
    points.par_chunks(LOT).flat_map_iter(lot).collect()
}
