//! How pixels map to directions and back.

use glam::{DVec2, DVec3};

pub(crate) mod cube;
pub(crate) mod latlong;
mod radial;

use super::lens::camera_model::CameraModel;
use radial::Radial;

/// How a picture's pixels map to directions in the camera's axes (+x right, +y forward, +z up).
///
/// All are as seen from inside: the centre looks forward, moving right turns right, up is up. Pixel coordinates run
/// from (0, 0), the top-left corner of the top-left pixel, to (width, height); pixel centres lie at halves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Latitude/longitude, 2:1: the centre column looks forward, moving right turns right, the top row is up.
    LatLong,
    /// Debevec's angular map, 1:1: angle from forward proportional to the distance from the centre, 180° at the rim.
    Angular,
    /// A mirror ball seen from far away, 1:1: the angle from forward is 2·asin(distance from the centre), 180° at the
    /// rim. A ball's own photograph shows its surroundings mirrored: flip it left to right first; forward is then from
    /// the ball to the camera.
    MirrorBall,
    /// Equidistant fisheye, 1:1: the angle from forward is proportional to the distance from the centre, 90° at the rim.
    Fisheye,
    /// A cube cross. Vertical, 3:4: up; left, front, right; down; back upside down. Horizontal, 4:3: up; left, front,
    /// right, back; down. Which of them is told by the picture's shape; up and down stand above and below front.
    CubeCross,
    /// An ordinary photograph with square pixels and no distortion.
    Perspective {
        /// Vertical field of view in radians.
        fov_y: f64,
    },
    /// A photograph through a calibrated lens.
    Camera(CameraModel),
}

impl Projection {
    /// The unit direction, in the camera's axes, of pixel coordinates in a `width × height` picture; `None` where the
    /// picture shows nothing (outside the disc, the cross or the frame).
    pub fn direction(&self, width: usize, height: usize, x: f64, y: f64) -> Option<DVec3> {
        if !(0.0..=width as f64).contains(&x) || !(0.0..=height as f64).contains(&y) {
            return None;
        }
        match self {
            Self::LatLong => Some(latlong::direction(width, height, x, y)),
            Self::Angular => Radial::ANGULAR.direction(width, height, x, y),
            Self::MirrorBall => Radial::MIRROR_BALL.direction(width, height, x, y),
            Self::Fisheye => Radial::FISHEYE.direction(width, height, x, y),
            Self::CubeCross => cube::direction(width, height, x, y),
            Self::Perspective { fov_y } => camera(*fov_y, width, height).direction(width, height, x, y),
            Self::Camera(model) => {
                let at = DVec2::new(x, y) / model.stretch(width, height);
                model.shows(at.x, at.y).then(|| model.direction(at.x, at.y))
            }
        }
    }

    /// The pixel coordinates of a direction in the camera's axes, of any length but zero; `None` where the picture
    /// does not show it.
    pub fn pixel(&self, width: usize, height: usize, direction: DVec3) -> Option<DVec2> {
        match self {
            Self::LatLong => Some(latlong::pixel(width, height, direction)),
            Self::Angular => Radial::ANGULAR.pixel(width, height, direction),
            Self::MirrorBall => Radial::MIRROR_BALL.pixel(width, height, direction),
            Self::Fisheye => Radial::FISHEYE.pixel(width, height, direction),
            Self::CubeCross => Some(cube::pixel(width, height, direction)),
            Self::Perspective { fov_y } => camera(*fov_y, width, height).pixel(width, height, direction),
            Self::Camera(model) => {
                let p = model.pixel(direction)? * model.stretch(width, height);
                let inside = (0.0..=width as f64).contains(&p.x) && (0.0..=height as f64).contains(&p.y);
                inside.then_some(p)
            }
        }
    }

