//! `[[view]]` tables.

use glam::DVec2;
use std::path::Path;
use toml::Spanned;

use super::super::camera::Camera;
use super::super::fault::SiteError;
use super::super::file::{MatchTable, ViewTable};
use super::super::frame::Pose;
use super::super::lens::Distortion;
use super::super::pose::{Orientation, finite, finite_number};
use super::super::{Match, UnposedView, View};
use super::Resolver;
use super::names::safe_name;
use super::picture::ASPECT_TOLERANCE;

/// A view whose pose is known, or is yet to be found.
pub(super) enum Posed {
    View(View),
    Not(UnposedView),
}

impl Resolver<'_> {
    pub(super) fn view(&self, table: &Spanned<ViewTable>) -> Result<Posed, SiteError> {
        let t = table.get_ref();
        safe_name(&self.source, &t.name, "view")?;
        let name = t.name.get_ref().clone();
        let file = |key: &Option<Spanned<String>>, what: &str| {
            key.as_ref().map(|k| self.existing(k.get_ref(), k.span(), what)).transpose()
        };
        let photo = match t.photo.as_ref().and_then(|k| self.to_be_made(k.get_ref())) {
            Some(path) => Some(path),
            None => file(&t.photo, "the photograph")?,
        };
        let mask = file(&t.mask, "the mask")?;
        let [width, height] = self.picture_size_of(table, photo.as_deref(), mask.as_deref())?;
        let matches = self.matches(t, width, height)?;
        let Some(position) = &t.position else {
            if matches.len() >= 4 {
                return Ok(Posed::Not(UnposedView { name, size: [width, height], matches, photo, mask }));
            }
            return Err(self.source.fault(
                table.span(),
                "the key `position` is missing",
                "Add position = [x, y, z], or at least four match pairs of pixel and model point",
            ));
        };
        let orientation = Orientation {
            heading: &t.heading,
            pitch: &t.pitch,
            roll: &t.roll,
            rotation: &t.rotation,
            matrix: &t.matrix,
            look_at: &t.look_at,
        };
        let pose = orientation.pose(&self.source, &self.frame, finite(&self.source, position)?)?;
        let camera = self.camera(table, pose, width, height)?;
        Ok(Posed::View(View { name, camera, photo, mask, matches }))
    }

    /// The view's size in pixels: as given, or its photograph's.
    fn picture_size_of(
        &self,
        table: &Spanned<ViewTable>,
        photo: Option<&Path>,
        mask: Option<&Path>,
    ) -> Result<[u32; 2], SiteError> {
        let t = table.get_ref();
        let at = |key: &Option<Spanned<String>>| key.as_ref().map_or(table.span(), Spanned::span);
        let photo_size = photo.filter(|p| p.exists()).map(|p| self.size_of(p, at(&t.photo))).transpose()?;
        let size = match (&t.size, photo_size) {
            (Some(size), _) if size.get_ref().iter().all(|n| (1..=65_536).contains(n)) => *size.get_ref(),
            (Some(size), _) => {
                return Err(self.source.fault(
                    size.span(),
                    format!("expected width and height from 1 to 65536 pixels, found {:?}", size.get_ref()),
                    "Correct the size",
                ));
            }
            (None, Some((width, height))) => [width, height],
            (None, None) => {
                return Err(self.source.fault(
                    table.span(),
                    "the key `size` is missing",
                    "Add size = [width, height] in pixels, or a photo, whose size is then taken",
                ));
            }
        };
        let mask_size = mask.map(|p| self.size_of(p, at(&t.mask))).transpose()?;
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        for (what, found, key) in [("photograph", photo_size, &t.photo), ("mask", mask_size, &t.mask)] {
            if let Some((w, h)) = found
                && (f64::from(w) / f64::from(h) / aspect - 1.0).abs() > ASPECT_TOLERANCE
            {
                return Err(self.source.fault(
                    at(key),
                    format!(
                        "expected a {what} in the view's aspect, {} × {}, found {w} × {h} pixels",
                        size[0], size[1]
                    ),
                    "Set size to the photograph's, and crop neither",
                ));
            }
        }
        Ok(size)
    }

    fn matches(&self, t: &ViewTable, width: u32, height: u32) -> Result<Vec<Match>, SiteError> {
        let one = |pair: &Spanned<MatchTable>| {
            let pixel = DVec2::from_array(*pair.get_ref().pixel.get_ref());
            let inside = pixel.cmpge(DVec2::ZERO).all() && pixel.x <= f64::from(width) && pixel.y <= f64::from(height);
            if !inside {
                return Err(self.source.fault(
                    pair.get_ref().pixel.span(),
                    format!("expected a pixel in the picture of {width} × {height}, found {pixel}"),
                    "Count from the top left corner",
                ));
            }
            Ok(Match { pixel, point: self.frame.point_in(finite(&self.source, &pair.get_ref().point)?) })
        };
        t.pairs.iter().map(one).collect()
    }

    fn camera(&self, table: &Spanned<ViewTable>, pose: Pose, width: u32, height: u32) -> Result<Camera, SiteError> {
        let t = table.get_ref();
        let pixels = |key: &Option<Spanned<f64>>, default: f64, positive: bool| match key {
            None => Ok(default),
            Some(v) if positive => self.number(v, |v| v > 0.0, "a focal length in pixels above zero"),
            Some(v) => finite_number(&self.source, v),
        };
        let mut camera = match (&t.fov_y, &t.fx, &t.fy) {
            (Some(fov), None, None) => Camera::with_fov(pose, width, height, self.field_of_view(fov)?),
            (None, None, None) => {
                return Err(self.source.fault(
                    table.span(),
                    "the view has neither fov_y nor fx",
                    "Add fov_y in degrees, or fx (and fy, cx, cy) in pixels",
                ));
            }
            (Some(fov), _, _) => {
                return Err(self.source.fault(
                    fov.span(),
                    "the view has both fov_y and a focal length",
                    "Keep one of them",
                ));
            }
            (None, fx, fy) => {
                let mut camera = Camera::with_fov(pose, width, height, 90.0);
                let x = pixels(if fx.is_some() { fx } else { fy }, 0.0, true)?;
                camera.focal = DVec2::new(x, pixels(fy, x, true)?);
                camera
            }
        };
        camera.centre = DVec2::new(pixels(&t.cx, camera.centre.x, false)?, pixels(&t.cy, camera.centre.y, false)?);
        let term = |key: &Option<Spanned<f64>>| pixels(key, 0.0, false);
        camera.distortion =
            Distortion::brown([term(&t.k1)?, term(&t.k2)?, term(&t.k3)?, 0.0], [term(&t.p1)?, term(&t.p2)?]);
        Ok(camera)
    }
}
