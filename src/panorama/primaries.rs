//! From a file's own primaries to Rec. 709.

use glam::{DMat3, DVec2, DVec3, Vec3};

/// CIE xy chromaticities of a colour space's red, green, blue and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Primaries {
    pub(super) red: DVec2,
    pub(super) green: DVec2,
    pub(super) blue: DVec2,
    pub(super) white: DVec2,
}

impl Primaries {
    /// ITU-R BT.709, white D65.
    pub(super) const REC709: Self = Self {
        red: DVec2::new(0.64, 0.33),
        green: DVec2::new(0.30, 0.60),
        blue: DVec2::new(0.15, 0.06),
        white: DVec2::new(0.3127, 0.3290),
    };

    /// From linear RGB to CIE XYZ with Y = 1 for white; `None` for chromaticities that span no colour space.
    fn to_xyz(self) -> Option<DMat3> {
        // not over y, which lies at or below zero for some imaginary primaries
        let xyz = |c: DVec2| DVec3::new(c.x, c.y, 1.0 - c.x - c.y);
        let unscaled = DMat3::from_cols(xyz(self.red), xyz(self.green), xyz(self.blue));
        let scale = unscaled.inverse() * (xyz(self.white) / self.white.y);
        let sane = unscaled.determinant().abs() > 1e-6 && scale.is_finite() && scale.min_element() > 0.0;
        sane.then(|| unscaled * DMat3::from_diagonal(scale))
    }

    /// The luminance of each primary; they sum to 1.
    pub(super) fn weights(self) -> Option<Vec3> {
        Some(self.to_xyz()?.row(1).as_vec3())
    }

    /// From these primaries to Rec. 709, white to white by von Kries scaling in Bradford's cone space (Lam 1985). The
    /// identity where these are Rec. 709's to the precision files state them with.
    pub(super) fn to_rec709(self) -> Option<DMat3> {
        let target = Self::REC709;
        let apart =
            [self.red - target.red, self.green - target.green, self.blue - target.blue, self.white - target.white];
        if apart.iter().all(|d| d.abs().max_element() < 1e-3) {
            return Some(DMat3::IDENTITY);
        }
        let (from, to) = (self.to_xyz()?, target.to_xyz()?);
        let cones =
            DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);
        let gain = (cones * to * DVec3::ONE) / (cones * from * DVec3::ONE);
        Some(to.inverse() * cones.inverse() * DMat3::from_diagonal(gain) * cones * from)
    }
}

/// A colour in Rec. 709. Colours that Rec. 709 cannot hold lose their negative part; what was negative or not finite
/// before stays as it is, to be counted.
pub(super) fn converted(matrix: &DMat3, p: Vec3) -> Vec3 {
    if !p.is_finite() || p.min_element() < 0.0 {
        return p;
    }
    (*matrix * p.as_dvec3()).max(DVec3::ZERO).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ACES AP0 (SMPTE ST 2065-1).
    const ACES: Primaries = Primaries {
        red: DVec2::new(0.7347, 0.2653),
        green: DVec2::new(0.0, 1.0),
        blue: DVec2::new(0.0001, -0.077),
        white: DVec2::new(0.32168, 0.33767),
    };

    #[test]
    fn white_stays_white_and_published_matrices_come_out() {
        let m = ACES.to_rec709().unwrap();
        assert!((m * DVec3::ONE).distance(DVec3::ONE) < 1e-9);
        // red's column of the ACES 2065-1 to linear Rec. 709 matrix with Bradford adaptation, as ACES publishes it
        assert!(m.x_axis.distance(DVec3::new(2.5217, -0.2765, -0.0153)) < 2e-3, "{}", m.x_axis);
        assert!(Primaries::REC709.weights().unwrap().distance(Vec3::new(0.2126, 0.7152, 0.0722)) < 1e-4);
        assert_eq!(Primaries::REC709.to_rec709(), Some(DMat3::IDENTITY));
        let flat = Primaries { green: DVec2::new(0.64, 0.33), ..ACES };
        assert!(flat.to_rec709().is_none());
        assert!(Primaries { white: DVec2::ZERO, ..ACES }.to_rec709().is_none());
    }

    #[test]
    fn only_the_conversion_s_own_negatives_are_cut() {
        let m = ACES.to_rec709().unwrap();
        assert!(converted(&m, Vec3::X).min_element() == 0.0);
        assert_eq!(converted(&m, Vec3::NEG_X), Vec3::NEG_X);
        assert!(converted(&m, Vec3::splat(f32::NAN)).is_nan());
    }
}
