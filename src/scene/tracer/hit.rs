//! Rays, what they hit, and the triangles they hit.

use glam::{Vec3, Vec4};

use crate::scene::tracer::triangle::{Corners, xyz};

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

/// The triangles in the order of the tree's leaves; a place in that order is a slot.
#[derive(Default)]
pub(super) struct Triangles {
    pub(super) corners: Vec<Corners>,
    /// Index in the mesh of each slot.
    pub(super) ids: Vec<u32>,
}

/// The best hit so far.
#[derive(Clone, Copy)]
pub(super) struct Best {
    pub(super) hit: Hit,
    /// Whether the triangle's winding faces away from the ray.
    pub(super) away: bool,
}

impl Best {
    /// Before any hit.
    pub(super) const NONE: Self = Self { hit: Hit { t: f32::MAX, triangle: u32::MAX }, away: true };

    /// Last bits of a distance that tell no two surfaces apart.
    pub(super) const ALIKE: u32 = 7;

    /// Whether this hit counts and not the other one.
    #[inline(always)]
    pub(super) fn before(&self, other: &Self) -> bool {
        let key = |best: &Self| (best.hit.t.to_bits() >> Self::ALIKE, best.away, best.hit.triangle);
        key(self) < key(other)
    }

    /// The farthest that another hit may lie and count as equally far.
    #[inline(always)]
    pub(super) fn reach(&self) -> f32 {
        f32::from_bits(self.hit.t.to_bits() | ((1 << Self::ALIKE) - 1))
    }

    pub(super) fn found(self) -> Option<Hit> {
        (self.hit.triangle != u32::MAX).then_some(self.hit)
    }
}

impl Triangles {
    /// A hit of the triangle in a slot.
    #[inline(always)]
    pub(super) fn hit(&self, slot: usize, direction: Vec3, t: f32) -> Best {
        let away = self.corners[slot].normal().dot(direction) > 0.0;
        Best { hit: Hit { t, triangle: self.ids[slot] }, away }
    }

    /// Whether the triangle in a slot stands on a ray between two distances.
    #[inline(always)]
    pub(super) fn stops(&self, slot: usize, ray: &Ray, t_min: f32, t_max: f32) -> bool {
        let origin = xyz(|axis| Vec4::splat(ray.origin[axis]));
        let meets = self.corners[slot].seen_from(&origin).meet(ray.direction);
        meets.is_some_and(|t| t > t_min && t < t_max && t.is_finite())
    }
}
