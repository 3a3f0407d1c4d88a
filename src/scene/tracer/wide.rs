//! Single rays through obvhs's eight-wide compressed tree, which is the fastest where rays have nothing in common.

use glam::{Vec3, Vec3A, Vec4};
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray as TreeRay, RayHit};

use super::{Hit, Ray, Triangles};

/// The deepest tree that obvhs's traversal stack of 32 groups surely holds.
const DEEPEST: usize = 30;

/// What a direction is multiplied by on its way to obvhs, whose node test leaves out boxes that end nearer than
/// t = 10⁻⁴. With this power of two the arithmetic stays the same and that distance becomes 0.1 µm.
const SCALE: f32 = 1.0 / 1024.0;

/// The least size of a direction's component for the node test; keeps its reciprocal finite.
const LEAST: f32 = 1e-24;

/// An eight-wide tree whose leaves name slots: leaf order is slot order.
pub(super) struct Wide(CwBvh);

impl Wide {
    /// Nothing where the tree is too deep to be traversed.
    pub(super) fn new(tree: CwBvh) -> Option<Self> {
        (depth(&tree) <= DEEPEST).then_some(Self(tree))
    }

    pub(super) fn closest(&self, triangles: &Triangles, ray: &Ray, t_min: f32) -> Option<Hit> {
        let origin = splat(ray.origin);
        let mut best = Hit { t: f32::MAX, triangle: u32::MAX };
        self.0.ray_traverse(door(ray, f32::INFINITY), &mut RayHit::none(), |_, slot| {
            match triangles.corners[slot].seen_from(&origin).meet(ray.direction) {
                Some(t) if t > t_min && t <= best.t => {
                    let triangle = triangles.ids[slot];
                    if t < best.t || triangle < best.triangle {
                        best = Hit { t, triangle };
                    }
                    t * SCALE.recip()
                }
                _ => f32::INFINITY,
            }
        });
        (best.triangle != u32::MAX).then_some(best)
    }

    pub(super) fn occluded(&self, triangles: &Triangles, ray: &Ray, t_min: f32, t_max: f32) -> bool {
        let origin = splat(ray.origin);
        !self.0.ray_traverse_miss(door(ray, t_max), |_, slot| {
            match triangles.corners[slot].seen_from(&origin).meet(ray.direction) {
                Some(t) if t > t_min && t < t_max && t.is_finite() => f32::NEG_INFINITY,
                _ => f32::INFINITY,
            }
        })
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.0.nodes.as_slice()) + size_of_val(self.0.primitive_indices.as_slice())
    }
}

/// The only place where a ray for obvhs is made. Adding zero turns −0 into +0: obvhs takes the sign of a direction
/// from `< 0` in one place and from the reciprocal in another, and misses everything where they differ.
fn door(ray: &Ray, t_max: f32) -> TreeRay {
    let direction = (Vec3A::from(ray.direction) + Vec3A::ZERO) * SCALE;
    let inv_direction = direction.abs().max(Vec3A::splat(LEAST)).recip().copysign(direction);
    TreeRay { origin: ray.origin.into(), direction, inv_direction, tmin: 0.0, tmax: t_max / SCALE }
}

fn splat(p: Vec3) -> [Vec4; 3] {
    [p.x, p.y, p.z].map(Vec4::splat)
}

/// Levels of nodes.
fn depth(tree: &CwBvh) -> usize {
    let mut level = if tree.nodes.is_empty() { vec![] } else { vec![0] };
    let mut depth = 0;
    while !level.is_empty() {
        depth += 1;
        level = level
            .iter()
            .flat_map(|&i: &u32| {
                let node = &tree.nodes[i as usize];
                node.child_base_idx..node.child_base_idx + node.imask.count_ones()
            })
            .collect();
    }
    depth
}
