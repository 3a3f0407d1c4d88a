//! COLMAP's sparse models, text and binary (colmap.github.io/format.html).
//!
//! A pose is stored from the world to the camera: x = R X + t, so the camera stands at −Rᵀ t. Pixels are those stored in
//! the file: COLMAP does not heed EXIF orientation.

use glam::{DMat3, DQuat, DVec2, DVec3};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::solved::{Intrinsics, PoseFile, PoseFileError, Result, SolvedCamera, bytes, text};
use crate::panorama::{Distortion, Lens};

/// The models' names, by number, and how many parameters each has.
const MODELS: [(&str, usize); 12] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
];

type Cameras = BTreeMap<u32, Intrinsics>;

/// Reads `cameras` and `images` with this ending in a folder.
pub(super) fn read(folder: &Path, ending: &str) -> Result<PoseFile> {
    let (cameras, images) = (folder.join(format!("cameras.{ending}")), folder.join(format!("images.{ending}")));
    let solved = if ending == "bin" {
        let known = binary_cameras(&mut Bytes::open(&cameras)?)?;
        binary_images(&mut Bytes::open(&images)?, &known)?
    } else {
        let known = text_cameras(&cameras, &text(&cameras)?)?;
        text_images(&images, &text(&images)?, &known)?
    };
    Ok(PoseFile { cameras: solved, ..PoseFile::default() })
}

fn text_cameras(path: &Path, text: &str) -> Result<Cameras> {
    let mut cameras = Cameras::new();
    for (i, line) in text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#')) {
        let at = FilePlace::line(path, i);
        let words: Vec<&str> = line.split_whitespace().collect();
        let [id, model, width, height, parameters @ ..] = &words[..] else {
            return Err(at.damaged("expected CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS"));
        };
        let parameters = parameters.iter().map(|w| at.number(w)).collect::<Result<Vec<f64>>>()?;
        let size = [at.whole(width)?, at.whole(height)?];
        cameras.insert(at.whole(id)?, intrinsics(&at, model, size, &parameters)?);
    }
    Ok(cameras)
}

fn text_images(path: &Path, text: &str, cameras: &Cameras) -> Result<Vec<SolvedCamera>> {
    let mut solved = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((i, line)) = lines.next() {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        let at = FilePlace::line(path, i);
        let words: Vec<&str> = line.split_whitespace().collect();
        if words.len() < 10 {
            return Err(at.damaged("expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"));
        }
        let mut v = [0.0; 7];
        for (value, word) in v.iter_mut().zip(&words[1..8]) {
            *value = at.number(word)?;
        }
        // names may hold blanks
        let name = words[9..].join(" ");
        solved.push(camera(&at, v, at.whole(words[8])?, name, cameras)?);
        // the line of points belongs to the image; it may be empty, but it has to be there
        if let Some((j, points)) = lines.next() {
            let tenth = points.split_whitespace().nth(9);
            if tenth.is_some_and(|w| w.parse::<f64>().is_err()) {
                let at = FilePlace::line(path, j);
                return Err(at.damaged("expected the image's line of points (it may be empty), found another image"));
            }
        }
    }
    Ok(solved)
}

fn binary_cameras(bytes: &mut Bytes) -> Result<Cameras> {
    let mut cameras = Cameras::new();
    for _ in 0..bytes.u64()? {
        let at = bytes.place();
        let (id, model) = (bytes.u32()?, bytes.u32()?);
        let size = [bytes.u64()?, bytes.u64()?];
        let size = size.map(|n| u32::try_from(n).map_err(|_| at.damaged(&format!("a side of {n} pixels"))));
        let [width, height] = size;
        let Some((name, count)) = MODELS.get(model as usize) else {
            return Err(at.damaged(&format!("camera model {model} is not known")));
        };
        let parameters = (0..*count).map(|_| bytes.f64()).collect::<Result<Vec<f64>>>()?;
        cameras.insert(id, intrinsics(&at, name, [width?, height?], &parameters)?);
    }
    Ok(cameras)
}

fn binary_images(bytes: &mut Bytes, cameras: &Cameras) -> Result<Vec<SolvedCamera>> {
    let mut solved = Vec::new();
    for _ in 0..bytes.u64()? {
        let at = bytes.place();
        bytes.u32()?; // the image's number
        let mut v = [0.0; 7];
        for value in &mut v {
            *value = bytes.f64()?;
        }
        let id = bytes.u32()?;
        let name = bytes.name()?;
        solved.push(camera(&at, v, id, name, cameras)?);
        // two coordinates and the number of a point each
        let points = bytes.u64()?;
        bytes.skip(points.checked_mul(24))?;
    }
    Ok(solved)
}

/// A camera from quaternion and translation.
fn camera(at: &FilePlace, v: [f64; 7], id: u32, photo: String, cameras: &Cameras) -> Result<SolvedCamera> {
    let [w, x, y, z, ..] = v;
    let q = DQuat::from_xyzw(x, y, z, w);
    let t = DVec3::new(v[4], v[5], v[6]);
    if !t.is_finite() || !q.is_finite() || (q.length() - 1.0).abs() > 1e-3 {
        return Err(at.damaged(&format!("expected a unit quaternion and a translation for {photo}, found {v:?}")));
    }
    let Some(intrinsics) = cameras.get(&id) else {
        return Err(at.damaged(&format!("{photo} has camera {id}, which the cameras' file does not hold")));
    };
    let to_world = DMat3::from_quat(q.normalize()).transpose();
    Ok(SolvedCamera { photo, position: -(to_world * t), rotation: to_world, intrinsics: *intrinsics })
}

