//! What a camera wrote beside the pixels: EXIF.

use std::fs::File;
use std::io::BufReader;
use std::panic::catch_unwind;
use std::path::Path;

use exif::{In, Tag, Value};

/// What EXIF says of a photograph, as far as it matters here. All is empty where a file has none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exif {
    /// Maker and model of the camera.
    pub camera: Option<String>,
    /// When it was taken, `YYYY-MM-DD hh:mm:ss`, by the camera's clock.
    pub taken: Option<String>,
    /// Focal length in millimetres.
    pub focal_mm: Option<f64>,
    /// The focal length that shows the same on 35 mm film, millimetres; usually rounded to a whole number.
    pub focal_35mm: Option<f64>,
    /// Exposure time in seconds.
    pub exposure_s: Option<f64>,
    /// Focal length over the aperture's width.
    pub f_number: Option<f64>,
    /// Sensitivity by ISO 12232.
    pub iso: Option<f64>,
}

/// The diagonal of a frame of 35 mm film, 36 mm × 24 mm.
const FILM_DIAGONAL_MM: f64 = 43.266_615;

impl Exif {
    /// Reads the EXIF data of a JPEG, TIFF or PNG file. Nothing is found in other files, and damaged data counts as
    /// absent: the picture itself is read elsewhere.
    pub fn read(path: &Path) -> Self {
        let Ok(file) = File::open(path) else { return Self::default() };
        let found = catch_unwind(move || {
            let data = exif::Reader::new().read_from_container(&mut BufReader::new(file)).ok()?;
            Some(Self::of(&data))
        });
        found.ok().flatten().unwrap_or_default()
    }

    fn of(data: &exif::Exif) -> Self {
        let text = |tag| match data.get_field(tag, In::PRIMARY)?.value {
            Value::Ascii(ref parts) => {
                let text = String::from_utf8_lossy(parts.first()?).trim().to_owned();
                (!text.is_empty()).then_some(text)
            }
            _ => None,
        };
        let number = |tag| {
            let value = match data.get_field(tag, In::PRIMARY)?.value {
                Value::Rational(ref v) => v.first()?.to_f64(),
                ref other => f64::from(other.get_uint(0)?),
            };
            // 0 means unknown
            (value.is_finite() && value > 0.0).then_some(value)
        };
        let camera = match (text(Tag::Make), text(Tag::Model)) {
            (Some(make), Some(model)) if !model.starts_with(&make) => Some(format!("{make} {model}")),
            (make, model) => model.or(make),
        };
        let taken = text(Tag::DateTimeOriginal).or_else(|| text(Tag::DateTime)).map(|t| match t.split_once(' ') {
            Some((day, time)) => format!("{} {time}", day.replace(':', "-")),
            None => t,
        });
        Self {
            camera,
            taken,
            focal_mm: number(Tag::FocalLength),
            focal_35mm: number(Tag::FocalLengthIn35mmFilm),
            exposure_s: number(Tag::ExposureTime),
            f_number: number(Tag::FNumber),
            iso: number(Tag::PhotographicSensitivity),
        }
    }

    /// The exposure value at ISO 100, log₂(N² / t · 100 / S): the brightness that the exposure was meant for (ISO 2720).
    /// Of two photographs by one kind of camera, equal pixel values mean radiances in the ratio 2^(difference). An
    /// exposure bias is in the exposure time already, and is not heeded.
    pub fn exposure_value(&self) -> Option<f64> {
        let (time, aperture, iso) = (self.exposure_s?, self.f_number?, self.iso?);
        Some((aperture * aperture / time * 100.0 / iso).log2())
    }

    /// The focal length in pixels of a picture of this size, from the 35 mm equivalent: by the ratio of diagonals (CIPA
    /// DCG-001). Right to some 5 %: the number is rounded, some makers compare widths, and focusing changes it.
    pub fn focal_px(&self, width: u32, height: u32) -> Option<f64> {
        let diagonal = f64::from(width).hypot(f64::from(height));
        Some(self.focal_35mm? / FILM_DIAGONAL_MM * diagonal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forty_three_millimetres_see_the_diagonal_at_its_own_distance() {
        let exif = Exif { focal_35mm: Some(FILM_DIAGONAL_MM), ..Exif::default() };
        assert!((exif.focal_px(300, 400).unwrap() - 500.0).abs() < 1e-9);
        assert_eq!(Exif::default().focal_px(300, 400), None);
    }

    #[test]
    fn an_exposure_value_follows_the_sunny_sixteen() {
        // f/16 and 1/100 s at ISO 100 suit full sun, EV 14.6; a stop less of any is one more or less
        let sunny = Exif { exposure_s: Some(0.01), f_number: Some(16.0), iso: Some(100.0), ..Exif::default() };
        let ev = sunny.exposure_value().unwrap();
        assert!((ev - 14.64).abs() < 0.01, "{ev}");
        let iso = Exif { iso: Some(200.0), ..sunny.clone() };
        assert!((iso.exposure_value().unwrap() - (ev - 1.0)).abs() < 1e-9);
        let time = Exif { exposure_s: Some(0.02), ..sunny.clone() };
        assert!((time.exposure_value().unwrap() - (ev - 1.0)).abs() < 1e-9);
        assert_eq!(Exif { f_number: None, ..sunny }.exposure_value(), None);
    }

    #[test]
    fn files_without_exif_say_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.jpg");
        std::fs::write(&path, b"\xff\xd8\xff\xe1\xff\xffExif\0\0II*\0\xff\xff\xff\xff").unwrap();
        assert_eq!(Exif::read(&path), Exif::default());
        assert_eq!(Exif::read(&folder.path().join("none")), Exif::default());
    }
}
