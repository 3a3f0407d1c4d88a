//! Ray casting: the one door to obvhs.
//!
//! Cures what obvhs leaves open: negative zeros in directions make its wide tree miss everything, and deep trees need
//! a large stack to build.

use glam::{Vec3, Vec3A};
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use obvhs::{BvhBuildParams, ray as bvh_ray};
use std::time::Duration;

use super::Mesh;

/// A half line.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start, local metres.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

/// The nearest triangle along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in metres.
    pub t: f32,
    /// Triangle index in the mesh.
    pub triangle: u32,
}

/// Finds the nearest hit or any hit.
pub struct Tracer {
    bvh: CwBvh,
    /// In leaf order.
    triangles: Vec<RtTriangle>,
}

impl Tracer {
    /// Builds a tree over all triangles of a clean mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let triangles: Vec<Triangle> = (0..mesh.triangles.len() as u32)
            .map(|i| {
                let [v0, v1, v2] = mesh.corners(i).map(Vec3A::from);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
        let triangles = bvh.primitive_indices.iter().map(|&i| (&triangles[i as usize]).into()).collect();
        Self { bvh, triangles }
    }

    /// The nearest hit farther than `t_min` metres.
    pub fn closest(&self, ray: &Ray, t_min: f32) -> Option<Hit> {
        let mut hit = bvh_ray::RayHit::none();
        let found =
            self.bvh.ray_traverse(door(ray, t_min, f32::INFINITY), &mut hit, |r, i| self.triangles[i].intersect(r));
        found.then(|| Hit { t: hit.t, triangle: self.bvh.primitive_indices[hit.primitive_id as usize] })
    }

    /// Whether anything stands on the ray between `t_min` and `t_max` metres.
    pub fn occluded(&self, ray: &Ray, t_min: f32, t_max: f32) -> bool {
        !self.bvh.ray_traverse_miss(door(ray, t_min, t_max), |r, i| self.triangles[i].intersect(r))
    }
}

/// The only place where a ray for obvhs is made: adding zero turns −0 into +0, which its wide tree needs.
fn door(ray: &Ray, t_min: f32, t_max: f32) -> bvh_ray::Ray {
    bvh_ray::Ray::new(Vec3A::from(ray.origin), Vec3A::from(ray.direction) + Vec3A::ZERO, t_min, t_max)
}
