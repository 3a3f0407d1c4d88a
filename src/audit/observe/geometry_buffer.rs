//! What the model shows in each pixel of a photograph.

use glam::{DVec2, DVec3, Mat3, Vec2, Vec3};
use rayon::prelude::*;

use crate::audit::observe::uv_islands::{Mapped, cut, runs_on};
use crate::audit::picture::regions::Segments;
use crate::edge_aware::EdgeAware;
use crate::render::{Cast, first_hits};
use crate::scene::{Ray, Scene};
use crate::site::Camera;

/// No surface.
pub(crate) const NONE: u32 = u32::MAX;

/// A line lies in a plane if it leaves it by no more than this sine of an angle, and two places do if the line between them does.
const FLAT: f32 = 0.1;

/// Side of the parts that a smooth surface is looked at in, pixels.
const PART_PX: usize = 48;

/// The surfaces in the middle of each pixel.
pub(crate) struct GeometryBuffer {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// The camera's place, local metres.
    pub(crate) origin: Vec3,
    /// Focal length in pixels.
    pub(crate) focal: f32,
    /// For lenses that are no pinhole.
    camera: Option<(Camera, DVec3)>,
    to_camera: Mat3,
    focals: Vec2,
    centre: Vec2,
    /// Unit direction of each pixel's middle.
    pub(crate) ray: Vec<Vec3>,
    /// Distance along it, metres; infinite without a surface.
    pub(crate) distance: Vec<f32>,
    pub(crate) position: Vec<Vec3>,
    /// Unit normal towards the camera.
    pub(crate) normal: Vec<Vec3>,
    /// [`NONE`] without a surface.
    pub(crate) triangle: Vec<u32>,
    /// Where in the triangle.
    pub(crate) barycentric: Vec<Vec2>,
    pub(crate) material: Vec<u32>,
    /// Which neighbours lie on one smooth surface, whatever its material.
    pub(crate) shape: EdgeAware,
    /// Per pixel, a number that is the same all over a smooth surface.
    pub(crate) label: Vec<u32>,
    /// Which neighbours lie on one smooth surface of one material, mapped in one piece.
    pub(crate) paint: EdgeAware,
    /// What is mapped in one piece.
    pub(crate) segments: Segments,
}

/// The camera of a picture whose pixels are averages of `n` × `n` of this camera's.
pub(crate) fn reduced(camera: &Camera, n: u32) -> Camera {
    let scale = 1.0 / f64::from(n);
    Camera {
        width: camera.width.div_ceil(n),
        height: camera.height.div_ceil(n),
        focal: camera.focal * scale,
        centre: camera.centre * scale,
        ..*camera
    }
}

/// The pixel of such averages that a pixel of a picture so wide goes into.
pub(crate) fn averaged_in(i: usize, width: usize, n: usize) -> usize {
    i / width / n * width.div_ceil(n) + i % width / n
}

