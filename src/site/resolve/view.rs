//! `[[view]]` tables.

use glam::{DMat3, DVec2, DVec3};
use std::path::Path;
use toml::Spanned;

use super::super::camera::Camera;
use super::super::fault::SiteError;
use super::super::file::{LensKey, MatchTable, ViewTable};
use super::super::frame::Pose;
use super::super::pose::finite;
use super::super::resection::{Resection, ResectionError};
use super::super::{CameraSource, Match, View};
use super::Resolver;
use super::names::safe_name;
use super::picture::ASPECT_TOLERANCE;
use crate::panorama::{Exif, Lens, MAX_PIXELS};

impl Resolver<'_> {
    pub(super) fn view(&self, table: &Spanned<ViewTable>, warnings: &mut Vec<String>) -> Result<View, SiteError> {
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
        let size = self.picture_size_of(table, photo.as_deref(), mask.as_deref())?;
        let matches = self.matches(t, size)?;
        let orientation = t.orientation();
        let lens = match t.projection.as_ref().map(Spanned::get_ref) {
            Some(LensKey::Fisheye) => Lens::Fisheye,
            Some(LensKey::Perspective) | None => Lens::Perspective,
        };
        let keys = t.lens();
        let model = |solved| self.camera_model(&keys, size, lens, solved, ("view", table.span()));
        let (camera, source) = match &t.position {
            Some(position) => {
                let pose = orientation.pose(&self.source, &self.frame, finite(&self.source, position)?)?;
                (Camera::new(pose, &model(false)?), CameraSource::SiteFile)
            }
            None if matches.is_empty() => {
                return Err(self.source.fault(
                    table.span(),
                    "the key `position` is missing",
                    "Add position = [x, y, z], or at least four match pairs of pixel and model point",
                ));
            }
            None => {
                if let Some(at) = orientation.given() {
                    return Err(self.source.fault(
                        at,
                        "an orientation without a position",
                        "Remove it, since the matches give both; or add position = [x, y, z]",
                    ));
                }
                let still = Pose { position: DVec3::ZERO, rotation: DMat3::IDENTITY };
                let focal = keys.of_unknown_width();
                let lens = Camera::new(still, &model(focal)?);
                let found = self.resection(t, &lens, &matches, focal)?;
                warnings.extend(doubts(&name, &found));
                (found.camera, CameraSource::Matches(Box::new(found)))
            }
        };
        if let Some(path) = photo.as_deref().filter(|p| p.exists()) {
            warnings.extend(contradiction(&name, &camera, path));
        }
        Ok(View { name, camera, photo, mask, matches, source })
    }

    /// The pose from matches; a fault stands at the pair that is to blame.
    fn resection(&self, t: &ViewTable, lens: &Camera, matches: &[Match], focal: bool) -> Result<Resection, SiteError> {
        use ResectionError as E;
        Resection::of(lens, matches, focal).map_err(|e| {
            let (pair, help) = match &e {
                E::TooFew { focal: true, .. } => (0, "Add pairs, or give fov_y or fx"),
                E::TooFew { .. } => (0, "Add pairs"),
                E::Coincident { second, .. } => (*second, "Remove one of them, or correct it"),
                E::Collinear { .. } => (0, "Add a pair well away from that line"),
                E::Unshown { pair } => (*pair, "Correct the pixel, or the lens's distortion"),
                E::NoFit { worst, .. } => (
                    *worst,
                    "Check that pixels are [right, down] from the top left corner, points in the model's own axes and \
                     units, and the focal length",
                ),
                E::Ambiguous { .. } => (0, "Add a pair away from the plane of the others"),
                E::Loose { .. } => (0, "Add pairs that are farther apart, at different distances from the camera"),
            };
            let at = t.pairs.get(pair.saturating_sub(1)).map_or(0..0, Spanned::span);
            self.source.fault(at, e.to_string(), help)
        })
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
        let fits = |[w, h]: [u32; 2]| {
            let side = 1..=65_536;
            side.contains(&w) && side.contains(&h) && u64::from(w) * u64::from(h) <= MAX_PIXELS
        };
        let size = match (&t.size, photo_size) {
            (Some(size), _) if fits(**size.get_ref()) => **size.get_ref(),
            (Some(size), _) => {
                return Err(self.source.fault(
                    size.span(),
                    format!(
                        "expected width and height from 1 to 65536 pixels, {MAX_PIXELS} in all at most, found {:?}",
                        **size.get_ref()
                    ),
                    "Correct the size",
                ));
            }
            (None, Some(size)) => size,
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
            if let Some([w, h]) = found
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

    fn matches(&self, t: &ViewTable, [width, height]: [u32; 2]) -> Result<Vec<Match>, SiteError> {
        let one = |pair: &Spanned<MatchTable>| {
            let pixel = DVec2::from_array(**pair.get_ref().pixel.get_ref());
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
}

/// What is odd about a pose that was found.
fn doubts(view: &str, found: &Resection) -> Option<String> {
    let worst = found.residuals_px.iter().copied().fold(0.0, f64::max);
    match found.suspect {
        Some(pair) => Some(format!(
            "View “{view}”: pair {} misses by {:.1} pixels, and without it the others agree far better: pick it again.",
            pair + 1,
            found.residuals_px[pair]
        )),
        None if worst > 5.0 => {
            Some(format!("View “{view}”: its pose misses a picked pixel by {worst:.1} pixels; see `check`."))
        }
        None => None,
    }
}

/// A warning where the photograph's EXIF data tells another focal length than the view.
fn contradiction(view: &str, camera: &Camera, photo: &Path) -> Option<String> {
    /// Relative difference that rounding, focusing and makers' habits explain.
    const TOLERANCE: f64 = 0.1;
    if camera.lens == Lens::Fisheye {
        return None;
    }
    let exif = Exif::read(photo);
    let says = exif.focal_px(camera.width, camera.height)?;
    let ratio = camera.focal.y / says;
    if (ratio - 1.0).abs() <= TOLERANCE {
        return None;
    }
    let fov = |f: f64| (2.0 * (0.5 * f64::from(camera.height) / f).atan()).to_degrees();
    Some(format!(
        "View “{view}”: the photograph's EXIF data says {:.0} mm (35 mm film), a vertical field of view of {:.1}°, but the \
         view has {:.1}°. Check fov_y or fx, and whether the photograph was cropped.",
        exif.focal_35mm?,
        fov(says),
        fov(camera.focal.y)
    ))
}
