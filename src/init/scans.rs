//! The pictures of an E57 file, taken out of it: panoramas with their poses become probes, pinhole pictures views or probes.

use glam::{DQuat, DVec2, DVec3, Vec3};
use std::f64::consts::{PI, TAU};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::InitError;
use super::names::unique;
use crate::atomic_write::{Unfinished, write_atomically};
use crate::panorama::{self, Layer, Picture};
use crate::scene::e57::{ScanPicture, ScanPictures, ScanProjection};

/// A picture that was taken out of a scan file.
#[derive(Clone, Debug)]
pub(super) struct Scanned {
    pub(super) name: String,
    pub(super) path: PathBuf,
    pub(super) mask: Option<PathBuf>,
    /// In the model's axes and units.
    pub(super) position: DVec3,
    /// From the camera's axes, as the site file has them, to the model's.
    pub(super) rotation: DQuat,
    /// How a pinhole picture's pixels map to directions; `None` for a panorama.
    pub(super) lens: Option<ScanLens>,
    pub(super) is_probe: bool,
}

/// The lens of a picture, in its own pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScanLens {
    pub(super) focal: DVec2,
    pub(super) centre: DVec2,
    /// k1, k2, k3, p1, p2.
    pub(super) distortion: [f64; 5],
}

/// Takes all pictures out of a scan file into a folder, which is made where there are any.
///
/// # Errors
///
/// A file that is damaged, a folder that is in use unless `overwrite`, and a file system that refuses.
pub(super) fn taken_out(
    model: &Path,
    folder: &Path,
    overwrite: bool,
    warnings: &mut Vec<String>,
) -> Result<Vec<Scanned>, InitError> {
    let scans = ScanPictures::of(model)?;
    warnings.extend(scans.warnings.iter().cloned());
    if scans.pictures.is_empty() {
        return Ok(Vec::new());
    }
    let in_use = std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
    if in_use && !overwrite {
        return Err(InitError::InUse { path: folder.to_owned() });
    }
    std::fs::create_dir_all(folder).map_err(|e| InitError::Folder { path: folder.to_owned(), why: e.to_string() })?;
    let is_pinhole = |p: &ScanPicture| matches!(p.projection, ScanProjection::Pinhole { .. });
    let panoramas = scans.pictures.iter().any(|p| !is_pinhole(p));
    let (mut all, mut names) = (Vec::new(), Vec::new());
    for (i, picture) in scans.pictures.iter().enumerate() {
        let name = if picture.name.is_empty() { format!("picture-{}", i + 1) } else { picture.name.clone() };
        let name = unique(&name, &mut names);
        let out = Out { folder, name: &name };
        match out.taken(&scans, picture) {
            // where there are no panoramas, photographs light the place, but every fifth
            Ok(scanned) => {
                let is_probe = scanned.lens.is_none() || (!panoramas && i % 5 != 4);
                all.push(Scanned { is_probe, ..scanned });
            }
            Err(why) => warnings.push(format!("Picture “{name}” is left out: {why}.")),
        }
    }
    Ok(all)
}

/// Where a picture goes.
struct Out<'a> {
    folder: &'a Path,
    name: &'a str,
}

