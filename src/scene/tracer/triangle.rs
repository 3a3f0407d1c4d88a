//! The triangle test, the same arithmetic for one ray and for packets.
//!
//! **Watertight along edges.** A ray passes an edge on the side that the sign of d·((Q − P) × (Q + P)) tells, P and Q
//! being the edge's ends relative to the ray's origin. Swapping P and Q, as the neighbouring triangle does, negates the
//! value exactly in IEEE arithmetic, so the neighbours never both reject the ray. This is the volume of
//! Davidovič et al. (*Performance Comparison of Ray-Object Intersection*, 2012; after Plücker), in the form that loses few digits far
//! from the origin, since (Q − P) × (Q + P) = 2 Q × P cancels only within the edge.

use glam::{Vec3, Vec4, Vec4Swizzles};

/// Corners of a triangle: the x of all three, then y, then z; the fourth lane repeats the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners(pub(super) [Vec4; 3]);

impl Corners {
    pub(super) fn new([a, b, c]: [Vec3; 3]) -> Self {
        Self([0, 1, 2].map(|axis| Vec4::new(a[axis], b[axis], c[axis], a[axis])))
    }

    /// As seen from a point.
    #[inline(always)]
    pub(super) fn seen_from(&self, origin: &[Vec4; 3]) -> Self {
        let [x, y, z] = self.0;
        Self([x - origin[0], y - origin[1], z - origin[2]])
    }

    /// For each edge a vector (its x in the first result, and so on) whose product with a direction tells on which
    /// side of the edge it passes. The triangle is relative to the rays' origin.
    #[inline(always)]
    pub(super) fn edges(&self) -> [Vec4; 3] {
        let [x, y, z] = self.0;
        let (qx, qy, qz) = (x.yzxw(), y.yzxw(), z.yzxw());
        let (ex, ey, ez) = (qx - x, qy - y, qz - z);
        let (sx, sy, sz) = (qx + x, qy + y, qz + z);
        [ey * sz - ez * sy, ez * sx - ex * sz, ex * sy - ey * sx]
    }

    /// The plane n·p = h that the triangle lies in, as (n, h); n is twice the area long.
    #[inline(always)]
    pub(super) fn plane(&self) -> (Vec3, f32) {
        let [x, y, z] = self.0;
        let a = Vec3::new(x.x, y.x, z.x);
        let n = (Vec3::new(x.y, y.y, z.y) - a).cross(Vec3::new(x.z, y.z, z.z) - a);
        (n, n.x * a.x + n.y * a.y + n.z * a.z)
    }

    /// Distance at which a ray from the origin meets the triangle (perhaps negative), if it does. Zero-area triangles
    /// and planes that hold the ray give NaN or infinity.
    #[inline(always)]
    pub(super) fn meet(&self, d: Vec3) -> Option<f32> {
        let [nx, ny, nz] = self.edges();
        let side = nx * d.x + ny * d.y + nz * d.z;
        let outside = |mask: u32| mask & 7 != 7;
        if outside(side.cmpge(Vec4::ZERO).bitmask()) && outside(side.cmple(Vec4::ZERO).bitmask()) {
            return None;
        }
        let (n, h) = self.plane();
        Some(h / (d.x * n.x + d.y * n.y + d.z * n.z))
    }
}
