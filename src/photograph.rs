//! Photographs of a site: linear pixels, and which of them can be compared with anything.
//!
//! ```
//! use clerestory::photograph;
//! use clerestory::site::Site;
//! # let chapel = concat!(env!("CARGO_MANIFEST_DIR"), "/sites/chapel");
//!
//! let site = Site::load(std::path::Path::new(chapel))?;
//! let (picture, _coding) = photograph::read(&site.views[0])?.expect("the chapel's views have photographs");
//! assert_eq!([picture.width, picture.height], [256, 256]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use rayon::prelude::*;
use std::path::PathBuf;

use crate::panorama::{self, Coding, Exif, PanoramaError, Picture, luminance, srgb_to_linear};
use crate::site::View;

/// What a pixel of a photograph is fit for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fitness {
    /// It measures light.
    Good,
    /// A channel is at the sensor's or the file's end: the light was at least that.
    Clipped,
    /// So dark that the file's steps or the sensor's noise hide what it shows.
    Dark,
    /// NaN, infinite or negative, or outside of what the lens shows.
    Invalid,
    /// The view's mask leaves it out.
    Masked,
}

/// A photograph that a view names.
#[derive(Clone, Debug)]
pub struct Photograph {
    /// Its file.
    pub path: PathBuf,
    /// Linear Rec. 709, upright; pixels that are no light are black.
    pub picture: Picture,
    /// What each pixel is fit for, rows from the top.
    pub fitness: Vec<Fitness>,
    /// How the file stores its values.
    pub coding: Coding,
    /// What the camera wrote beside them.
    pub exif: Exif,
}

/// Why a view's photograph cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PhotographError {
    /// The photograph or the mask cannot be read.
    #[error(transparent)]
    Picture(#[from] PanoramaError),
    /// The photograph has another size than its view.
    #[error(
        "{}: the photograph has {} × {} pixels, but the view “{view}” has {} × {}. Leave out the view's size, or set it \
         to the photograph's",
        path.display(), found[0], found[1], wanted[0], wanted[1]
    )]
    Size {
        /// The photograph's file.
        path: PathBuf,
        /// The view's name.
        view: String,
        /// The photograph's width and height.
        found: [usize; 2],
        /// The view's width and height.
        wanted: [usize; 2],
    },
}

/// Linear value below which an 8-bit file's steps are wider than a tenth of the light: code 10, in sRGB's straight part.
const DARK_8_BIT: f32 = 10.0 / 255.0 / 12.92;

/// Linear share of white below which cameras' 16-bit files hold noise: 11 stops.
const DARK_16_BIT: f32 = 1.0 / 2048.0;

/// The same for pictures without an end, 13 stops below their 99th percentile.
const DARK_LINEAR: f32 = 1.0 / 8192.0;

/// Encoded brightness (sRGB, half of the range) below which a mask leaves pixels out.
const MASK: f32 = 0.5;

impl Photograph {
    /// Reads the photograph of a view, and its mask; `None` where the view has none.
    ///
    /// # Errors
    ///
    /// [`PhotographError`] when a file cannot be read, or the photograph's size is not the view's. A mask of another size
    /// is stretched: the site file's check saw to its aspect.
    pub fn of(view: &View) -> Result<Option<Self>, PhotographError> {
        let (Some(path), Some((picture, coding))) = (&view.photo, read(view)?) else { return Ok(None) };
        let mut fitness = fitness(&picture, coding);
        if !view.camera.is_pinhole() {
            let width = picture.width;
            fitness.par_iter_mut().enumerate().for_each(|(i, f)| {
                if !view.camera.shows((i % width) as f64 + 0.5, (i / width) as f64 + 0.5) {
                    *f = Fitness::Invalid;
                }
            });
        }
        if let Some(out) = left_out(view)? {
            for (f, _) in fitness.iter_mut().zip(out).filter(|(_, out)| *out) {
                *f = Fitness::Masked;
            }
        }
        Ok(Some(Self { path: path.clone(), picture: picture.cleaned(), fitness, coding, exif: Exif::read(path) }))
    }

