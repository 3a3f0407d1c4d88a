//! Files and pictures that a site names.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::super::Pictures;
use super::super::fault::SiteError;
use super::super::file::ProjectionKey;
use super::super::files::{find_by_end, find_loosely, is_url};
use super::super::sequence::{is_numbered, numbered};
use super::Resolver;
use crate::panorama::{self, Projection};

/// Largest relative difference between a picture's aspect and its projection's.
pub(super) const ASPECT_TOLERANCE: f64 = 0.01;

impl Resolver<'_> {
    pub(super) fn existing(&self, name: &str, at: Range<usize>, what: &str) -> Result<PathBuf, SiteError> {
        let fault = |problem: String, help: String| Err(self.source.fault(at.clone(), problem, help));
        if name.trim().is_empty() {
            return fault(
                format!("expected the path of {what}, found empty text"),
                "Give a path relative to this file".into(),
            );
        }
        if is_url(name) {
            return fault(
                format!("expected a path on this machine, found the URL “{name}”"),
                "Download the file and give its path relative to this file".into(),
            );
        }
        let path = self.folder.join(name);
        if path.is_file() {
            return Ok(path);
        }
        if path.is_dir() {
            return fault(
                format!("expected {what}, found the folder “{}”", path.display()),
                "Name the file in it".into(),
            );
        }
        let help = match find_loosely(&self.folder, name).or_else(|| find_by_end(&self.folder, name)) {
            Some(near) => {
                let near = near.strip_prefix(&self.folder).unwrap_or(&near).display().to_string();
                format!("Did you mean “{near}”? Letter case counts, and folders are separated by /")
            }
            None => "Paths are relative to this file; check the name, or put the file there".to_owned(),
        };
        fault(format!("there is no file “{}” for {what}", path.display()), help)
    }

    /// Where a picture that is still to be made will be; `None` where it is there already or has to be.
    pub(super) fn to_be_made(&self, name: &str) -> Option<PathBuf> {
        let path = self.folder.join(name);
        let may_be = self.pictures == Pictures::MayBeMissing && !name.trim().is_empty() && !is_url(name);
        (may_be && !path.exists()).then_some(path)
    }

    /// A picture that exists and whose aspect can be its projection's.
    pub(super) fn panorama(&self, name: &str, at: Range<usize>, projection: &Projection) -> Result<PathBuf, SiteError> {
        let path = self.existing(name, at.clone(), "the picture")?;
        let [width, height] = self.size_of(&path, at.clone())?;
        let (shape, aspects) = match projection {
            Projection::LatLong => ("twice as wide as high", vec![2.0]),
            Projection::Angular | Projection::MirrorBall | Projection::Fisheye => ("square", vec![1.0]),
            Projection::CubeCross => ("a cross of 3 × 4 or 4 × 3 squares", vec![0.75, 4.0 / 3.0]),
            Projection::Perspective { .. } => return Ok(path),
            Projection::Camera(model) => {
                ("in the aspect of the first", vec![f64::from(model.size[0]) / f64::from(model.size[1])])
            }
        };
        let aspect = f64::from(width) / f64::from(height);
        if aspects.iter().any(|a| (aspect / a - 1.0).abs() <= ASPECT_TOLERANCE) {
            return Ok(path);
        }
        Err(self.source.fault(
            at,
            format!("expected a picture that is {shape}, found {width} × {height} pixels in “{name}”"),
            "Crop the picture, or set projection to what it is",
        ))
    }

    /// The pictures that a name with # for the digits of a number means, all of one size; `None` for any other name.
    pub(super) fn sequence(
        &self,
        name: &str,
        projection: &Projection,
        at: &Range<usize>,
    ) -> Result<Option<Vec<PathBuf>>, SiteError> {
        if !is_numbered(name) || self.folder.join(name).exists() {
            return Ok(None);
        }
        let fault = |problem: String, help: &str| self.source.fault(at.clone(), problem, help);
        let frames = match numbered(&self.folder, name) {
            Ok(frames) => frames,
            Err(_) if self.pictures == Pictures::MayBeMissing => return Ok(None),
            Err(why) => {
                return Err(fault(why, "Name them as west_####.exr means west_0001.exr, west_0002.exr and so on"));
            }
        };
        let first = frames[0].strip_prefix(&self.folder).unwrap_or(&frames[0]).display().to_string();
        self.panorama(&first, at.clone(), projection)?;
        let size = self.size_of(&frames[0], at.clone())?;
        for frame in &frames[1..] {
            let other = self.size_of(frame, at.clone())?;
            if other != size {
                let [width, height] = other;
                let problem = format!(
                    "“{}” has {width} × {height} pixels, the first of its sequence {} × {}",
                    frame.display(),
                    size[0],
                    size[1]
                );
                return Err(fault(problem, "Give all pictures of a sequence one size"));
            }
        }
        Ok(Some(frames))
    }

    /// Width and height, from the picture's header alone.
    pub(super) fn size_of(&self, path: &Path, at: Range<usize>) -> Result<[u32; 2], SiteError> {
        let why = match panorama::dimensions(path).map(|(w, h)| (u32::try_from(w), u32::try_from(h))) {
            Ok((Ok(width), Ok(height))) => return Ok([width, height]),
            Ok(_) => format!("{}: the picture is too large", path.display()),
            Err(why) => why.to_string(),
        };
        let help = "Give an OpenEXR, Radiance HDR, PNG, JPEG or TIFF picture";
        Err(self.source.fault(at, format!("the picture cannot be read: {why}"), help))
    }
}

impl ProjectionKey {
    /// How pixels map to directions; `None` for a photograph, whose lens other keys tell.
    pub(super) fn panorama(self) -> Option<Projection> {
        match self {
            Self::LatLong => Some(Projection::LatLong),
            Self::Angular => Some(Projection::Angular),
            Self::MirrorBall => Some(Projection::MirrorBall),
            Self::Fisheye => Some(Projection::Fisheye),
            Self::CubeCross => Some(Projection::CubeCross),
            Self::Perspective => None,
        }
    }
}