impl Out<'_> {
    fn taken(&self, scans: &ScanPictures, picture: &ScanPicture) -> Result<Scanned, String> {
        let bytes = scans.picture(picture).map_err(|e| e.to_string())?;
        let mask = scans.mask(picture).map_err(|e| e.to_string())?;
        let path = self.folder.join(format!("{}.{}", self.name, picture.ending));
        let scanned = Scanned {
            name: self.name.to_owned(),
            path: path.clone(),
            mask: None,
            position: picture.position,
            rotation: DQuat::from_mat3(&picture.rotation).normalize(),
            lens: None,
            is_probe: true,
        };
        match picture.projection {
            ScanProjection::Pinhole { focal, centre, distortion } => {
                put(&path, &bytes)?;
                let (width, height) = panorama::dimensions(&path).map_err(|e| e.to_string())?;
                let by = DVec2::new(width as f64, height as f64)
                    / DVec2::new(f64::from(picture.size[0]), f64::from(picture.size[1]));
                let mask = mask.map(|bytes| self.mask_of(&bytes)).transpose()?;
                let lens = ScanLens { focal: focal * by, centre: centre * by, distortion };
                Ok(Scanned { mask, lens: Some(lens), ..scanned })
            }
            projection if mask.is_none() && is_whole(&projection, picture.size) => {
                put(&path, &bytes)?;
                Ok(scanned)
            }
            projection => {
                let source = self.decoded(&bytes, picture.ending)?;
                let mask = mask.map(|bytes| self.decoded(&bytes, "png")).transpose()?;
                let around = latlong(&source, mask.as_ref(), &projection, picture.size);
                let path = self.folder.join(format!("{}.exr", self.name));
                panorama::write_exr(&path, around.width, around.height, &[Layer::rgb("", &around)], None)
                    .map_err(|e| e.to_string())?;
                Ok(Scanned { path, ..scanned })
            }
        }
    }

    /// A picture's pixels as light; they are read from a file that goes away.
    fn decoded(&self, bytes: &[u8], ending: &str) -> Result<Picture, String> {
        let file = Unfinished::new(self.folder.join(format!(".{}.{}.part", self.name, ending)));
        std::fs::write(file.path(), bytes).map_err(|e| e.to_string())?;
        panorama::read(file.path()).map_err(|e| e.to_string())
    }

    /// A view's mask, which is white where the scan file's is anything but 0.
    fn mask_of(&self, bytes: &[u8]) -> Result<PathBuf, String> {
        let mask = self.decoded(bytes, "png")?;
        let path = self.folder.join(format!("{}-mask.png", self.name));
        let pixels: Vec<u8> = mask.pixels.iter().map(|p| if p.max_element() > 0.0 { 255 } else { 0 }).collect();
        let mut png = io::Cursor::new(Vec::new());
        image::write_buffer_with_format(
            &mut png,
            &pixels,
            mask.width as u32,
            mask.height as u32,
            image::ExtendedColorType::L8,
            image::ImageFormat::Png,
        )
        .map_err(|e| e.to_string())?;
        put(&path, png.get_ref())?;
        Ok(path)
    }
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), String> {
    write_atomically(path, |e| e.to_string(), |file| file.write_all(bytes).map_err(|e| e.to_string()))
}

/// Whether a picture shows the whole sphere by latitude and longitude.
fn is_whole(projection: &ScanProjection, [width, height]: [u32; 2]) -> bool {
    match projection {
        ScanProjection::Spherical { step } => {
            let [across, down] = [f64::from(width) * step.x / TAU, f64::from(height) * step.y / PI];
            (across - 1.0).abs() < 0.005 && (down - 1.0).abs() < 0.005 && width.abs_diff(2 * height) <= height / 50
        }
        _ => false,
    }
}

/// A picture that shows a part of the sphere, as one of the whole: NaN where it shows nothing. `size` is what the projection
/// counts in.
fn latlong(source: &Picture, mask: Option<&Picture>, projection: &ScanProjection, size: [u32; 2]) -> Picture {
    /// Larger panoramas are made smaller.
    const WIDEST: f64 = 8192.0;
    let step = match projection {
        ScanProjection::Spherical { step } => step.x,
        ScanProjection::Cylindrical { step, .. } => *step,
        ScanProjection::Pinhole { .. } => TAU,
    };
    let [width, height] = size.map(f64::from);
    let finer = source.width as f64 / width;
    let height_out = (0.5 * (TAU / step * finer).clamp(64.0, WIDEST)).round() as usize;
    let mut out = Picture::new(2 * height_out, height_out);
    let columns = out.width;
    let whole_turn = (width * step / TAU - 1.0).abs() < 0.005;
    for (i, pixel) in out.pixels.iter_mut().enumerate() {
        let azimuth = PI - TAU * ((i % columns) as f64 + 0.5) / columns as f64;
        let elevation = 0.5 * PI - PI * ((i / columns) as f64 + 0.5) / height_out as f64;
        let x = 0.5 * width - azimuth / step;
        let y = match projection {
            ScanProjection::Spherical { step } => 0.5 * height - elevation / step.y,
            ScanProjection::Cylindrical { slope, horizon, .. } => horizon - elevation.tan() / slope,
            ScanProjection::Pinhole { .. } => f64::NAN,
        };
        let at = DVec2::new(x / width, y / height);
        let hidden = |mask: &Picture| sample(mask, at, whole_turn, false).is_none_or(|v| v.max_element() <= 0.0);
        let shown = if mask.is_some_and(hidden) { None } else { sample(source, at, whole_turn, true) };
        *pixel = shown.unwrap_or(Vec3::NAN);
    }
    out
}

