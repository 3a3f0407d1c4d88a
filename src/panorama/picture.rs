//! Pixels of linear light.

use glam::Vec3;
use serde::Serialize;

/// A linear RGB picture, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// `width × height` pixels.
    pub pixels: Vec<Vec3>,
}

/// What a picture's pixels are fit for. Each pixel counts once, under the first heading that fits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct PictureHealth {
    /// All pixels.
    #[serde(skip)]
    pub pixels: usize,
    /// Pixels with a channel that is not a number.
    pub nan: usize,
    /// Pixels with an infinite channel.
    pub infinite: usize,
    /// Pixels with a negative channel.
    pub negative: usize,
    /// Pixels that are zero in every channel.
    pub black: usize,
    /// Pixels with a channel at the picture's largest value, where that value is shared by more than one pixel in
    /// 2,000 (the sensor, or an 8-bit file, could go no further); 0 otherwise.
    pub clipped: usize,
}

impl Picture {
    /// A black picture.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![Vec3::ZERO; width * height] }
    }

    /// Whether a pixel can be light: finite and nowhere negative.
    pub fn valid(pixel: Vec3) -> bool {
        pixel.is_finite() && pixel.min_element() >= 0.0
    }

    /// The same picture with black where pixels are not [valid](Self::valid).
    pub fn cleaned(mut self) -> Self {
        for p in &mut self.pixels {
            if !Self::valid(*p) {
                *p = Vec3::ZERO;
            }
        }
        self
    }

    /// Counts pixels that are not numbers, infinite, negative, black or clipped.
    pub fn health(&self) -> PictureHealth {
        let mut health = PictureHealth { pixels: self.pixels.len(), ..Default::default() };
        let valid = self.pixels.iter().filter(|p| Self::valid(**p));
        let largest = valid.fold(0.0f32, |m, p| m.max(p.max_element()));
        for p in &self.pixels {
            if p.is_nan() {
                health.nan += 1;
            } else if !p.is_finite() {
                health.infinite += 1;
            } else if p.min_element() < 0.0 {
                health.negative += 1;
            } else if *p == Vec3::ZERO {
                health.black += 1;
            } else if p.max_element() == largest {
                health.clipped += 1;
            }
        }
        if health.clipped * 2000 <= health.pixels {
            health.clipped = 0;
        }
        health
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ill_pixels_are_counted_and_never_light() {
        let mut picture = Picture::new(100, 100);
        picture.pixels.fill(Vec3::new(0.25, 0.5, 0.75));
        picture.pixels[0] = Vec3::new(f32::NAN, -1.0, f32::INFINITY);
        picture.pixels[1] = Vec3::new(0.0, f32::INFINITY, 0.0);
        picture.pixels[2] = Vec3::new(1.0, -1e-9, 0.0);
        picture.pixels[3] = Vec3::ZERO;
        for (i, p) in picture.pixels[10..20].iter_mut().enumerate() {
            *p = Vec3::new(1.0, i as f32 * 0.1, 0.2);
        }
        let health = picture.health();
        let expected = PictureHealth { pixels: 10_000, nan: 1, infinite: 1, negative: 1, black: 1, clipped: 10 };
        assert_eq!(health, expected);
        assert!(picture.cleaned().pixels[..4].iter().all(|p| *p == Vec3::ZERO));
    }

    #[test]
    fn a_lone_brightest_pixel_is_not_clipped() {
        let mut picture = Picture::new(100, 100);
        for (i, p) in picture.pixels.iter_mut().enumerate() {
            *p = Vec3::splat(1.0 + i as f32);
        }
        assert_eq!(picture.health().clipped, 0);
    }
}
