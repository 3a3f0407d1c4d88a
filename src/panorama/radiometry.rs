//! From a picture's stored values to light.

use glam::{Vec2, Vec3};

use super::{Picture, srgb_to_linear};

/// How the values that a picture stores (decoded to linear) become radiance:
///
/// radiance = gain · x · exp(a x + b x²) · exp(v r² + w r⁴)
///
/// for a stored value x of a channel, r the distance from the picture's centre, 1 in its corners. The response (a, b) is
/// what a camera bent beside sRGB's curve, written so that x = 0 stays dark and small x stays proportional; a pure power
/// of x cannot be told from exposures (Grossberg and Nayar, *Determining the camera response from images: what is
/// knowable?*, 2003), so it is no part of it. Vignetting (v, w) is above zero where corners are too dark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Radiometry {
    /// Radiance per stored value: exposure and white balance.
    pub gain: Vec3,
    /// v and w.
    pub vignetting: Vec2,
    /// a and b.
    pub response: Vec2,
    /// The stored value from which a channel is at the file's end, so that the light was at least that; infinite where
    /// there is none.
    pub clipped: f32,
}

impl Default for Radiometry {
    /// Stored values are radiance.
    fn default() -> Self {
        Self { gain: Vec3::ONE, vignetting: Vec2::ZERO, response: Vec2::ZERO, clipped: f32::INFINITY }
    }
}

/// sRGB-encoded value from which on a channel counts as clipped: tone curves and JPEG smear the end a little.
const CLIPPED: f32 = 252.0 / 255.0;

impl Coding {
    /// The linear value from which a channel of such a file counts as clipped; infinite for files without an end.
    pub fn clipped(self) -> f32 {
        match self {
            Self::Srgb8 | Self::Srgb16 => srgb_to_linear(CLIPPED),
            Self::Linear => f32::INFINITY,
        }
    }
}

impl Radiometry {
    /// The radiance of a stored pixel at the squared distance `r2` from the picture's centre, 1 in its corners.
    #[inline]
    pub fn light(&self, stored: Vec3, r2: f32) -> Vec3 {
        let mut light = stored * self.gain;
        if self.response != Vec2::ZERO {
            light *= (stored * (stored * self.response.y + self.response.x)).map(f32::exp);
        }
        if self.vignetting != Vec2::ZERO {
            light *= (r2 * (self.vignetting.x + self.vignetting.y * r2)).exp();
        }
        light
    }

    /// Whether a channel of a stored pixel is at the file's end.
    #[inline]
    pub fn is_clipped(&self, stored: Vec3) -> bool {
        stored.max_element() >= self.clipped
    }

    /// A picture's radiance in the place of what it stores.
    pub fn develop(&self, picture: &mut Picture) {
        let (width, height) = (picture.width, picture.height);
        for (i, pixel) in picture.pixels.iter_mut().enumerate() {
            let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
            *pixel = self.light(*pixel, radius2(width, height, x, y));
        }
    }
}

/// Whether the light of a response (a, b) rises all the way from black to white: 1 + a x + 2 b x² > 0 for x in 0..=1.
pub fn response_rises(response: Vec2) -> bool {
    let [a, b] = response.to_array();
    let slope = |x: f32| 1.0 + a * x + 2.0 * b * x * x;
    let lowest = if b > 0.0 { (-a / (4.0 * b)).clamp(0.0, 1.0) } else { 1.0 };
    slope(1.0) > 0.0 && slope(lowest) > 0.0
}

/// The squared distance of pixel coordinates from a picture's centre, 1 in its corners.
#[inline]
pub fn radius2(width: usize, height: usize, x: f32, y: f32) -> f32 {
    let half = 0.5 * Vec2::new(width as f32, height as f32);
    (Vec2::new(x, y) - half).length_squared() / half.length_squared()
}

/// How a file stores its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Numbers proportional to light, without an upper end of their own.
    Linear,
    /// 8 bits, encoded by sRGB's curve.
    Srgb8,
    /// 16 bits, encoded by sRGB's curve.
    Srgb16,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_lifted_and_colours_balanced() {
        let radiometry =
            Radiometry { gain: Vec3::new(2.0, 1.0, 0.5), vignetting: Vec2::new(0.3, 0.1), ..Default::default() };
        let mut picture = Picture { width: 200, height: 100, pixels: vec![Vec3::splat(0.5); 20_000] };
        radiometry.develop(&mut picture);
        assert!(picture.pixels[50 * 200 + 100].distance(Vec3::new(1.0, 0.5, 0.25)) < 1e-4, "the middle stays");
        let corner = picture.pixels[0] / Vec3::new(1.0, 0.5, 0.25);
        assert!((corner - 0.4f32.exp()).abs().max_element() < 0.02, "{corner}");
    }

    #[test]
    fn a_response_keeps_black_and_bends_the_bright_end() {
        let radiometry = Radiometry { response: Vec2::new(0.2, 0.1), ..Default::default() };
        let of = |x: f32| radiometry.light(Vec3::splat(x), 0.3).x;
        assert_eq!(of(0.0), 0.0);
        assert!((of(1e-3) / 1e-3 - 1.0).abs() < 1e-3 && (of(1.0) - 0.3f32.exp()).abs() < 1e-6);
        assert!(response_rises(radiometry.response) && response_rises(Vec2::ZERO));
        assert!(!response_rises(Vec2::new(-1.1, 0.0)) && !response_rises(Vec2::new(-4.0, 2.0)));
        assert!(Coding::Linear.clipped().is_infinite() && Coding::Srgb8.clipped() < 1.0);
    }
}
