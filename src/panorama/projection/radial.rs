//! Projections whose angle from forward depends on the distance from the picture's centre alone.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3};

/// A radial projection, with r = 1 at the rim of the disc that touches the picture's edges.
pub(crate) struct Radial {
    /// Angle from forward at r = 1, radians.
    rim: f64,
    /// θ(r) for r in 0..=1.
    angle: fn(f64) -> f64,
    /// r(θ) for θ in 0..=rim.
    radius: fn(f64) -> f64,
    /// (1 − cos θ(r)) / r², smooth also at r = 0.
    cap: fn(f64) -> f64,
}

impl Radial {
    /// θ = πr (Debevec, *Rendering Synthetic Objects into Real Scenes*, 1998).
    pub(crate) const ANGULAR: Self =
        Self { rim: PI, angle: |r| PI * r, radius: |t| t / PI, cap: |r| equidistant_cap(PI, r) };
    /// A ball of radius 1 seen from far away reflects at twice the angle of its normal: θ = 2 asin r.
    pub(crate) const MIRROR_BALL: Self =
        Self { rim: PI, angle: |r| 2.0 * r.min(1.0).asin(), radius: |t| (0.5 * t).sin(), cap: |_| 2.0 };
    /// θ = πr/2.
    pub(crate) const FISHEYE: Self = Self {
        rim: FRAC_PI_2,
        angle: |r| FRAC_PI_2 * r,
        radius: |t| t / FRAC_PI_2,
        cap: |r| equidistant_cap(FRAC_PI_2, r),
    };

    pub(crate) fn direction(&self, width: usize, height: usize, x: f64, y: f64) -> Option<DVec3> {
        let p = DVec2::new(2.0 * x / width as f64 - 1.0, 1.0 - 2.0 * y / height as f64);
        let r = p.length();
        if r > 1.0 {
            return None;
        }
        let (sin, cos) = (self.angle)(r).sin_cos();
        let side = if r > 0.0 { p * (sin / r) } else { DVec2::ZERO };
        Some(DVec3::new(side.x, cos, side.y))
    }

    pub(crate) fn pixel(&self, width: usize, height: usize, d: DVec3) -> Option<DVec2> {
        let side = DVec2::new(d.x, d.z);
        let theta = side.length().atan2(d.y);
        if theta > self.rim {
            return None;
        }
        // straight back lies on the whole rim: take its right end
        let towards = side.try_normalize().unwrap_or(if theta > 1.0 { DVec2::X } else { DVec2::ZERO });
        let p = towards * (self.radius)(theta);
        Some(DVec2::new(0.5 * (p.x + 1.0) * width as f64, 0.5 * (1.0 - p.y) * height as f64))
    }

    /// By Green's theorem, Ω = ∮ (1 − cos θ) dφ around the pixel's part of the disc. Along an edge dφ = (u dv − v du)/r²;
    /// along the rim θ is constant.
    pub(crate) fn solid_angle(&self, width: usize, height: usize, x: usize, y: usize) -> f64 {
        let u = |x: usize| 2.0 * x as f64 / width as f64 - 1.0;
        let v = |y: usize| 1.0 - 2.0 * y as f64 / height as f64;
        let (left, right, top, bottom) = (u(x), u(x + 1), v(y), v(y + 1));
        let corners =
            [DVec2::new(left, bottom), DVec2::new(right, bottom), DVec2::new(right, top), DVec2::new(left, top)];
        let edges: Vec<_> = (0..4).filter_map(|i| inside_disc(corners[i], corners[(i + 1) % 4])).collect();
        if edges.is_empty() {
            let holds_disc = left < 0.0 && right > 0.0 && bottom < 0.0 && top > 0.0;
            return if holds_disc { TAU * (self.cap)(1.0) } else { 0.0 };
        }
        let mut sum = 0.0;
        for (i, &(a, b)) in edges.iter().enumerate() {
            sum += self.along(a, b);
            let next = edges[(i + 1) % edges.len()].0;
            if b.distance_squared(next) > 1e-24 {
                sum += (self.cap)(1.0) * b.angle_to(next).rem_euclid(TAU);
            }
        }
        sum
    }

    /// ∫ (1 − cos θ) dφ along the segment from `a` to `b`, by 8-point Gauss–Legendre quadrature on pieces shorter than
    /// an eighth, where the integrand is a polynomial for all practical purposes.
    fn along(&self, a: DVec2, b: DVec2) -> f64 {
        let swept = a.perp_dot(b); // u dv − v du is constant along a straight line
        let pieces = (a.distance(b) * 8.0).ceil().max(1.0) as usize;
        let mut sum = 0.0;
        for piece in 0..pieces {
            for (node, weight) in GAUSS_8 {
                for t in [0.5 * (1.0 - node), 0.5 * (1.0 + node)] {
                    let t = (piece as f64 + t) / pieces as f64;
                    sum += 0.5 * weight * (self.cap)(a.lerp(b, t).length());
                }
            }
        }
        swept * sum / pieces as f64
    }
}

/// Nodes (both signs) and weights of the 8-point Gauss–Legendre rule on [−1, 1].
const GAUSS_8: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// (1 − cos kr)/r² = k²/2 · sinc²(kr/2).
fn equidistant_cap(k: f64, r: f64) -> f64 {
    let half = 0.5 * k * r;
    let sinc = if half > 1e-9 { half.sin() / half } else { 1.0 };
    0.5 * k * k * sinc * sinc
}

/// The part of the segment from `a` to `b` inside the unit disc, if it has any length.
fn inside_disc(a: DVec2, b: DVec2) -> Option<(DVec2, DVec2)> {
    let d = b - a;
    let (qa, qb, qc) = (d.length_squared(), a.dot(d), a.length_squared() - 1.0);
    let root = (qb * qb - qa * qc).sqrt();
    let (t0, t1) = (((-qb - root) / qa).max(0.0), ((-qb + root) / qa).min(1.0));
    // NaN where the line misses the disc
    (t1 > t0 && !root.is_nan()).then(|| (a + d * t0, a + d * t1))
}
