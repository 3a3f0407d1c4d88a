//! Cameras: a lens with a pose.

use glam::{DVec2, DVec3};

use super::Pose;
use crate::panorama::{CameraModel, Distortion, Lens};

/// A posed camera. Pixel (0, 0) is the top-left pixel's top-left corner; its centre is (0.5, 0.5).
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Where it stands and looks.
    pub pose: Pose,
    /// Picture width in pixels.
    pub width: u32,
    /// Picture height in pixels.
    pub height: u32,
    /// How ideal coordinates follow from directions.
    pub lens: Lens,
    /// Focal lengths in pixels; of a fisheye, pixels per radian on the axis.
    pub focal: DVec2,
    /// Principal point in pixels.
    pub centre: DVec2,
    /// Pixels to the right per ideal coordinate down: sensors whose columns lean.
    pub skew: f64,
    /// Lens distortion.
    pub distortion: Distortion,
}

impl Camera {
    /// A camera with this lens.
    pub fn new(pose: Pose, model: &CameraModel) -> Self {
        let CameraModel { size: [width, height], lens, focal, centre, skew, distortion } = *model;
        Self { pose, width, height, lens, focal, centre, skew, distortion }
    }

    /// A distortion-free camera with square pixels and the given vertical field of view in degrees.
    pub fn with_fov(pose: Pose, width: u32, height: u32, fov_y_deg: f64) -> Self {
        Self::new(pose, &CameraModel::with_fov([width, height], fov_y_deg))
    }

    /// Its lens, without a pose.
    pub fn model(&self) -> CameraModel {
        let Self { width, height, lens, focal, centre, skew, distortion, .. } = *self;
        CameraModel { size: [width, height], lens, focal, centre, skew, distortion }
    }

    /// Whether it is a perfect pinhole: directions are linear in pixels before they are normalised.
    pub fn is_pinhole(&self) -> bool {
        self.lens == Lens::Perspective && self.distortion.is_none() && self.skew == 0.0
    }

    /// The vertical field of view in degrees, through the middle column's ends.
    pub fn fov_y_deg(&self) -> f64 {
        let x = 0.5 * f64::from(self.width);
        let (top, bottom) = (self.direction(x, 0.0), self.direction(x, f64::from(self.height)));
        // beyond 180° the angle between the two is the wrong one
        let middle = self.direction(x, 0.5 * f64::from(self.height));
        (top.angle_between(middle) + middle.angle_between(bottom)).to_degrees()
    }

