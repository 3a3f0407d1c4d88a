//! Units, axes and poses: from the model's frame to the program's and back.

use glam::{DMat3, DQuat, DVec2, DVec3};

/// What points up in the model's file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Up {
    /// y up: east = +x, north = −z.
    Y,
    /// z up: east = +x, north = +y.
    Z,
    /// Any other direction. Made by [`Up::along`].
    Turned {
        /// From the model's axes to east, north and up.
        rotation: DMat3,
    },
}

/// A unit that people model in.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Unit {
    /// As the site file names it.
    pub key: &'static str,
    /// As a sentence does.
    pub name: &'static str,
    /// Metres in one.
    pub metres: f64,
}

/// The units that people model in.
pub const UNITS: [Unit; 5] = [
    Unit { key: "m", name: "metres", metres: 1.0 },
    Unit { key: "cm", name: "centimetres", metres: 0.01 },
    Unit { key: "mm", name: "millimetres", metres: 0.001 },
    Unit { key: "ft", name: "feet", metres: 0.3048 },
    Unit { key: "in", name: "inches", metres: 0.0254 },
];

/// The model's axes that may point up, with the east and the north that go with each.
const UPRIGHT: [[DVec3; 3]; 6] = [
    [DVec3::X, DVec3::NEG_Z, DVec3::Y],
    [DVec3::X, DVec3::Y, DVec3::Z],
    [DVec3::Y, DVec3::Z, DVec3::X],
    [DVec3::Y, DVec3::NEG_Z, DVec3::NEG_X],
    [DVec3::X, DVec3::Z, DVec3::NEG_Y],
    [DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z],
];

impl Up {
    /// A direction of any length but 0 that points up; `None` where it has no length or is not finite.
    ///
    /// East and north are those of the axis that is nearest to it, turned with that axis on the shortest way:
    ///
    /// | up | east | north |
    /// |---|---|---|
    /// | y | x | −z |
    /// | z | x | y |
    /// | x | y | z |
    /// | −x | y | −z |
    /// | −y | x | z |
    /// | −z | x | −y |
    pub fn along(direction: DVec3) -> Option<Self> {
        // lengths near the ends of the range must not become 0 or infinite when squared
        let up = (direction / direction.abs().max_element()).try_normalize()?;
        let nearer = |a: &[DVec3; 3], b: &[DVec3; 3]| if b[2].dot(up) > a[2].dot(up) + 1e-12 { *b } else { *a };
        let [east, north, axis] = UPRIGHT.iter().skip(1).fold(UPRIGHT[0], |best, next| nearer(&best, next));
        if (up - axis).length() < 1e-12 && axis == DVec3::Y {
            return Some(Self::Y);
        }
        if (up - axis).length() < 1e-12 && axis == DVec3::Z {
            return Some(Self::Z);
        }
        let tilt = DQuat::from_rotation_arc(axis, up);
        let rotation = DMat3::from_cols(tilt * east, tilt * north, up).transpose();
        Some(Self::Turned { rotation })
    }

    /// The direction in the model's axes; unit length.
    pub fn direction(&self) -> DVec3 {
        match self {
            Self::Y => DVec3::Y,
            Self::Z => DVec3::Z,
            Self::Turned { rotation } => rotation.transpose() * DVec3::Z,
        }
    }

    /// How a person writes it in a site file: `y`, `-z`, or three numbers.
    pub fn name(&self) -> String {
        let up = self.direction();
        let names = ["y", "z", "x", "-x", "-y", "-z"];
        let axis = UPRIGHT.iter().zip(names).find(|(axes, _)| (axes[2] - up).length() < 1e-9);
        axis.map_or_else(|| format!("[{:.3}, {:.3}, {:.3}]", up.x, up.y, up.z), |(_, name)| name.to_owned())
    }
}

