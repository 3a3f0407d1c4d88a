//! Occluding contours: where a thing ends before what lies behind it, a photograph shows a step; where the photograph goes on over
//! the contours of a part of the model, the part is not there.
//!
//! What a contour steps by is foretold from the albedo on its two sides, with and without the irradiance.

use glam::Vec3;
use rayon::prelude::*;

use crate::audit::hypothesis::borders::odds;
use crate::audit::hypothesis::sideways::LARGEST;
use crate::audit::likelihood::noise::EVERY;
use crate::audit::likelihood::step::{ASIDE, BESIDE, Place, border};
use crate::audit::picture::FEWEST;
use crate::audit::picture::regions::mask_of;
use crate::audit::view::{AuditScene, Observations};
use crate::components::members;
use crate::statistics::median;

/// A part of the model over whose contours the photograph may go on.
pub(crate) struct Absent {
    pub(crate) pixels: Vec<usize>,
    /// Logarithm of how much likelier it is that the photograph goes on than that it shows the contours, times the share of them that
    /// tells.
    pub(crate) odds: f32,
}

/// All parts with contours of which enough tells, and how likely the photograph goes on over these.
pub(crate) fn absent(prepared: &AuditScene, observed: &Observations, least: usize) -> Vec<Absent> {
    let parts: Vec<u32> = observed.surfaces.triangle.iter().map(|t| prepared.part(*t)).collect();
    let largest = (LARGEST * parts.len() as f32) as usize;
    let things = members(&parts).into_par_iter().filter(|p| (least..=largest).contains(&p.len()));
    let known_m = outlines_known_to(prepared, observed);
    things.filter_map(|pixels| Some(Absent { odds: observed.no_contour(&pixels, known_m)?, pixels })).collect()
}

/// Metres to which outlines of the model are known: half of what lies between a scan's vertices, 0 of what was modelled.
fn outlines_known_to(prepared: &AuditScene, observed: &Observations) -> f32 {
    let some = observed.surfaces.triangle.iter().step_by(EVERY);
    0.5 * median(some.filter_map(|t| prepared.vertex_spacing(*t))).unwrap_or(0.0)
}

impl Observations {
    /// Logarithm of how much likelier it is that the photograph goes on over the contours of some pixels than that it shows the model's,
    /// times the share of these that tells; `None` where too few do.
    fn no_contour(&self, pixels: &[usize], known_m: f32) -> Option<f32> {
        let s = &self.surfaces;
        let mask = mask_of(pixels, self.albedo.len());
        let inside = |i: usize| mask[i];
        // what is behind may touch it
        let behind = |i: usize, j: usize| s.distance[j] > (1.0 - BESIDE) * s.distance[i];
        let contour: Vec<Place> =
            border([s.width, s.height], pixels, &inside).filter(|p| behind(p.last, p.next)).collect();
        let lit = |i: usize| self.shows(i) && self.irradiance[i].min_element() > 0.0;
        let of = |p: &Place| {
            let (i, j) = (p.own?, p.other.filter(|j| behind(p.last, *j))?);
            // of a near thing in a scan the contour may not lie between the two
            let known = known_m * s.focal <= ASIDE as f32 * s.distance[i];
            // what lies flat on another surface is paint
            let told = known && lit(i) && lit(j) && !s.coplanar(i, j);
            let photo = self.log_photo[i] - self.log_photo[j];
            let paint = self.texture.paint[i] - self.texture.paint[j];
            let light = (self.irradiance[i] / self.irradiance[j]).map(f32::ln);
            // light that is not as foretold is no thing that is absent: its paint must tell as well
            let against = |model: Vec3| odds([model, photo].map(|step| self.texture.unit * step));
            told.then(|| against(paint).min(against(paint + light)))
        };
        let all: Vec<f32> = contour.iter().filter_map(of).collect();
        let told = all.len() as f32 / contour.len() as f32;
        if all.len() < FEWEST { None } else { Some(told * median(all)?) }
    }
}
