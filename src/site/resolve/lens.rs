//! The lens keys that `[[view]]` and `[[probe]]` share.

use glam::DVec2;
use std::ops::Range;
use toml::Spanned;

use super::super::fault::SiteError;
use super::super::file::{LensKeys, Number};
use super::super::pose::finite_number;
use super::Resolver;
use crate::panorama::{CameraModel, Distortion, Lens};

impl LensKeys<'_> {
    /// Where the first key is that only a calibrated lens has.
    pub(super) fn calibrated(&self) -> Option<Range<usize>> {
        let all = self.focal.iter().chain(&self.centre).chain(&self.radial).chain(&self.tangential);
        all.filter_map(|key| key.as_ref().map(Spanned::span)).min_by_key(|at| at.start)
    }

    /// Whether nothing tells how wide the lens sees.
    pub(super) fn of_unknown_width(&self) -> bool {
        self.fov_y.is_none() && self.focal[0].is_none() && self.focal[1].is_none()
    }
}

impl Resolver<'_> {
    /// The lens before a picture of `size`; `at` is the table of the `what` (view, probe) that has it. Without any width
    /// its field of view is 60° where it is still to be `solved` for, else that is a fault.
    pub(super) fn camera_model(
        &self,
        keys: &LensKeys,
        size: [u32; 2],
        lens: Lens,
        solved: bool,
        (what, at): (&str, Range<usize>),
    ) -> Result<CameraModel, SiteError> {
        let pixels = |key: &Option<Number>, default: f64, positive: bool| match key {
            None => Ok(default),
            Some(v) if positive => self.number(v, |v| v > 0.0, "a focal length in pixels above zero"),
            Some(v) => finite_number(&self.source, v),
        };
        let [fx, fy] = keys.focal;
        let mut model = CameraModel::with_fov(size, 60.0);
        match (keys.fov_y, fx, fy) {
            (Some(fov), None, None) if lens == Lens::Fisheye => {
                let fov =
                    self.number(fov, |v| v > 0.0 && v <= 360.0, "a field of view above 0, at most 360 degrees")?;
                model.focal = DVec2::splat(f64::from(size[1]) / fov.to_radians());
            }
            (Some(fov), None, None) => model = CameraModel::with_fov(size, self.field_of_view(fov)?),
            (None, None, None) if solved => {}
            (None, None, None) => {
                return Err(self.source.fault(
                    at,
                    format!("the {what} has neither fov_y nor fx"),
                    "Add fov_y in degrees, or fx (and fy, cx, cy) in pixels",
                ));
            }
            (Some(fov), _, _) => {
                return Err(self.source.fault(
                    fov.span(),
                    format!("the {what} has both fov_y and a focal length"),
                    "Keep one of them",
                ));
            }
            (None, fx, fy) => {
                let x = pixels(if fx.is_some() { fx } else { fy }, 0.0, true)?;
                model.focal = DVec2::new(x, pixels(fy, x, true)?);
            }
        }
        let [cx, cy] = keys.centre;
        model.centre = DVec2::new(pixels(cx, model.centre.x, false)?, pixels(cy, model.centre.y, false)?);
        let term = |key| pixels(key, 0.0, false);
        let [k1, k2, k3, k4] = keys.radial;
        let [p1, p2] = keys.tangential;
        model.distortion = Distortion::brown([term(k1)?, term(k2)?, term(k3)?, term(k4)?], [term(p1)?, term(p2)?]);
        model.lens = lens;
        Ok(model)
    }
}