    /// The solid angle of pixel `(x, y)` in steradians: of the part of the pixel that shows something, 0 where none
    /// does. Closed forms, or to 10⁻¹² by Gauss quadrature along the pixel's rim (angular map and fisheye); with a
    /// distorted lens as [`CameraModel::solid_angle`] has it.
    pub fn solid_angle(&self, width: usize, height: usize, x: usize, y: usize) -> f64 {
        match self {
            Self::LatLong => latlong::solid_angle(width, height, y),
            Self::Angular => Radial::ANGULAR.solid_angle(width, height, x, y),
            Self::MirrorBall => Radial::MIRROR_BALL.solid_angle(width, height, x, y),
            Self::Fisheye => Radial::FISHEYE.solid_angle(width, height, x, y),
            Self::CubeCross => cube::solid_angle(width, height, x, y),
            Self::Perspective { fov_y } => camera(*fov_y, width, height).solid_angle(width, height, x, y),
            Self::Camera(model) => {
                let by = model.stretch(width, height);
                let [low, middle, high] = [0.0, 0.5, 1.0].map(|d| DVec2::new(x as f64 + d, y as f64 + d) / by);
                if model.shows(middle.x, middle.y) { model.solid_angle(low, high) } else { 0.0 }
            }
        }
    }

    /// The same for pictures of this size alone: of a field of view the lens, which is costly to find for each pixel anew.
    pub(super) fn calibrated(self, width: usize, height: usize) -> Self {
        match self {
            Self::Perspective { fov_y } => camera(fov_y, width, height),
            other => other,
        }
    }

    /// Whether it shows a part of the surroundings only, as a photograph does: its field of view is its own.
    pub fn is_photograph(&self) -> bool {
        matches!(self, Self::Perspective { .. } | Self::Camera(_))
    }
}

