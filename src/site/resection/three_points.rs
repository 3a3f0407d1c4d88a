//! The three-point problem: poses that see three points in three directions.

use glam::{DMat3, DVec3};

use super::super::Pose;

/// Places along the searched angle.
const STEPS: usize = 360;

/// All poses (camera's axes: x right, y forward, z up) from which the points `p` lie in the unit directions `b` of the
/// camera's axes: at most four; ones that nearly coincide may be missed.
///
/// With the camera C, let α = ∠P₁CP₂ and β = ∠CP₂P₁. The law of sines gives |CP₁| = |P₁P₂| sin β / sin α and
/// |CP₂| = |P₁P₂| sin(α+β) / sin α; the law of cosines then |CP₃| up to a sign, and once more a residual that is zero
/// at a pose. Its zeros in β are bracketed and halved.
pub(super) fn poses(b: &[DVec3; 3], p: &[DVec3; 3]) -> Vec<Pose> {
    let side = |i: usize, j: usize| p[i].distance(p[j]);
    let (d12, d13, d23) = (side(0, 1), side(0, 2), side(1, 2));
    let angle = |i: usize, j: usize| b[i].cross(b[j]).length().atan2(b[i].dot(b[j]));
    let (a12, a13, a23) = (angle(0, 1), angle(0, 2), angle(1, 2));
    let flat = (p[1] - p[0]).cross(p[2] - p[0]).length() < 1e-6 * d12 * d13;
    if flat || [a12, a13, a23].iter().any(|a| a.sin() < 1e-6) {
        return Vec::new();
    }
    let distances = |beta: f64, sign: f64| -> Option<([f64; 3], f64)> {
        let s1 = d12 * beta.sin() / a12.sin();
        let s2 = d12 * (a12 + beta).sin() / a12.sin();
        let root = d13 * d13 - (s1 * a13.sin()).powi(2);
        let s3 = s1 * a13.cos() + sign * root.max(0.0).sqrt();
        // slightly below zero is zero, so that the two branches meet
        (root > -1e-9 * d13 * d13 && s3 > 0.0)
            .then(|| ([s1, s2, s3], s2 * s2 + s3 * s3 - 2.0 * s2 * s3 * a23.cos() - d23 * d23))
    };
    let mut found = Vec::new();
    for sign in [-1.0, 1.0] {
        let at = |i: usize| (std::f64::consts::PI - a12) * (i as f64 + 0.5) / STEPS as f64;
        let mut last: Option<(f64, f64)> = None;
        for i in 0..STEPS {
            let beta = at(i);
            let here = distances(beta, sign).map(|(_, r)| (beta, r));
            if let (Some((b0, r0)), Some((b1, r1))) = (last, here)
                && (r0 < 0.0) != (r1 < 0.0)
                && let Some(s) = zero(&distances, sign, b0, b1, r0 < 0.0)
            {
                found.push(pose(b, p, s));
            }
            // the ends of a branch are candidates too: refinement makes of them what it can
            if last.is_some() != here.is_some()
                && i > 0
                && let Some((s, _)) = distances(beta, sign).or_else(|| distances(at(i - 1), sign))
            {
                found.push(pose(b, p, s));
            }
            last = here;
        }
    }
    found
}

/// Halves an interval down to where the residual changes sign.
fn zero(
    distances: &impl Fn(f64, f64) -> Option<([f64; 3], f64)>,
    sign: f64,
    mut low: f64,
    mut high: f64,
    rising: bool,
) -> Option<[f64; 3]> {
    for _ in 0..48 {
        let middle = 0.5 * (low + high);
        let (_, r) = distances(middle, sign)?;
        if (r < 0.0) == rising { low = middle } else { high = middle }
    }
    distances(0.5 * (low + high), sign).map(|(s, _)| s)
}

/// The pose that puts the points at these distances along the directions.
fn pose(b: &[DVec3; 3], p: &[DVec3; 3], s: [f64; 3]) -> Pose {
    let q = [b[0] * s[0], b[1] * s[1], b[2] * s[2]];
    let axes = |t: &[DVec3; 3]| {
        let x = (t[1] - t[0]).normalize_or(DVec3::X);
        let z = x.cross(t[2] - t[0]).normalize_or(x.any_orthonormal_vector());
        DMat3::from_cols(x, z.cross(x), z)
    };
    let rotation = axes(p) * axes(&q).transpose();
    let middle = |t: &[DVec3; 3]| (t[0] + t[1] + t[2]) / 3.0;
    Pose { position: middle(p) - rotation * middle(&q), rotation }
}