impl GeometryBuffer {
    /// Casts a ray through the middle of each pixel.
    pub(crate) fn look(scene: &Scene, camera: &Camera) -> Self {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let origin = scene.local(camera.pose.position);
        let surface = |&Cast { direction, hit }: &Cast| {
            (direction, hit.map(|hit| (hit.t, scene.surface(&Ray { origin, direction }, &hit))))
        };
        let found: Vec<_> = first_hits(scene, camera).par_iter().map(surface).collect();
        let mut this = Self {
            width,
            height,
            origin,
            focal: camera.focal.y as f32,
            camera: (!camera.is_pinhole()).then_some((*camera, scene.origin)),
            to_camera: camera.pose.rotation.transpose().as_mat3(),
            focals: camera.focal.as_vec2(),
            centre: camera.centre.as_vec2(),
            ray: found.iter().map(|f| f.0).collect(),
            distance: found.iter().map(|f| f.1.as_ref().map_or(f32::INFINITY, |s| s.0)).collect(),
            position: found.iter().map(|f| f.1.as_ref().map_or(Vec3::ZERO, |s| s.1.position)).collect(),
            normal: found.iter().map(|f| f.1.as_ref().map_or(Vec3::ZERO, |s| s.1.normal)).collect(),
            triangle: found.iter().map(|f| f.1.as_ref().map_or(NONE, |s| s.1.triangle)).collect(),
            barycentric: found.iter().map(|f| f.1.as_ref().map_or(Vec2::ZERO, |s| s.1.barycentric)).collect(),
            material: found
                .iter()
                .map(|f| f.1.as_ref().map_or(NONE, |s| scene.mesh.materials[s.1.triangle as usize]))
                .collect(),
            shape: EdgeAware::open(1, 1),
            label: Vec::new(),
            paint: EdgeAware::open(1, 1),
            segments: Segments::default(),
        };
        this.smooth_normals();
        this.shape = EdgeAware::new(width, height, |i, j| this.one_surface(i, j));
        this.label = this.shape.labels();
        let painted =
            EdgeAware::new(width, height, |i, j| this.material[i] == this.material[j] && this.shape.joined(i, j));
        let textured =
            |i: usize| this.triangle[i] != NONE && scene.materials[this.material[i] as usize].texture.is_some();
        let mapped = |i: usize| {
            let uv = if textured(i) { scene.mesh.uv(this.triangle[i], this.barycentric[i]) } else { None };
            Mapped { triangle: this.triangle[i], position: this.position[i], uv }
        };
        this.paint = cut(&painted, |i, j| runs_on(&scene.mesh, mapped(i), mapped(j)));
        this.segments = Segments::new(&this.paint);
        this
    }

    /// Takes for each normal the mean of those around it on the same surface: a scan is rough where the wall is not. Beyond a
    /// crease lies another surface.
    fn smooth_normals(&mut self) {
        const RADIUS: usize = 3;
        const CREASE: f32 = 0.75;
        let (w, h) = (self.width, self.height);
        let mean = |i: usize| {
            if self.triangle[i] == NONE {
                return self.normal[i];
            }
            let (x, y, n) = (i % w, i / w, self.normal[i]);
            let reach = RADIUS as f32 * self.distance[i] / self.focal;
            let mut sum = Vec3::ZERO;
            for v in y.saturating_sub(RADIUS)..=(y + RADIUS).min(h - 1) {
                for u in x.saturating_sub(RADIUS)..=(x + RADIUS).min(w - 1) {
                    let j = v * w + u;
                    let beside = n.dot(self.position[j] - self.position[i]).abs() < reach;
                    if self.triangle[j] != NONE && n.dot(self.normal[j]) > CREASE && beside {
                        sum += self.normal[j];
                    }
                }
            }
            sum.try_normalize().unwrap_or(n)
        };
        self.normal = (0..w * h).into_par_iter().map(mean).collect();
    }

    /// Whether two neighbouring pixels see one smooth surface: normals within 18° and each point near the other's plane.
    fn one_surface(&self, i: usize, j: usize) -> bool {
        if self.triangle[i] == NONE || self.triangle[j] == NONE {
            return self.triangle[i] == self.triangle[j];
        }
        let (a, b) = (self.normal[i], self.normal[j]);
        let gap = self.position[j] - self.position[i];
        // a step as deep as a pixel is wide, seen at 45°, is an edge
        let step = 1.0 * self.distance[i].min(self.distance[j]) / self.focal;
        a.dot(b) > 0.95 && a.dot(gap).abs().max(b.dot(gap).abs()) < step.max(2e-3)
    }

    /// The part of a smooth surface that a pixel is in.
    pub(crate) fn part(&self, i: usize) -> (u32, usize, usize) {
        (self.label[i], i / self.width / PART_PX, i % self.width / PART_PX)
    }

    /// Whether two pixels' surfaces lie in one plane.
    pub(crate) fn coplanar(&self, i: usize, j: usize) -> bool {
        let line = self.position[j] - self.position[i];
        let most = FLAT * line.length();
        [i, j].iter().all(|k| line.dot(self.normal[*k]).abs() <= most)
    }

    /// Where a point is in the picture or beside it; `None` where the lens does not show it.
    pub(crate) fn project(&self, point: Vec3) -> Option<Vec2> {
        if let Some((camera, origin)) = &self.camera {
            return camera.project(point.as_dvec3() + *origin).map(|p| p.as_vec2());
        }
        let c = self.to_camera * (point - self.origin);
        (c.y > 1e-3).then(|| self.centre + self.focals * Vec2::new(c.x, -c.z) / c.y)
    }