    /// Linear value below which the file's steps or the sensor's noise are wider than a tenth of the light.
    pub fn dark(&self) -> f32 {
        ends(&self.picture, self.coding).1
    }

    /// The share of pixels of one fitness.
    pub fn share(&self, fitness: Fitness) -> f64 {
        self.fitness.iter().filter(|f| **f == fitness).count() as f64 / self.fitness.len().max(1) as f64
    }
}

/// The picture that a view names, as its file has it, linear and upright, and how the file stores its values; `None` where
/// the view has none.
///
/// # Errors
///
/// [`PhotographError`] when the file cannot be read, or the picture's size is not the view's.
pub fn read(view: &View) -> Result<Option<(Picture, Coding)>, PhotographError> {
    let Some(path) = &view.photo else { return Ok(None) };
    let (picture, coding) = panorama::read_coded(path)?;
    let found = [picture.width, picture.height];
    let wanted = [view.camera.width as usize, view.camera.height as usize];
    if found != wanted {
        return Err(PhotographError::Size { path: path.clone(), view: view.name.clone(), found, wanted });
    }
    Ok(Some((picture, coding)))
}

/// The same with NaN where the view's mask leaves pixels out.
///
/// # Errors
///
/// As [`read`], or a mask that cannot be read.
pub fn read_masked(view: &View) -> Result<Option<(Picture, Coding)>, PhotographError> {
    let Some((mut picture, coding)) = read(view)? else { return Ok(None) };
    let out = left_out(view)?.unwrap_or_default();
    picture.pixels.iter_mut().zip(out).filter(|(_, out)| *out).for_each(|(pixel, _)| *pixel = glam::Vec3::NAN);
    Ok(Some((picture, coding)))
}

/// The pixels that a view's mask leaves out, in the view's size; `None` without a mask.
///
/// # Errors
///
/// When the mask cannot be read.
pub fn left_out(view: &View) -> Result<Option<Vec<bool>>, PanoramaError> {
    let Some(path) = &view.mask else { return Ok(None) };
    let mask = panorama::read(path)?;
    let (width, height) = (view.camera.width as usize, view.camera.height as usize);
    let threshold = srgb_to_linear(MASK);
    let at = |i: usize| {
        let (x, y) = (i % width, i / width);
        let (u, v) = ((2 * x + 1) * mask.width / (2 * width), (2 * y + 1) * mask.height / (2 * height));
        // what is not a number is not white
        let white = luminance(mask.pixels[v * mask.width + u]) >= threshold;
        !white
    };
    Ok(Some((0..width * height).into_par_iter().map(at).collect()))
}

/// What each pixel of a picture is fit for, as far as its values tell.
fn fitness(picture: &Picture, coding: Coding) -> Vec<Fitness> {
    let (clipped, dark) = ends(picture, coding);
    let of = |p: &glam::Vec3| {
        if !Picture::valid(*p) {
            Fitness::Invalid
        } else if p.max_element() >= clipped {
            Fitness::Clipped
        } else if p.max_element() <= dark {
            Fitness::Dark
        } else {
            Fitness::Good
        }
    };
    picture.pixels.par_iter().map(of).collect()
}

/// The values from which a picture is clipped and up to which it is too dark.
fn ends(picture: &Picture, coding: Coding) -> (f32, f32) {
    match coding {
        Coding::Srgb8 => (coding.clipped(), DARK_8_BIT),
        Coding::Srgb16 => (coding.clipped(), DARK_16_BIT),
        Coding::Linear => linear_ends(picture),
    }
}

/// The values from which a linear picture is clipped (infinite where it is not) and up to which it is too dark.
fn linear_ends(picture: &Picture) -> (f32, f32) {
    let mut values: Vec<f32> = picture.pixels.iter().filter(|p| Picture::valid(**p)).map(|p| p.max_element()).collect();
    if values.is_empty() {
        return (f32::INFINITY, 0.0);
    }
    let clipped = if picture.health().clipped > 0 { values.iter().copied().fold(0.0, f32::max) } else { f32::INFINITY };
    let nth = (values.len() - 1) * 99 / 100;
    let (_, white, _) = values.select_nth_unstable_by(nth, f32::total_cmp);
    (clipped, *white * DARK_LINEAR)
}
