//! The pictures of an E57 file that have a projection, and where each was taken.

use e57::{Blob, Image, ImageFormat, Projection};
use glam::{DMat3, DVec2, DVec3};
use std::path::{Path, PathBuf};

use super::distortion::{Calibrated, distortions};
use super::grid::Placement;
use super::{decode_error, opened, placement};
use crate::scene::SceneError;

/// A picture in an E57 file.
#[derive(Clone, Debug)]
pub struct ScanPicture {
    /// What it is called there; perhaps empty.
    pub name: String,
    /// Where it was taken, in the file's axes, metres.
    pub position: DVec3,
    /// From the camera's axes (+x right, +y up, −z forward) to the file's.
    pub rotation: DMat3,
    /// How its pixels map to directions.
    pub projection: ScanProjection,
    /// Width and height that the projection counts in; the picture itself may be larger or smaller.
    pub size: [u32; 2],
    /// `png` or `jpg`.
    pub ending: &'static str,
    picture: Blob,
    mask: Option<Blob>,
}

/// How the pixels of a picture in an E57 file map to directions; forward is its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScanProjection {
    /// Focal lengths and principal point in pixels, from the top-left corner.
    Pinhole {
        /// Focal lengths.
        focal: DVec2,
        /// Principal point.
        centre: DVec2,
        /// OpenCV's k1, k2, k3, p1 and p2; zeros without distortion.
        distortion: [f64; 5],
    },
    /// Latitude/longitude, perhaps a part of the sphere; radians per pixel.
    Spherical {
        /// Across and down.
        step: DVec2,
    },
    /// Longitude across, the tangent of latitude down.
    Cylindrical {
        /// Radians per pixel across.
        step: f64,
        /// Change of the tangent of latitude per pixel down.
        slope: f64,
        /// The horizon's row.
        horizon: f64,
    },
}

/// The pictures of a file, and the file to take them out of.
#[derive(Clone, Debug)]
pub struct ScanPictures {
    path: PathBuf,
    /// Those with a projection, in the file's order.
    pub pictures: Vec<ScanPicture>,
    /// What was passed over, a sentence each.
    pub warnings: Vec<String>,
}

impl ScanPictures {
    /// Lists a file's pictures.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is damaged.
    pub fn of(path: &Path) -> Result<Self, SceneError> {
        opened(path, |reader| {
            let clouds = reader.pointclouds();
            let (mut pictures, mut warnings) = (Vec::new(), Vec::new());
            let lenses = distortions(reader.xml());
            let images = reader.images();
            let lenses = if lenses.len() == images.len() { lenses } else { vec![None; images.len()] };
            for (image, lens) in images.into_iter().zip(lenses) {
                let name = image.name.clone().or(image.guid.clone()).unwrap_or_default();
                // a picture without a pose of its own belongs to its scan
                let scan = clouds.iter().find(|c| c.guid.is_some() && c.guid == image.pointcloud_guid);
                let transform = image.transform.as_ref().or(scan.and_then(|c| c.transform.as_ref()));
                let at = placement(transform);
                match described(&image, &name, at, lens) {
                    Ok(picture) if at.position.is_finite() && picture.rotation.is_finite() => pictures.push(picture),
                    Ok(_) => warnings.push(format!("Picture “{name}” has a pose that is not finite: left out.")),
                    Err(why) => warnings.push(format!("Picture “{name}” is left out: {why}.")),
                }
            }
            Ok(Self { path: path.to_owned(), pictures, warnings })
        })
    }

    /// A picture's own bytes, a PNG or JPEG file.
    ///
    /// # Errors
    ///
    /// A file that is damaged there.
    pub fn picture(&self, picture: &ScanPicture) -> Result<Vec<u8>, SceneError> {
        self.bytes(&picture.picture)
    }

    /// The bytes of its mask, a PNG file that is black where the picture shows nothing; `None` without one.
    ///
    /// # Errors
    ///
    /// A file that is damaged there.
    pub fn mask(&self, picture: &ScanPicture) -> Result<Option<Vec<u8>>, SceneError> {
        picture.mask.as_ref().map(|mask| self.bytes(mask)).transpose()
    }

    fn bytes(&self, blob: &Blob) -> Result<Vec<u8>, SceneError> {
        opened(&self.path, |reader| {
            let mut bytes = Vec::new();
            reader.blob(blob, &mut bytes).map_err(|e| SceneError::malformed(&self.path, decode_error(&e)))?;
            Ok(bytes)
        })
    }
}

/// A picture that was taken there, with the lens that the extension for distortion gives a pinhole, if it gives one; only if its
/// projection can be used. The standard's own axes are those of OpenGL for a pinhole; spherical and cylindrical pictures have
/// their centre column along +x, z up.
fn described(image: &Image, name: &str, at: Placement, lens: Option<Calibrated>) -> Result<ScanPicture, &'static str> {
    let around = at.rotation * DMat3::from_cols(DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X);
    let finite = |numbers: &[f64]| numbers.iter().all(|v| v.is_finite());
    let (blob, mask, size, rotation, projection, fits) = match image.projection.as_ref() {
        None => return Err("it is an illustration without a projection"),
        Some(Projection::Pinhole(p)) => {
            let v = &p.properties;
            let own = Calibrated {
                focal: DVec2::new(v.focal_length / v.pixel_width, v.focal_length / v.pixel_height),
                centre: DVec2::new(v.principal_x, v.principal_y),
                distortion: [0.0; 5],
                rational: false,
                size: None,
            };
            let Calibrated { focal, centre, distortion, rational, size } = lens.unwrap_or(own);
            if rational {
                return Err(
                    "its distortion is OpenCV's rational one, which a site file cannot hold: undistort it first",
                );
            }
            let fits = focal.is_finite() && focal.min_element() > 0.0 && centre.is_finite() && finite(&distortion);
            let projection = ScanProjection::Pinhole { focal, centre, distortion };
            (&p.blob, &p.mask, size.unwrap_or([v.width, v.height]), at.rotation, projection, fits)
        }
        Some(Projection::Spherical(p)) => {
            let v = &p.properties;
            let step = DVec2::new(v.pixel_width, v.pixel_height);
            let fits = step.is_finite() && step.min_element() > 0.0;
            (&p.blob, &p.mask, [v.width, v.height], around, ScanProjection::Spherical { step }, fits)
        }
        Some(Projection::Cylindrical(p)) => {
            let v = &p.properties;
            let (step, slope, horizon) = (v.pixel_width, v.pixel_height / v.radius, v.principal_y);
            let fits = finite(&[step, slope, horizon]) && step > 0.0 && slope > 0.0;
            (&p.blob, &p.mask, [v.width, v.height], around, ScanProjection::Cylindrical { step, slope, horizon }, fits)
        }
    };
    if !fits || size.contains(&0) {
        return Err("its projection has no size");
    }
    let ending = match blob.format {
        ImageFormat::Png => "png",
        ImageFormat::Jpeg => "jpg",
    };
    let (name, picture, mask) = (name.to_owned(), blob.data.clone(), mask.clone());
    Ok(ScanPicture { name, position: at.position, rotation, projection, size, ending, picture, mask })
}
