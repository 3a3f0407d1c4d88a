//! The triangle test, the same arithmetic for one ray and for packets.
//!
//! **Watertight along edges.** A ray passes an edge on the side that the sign of d·((Q − P) × (Q + P)) tells, P and Q
//! being the edge's ends relative to the ray's origin. Swapping P and Q, as the neighbouring triangle does, negates the
//! value exactly in IEEE arithmetic, so the neighbours never both reject the ray. This is the volume of
//! Davidovič et al. (*Performance Comparison of Ray-Object Intersection*, 2012; after Plücker), in the form that loses few digits far
//! from the origin, since (Q − P) × (Q + P) = 2 Q × P is rounded in proportion to the edge.

use glam::{BVec4A, Vec3, Vec4, Vec4Swizzles};

/// Bound of the error of an edge's product, as a part of the sizes multiplied. A triangle counts as that much larger
/// (about 1 µm at a distance of 1 m), so that rays at its corners, where edges meet that rounding may have turned, do not slip
/// through either.
const ROUNDING: f32 = 2.5e-7;

/// How far a hit may lie outside of its triangle's box, as a part of the distance.
pub(super) const BESIDE: f32 = 4e-6;

/// Something along x, y and z. Written out, since `map` and `from_fn` of an array are calls that the compiler leaves in the
/// innermost loops.
#[inline(always)]
pub(super) fn xyz<T>(along: impl Fn(usize) -> T) -> [T; 3] {
    [along(0), along(1), along(2)]
}

/// Corners of a triangle: the x of all three, then y, then z; the fourth lane repeats the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners(pub(super) [Vec4; 3]);

impl Corners {
    pub(super) fn new([a, b, c]: [Vec3; 3]) -> Self {
        Self(xyz(|axis| Vec4::new(a[axis], b[axis], c[axis], a[axis])))
    }

    /// As seen from a point.
    #[inline(always)]
    pub(super) fn seen_from(&self, origin: &[Vec4; 3]) -> Self {
        let [x, y, z] = self.0;
        Self([x - origin[0], y - origin[1], z - origin[2]])
    }

    /// The edges, of a triangle relative to the rays' origin.
    #[inline(always)]
    pub(super) fn edges(&self) -> Edges {
        let [x, y, z] = self.0;
        let (qx, qy, qz) = (x.yzxw(), y.yzxw(), z.yzxw());
        let (ex, ey, ez) = (qx - x, qy - y, qz - z);
        let (sx, sy, sz) = (qx + x, qy + y, qz + z);
        let size = (ex.abs() + ey.abs() + ez.abs()) * (sx.abs() + sy.abs() + sz.abs());
        let scale = size.max(Vec4::splat(f32::MIN_POSITIVE)).recip();
        Edges { x: (ey * sz - ez * sy) * scale, y: (ez * sx - ex * sz) * scale, z: (ex * sy - ey * sx) * scale }
    }

    /// The normal by the winding of the corners, twice the area long.
    #[inline(always)]
    pub(super) fn normal(&self) -> Vec3 {
        let [x, y, z] = self.0;
        let a = Vec3::new(x.x, y.x, z.x);
        (Vec3::new(x.y, y.y, z.y) - a).cross(Vec3::new(x.z, y.z, z.z) - a)
    }

    /// The plane n·p = h that the triangle lies in, as (n, h); n is twice the area long.
    #[inline(always)]
    fn plane(&self) -> (Vec3, f32) {
        let ([x, y, z], n) = (self.0, self.normal());
        (n, n.x * x.x + n.y * y.x + n.z * z.x)
    }

    /// How far along four rays, that pass inside all edges, the triangle lies; NaN where it does not. Rays in its plane
    /// pass "inside" anywhere and meet the plane anywhere, so the distance is kept between the corners' own, and the
    /// point must lie within the triangle's box.
    #[inline(always)]
    pub(super) fn distance(&self, d: &[Vec4; 3]) -> Vec4 {
        let (n, h) = self.plane();
        let corner = |i: usize| d[0] * self.0[0][i] + d[1] * self.0[1][i] + d[2] * self.0[2][i];
        let (a, b, c) = (corner(0), corner(1), corner(2));
        let (near, far) = (a.min(b).min(c), a.max(b).max(c));
        let across = d[0] * n.x + d[1] * n.y + d[2] * n.z;
        let t = (Vec4::splat(h) / across).max(near).min(far);
        let beside = BESIDE * near.abs().max(far.abs());
        let mut meets = across.cmpne(Vec4::ZERO);
        for (&d, ends) in d.iter().zip(self.0) {
            let p = d * t;
            meets &= (p + beside).cmpge(Vec4::splat(ends.min_element()));
            meets &= (p - beside).cmple(Vec4::splat(ends.max_element()));
        }
        Vec4::select(meets, t, Vec4::NAN)
    }