/// A picture's value at a place from 0 to 1, the nearest pixel's or between pixels; `None` outside.
fn sample(picture: &Picture, at: DVec2, wraps: bool, between: bool) -> Option<Vec3> {
    let (width, height) = (picture.width as f64, picture.height as f64);
    let x = if wraps { at.x.rem_euclid(1.0) } else { at.x } * width;
    let y = at.y * height;
    if !((0.0..=width).contains(&x) && (0.0..=height).contains(&y)) {
        return None;
    }
    let pixel = |column: f64, row: f64| {
        let column = if wraps { column.rem_euclid(width) } else { column.clamp(0.0, width - 1.0) };
        picture.pixels[row.clamp(0.0, height - 1.0) as usize * picture.width + (column as usize).min(picture.width - 1)]
    };
    if !between {
        return Some(pixel(x.floor().min(width - 1.0), y.floor()));
    }
    let (left, top) = ((x - 0.5).floor(), (y - 0.5).floor());
    let (u, v) = ((x - 0.5 - left) as f32, (y - 0.5 - top) as f32);
    let row = |row: f64| pixel(left, row).lerp(pixel(left + 1.0, row), u);
    Some(row(top).lerp(row(top + 1.0), v))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each direction has a colour of its own.
    fn colour(azimuth: f64, elevation: f64) -> Vec3 {
        let (sin, cos) = azimuth.sin_cos();
        (DVec3::new(cos * elevation.cos(), sin * elevation.cos(), elevation.sin()).as_vec3() + 1.5) / 2.5
    }

    /// What `shows` at the middles of pixels.
    fn picture(width: u32, height: u32, shows: impl Fn(f64, f64) -> Vec3) -> Picture {
        let mut picture = Picture::new(width as usize, height as usize);
        for (i, pixel) in picture.pixels.iter_mut().enumerate() {
            *pixel = shows((i % width as usize) as f64 + 0.5, (i / width as usize) as f64 + 0.5);
        }
        picture
    }

    fn assert_right(out: &Picture, shows: impl Fn(f64) -> bool) {
        for (i, pixel) in out.pixels.iter().enumerate() {
            let azimuth = PI - TAU * ((i % out.width) as f64 + 0.5) / out.width as f64;
            let elevation = 0.5 * PI - PI * ((i / out.width) as f64 + 0.5) / out.height as f64;
            if shows(elevation) {
                assert!(pixel.distance(colour(azimuth, elevation)) < 0.01, "{azimuth} {elevation}: {pixel}");
            } else {
                assert!(pixel.is_nan(), "{azimuth} {elevation}: {pixel}");
            }
        }
    }

    #[test]
    fn a_part_of_the_sphere_is_put_where_it_belongs() {
        // 360° across, 120° down
        let (width, height) = (240u32, 80u32);
        let step = DVec2::splat(TAU / f64::from(width));
        let source = picture(width, height, |x, y| colour((120.0 - x) * step.x, (40.0 - y) * step.y));
        let projection = ScanProjection::Spherical { step };
        assert!(!is_whole(&projection, [width, height]) && is_whole(&projection, [240, 120]));
        let out = latlong(&source, None, &projection, [width, height]);
        assert_eq!((out.width, out.height), (240, 120));
        assert_right(&out, |elevation| elevation.abs() < PI / 3.0);
        // a mask hides the lower half
        let mut mask = Picture::new(width as usize, height as usize);
        mask.pixels[..(width * height / 2) as usize].fill(Vec3::ONE);
        assert_right(&latlong(&source, Some(&mask), &projection, [width, height]), |e| e > 0.0 && e < PI / 3.0);
    }

    #[test]
    fn a_cylinder_is_bent_into_the_sphere() {
        let (width, height, slope) = (240u32, 100u32, 0.02);
        let step = TAU / f64::from(width);
        let horizon = 30.0;
        let source = picture(width, height, |x, y| colour((120.0 - x) * step, ((horizon - y) * slope).atan()));
        let out = latlong(&source, None, &ScanProjection::Cylindrical { step, slope, horizon }, [width, height]);
        assert_right(&out, |elevation| elevation.tan() < 0.6 && elevation.tan() > -1.4);
    }
}