/// A perspective picture of this size as one through a lens.
fn camera(fov_y: f64, width: usize, height: usize) -> Projection {
    Projection::Camera(CameraModel::with_fov([width as u32, height as u32], fov_y.to_degrees()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::{Distortion, Lens};
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn all() -> [Projection; 8] {
        let mut barrel = CameraModel::with_fov([60, 40], 63.0);
        barrel.focal.x *= 1.1;
        barrel.distortion = Distortion::brown([-0.1, 0.01, 0.0, 0.0], [0.0; 2]);
        let fisheye = CameraModel { lens: Lens::Fisheye, focal: DVec2::splat(12.0), ..barrel };
        [
            Projection::LatLong,
            Projection::Angular,
            Projection::MirrorBall,
            Projection::Fisheye,
            Projection::CubeCross,
            Projection::Perspective { fov_y: 1.1 },
            Projection::Camera(barrel),
            Projection::Camera(fisheye),
        ]
    }

    fn total(projection: Projection, width: usize, height: usize) -> f64 {
        let rows = (0..height).map(|y| (0..width).map(|x| projection.solid_angle(width, height, x, y)).sum::<f64>());
        rows.sum()
    }

    #[test]
    fn solid_angles_sum_to_what_is_shown() {
        for (width, height) in [(1, 1), (2, 3), (64, 32), (31, 47), (60, 80), (80, 60)] {
            for full in [Projection::LatLong, Projection::Angular, Projection::MirrorBall, Projection::CubeCross] {
                let sum = total(full, width, height);
                assert!((sum - 4.0 * PI).abs() < 1e-9, "{full:?} {width}×{height}: {sum}");
            }
            let half = total(Projection::Fisheye, width, height);
            assert!((half - 2.0 * PI).abs() < 1e-9, "fisheye {width}×{height}: {half}");
            // a rectangle's solid angle (Khadjavi 1968): 4 asin(sin(a/2) sin(b/2))
            let fov_y: f64 = 1.1;
            let fov_x = 2.0 * ((fov_y / 2.0).tan() * width as f64 / height as f64).atan();
            let closed = 4.0 * ((fov_x / 2.0).sin() * (fov_y / 2.0).sin()).asin();
            let sum = total(Projection::Perspective { fov_y }, width, height);
            assert!((sum - closed).abs() < 1e-9, "perspective {width}×{height}: {sum} for {closed}");
            let model = CameraModel::with_fov([3 * width as u32, 3 * height as u32], fov_y.to_degrees());
            let camera = total(Projection::Camera(model), width, height);
            assert!((camera - closed).abs() < 1e-9, "camera {width}×{height}: {camera} for {closed}");
        }
    }

    #[test]
    fn a_pixel_covers_what_its_directions_spread_over() {
        // |∂d/∂x × ∂d/∂y| integrated over the pixel by the midpoint rule, against the exact solid angle
        let (width, height, n) = (24, 32, 40);
        for projection in all() {
            for (x, y) in [(11, 15), (9, 12), (12, 18), (10, 9)] {
                let mut sum = 0.0;
                for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
                    let at = |dx: f64, dy: f64| {
                        let px = x as f64 + (i as f64 + 0.5 + dx) / n as f64;
                        let py = y as f64 + (j as f64 + 0.5 + dy) / n as f64;
                        projection.direction(width, height, px, py).unwrap()
                    };
                    let (a, b) = (at(0.4, 0.0) - at(-0.4, 0.0), at(0.0, 0.4) - at(0.0, -0.4));
                    sum += a.cross(b).length() / 0.64;
                }
                let exact = projection.solid_angle(width, height, x, y);
                assert!((sum - exact).abs() < 2e-3 * exact, "{projection:?} ({x}, {y}): {sum} for {exact}");
            }
        }
    }

    #[test]
    fn the_centre_looks_forward_and_right_is_right() {
        for projection in all() {
            // a vertical cross has its front face above the middle
            let (w, h, cy) = if projection == Projection::CubeCross { (30, 40, 15.0) } else { (40, 40, 20.0) };
            let cx = w as f64 / 2.0;
            let forward = projection.direction(w, h, cx, cy).unwrap();
            assert!((forward - DVec3::Y).length() < 1e-12, "{projection:?}: {forward}");
            let right = projection.direction(w, h, cx + 2.0, cy).unwrap();
            assert!(right.x > 0.05 && right.z.abs() < 1e-12, "{projection:?}: {right}");
            let up = projection.direction(w, h, cx, cy - 2.0).unwrap();
            assert!(up.z > 0.05 && up.x.abs() < 1e-12, "{projection:?}: {up}");
        }
    }

    #[test]
    fn discs_crosses_and_frames_end() {
        assert!(Projection::Angular.direction(100, 100, 1.0, 1.0).is_none());
        assert!(Projection::CubeCross.direction(30, 40, 1.0, 1.0).is_none());
        assert!(Projection::Fisheye.pixel(100, 100, DVec3::NEG_Y).is_none());
        assert!(Projection::Perspective { fov_y: FRAC_PI_2 }.pixel(100, 100, DVec3::NEG_Y).is_none());
        assert!(Projection::Perspective { fov_y: FRAC_PI_2 }.pixel(100, 100, DVec3::new(1.1, 1.0, 0.0)).is_none());
        assert_eq!(Projection::Fisheye.solid_angle(100, 100, 0, 0), 0.0);
        assert!(Projection::LatLong.direction(10, 10, 10.1, 5.0).is_none());
    }

    proptest! {
        #[test]
        fn pixel_undoes_direction(which in 0..8usize, w in 3usize..3000, h in 3usize..3000, u in 0.001..0.999, v in 0.001..0.999) {
            let projection = all()[which];
            let (x, y) = (u * w as f64, v * h as f64);
            if let Some(direction) = projection.direction(w, h, x, y) {
                prop_assert!((direction.length() - 1.0).abs() < 1e-12);
                let p = projection.pixel(w, h, direction * 3.7);
                prop_assert!(p.is_some_and(|p| p.distance(DVec2::new(x, y)) < 1e-6 * w.max(h) as f64), "{:?} {} {} {:?}", projection, x, y, p);
            }
        }
    }
}
