//! How a probe or view is turned: bearings, a point to look at, a quaternion or a matrix.

use glam::{DMat3, DQuat, DVec3};
use std::ops::Range;
use toml::Spanned;

use super::fault::{SiteError, Source};
use super::file::{Matrix, Number, Orientation, Quaternion, Vector};
use super::frame::{Frame, Pose, exact_rotation};

/// Largest departure from unit length that counts as rounding.
const TOLERANCE: f64 = 1e-3;

impl Orientation<'_> {
    /// The pose at `position` (model's axes and units). No orientation key at all is heading 0, level.
    pub(super) fn pose(&self, source: &Source, frame: &Frame, position: DVec3) -> Result<Pose, SiteError> {
        let at = frame.point_in(position);
        self.only_one_way(source)?;
        if let Some(target) = self.look_at {
            let to = finite(source, target)?;
            if (to - position).length() < 1e-9 * position.length().max(1.0) {
                return Err(source.fault(
                    target.span(),
                    "look_at is the position itself",
                    "Give a point that lies in front of the camera",
                ));
            }
            return Ok(Pose::look_at(at, frame.point_in(to)));
        }
        let rotation = if let Some(wxyz) = self.rotation {
            frame_from_model(frame, quaternion(source, wxyz)?)
        } else if let Some(rows) = self.matrix {
            frame_from_model(frame, matrix(source, rows)?)
        } else {
            let angle = |key: &Option<Number>| key.as_ref().map_or(Ok(0.0), |v| finite_number(source, v));
            frame.rotation(angle(self.heading)?, angle(self.pitch)?, angle(self.roll)?)
        };
        Ok(Pose { position: at, rotation })
    }

    /// Where any orientation is given.
    pub(super) fn given(&self) -> Option<Range<usize>> {
        self.ways().next()
    }

    /// Where each way to give it is used.
    fn ways(&self) -> impl Iterator<Item = Range<usize>> {
        let bearings = [self.heading, self.pitch, self.roll].into_iter().flatten().map(Spanned::span).next();
        let rotation = self.rotation.as_ref().map(Spanned::span);
        let matrix = self.matrix.as_ref().map(Spanned::span);
        let target = self.look_at.as_ref().map(Spanned::span);
        [bearings, rotation, matrix, target].into_iter().flatten()
    }

    fn only_one_way(&self, source: &Source) -> Result<(), SiteError> {
        self.ways().nth(1).map_or(Ok(()), |second| {
            Err(source.fault(
                second,
                "the orientation is given twice",
                "Keep one of: heading with pitch and roll, rotation, matrix, look_at",
            ))
        })
    }
}

/// From the camera's axes in the model's convention to the program's.
///
/// A quaternion or matrix in the site file takes the camera axes of OpenGL, Blender and glTF (+x right, +y up, −z
/// forward) to the model's axes. The program's camera has +x right, +y forward, +z up.
fn frame_from_model(frame: &Frame, model_from_camera: DMat3) -> DMat3 {
    let axis = |v: DVec3| frame.direction_in(model_from_camera * v);
    DMat3::from_cols(axis(DVec3::X), axis(DVec3::NEG_Z), axis(DVec3::Y))
}

pub(super) fn quaternion(source: &Source, wxyz: &Quaternion) -> Result<DMat3, SiteError> {
    let [w, x, y, z] = **wxyz.get_ref();
    let q = DQuat::from_xyzw(x, y, z, w);
    let length = q.length();
    if !length.is_finite() || (length - 1.0).abs() > TOLERANCE {
        return Err(source.fault(
            wxyz.span(),
            format!("expected a unit quaternion [w, x, y, z], found one of length {length:.4}"),
            "Divide its four numbers by its length, and check that w comes first",
        ));
    }
    Ok(DMat3::from_quat(q.normalize()))
}

pub(super) fn matrix(source: &Source, rows: &Matrix) -> Result<DMat3, SiteError> {
    let m = DMat3::from_cols_array_2d(&rows.get_ref().map(|row| *row)).transpose();
    exact_rotation(m).ok_or_else(|| {
        let (problem, help) = match exact_rotation(-m) {
            Some(_) => (
                "expected a rotation matrix, found one that mirrors (its determinant is −1)",
                "Check the axes: the columns are the camera's right, up and backward in the model's axes",
            ),
            None => (
                "expected a rotation matrix (rows at right angles and of length 1)",
                "Give three rows without scale or shear; leave a translation out",
            ),
        };
        source.fault(rows.span(), problem, help)
    })
}

/// Three finite numbers.
pub(super) fn finite(source: &Source, vector: &Vector) -> Result<DVec3, SiteError> {
    let v = DVec3::from_array(**vector.get_ref());
    if v.is_finite() {
        return Ok(v);
    }
    Err(source.fault(
        vector.span(),
        format!("expected three finite numbers, found {v}"),
        "Measure it again, or leave it out",
    ))
}

/// One finite number.
pub(super) fn finite_number(source: &Source, number: &Number) -> Result<f64, SiteError> {
    let v = *number.get_ref();
    if v.is_finite() {
        return Ok(v);
    }
    Err(source.fault(
        number.span(),
        format!("expected a finite number, found {v}"),
        "Measure it again, or leave it out",
    ))
}
