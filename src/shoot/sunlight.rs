//! Which cells the sun shines on, where its direction is known.
//!
//! The edge of a sun patch is far sharper than a probe's pixels. Records on either side of it are kept apart, so that
//! neither bleeds into the other; where a rendered point has both kinds around, one shadow ray decides which it takes.

use glam::Vec3;
use rayon::prelude::*;
use std::sync::Arc;

use super::hits::{Hits, Sunlit, split_rows, unpack_normal};
use crate::scene::{Occluder, Ray, Scene};

/// Whether the sun (unit direction towards it) reaches a point of a surface with this normal (on either side).
pub fn reaches(scene: &Scene, point: Vec3, normal: Vec3, sun: Vec3) -> bool {
    reaches_past(&mut Occluder::default(), scene, point, normal, sun)
}

/// The same for one of many points that follow each other, asking first what shaded the last of them.
fn reaches_past(last: &mut Occluder, scene: &Scene, point: Vec3, normal: Vec3, sun: Vec3) -> bool {
    let origin = point + normal * (1e-4 + 1e-5 * point.abs().max_element());
    let ray = Ray { origin, direction: sun };
    normal.dot(sun) > 0.0 && !scene.tracer.occluded_again(&ray, 1e-4, f32::INFINITY, last)
}

impl Hits {
    /// Which cells the sun shines on. Casts rays for the first direction asked for only.
    pub(super) fn sunlit(&self, scene: &Scene, sun: Vec3) -> Arc<[Sunlit]> {
        let find = || sunlit(scene, self, sun).into();
        let (first, sunlit) = self.sunlit.get_or_init(|| (sun, find()));
        if *first == sun { sunlit.clone() } else { find() }
    }
}

/// The sun's reach for each cell.
fn sunlit(scene: &Scene, hits: &Hits, sun: Vec3) -> Vec<Sunlit> {
    let chart = &hits.chart;
    let to_world = hits.to_probe.transpose();
    let reaches_along = |last: &mut Occluder, i: usize, d: Vec3| {
        let cell = &hits.cells[i];
        let normal = unpack_normal(cell.normal);
        if normal.dot(sun) <= 0.0 {
            return false;
        }
        let d = to_world * d;
        let along = normal.dot(d);
        // the plane may be left behind past a grazing cell's corner
        along < -1e-3 && reaches_past(last, scene, hits.origin + d * (cell.plane / along), normal, sun)
    };
    let mut centres = vec![false; chart.len()];
    split_rows(chart, &mut centres).into_par_iter().for_each(|(row, centres)| {
        let (first, middle) = (chart.row(row).start, chart.middles(row));
        let mut last = Occluder::default();
        for (x, centre) in centres.iter_mut().enumerate() {
            *centre = hits.cells[first + x].is_hit() && reaches_along(&mut last, first + x, middle(x));
        }
    });
    let mut sunlit = vec![Sunlit::No; chart.len()];
    split_rows(chart, &mut sunlit).into_par_iter().for_each(|(row, sunlit)| {
        let first = chart.row(row).start;
        let mut last = Occluder::default();
        for (x, sunlit) in sunlit.iter_mut().enumerate() {
            let i = first + x;
            let here = centres[i];
            let even = || hits.neighbours(row, x).all(|j| centres[j] == here);
            let place = |(dx, dy): (f32, f32)| chart.direction(row, x as f32 + dx, row as f32 + dy);
            let mut corners = chart.corners().into_iter();
            *sunlit = match hits.cells[i].is_hit() && !even() {
                true if !corners.all(|corner| reaches_along(&mut last, i, place(corner)) == here) => Sunlit::Partly,
                _ if here => Sunlit::Yes,
                _ => Sunlit::No,
            };
        }
    });
    sunlit
}