/// A lens from a model's parameters, in the order of COLMAP's `models.h`.
fn intrinsics(at: &FilePlace, model: &str, size: [u32; 2], p: &[f64]) -> Result<Intrinsics> {
    let Some((_, count)) = MODELS.iter().find(|(name, _)| *name == model) else {
        return Err(at.damaged(&format!("camera model {model} is not known")));
    };
    if p.len() != *count {
        return Err(at.damaged(&format!("expected {count} parameters of {model}, found {}", p.len())));
    }
    let one_focal =
        |k: [f64; 2]| (DVec2::splat(p[0]), DVec2::new(p[1], p[2]), Distortion::brown([k[0], k[1], 0.0, 0.0], [0.0; 2]));
    let two_focals = |d: Distortion| (DVec2::new(p[0], p[1]), DVec2::new(p[2], p[3]), d);
    let (focal, centre, distortion) = match model {
        "SIMPLE_PINHOLE" => one_focal([0.0; 2]),
        "PINHOLE" => two_focals(Distortion::default()),
        "SIMPLE_RADIAL" | "SIMPLE_RADIAL_FISHEYE" => one_focal([p[3], 0.0]),
        "RADIAL" | "RADIAL_FISHEYE" => one_focal([p[3], p[4]]),
        "OPENCV" => two_focals(Distortion::brown([p[4], p[5], 0.0, 0.0], [p[6], p[7]])),
        "OPENCV_FISHEYE" => two_focals(Distortion::brown([p[4], p[5], p[6], p[7]], [0.0; 2])),
        // k1, k2, p1, p2, k3, then the denominator's
        "FULL_OPENCV" => two_focals(Distortion::rational([p[4], p[5], p[8], 0.0], [p[9], p[10], p[11]], [p[6], p[7]])),
        _ => {
            return Err(PoseFileError::Unsupported {
                path: at.path.clone(),
                what: format!("{}: camera model {model} is not read here", at.place),
                remedy: "run COLMAP's image_undistorter, or reconstruct with OPENCV or OPENCV_FISHEYE",
            });
        }
    };
    let good = focal.is_finite() && focal.min_element() > 0.0 && centre.is_finite() && p.iter().all(|v| v.is_finite());
    if !good || size.contains(&0) {
        return Err(at.damaged(&format!("expected a size and a focal length above zero, found {size:?} and {p:?}")));
    }
    let lens = if model.ends_with("FISHEYE") { Lens::Fisheye } else { Lens::Perspective };
    Ok(Intrinsics { size: Some(size), lens, focal, centre, skew: 0.0, distortion })
}

/// Where in a file something is.
struct FilePlace {
    path: PathBuf,
    place: String,
}

impl FilePlace {
    fn line(path: &Path, index: usize) -> Self {
        Self { path: path.into(), place: format!("line {}", index + 1) }
    }

    fn damaged(&self, what: &str) -> PoseFileError {
        PoseFileError::Damaged { path: self.path.clone(), place: self.place.clone(), what: what.to_owned() }
    }

    fn number(&self, word: &str) -> Result<f64> {
        let value = word.parse().ok().filter(|v: &f64| v.is_finite());
        value.ok_or_else(|| self.damaged(&format!("expected a number, found “{word}”")))
    }

    fn whole(&self, word: &str) -> Result<u32> {
        word.parse().map_err(|_| self.damaged(&format!("expected a whole number, found “{word}”")))
    }
}

/// Little-endian numbers of a file.
struct Bytes {
    path: PathBuf,
    bytes: Vec<u8>,
    at: usize,
}

impl Bytes {
    fn open(path: &Path) -> Result<Self> {
        Ok(Self { path: path.into(), bytes: bytes(path)?, at: 0 })
    }

    fn place(&self) -> FilePlace {
        FilePlace { path: self.path.clone(), place: format!("byte {}", self.at) }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let part = self.bytes.get(self.at..).and_then(|rest| rest.first_chunk::<N>()).copied();
        let part = part.ok_or_else(|| self.place().damaged("the file is cut short"))?;
        self.at += N;
        Ok(part)
    }

    fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn u64(&mut self) -> Result<u64> {
        Ok(u64::from_le_bytes(self.take()?))
    }

    fn f64(&mut self) -> Result<f64> {
        Ok(f64::from_le_bytes(self.take()?))
    }

    /// Text up to a zero byte.
    fn name(&mut self) -> Result<String> {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|b| *b == 0).ok_or_else(|| self.place().damaged("the file is cut short"))?;
        let name = String::from_utf8_lossy(&rest[..length]).into_owned();
        self.at += length + 1;
        Ok(name)
    }

    fn skip(&mut self, count: Option<u64>) -> Result<()> {
        let end = count.and_then(|n| self.at.checked_add(usize::try_from(n).ok()?)).filter(|e| *e <= self.bytes.len());
        self.at = end.ok_or_else(|| self.place().damaged("the file is cut short"))?;
        Ok(())
    }
}