/// Units, up axis and north of a model.
///
/// The program's frame is right-handed, in metres, z up, with +x towards the model's own east and +y towards its own
/// north.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Metres in one model unit.
    pub metres_per_unit: f64,
    /// What points up in the model's axes.
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
            Up::Turned { rotation } => rotation * v,
        }
    }

    /// A direction in the program's axes, in the model's.
    pub fn direction_out(&self, v: DVec3) -> DVec3 {
        match self.up {
            Up::Y => DVec3::new(v.x, v.z, -v.y),
            Up::Z => v,
            Up::Turned { rotation } => rotation.transpose() * v,
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

    /// A point in plan, given as the site file gives it in model units, in metres in the program's x and y: the pair
    /// (x, z) where y is up, (x, y) where z is up, (east, north) where neither is.
    pub fn plan_in(&self, [a, b]: [f64; 2]) -> DVec2 {
        match self.up {
            Up::Y => DVec2::new(a, -b) * self.metres_per_unit,
            Up::Z | Up::Turned { .. } => DVec2::new(a, b) * self.metres_per_unit,
        }
    }

    /// The inverse of [`plan_in`](Self::plan_in).
    pub fn plan_out(&self, p: DVec2) -> [f64; 2] {
        let p = p / self.metres_per_unit;
        match self.up {
            Up::Y => [p.x, -p.y],
            Up::Z | Up::Turned { .. } => [p.x, p.y],
        }
    }

    /// The height of a point in metres in the program's axes, in model units along the model's up direction.
    pub fn height_out(&self, z: f64) -> f64 {
        z / self.metres_per_unit
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

/// A rotation matrix made exactly one; `None` where it is none to 10⁻³.
pub(super) fn exact_rotation(m: DMat3) -> Option<DMat3> {
    let departure = (m * m.transpose() - DMat3::IDENTITY).to_cols_array().iter().fold(0.0, |a: f64, v| a.max(v.abs()));
    (m.is_finite() && departure < 2e-3 && m.determinant() > 0.0)
        .then(|| DMat3::from_quat(DQuat::from_mat3(&m).normalize()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_direction_can_be_up() {
        assert_eq!((Up::along(DVec3::Y * 3.0), Up::along(DVec3::Z)), (Some(Up::Y), Some(Up::Z)));
        assert_eq!((Up::along(DVec3::ZERO), Up::along(DVec3::new(f64::NAN, 1.0, 0.0))), (None, None));
        let tilted = DVec3::new(0.1, 0.0, 0.99);
        let all =
            [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z, tilted, DVec3::splat(1e-200)];
        for v in all {
            let frame = Frame { metres_per_unit: 0.5, up: Up::along(v).unwrap(), north_deg: 0.0 };
            assert!(frame.direction_in(v.normalize_or_zero()).distance(DVec3::Z) < 1e-12 || v.x == 1e-200);
            assert!((frame.up.direction() - (v / v.abs().max_element()).normalize()).length() < 1e-12);
            let p = DVec3::new(1.0, -2.0, 3.0);
            assert!(frame.point_out(frame.point_in(p)).distance(p) < 1e-12);
            let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|a| frame.direction_in(a));
            assert!((DMat3::from_cols_array_2d(&axes.map(|a| a.to_array())).determinant() - 1.0).abs() < 1e-12);
            assert_eq!(frame.plan_out(frame.plan_in([4.0, -7.0])), [4.0, -7.0]);
        }
        // a little tilt turns east and north a little
        let frame = Frame { metres_per_unit: 1.0, up: Up::along(tilted).unwrap(), north_deg: 0.0 };
        assert!(
            frame.direction_in(DVec3::X).distance(DVec3::X) < 0.11
                && frame.direction_in(DVec3::Y).distance(DVec3::Y) < 1e-12
        );
        let names = all[..7].iter().map(|v| Up::along(*v).unwrap().name()).collect::<Vec<_>>();
        assert_eq!(names, ["x", "-x", "y", "-y", "z", "-z", "[0.100, 0.000, 0.995]"]);
    }

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
