//! A photograph as a camera gives it: vignetting, exposure, white balance, noise, clipping, 8 bits of sRGB, JPEG.

use clerestory::panorama::{Exposure, Picture, linear_to_srgb};
use glam::Vec3;
use image::{Rgb, RgbImage};

use super::dice::Dice;

/// How a camera was set, and what its lens does.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Light is multiplied by this; what is above 1 is clipped.
    pub gain: [f64; 3],
    /// Loss of light at the corners, as a share; it grows with the square of the distance from the middle.
    pub vignetting: f64,
    /// Standard deviation of the noise at full light and in the dark, of linear values.
    pub noise: [f64; 2],
    /// JPEG quality.
    pub quality: u8,
}

impl Camera {
    /// A camera that exposes a picture by itself, for its middle tones, unless too much of it would be clipped.
    pub fn automatic(picture: &Picture, dice: &mut Dice) -> Self {
        let middle = dice.between(0.7, 1.3) * f64::from(Exposure::of(picture).0);
        let exposure = middle.min(1.0 / brightness(picture, dice.between(0.86, 0.95)));
        let warm = dice.between(-0.12, 0.12);
        Self {
            gain: [exposure * (1.0 + warm), exposure, exposure * (1.0 - warm)],
            vignetting: dice.between(0.0, 0.3),
            noise: [dice.between(0.004, 0.012), dice.between(0.0005, 0.0015)],
            quality: dice.whole(86, 95) as u8,
        }
    }

    /// A camera without faults that is set so that this share of a picture is not clipped.
    pub fn plain(picture: &Picture, share: f64) -> Self {
        let white = brightness(picture, share);
        Self { gain: [1.0 / white; 3], vignetting: 0.0, noise: [0.004, 0.0005], quality: 92 }
    }

    /// The photograph.
    pub fn photograph(&self, picture: &Picture, dice: &mut Dice) -> RgbImage {
        let (w, h) = (picture.width, picture.height);
        let gain = Vec3::from(self.gain.map(|g| g as f32));
        let mut out = RgbImage::new(w as u32, h as u32);
        for (i, &light) in picture.pixels.iter().enumerate() {
            let (x, y) = ((i % w) as f64 + 0.5 - 0.5 * w as f64, (i / w) as f64 + 0.5 - 0.5 * h as f64);
            let r2 = (x * x + y * y) / (0.25 * (w * w + h * h) as f64);
            let exposed = light * gain * (1.0 - self.vignetting * r2) as f32;
            let code = exposed.to_array().map(|v| {
                // photons: the variance grows with the light; the amplifier's noise does not
                let variance = self.noise[0].powi(2) * f64::from(v.clamp(0.0, 1.0)) + self.noise[1].powi(2);
                let noisy = v + (variance.sqrt() * dice.normal()) as f32;
                (linear_to_srgb(noisy.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
            });
            out.put_pixel((i % w) as u32, (i / w) as u32, Rgb(code));
        }
        out
    }
}

/// The brightness that this share of a picture's pixels does not exceed in any channel.
fn brightness(picture: &Picture, share: f64) -> f64 {
    let mut brightest: Vec<f32> = picture.pixels.iter().map(|p| p.max_element()).collect();
    brightest.sort_unstable_by(f32::total_cmp);
    f64::from(brightest[((brightest.len() - 1) as f64 * share) as usize]).max(1e-6)
}
