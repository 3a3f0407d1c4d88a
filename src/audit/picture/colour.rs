//! Colour differences as people see them.

use glam::{Vec2, Vec3};

use crate::panorama::luminance;

/// CIE L*a*b* (D65) of linear Rec. 709, white = 1.
fn lab(rgb: Vec3) -> Vec3 {
    let x = rgb.dot(Vec3::new(0.412_390_8, 0.357_584_34, 0.180_480_8)) / 0.950_455_9;
    let y = rgb.dot(Vec3::new(0.212_639, 0.715_168_7, 0.072_192_32));
    let z = rgb.dot(Vec3::new(0.019_330_82, 0.119_194_78, 0.950_532_15)) / 1.089_057_8;
    let f = |t: f32| if t > 0.008_856_452 { t.cbrt() } else { t * 7.787_037 + 16.0 / 116.0 };
    let (x, y, z) = (f(x), f(y), f(z));
    Vec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

/// CIEDE2000 between two colours in L*a*b* (Sharma, Wu and Dalal, *The CIEDE2000 color-difference formula*, 2005).
fn ciede2000(one: Vec3, two: Vec3) -> f32 {
    use std::f64::consts::{PI, TAU};
    let ([l1, a1, b1], [l2, a2, b2]) = (one.to_array().map(f64::from), two.to_array().map(f64::from));
    let c7 = (0.5 * (a1.hypot(b1) + a2.hypot(b2))).powi(7);
    let g = 1.5 - 0.5 * (c7 / (c7 + 25f64.powi(7))).sqrt();
    let (a1, a2) = (a1 * g, a2 * g);
    let (c1, c2) = (a1.hypot(b1), a2.hypot(b2));
    let hue = |a: f64, b: f64| if a == 0.0 && b == 0.0 { 0.0 } else { b.atan2(a).rem_euclid(TAU) };
    let (h1, h2) = (hue(a1, b1), hue(a2, b2));
    let grey = c1 * c2 == 0.0;
    let dh = match h2 - h1 {
        _ if grey => 0.0,
        d if d > PI => d - TAU,
        d if d < -PI => d + TAU,
        d => d,
    };
    let (dl, dc, dh) = (l2 - l1, c2 - c1, 2.0 * (c1 * c2).sqrt() * (0.5 * dh).sin());
    let (l, c) = (0.5 * (l1 + l2), 0.5 * (c1 + c2));
    let h = match h1 + h2 {
        s if grey => s,
        s if (h1 - h2).abs() <= PI => 0.5 * s,
        s if s < TAU => 0.5 * (s + TAU),
        s => 0.5 * (s - TAU),
    };
    let t = 1.0 - 0.17 * (h - PI / 6.0).cos() + 0.24 * (2.0 * h).cos() + 0.32 * (3.0 * h + PI / 30.0).cos()
        - 0.20 * (4.0 * h - 63f64.to_radians()).cos();
    let turn = 60f64.to_radians() * (-((h.to_degrees() - 275.0) / 25.0).powi(2)).exp();
    let c7 = c.powi(7);
    let rotation = -2.0 * (c7 / (c7 + 25f64.powi(7))).sqrt() * turn.sin();
    let l50 = (l - 50.0).powi(2);
    let (sl, sc, sh) = (1.0 + 0.015 * l50 / (20.0 + l50).sqrt(), 1.0 + 0.045 * c, 1.0 + 0.015 * c * t);
    let (dl, dc, dh) = (dl / sl, dc / sc, dh / sh);
    (dl * dl + dc * dc + dh * dh + rotation * dc * dh).max(0.0).sqrt() as f32
}

/// ΔE00 between an albedo and the same with its red and blue over green changed by these logarithms, brightness kept.
pub(crate) fn colour_difference(albedo: Vec3, red: f32, blue: f32) -> f32 {
    let other = albedo * Vec3::new(red.clamp(-3.0, 3.0).exp(), 1.0, blue.clamp(-3.0, 3.0).exp());
    let other = other * (luminance(albedo) / luminance(other).max(1e-9));
    // seen at the lightness of a mid grey, so that dark and light surfaces count alike
    let scale = 0.3 / luminance(albedo).max(1e-6);
    ciede2000(lab(albedo * scale), lab(other * scale))
}

/// Red and blue over green of a factor that is told as a logarithm.
pub(crate) fn chroma(log: Vec3) -> Vec2 {
    Vec2::new(log.x - log.y, log.z - log.y)
}

/// ΔE00 between mid grey and the same with its chroma changed so.
pub(crate) fn colour_of(chroma: Vec2) -> f32 {
    colour_difference(Vec3::splat(0.3), chroma.x, chroma.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of the test data that the formula's paper publishes (its table 1).
    #[test]
    fn published_pairs() {
        let pairs = [
            ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
            ([50.0, -1.3802, -84.2814], [50.0, 0.0, -82.7485], 1.0000),
            ([50.0, 2.5, 0.0], [50.0, 0.0, -2.5], 4.3065),
            ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
            ([60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644),
            ([2.0776, 0.0795, -1.1350], [0.9033, -0.0636, -0.5514], 0.9082),
        ];
        for (a, b, expected) in pairs {
            let d = ciede2000(Vec3::from(a), Vec3::from(b));
            assert!((d - expected).abs() < 2e-4, "{d} for {expected}");
        }
    }

    #[test]
    fn white_and_grey_have_no_hue() {
        let white = lab(Vec3::ONE);
        assert!((white - Vec3::new(100.0, 0.0, 0.0)).length() < 0.02, "{white}");
        assert!(lab(Vec3::splat(0.184_187)).distance(Vec3::new(50.0, 0.0, 0.0)) < 0.02);
    }
}
