//! A view's findings and doubts, before they have numbers, and what is needed to compare them with other views'.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::audit::decide::false_alarms::Field;
use crate::audit::decide::odds;
use crate::audit::finding::{AuditedView, Finding};
use crate::audit::likelihood::agreement::near;
use crate::audit::likelihood::step::BESIDE;
use crate::audit::picture::regions::mask_of;
use crate::audit::verdict::Verdict;
use crate::audit::view::Settings;
use crate::site::Camera;

/// A view with its findings and doubts, before they have numbers.
pub(crate) struct Assessed {
    pub(crate) view: AuditedView,
    pub(crate) field: Field,
    /// What each pixel adds by itself to the logarithm of the odds of a fault.
    pub(crate) own: Vec<f32>,
    pub(crate) eye: Eye,
    pub(crate) found: Vec<Found>,
}

/// A finding or doubt, and its pixels.
pub(crate) struct Found {
    pub(crate) finding: Finding,
    pub(crate) pixels: Vec<usize>,
    /// Mean of the modelled surface's normals, of length 1.
    pub(crate) normal: Vec3,
    /// Logarithm of the odds of a fault.
    pub(crate) log_odds: f32,
    /// The part of the model whose outline told it, and the logarithm of the odds against its place.
    pub(crate) part: Option<(u32, f32)>,
}

impl Assessed {
    /// Per pixel, whether it is found right: tested, and in no region that may be a fault.
    pub(crate) fn right(&self) -> Vec<bool> {
        let mut right: Vec<bool> = self.view.verdicts.iter().map(|v| *v == Verdict::Ok).collect();
        let least = Settings::default().least_probability;
        for f in self.found.iter().filter(|f| odds::probability(f.log_odds) >= least) {
            f.pixels.iter().for_each(|i| right[*i] = false);
        }
        right
    }
}

impl Found {
    /// Adds another part of the same thing, as its view shows it.
    pub(crate) fn join(&mut self, part: Self, eye: &Eye) {
        let (whole, part, pixels) = (&mut self.finding, part.finding, part.pixels);
        let area = whole.area_cm2 + part.area_cm2;
        let share = if area > 0.0 { part.area_cm2 / area } else { 0.5 };
        whole.position = DVec3::from(whole.position).lerp(part.position.into(), share).to_array();
        whole.area_cm2 = area;
        self.pixels.extend(pixels);
        self.pixels.sort_unstable();
        self.pixels.dedup();
        let on_surface = self.pixels.iter().filter(|i| eye.distance[**i].is_finite()).map(|i| eye.position[*i]);
        let (low, high) = on_surface.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        whole.size_m = whole.size_m.max((high - low).max_element().into());
    }
}

/// What of a view is needed to ask what it shows of a place.
pub(crate) struct Eye {
    pub(crate) camera: Camera,
    /// Of the program's axes, as the model's own are.
    pub(crate) origin: DVec3,
    /// Each pixel's modelled place, and its distance, metres; infinite without a surface.
    pub(crate) position: Vec<Vec3>,
    pub(crate) distance: Vec<f32>,
}

impl Eye {
    /// The pixel where a place would be, and its distance as a share of the modelled surface's there.
    fn project(&self, point: Vec3) -> Option<(usize, f32)> {
        let place = point.as_dvec3() + self.origin;
        let at = self.camera.project(place)?;
        let (w, h) = (self.camera.width as usize, self.camera.height as usize);
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < w as f64 && at.y < h as f64;
        let i = inside.then(|| at.y as usize * w + at.x as usize)?;
        Some((i, place.distance(self.camera.pose.position) as f32 / self.distance[i]))
    }

    /// The pixel that shows a place on a modelled surface.
    pub(crate) fn on(&self, point: Vec3) -> Option<usize> {
        self.project(point).filter(|(_, share)| (share - 1.0).abs() <= BESIDE).map(|(i, _)| i)
    }

    /// The pixel that would show a place before the modelled surface.
    pub(crate) fn before(&self, point: Vec3) -> Option<usize> {
        self.project(point).filter(|(_, share)| *share < 1.0 - BESIDE).map(|(i, _)| i)
    }

    /// Per pixel, whether it is one of some or no farther off than the widest windows that regions are told over.
    pub(crate) fn near(&self, pixels: &[usize]) -> Vec<bool> {
        near(pixels, self.camera.width as usize, self.distance.len())
    }

    /// Whether a pixel shows a modelled surface that another view shows inside a mask.
    pub(crate) fn shows_inside(&self, i: usize, other: &Self, inside: &[bool]) -> bool {
        self.distance[i].is_finite() && other.on(self.position[i]).is_some_and(|j| inside[j])
    }

    /// Per pixel, whether it shows a modelled surface that another view shows in some of its pixels.
    pub(crate) fn showing(&self, other: &Self, pixels: &[usize]) -> Vec<bool> {
        let inside = mask_of(pixels, other.distance.len());
        (0..self.distance.len()).into_par_iter().map(|i| self.shows_inside(i, other, &inside)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::Pose;

    #[test]
    fn a_place_before_or_behind_a_surface_is_not_on_it() {
        let pose = Pose::look_at(DVec3::ZERO, DVec3::Y);
        let eye = Eye {
            camera: Camera::with_fov(pose, 8, 8, 60.0),
            origin: DVec3::ZERO,
            position: vec![],
            distance: vec![4.0; 64],
        };
        assert_eq!((eye.on(Vec3::new(0.05, 4.0, -0.05)), eye.on(Vec3::new(0.05, 2.0, -0.05))), (Some(36), None));
        assert_eq!(eye.on(Vec3::new(0.0, -4.0, 0.0)), None);
    }
}
