//! What a card is told of a camera and a sun.

use glam::{DVec3, Mat3, Vec3, Vec4};

use crate::bake::Baked;
use crate::site::Camera;

/// Nearer surfaces are not shown, metres: as `render` has it.
const NEAREST_M: f32 = 1e-3;

/// Part of a camera's picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tile {
    pub(super) left: u32,
    pub(super) top: u32,
    pub(super) width: u32,
    pub(super) height: u32,
}

/// Tiles over a picture, each side at most so many pixels.
pub(super) fn tiles(width: u32, height: u32, most: u32) -> Vec<Tile> {
    let tile = |left: u32, top: u32| Tile { left, top, width: most.min(width - left), height: most.min(height - top) };
    let row = |top: u32| (0..width).step_by(most as usize).map(move |left| tile(left, top));
    (0..height).step_by(most as usize).flat_map(row).collect()
}

/// `Frame` in shader.wgsl.
pub(super) type Uniform = [[f32; 4]; 10];

/// A tile of a camera's picture: how points and samples lie in it.
pub(super) struct View {
    pub(super) eye: Vec3,
    /// Clip coordinates x, y and w of a point relative to the eye.
    pub(super) clip: [Vec3; 3],
    /// Direction of the first sample's corner, and what a sample to the right and down adds.
    rays: [Vec3; 3],
    samples: u32,
}

impl View {
    /// Of a pinhole camera, `samples` along a pixel's side; `origin` is the scene's.
    pub(super) fn new(camera: &Camera, origin: DVec3, tile: Tile, samples: u32) -> Self {
        let m = camera.pose.rotation;
        let (right, forward, up) = (m.x_axis, m.y_axis, m.z_axis);
        let [left, top, width, height] = [tile.left, tile.top, tile.width, tile.height].map(f64::from);
        let (f, c) = (camera.focal, camera.centre);
        let x = right * (2.0 * f.x / width) + forward * (2.0 * (c.x - left) / width - 1.0);
        let y = up * (2.0 * f.y / height) + forward * (1.0 - 2.0 * (c.y - top) / height);
        let (across, down) = (right / f.x, -up / f.y);
        let corner = forward + across * (left - c.x) + down * (top - c.y);
        let step = 1.0 / f64::from(samples);
        Self {
            eye: (camera.pose.position - origin).as_vec3(),
            clip: [x, y, forward].map(|v| v.as_vec3()),
            rays: [corner, across * step, down * step].map(|v| v.as_vec3()),
            samples,
        }
    }

    /// Whether anything of a box may be in the picture.
    pub(super) fn may_show(&self, low: Vec3, high: Vec3) -> bool {
        let ([x, y, w], low, high) = (self.clip, low - self.eye, high - self.eye);
        [w + x, w - x, w + y, w - y, w].iter().all(|side| (side * low).max(side * high).element_sum() >= 0.0)
    }

    /// Square of the distance from the eye to a box.
    pub(super) fn distance2(&self, low: Vec3, high: Vec3) -> f32 {
        (low - self.eye).max(self.eye - high).max(Vec3::ZERO).length_squared()
    }

    pub(super) fn uniform(&self, sun: &SunView) -> Uniform {
        let with = |v: Vec3, w: f32| v.extend(w).to_array();
        let ([x, y, w], [corner, right, down]) = (self.clip, self.rays);
        let [across, upwards, depth] = sun.rows.map(|row| row.to_array());
        [
            with(x, NEAREST_M),
            with(y, self.samples as f32),
            with(w, sun.off_m),
            with(self.eye, 0.0),
            with(corner, 0.0),
            with(right, 0.0),
            with(down, 0.0),
            across,
            upwards,
            depth,
        ]
    }
}

/// How the sun sees a model: straight down along its rays.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SunView {
    /// A place with a 1 behind it → across, down and depth, each 0..=1 over the model's box.
    rows: [Vec4; 3],
    /// How far off its surface a point asks for the sun, metres.
    off_m: f32,
}

impl SunView {
    /// Towards a sun, on a map of so many texels a side.
    pub(super) fn new(baked: &Baked, sun: Vec3, side: u32) -> Self {
        let level = if sun.z.abs() < 0.9 { Vec3::Z } else { Vec3::X }.cross(sun).normalize();
        let axes = [level, sun.cross(level), -sun];
        let to_sun = Mat3::from_cols(axes[0], axes[1], axes[2]).transpose();
        let (low, high) = (baked.vertices.iter().map(|v| to_sun * v.position))
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let size = (high - low).max(Vec3::splat(f32::MIN_POSITIVE));
        let rows = [0, 1, 2].map(|c| (axes[c] / size[c]).extend(-low[c] / size[c]));
        Self { rows, off_m: 2.0 * size.x.max(size.y) / side as f32 }
    }

    /// For drawing what the sun sees: without a camera.
    pub(super) fn uniform(&self) -> Uniform {
        let mut all = [[0.0; 4]; 10];
        all[7..].copy_from_slice(&self.rows.map(|row| row.to_array()));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::{Frame, Pose, Up};
    use glam::DVec2;

    #[test]
    fn points_land_where_the_camera_projects_them_and_rays_lead_back() {
        let frame = Frame { metres_per_unit: 1.0, up: Up::Z, north_deg: 0.0 };
        let pose = Pose { position: DVec3::new(5e5, -2.0, 3.0), rotation: frame.rotation(123.0, -20.0, 15.0) };
        let mut camera = Camera::with_fov(pose, 640, 480, 60.0);
        (camera.focal, camera.centre) = (DVec2::new(410.0, 400.0), DVec2::new(331.0, 225.0));
        let origin = DVec3::new(5e5, 0.0, 0.0);
        let tile = Tile { left: 256, top: 128, width: 200, height: 100 };
        let view = View::new(&camera, origin, tile, 3);
        for (x, y) in [(256.0, 128.0), (300.5, 200.25), (456.0, 228.0)] {
            let point = pose.position + camera.direction(x, y) * 7.0;
            let p = (point - origin).as_vec3() - view.eye;
            let [cx, cy, w] = view.clip.map(|row| row.dot(p));
            let at = DVec2::new(f64::from(cx / w), f64::from(cy / w));
            let expected = DVec2::new((x - 256.0) / 100.0 - 1.0, 1.0 - (y - 128.0) / 50.0);
            assert!(at.distance(expected) < 1e-4, "{at} {expected}");
            assert!(view.may_show(p + view.eye, p + view.eye) && !view.may_show(view.eye - p, view.eye - p));
            let [corner, right, down] = view.rays;
            let d = corner + right * (3.0 * (x as f32 - 256.0)) + down * (3.0 * (y as f32 - 128.0));
            assert!(d.as_dvec3().normalize().distance(camera.direction(x, y)) < 1e-6);
        }
    }

    #[test]
    fn tiles_cover_a_picture_once() {
        let all = tiles(1000, 300, 256);
        assert_eq!(all.iter().map(|t| t.width * t.height).sum::<u32>(), 300_000);
        assert_eq!((all.len(), all[7]), (8, Tile { left: 768, top: 256, width: 232, height: 44 }));
    }
}
