//! HDR pictures and how their pixels map to directions.

mod picture;

pub use picture::Picture;

/// How a picture's pixels map to directions in the camera's axes (+x right, +y forward, +z up).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Latitude/longitude: the centre column looks forward, moving right turns right, the top row is up.
    LatLong,
    /// Debevec's angular map: angle from forward proportional to the distance from the centre, 180° at the rim.
    Angular,
    /// A mirror ball photographed from far away.
    MirrorBall,
    /// Equidistant fisheye: the angle from forward is proportional to the distance from the centre, 90° at the rim.
    Fisheye,
    /// A vertical cube cross, 3 × 4 faces.
    CubeCross,
    /// An ordinary photograph.
    Perspective {
        /// Vertical field of view in radians.
        fov_y: f64,
    },
}