    /// The unit direction, in the program's axes, that pixel coordinates `(x, y)` look along. Where the lens
    /// [shows nothing](Self::shows), the direction on the rim of what it shows.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        self.pose.rotation * self.model().direction(x, y)
    }

    /// Whether the lens shows anything at pixel coordinates `(x, y)`. See [`CameraModel::shows`].
    pub fn shows(&self, x: f64, y: f64) -> bool {
        self.model().shows(x, y)
    }

    /// The pixel coordinates of a point (metres, program's axes, same origin as the pose), or `None` where the lens does
    /// not show it: behind a perspective camera, or outside the distortion's domain.
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        self.model().pixel(self.pose.rotation.transpose() * (point - self.pose.position))
    }

    /// The same camera for its picture turned by quarter turns clockwise, as a viewer that heeds the EXIF orientation
    /// shows it. The skew must be zero where the number of quarters is odd.
    pub(super) fn turned(&self, quarters: u32) -> Self {
        let mut turned = *self;
        for _ in 0..quarters % 4 {
            let c = turned;
            // the old left edge becomes the top: x' = height − y, y' = x
            (turned.width, turned.height) = (c.height, c.width);
            turned.focal = DVec2::new(c.focal.y, c.focal.x);
            turned.centre = DVec2::new(f64::from(c.height) - c.centre.y, c.centre.x);
            // new right is the old up, new up the old left
            let m = c.pose.rotation;
            turned.pose.rotation = glam::DMat3::from_cols(m.z_axis, m.y_axis, -m.x_axis);
        }
        turned.distortion = self.distortion.turned(quarters);
        turned
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::{Frame, Up};
    use proptest::prelude::*;

    fn camera(lens: Lens, k: [f64; 4], p: [f64; 2], skew: f64) -> Camera {
        let frame = Frame { metres_per_unit: 1.0, up: Up::Z, north_deg: 0.0 };
        let pose = Pose { position: DVec3::new(1.0, -2.0, 3.0), rotation: frame.rotation(123.0, -20.0, 15.0) };
        let mut camera = Camera::with_fov(pose, 640, 480, 60.0);
        camera.lens = lens;
        camera.focal = DVec2::new(410.0, 400.0);
        camera.centre = DVec2::new(331.0, 225.0);
        camera.skew = skew;
        camera.distortion = Distortion::brown(k, p);
        camera
    }

    /// The textbook projection in OpenCV's axes, written down on its own.
    fn opencv(c: &Camera, point: DVec3) -> DVec2 {
        let v = c.pose.rotation.transpose() * (point - c.pose.position);
        let (x, y) = (v.x / v.y, -v.z / v.y);
        let r2 = x * x + y * y;
        let [k1, k2, k3, _] = c.distortion.k();
        let [p1, p2] = c.distortion.p();
        let radial = 1.0 + k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3);
        let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        DVec2::new(c.focal.x * xd + c.skew * yd + c.centre.x, c.focal.y * yd + c.centre.y)
    }

    #[test]
    fn a_point_lands_where_opencv_puts_it() {
        let c = camera(Lens::Perspective, [-0.2, 0.05, -0.01, 0.0], [0.003, -0.002], 1.5);
        for (x, y) in [(50.0, 40.0), (600.0, 440.0), (320.0, 20.0)] {
            let point = c.pose.position + c.direction(x, y) * 7.0;
            assert!(c.project(point).unwrap().distance(opencv(&c, point)) < 1e-9);
        }
    }

    #[test]
    fn a_fisheye_counts_pixels_per_radian_and_sees_backwards() {
        let mut c = camera(Lens::Fisheye, [0.0; 4], [0.0; 2], 0.0);
        c.focal = DVec2::splat(100.0);
        for degrees in [0.0f64, 30.0, 90.0, 120.0] {
            let d = c.direction(c.centre.x + 100.0 * degrees.to_radians(), c.centre.y);
            assert!((d.angle_between(c.pose.rotation.y_axis).to_degrees() - degrees).abs() < 1e-9);
            let far = c.project(c.pose.position + d).unwrap().distance(c.centre);
            assert!((far - 100.0 * degrees.to_radians()).abs() < 1e-9);
        }
        assert!(c.shows(c.centre.x + 314.0, c.centre.y) && !c.shows(c.centre.x + 315.0, c.centre.y));
        assert!(c.direction(c.centre.x + 500.0, c.centre.y).is_normalized());
    }

    #[test]
    fn a_wide_point_does_not_fold_back_into_the_picture() {
        let c = camera(Lens::Perspective, [-0.3, 0.0, 0.0, 0.0], [0.0; 2], 0.0);
        let aside = |tan: f64| c.pose.position + c.pose.rotation * DVec3::new(tan, 1.0, 0.0);
        assert!(c.project(aside(1.0)).is_some());
        assert!(c.project(aside(1.7)).is_none(), "its polynomial leads back to the middle");
        assert!(!c.shows(c.centre.x + 0.75 * c.focal.x, c.centre.y));
    }

    #[test]
    fn a_turned_camera_sees_the_turned_picture() {
        let c = camera(Lens::Perspective, [-0.1, 0.03, 0.0, 0.0], [0.002, -0.004], 0.0);
        for (x, y) in [(100.0, 50.0), (630.0, 470.0)] {
            let point = c.pose.position + c.direction(x, y) * 3.0;
            let expected = [
                DVec2::new(x, y),
                DVec2::new(480.0 - y, x),
                DVec2::new(640.0 - x, 480.0 - y),
                DVec2::new(y, 640.0 - x),
            ];
            for (quarters, expected) in expected.into_iter().enumerate() {
                let turned = c.turned(quarters as u32);
                assert!((turned.pose.rotation.determinant() - 1.0).abs() < 1e-12);
                assert!(turned.project(point).unwrap().distance(expected) < 1e-9, "{quarters}");
            }
        }
    }

    proptest! {
        #[test]
        fn projecting_a_direction_gives_its_pixel(
            fisheye in any::<bool>(), k1 in -0.15..0.15f64, k2 in -0.05..0.05f64, p1 in -0.005..0.005f64,
            p2 in -0.005..0.005f64, skew in -3.0..3.0f64, x in 0.0..640.0f64, y in 0.0..480.0f64, far in 0.1..100.0f64,
        ) {
            let lens = if fisheye { Lens::Fisheye } else { Lens::Perspective };
            let c = camera(lens, [k1, k2, 0.0, 0.0], [p1, p2], skew);
            prop_assume!(c.shows(x, y));
            let d = c.direction(x, y);
            prop_assert!(d.is_normalized());
            let back = c.project(c.pose.position + d * far);
            prop_assert!(back.is_some_and(|b| b.distance(DVec2::new(x, y)) < 1e-7), "{back:?}");
        }
    }
}
