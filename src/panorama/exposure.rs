//! From linear light to what a screen shows.

use glam::Vec3;

use super::{Picture, linear_to_srgb};

/// The Rec. 709 luminance of linear RGB.
pub fn luminance(p: Vec3) -> f32 {
    p.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// The scale that brings a picture's light into a screen's range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure(
    /// Screen value (linear, 1 is white) per radiance.
    pub f32,
);

impl Exposure {
    /// Puts the picture's log-average luminance at 0.18 (Reinhard et al., *Photographic Tone Reproduction*, 2002,
    /// eq. 1–2); luminance is floored at 10⁻⁴ of its mean, so that black pixels do not decide. Pixels that are no light
    /// are left out; a picture without light gets 1.
    pub fn of(picture: &Picture) -> Self {
        let valid = || picture.pixels.iter().filter(|p| Picture::valid(**p)).map(|&p| f64::from(luminance(p)));
        let count = valid().count() as f64;
        let mean = valid().sum::<f64>() / count;
        if mean.is_nan() || mean <= 0.0 {
            return Self(1.0);
        }
        let log_average = (valid().map(|l| l.max(1e-4 * mean).ln()).sum::<f64>() / count).exp();
        Self((0.18 / log_average) as f32)
    }

    /// One for pictures that are seen together: the geometric mean of theirs; 1 where there is none.
    pub fn mean(all: impl IntoIterator<Item = Self>) -> Self {
        let (sum, count) = all.into_iter().fold((0.0, 0.0f32), |(sum, n), e| (sum + e.0.ln(), n + 1.0));
        Self((sum / count.max(1.0)).exp())
    }

    /// Linear screen values, cut off at 0 and 1; what is no light is black. Metrics look through this.
    pub fn clip(self, p: Vec3) -> Vec3 {
        if Picture::valid(p) { (p * self.0).min(Vec3::ONE) } else { Vec3::ZERO }
    }

    /// Linear screen values in 0..=1, as people see the picture: proportional up to 0.8 of white, then a shoulder that bends
    /// towards white by the brightest channel, so that windows keep some drawing and their hue.
    pub fn bend(self, p: Vec3) -> Vec3 {
        if !Picture::valid(p) {
            return Vec3::ZERO;
        }
        let p = (p * self.0).min(Vec3::splat(1e30));
        let peak = p.max_element();
        if peak > KNEE { p * (shoulder(peak) / peak) } else { p }
    }

    /// [`Exposure::bend`], sRGB-encoded.
    pub fn show(self, p: Vec3) -> Vec3 {
        self.bend(p).map(linear_to_srgb)
    }
}

/// Screen value up to which light is shown in proportion.
const KNEE: f32 = 0.8;

/// Continues the straight line at [`KNEE`] with the same slope and approaches 1.
fn shoulder(v: f32) -> f32 {
    let room = 1.0 - KNEE;
    let over = (v - KNEE) / room;
    KNEE + room * over / (1.0 + over)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grey_picture_lands_at_middle_grey() {
        let mut picture = Picture::new(10, 10);
        picture.pixels.fill(Vec3::splat(7.0));
        let exposure = Exposure::of(&picture);
        assert!((exposure.clip(picture.pixels[0]).x - 0.18).abs() < 1e-6);
        // half at 1, half black: mean 0.5, floor 5·10⁻⁵, log-average √(5·10⁻⁵)
        for p in &mut picture.pixels[..50] {
            *p = Vec3::ZERO;
        }
        picture.pixels[50..].fill(Vec3::ONE);
        assert!((Exposure::of(&picture).0 - 0.18 / 5e-5f32.sqrt()).abs() < 1e-3);
        assert_eq!(Exposure::of(&Picture::new(3, 3)), Exposure(1.0));
        picture.pixels.fill(Vec3::splat(f32::NAN));
        assert_eq!(Exposure::of(&picture), Exposure(1.0));
    }

    #[test]
    fn the_mean_of_exposures_is_as_many_stops_from_each() {
        assert!((Exposure::mean([Exposure(0.5), Exposure(8.0)]).0 - 2.0).abs() < 1e-6);
        assert_eq!(Exposure::mean([]), Exposure(1.0));
    }

    #[test]
    fn the_shoulder_rises_without_a_step_and_stays_below_white() {
        let shown = |v: f32| Exposure(1.0).show(Vec3::splat(v)).x;
        let mut last = 0.0;
        for i in 0..4000 {
            let now = shown(i as f32 * 0.001);
            assert!(now >= last && now - last < 0.02 && now <= 1.0);
            last = now;
        }
        assert!((shown(0.5) - linear_to_srgb(0.5)).abs() < 1e-6);
        assert!(shown(1e30) <= 1.0 && shown(f32::MAX) <= 1.0);
        assert_eq!(Exposure(1.0).show(Vec3::new(f32::NAN, 1.0, 1.0)), Vec3::ZERO);
    }
}