    /// Distance at which one ray from the origin meets the triangle (perhaps negative), if it does.
    #[inline(always)]
    pub(super) fn meet(&self, d: Vec3) -> Option<f32> {
        self.edges().enclose(d).then(|| self.distance(&xyz(|axis| Vec4::splat(d[axis]))).x)
    }
}

/// For each edge (a lane) a vector whose product with a direction tells on which side of the edge it passes, scaled so
/// that rounding changes the product by less than [`ROUNDING`].
pub(super) struct Edges {
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

impl Edges {
    /// Whether a direction passes inside of all edges.
    #[inline(always)]
    fn enclose(&self, d: Vec3) -> bool {
        let side = self.x * d.x + self.y * d.y + self.z * d.z;
        let all = |mask: u32| mask & 7 == 7;
        let slack = Vec4::splat(ROUNDING);
        all(side.cmpge(-slack).bitmask()) || all(side.cmple(slack).bitmask())
    }

    /// The same for four directions at a time.
    #[inline(always)]
    pub(super) fn spread(&self) -> impl Fn(&[Vec4; 3]) -> BVec4A + use<> {
        let edge = |i: usize| [Vec4::splat(self.x[i]), Vec4::splat(self.y[i]), Vec4::splat(self.z[i])];
        let (e0, e1, e2) = (edge(0), edge(1), edge(2));
        let slack = Vec4::splat(ROUNDING);
        move |d| {
            let side = |e: &[Vec4; 3]| e[0] * d[0] + e[1] * d[1] + e[2] * d[2];
            let (u, v, w) = (side(&e0), side(&e1), side(&e2));
            u.min(v).min(w).cmpge(-slack) | u.max(v).max(w).cmple(slack)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [Vec3; 3] = [Vec3::new(1.0, 0.2, 2.0), Vec3::new(0.3, 0.9, 3.0), Vec3::new(-0.8, -0.4, 2.5)];

    #[test]
    fn the_other_triangle_of_an_edge_sees_it_exactly_negated() {
        let [a, b, c] = CORNERS;
        let (one, other) = (Corners::new([a, b, c]).edges(), Corners::new([b, a, c]).edges());
        for (v, w) in [(one.x, other.x), (one.y, other.y), (one.z, other.z)] {
            assert_eq!((v.x, v.y, v.z), (-w.x, -w.z, -w.y));
        }
    }

    #[test]
    fn a_ray_at_a_point_of_the_triangle_meets_it_there_from_both_sides() {
        let [a, b, c] = CORNERS;
        for (u, v) in [(0.2, 0.3), (0.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.01, 0.01)] {
            let p = a + (b - a) * u + (c - a) * v;
            for order in [[a, b, c], [a, c, b]] {
                let t = Corners::new(order).meet(p.normalize()).unwrap();
                assert!((t - p.length()).abs() < 1e-5);
                assert!(Corners::new(order).meet(-p.normalize()).is_none_or(|t| t < 0.0));
            }
        }
    }

    #[test]
    fn rays_in_the_plane_but_beside_the_triangle_do_not_meet_it_ahead() {
        for turn in 0..50 {
            let turn = glam::Quat::from_rotation_y(turn as f32 * 0.37) * glam::Quat::from_rotation_x(turn as f32);
            let triangle = Corners::new([Vec3::X, Vec3::X * 1.5, Vec3::X + Vec3::Y * 0.5].map(|p| turn * p));
            for i in 10..60 {
                let angle = 0.1 * i as f32;
                let d = turn * Vec3::new(angle.cos(), angle.sin(), 0.0);
                let t = triangle.meet(d);
                assert!(t.is_none_or(|t| t.is_nan() || t < 0.0), "{turn} {angle} {t:?}");
            }
        }
    }
}