    /// Width of a pixel on its surface, metres: the root of its area.
    pub(crate) fn footprint(&self, i: usize) -> f32 {
        let cos = self.normal[i].dot(self.ray[i]).abs().max(0.05);
        self.distance[i] / self.focal / cos.sqrt()
    }

    /// Where a pixel's ray meets the plane of another pixel's surface, or of its own, and the area of it that the pixel shows, m². `None`
    /// where it has no surface, or the ray leads away from it or lies in another's plane.
    pub(crate) fn on_plane(&self, other: usize, i: usize) -> Option<(Vec3, f64)> {
        let (normal, ray) = (self.normal[other], self.ray[i]);
        let along = normal.dot(ray);
        let distance = normal.dot(self.position[other] - self.origin) / along;
        let meets = other == i || along.abs() > FLAT;
        let told = self.triangle[other] != NONE && meets && distance.is_finite() && distance > 0.0;
        let area = f64::from(distance / self.focal).powi(2) / f64::from(along.abs().max(0.05));
        told.then(|| (self.origin + ray * distance, area))
    }

    /// Distance from the picture's centre, 1 in its corners, squared.
    pub(crate) fn radius2(&self, i: usize) -> f32 {
        let half = DVec2::new(self.width as f64, self.height as f64) * 0.5;
        let at = DVec2::new((i % self.width) as f64 + 0.5, (i / self.width) as f64 + 0.5);
        ((at - half).length_squared() / half.length_squared()) as f32
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::panorama::Distortion;
    use crate::scene::testing::{grey, triangles};
    use crate::site::Pose;

    #[test]
    fn a_ray_meets_another_pixel_s_plane_unless_it_lies_in_it() {
        let square = |corners: [(f32, f32, f32); 4]| {
            let [a, b, c, d] = corners.map(Vec3::from);
            [[a, b, c], [a, c, d]]
        };
        let wall = square([(-9.0, 3.0, -9.0), (9.0, 3.0, -9.0), (9.0, 3.0, 9.0), (-9.0, 3.0, 9.0)]);
        let floor = square([(-9.0, 0.5, -1.0), (9.0, 0.5, -1.0), (9.0, 3.0, -1.0), (-9.0, 3.0, -1.0)]);
        let scene = grey(triangles(&[wall, floor].concat()), 0.5);
        let pose = Pose { position: DVec3::ZERO, rotation: DMat3::IDENTITY };
        let surfaces = GeometryBuffer::look(&scene, &Camera::with_fov(pose, 60, 40, 70.0));
        let [level, lowest] = [20, 39].map(|row| row * 60 + 30);
        assert!(surfaces.normal[level].y < -0.9 && surfaces.normal[lowest].z > 0.9);
        assert!(surfaces.on_plane(lowest, level).is_none(), "the floor is seen edge-on");
        let (met, _) = surfaces.on_plane(lowest + 5, lowest).unwrap();
        assert!(met.distance(surfaces.position[lowest]) < 1e-3);
        assert!(surfaces.on_plane(level, level).is_some());
    }

    #[test]
    fn a_pixel_s_surface_is_in_that_pixel_through_any_lens() {
        let [a, b, c, d] = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, z)| Vec3::new(x, 3.0, z));
        let scene = grey(triangles(&[[a, b, c], [a, c, d]]), 0.5);
        let pose = Pose { position: DVec3::ZERO, rotation: DMat3::from_rotation_z(0.2) };
        let pinhole = Camera::with_fov(pose, 60, 40, 70.0);
        let bent = Camera { distortion: Distortion::brown([-0.1, 0.01, 0.0, 0.0], [0.002, -0.001]), ..pinhole };
        for camera in [pinhole, bent] {
            let surfaces = GeometryBuffer::look(&scene, &camera);
            for i in 0..60 * 40 {
                let middle = Vec2::new((i % 60) as f32 + 0.5, (i / 60) as f32 + 0.5);
                let at = surfaces.project(surfaces.position[i]).unwrap();
                assert!(at.distance(middle) < 1e-2, "{middle} is at {at}");
            }
        }
    }
}
