//! RealityCapture's (RealityScan's) XMP files: one beside each photograph, of the same name.
//!
//! `Rotation` holds the rows of the rotation from the world to the camera, `Position` the camera's place. Lengths of the
//! lens are in units of the picture's longer side: the focal length as that of 36 mm film, the principal point from the
//! picture's middle. `DistortionCoeficients` (sic) are k1 k2 k3 k4 t1 t2, where t1 goes with x: OpenCV's p2. (Capturing
//! Reality, *RealityCapture XMP Camera Math*.)

use glam::{DMat3, DVec2, DVec3};
use std::path::{Path, PathBuf};

use super::solved::{Intrinsics, PoseFile, PoseFileError, Result, SolvedCamera, text};
use super::xml::{damaged, number, numbers, parse, value};
use crate::panorama::{Distortion, Lens};
use crate::site::frame::exact_rotation;

pub(super) fn read(files: &[PathBuf]) -> Result<PoseFile> {
    let mut found = PoseFile::default();
    let mut unsolved = Vec::new();
    for path in files {
        match camera(path)? {
            Some(camera) => found.cameras.push(camera),
            None => unsolved.push(path.file_name().unwrap_or_default().to_string_lossy().into_owned()),
        }
    }
    if !unsolved.is_empty() {
        found.warnings.push(format!("{} hold no pose and are left out: {}.", unsolved.len(), super::listed(&unsolved)));
    }
    Ok(found)
}

/// The camera of an XMP file; `None` where it holds no pose.
fn camera(path: &Path) -> Result<Option<SolvedCamera>> {
    let text = text(path)?;
    let document = parse(path, &text)?;
    let described = document.descendants().find(|n| value(*n, "Rotation").is_some() && value(*n, "Position").is_some());
    let Some(node) = described else { return Ok(None) };
    let rows: [f64; 9] = numbers(path, node, value(node, "Rotation").unwrap_or_default())?;
    let to_camera = exact_rotation(DMat3::from_cols_array(&rows).transpose())
        .ok_or_else(|| damaged(path, node, "expected the rows of a rotation matrix in Rotation"))?;
    let position: [f64; 3] = numbers(path, node, value(node, "Position").unwrap_or_default())?;
    let photo = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Some(SolvedCamera {
        photo,
        position: DVec3::from_array(position),
        rotation: to_camera.transpose(),
        intrinsics: intrinsics(path, node)?,
    }))
}

fn intrinsics(path: &Path, node: roxmltree::Node) -> Result<Intrinsics> {
    let focal_35mm = number(path, node, "FocalLength35mm", 0.0)?;
    if focal_35mm <= 0.0 {
        return Err(damaged(path, node, format!("expected FocalLength35mm above zero, found {focal_35mm}")));
    }
    let fx = focal_35mm / 36.0;
    let coefficients = match value(node, "DistortionCoeficients").or_else(|| value(node, "DistortionCoefficients")) {
        Some(text) if !text.is_empty() => numbers::<6>(path, node, text)?,
        _ => [0.0; 6],
    };
    let [k1, k2, k3, k4, t1, t2] = coefficients;
    let distortion = match value(node, "DistortionModel").unwrap_or("perspective") {
        "perspective" => Distortion::default(),
        "brown3" => Distortion::brown([k1, k2, k3, 0.0], [0.0; 2]),
        "brown4" => Distortion::brown([k1, k2, k3, k4], [0.0; 2]),
        "brown3t2" => Distortion::brown([k1, k2, k3, 0.0], [t2, t1]),
        "brown4t2" => Distortion::brown([k1, k2, k3, k4], [t2, t1]),
        other => {
            return Err(PoseFileError::Unsupported {
                path: path.into(),
                what: format!("the distortion model {other} is not read here"),
                remedy: "set the distortion model to Brown3 in the alignment settings, align and export again",
            });
        }
    };
    Ok(Intrinsics {
        size: None,
        lens: Lens::Perspective,
        focal: DVec2::new(fx, fx * number(path, node, "AspectRatio", 1.0)?),
        centre: DVec2::new(number(path, node, "PrincipalPointU", 0.0)?, number(path, node, "PrincipalPointV", 0.0)?),
        skew: number(path, node, "Skew", 0.0)?,
        distortion,
    })
}
