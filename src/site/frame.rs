//! Units, axes and poses: from the model's frame to the program's and back.

use glam::{DMat3, DVec3};

/// The axis that points up in the model's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    /// y up: east = +x, north = −z.
    Y,
    /// z up: east = +x, north = +y.
    Z,
}

/// Units, up axis and north of a model.
///
/// The program's frame is right-handed, in metres, z up, with +x towards the model's own east and +y towards its own
/// north.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Metres in one model unit.
    pub metres_per_unit: f64,
    /// The model's up axis.
    pub up: Up,
    /// Degrees clockwise, seen from above, from the model's own north to true north.
    pub north_deg: f64,
}

impl Frame {
    /// A direction in the model's axes, in the program's axes; lengths are kept.
    pub fn direction_in(&self, v: DVec3) -> DVec3 {
        match self.up {
            Up::Y => DVec3::new(v.x, -v.z, v.y),
            Up::Z => v,
        }
    }

    /// A direction in the program's axes, in the model's.
    pub fn direction_out(&self, v: DVec3) -> DVec3 {
        match self.up {
            Up::Y => DVec3::new(v.x, v.z, -v.y),
            Up::Z => v,
        }
    }

    /// A point in the model's axes and units, in metres in the program's axes.
    pub fn point_in(&self, p: DVec3) -> DVec3 {
        self.direction_in(p) * self.metres_per_unit
    }

    /// A point in the program's axes, in the model's axes and units.
    pub fn point_out(&self, p: DVec3) -> DVec3 {
        self.direction_out(p) / self.metres_per_unit
    }

    /// The rotation of a camera or panorama with this heading (degrees clockwise from true north), pitch (degrees, up
    /// positive) and roll (degrees clockwise as the camera sees it).
    pub fn rotation(&self, heading_deg: f64, pitch_deg: f64, roll_deg: f64) -> DMat3 {
        let heading = DMat3::from_rotation_z(-(heading_deg + self.north_deg).to_radians());
        let pitch = DMat3::from_rotation_x(pitch_deg.to_radians());
        let roll = DMat3::from_rotation_y(roll_deg.to_radians());
        heading * pitch * roll
    }

    /// Heading (0 to 360), pitch and roll in degrees of a rotation: the inverse of [`rotation`](Self::rotation). Straight
    /// up or down, the roll is 0.
    pub fn bearings(&self, rotation: &DMat3) -> [f64; 3] {
        let (right, forward) = (rotation.x_axis, rotation.y_axis);
        let pitch = forward.z.clamp(-1.0, 1.0).asin();
        let level = forward.cross(DVec3::Z);
        let steep = level.length() < 1e-9;
        let level = if steep { right } else { level.normalize() };
        // level is to the right of the heading
        let heading = (-level.y).atan2(level.x).to_degrees() - self.north_deg;
        let roll = (-right.dot(level.cross(forward))).atan2(right.dot(level));
        [heading.rem_euclid(360.0), pitch.to_degrees(), if steep { 0.0 } else { roll.to_degrees() }]
    }
}

/// Where a probe or camera stands and how it is turned.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    /// Metres in the program's axes, not yet re-centred (see [`crate::scene::Scene::local`]).
    pub position: DVec3,
    /// From the camera's axes (+x right, +y forward, +z up) to the program's.
    pub rotation: DMat3,
}

impl Pose {
    /// A pose at `position` that looks at `target` with the horizon level. Looking straight up or down, the picture's
    /// top is towards model north or south.
    pub fn look_at(position: DVec3, target: DVec3) -> Self {
        let forward = (target - position).normalize_or(DVec3::Y);
        let right = forward.cross(DVec3::Z).normalize_or(DVec3::X);
        let up = right.cross(forward);
        Self { position, rotation: DMat3::from_cols(right, forward, up) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bearings_come_back() {
        let frame = Frame { metres_per_unit: 1.0, up: Up::Z, north_deg: 25.0 };
        for bearings in [[0.0, 0.0, 0.0], [90.0, 30.0, -20.0], [200.0, -75.0, 170.0], [359.0, 10.0, 5.0]] {
            let back = frame.bearings(&frame.rotation(bearings[0], bearings[1], bearings[2]));
            let near = back.iter().zip(&bearings).all(|(a, b)| (a - b).abs() < 1e-9);
            assert!(near, "{back:?}, not {bearings:?}");
        }
        let up = frame.rotation(40.0, 90.0, 0.0);
        let [heading, pitch, roll] = frame.bearings(&up);
        let again = frame.rotation(heading, pitch, roll);
        assert!((again - up).to_cols_array().iter().all(|v| v.abs() < 1e-6));
    }
}
