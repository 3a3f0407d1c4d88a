//! The light outside: a sky by seed, and a sun that shines in through one of the windows.

use clerestory::panorama::Picture;
use glam::{DVec3, dvec2, dvec3};
use std::f64::consts::PI;

use super::dice::Dice;
use super::layout::Window;
use crate::common::pattern::cloud;

/// Width of the sky's picture in pixels; it is half as high.
const WIDTH: usize = 128;

/// A sun: where it stands (unit, model's axes) and its irradiance on what faces it.
#[derive(Clone, Copy, Debug)]
pub struct Sun {
    /// Towards it.
    pub direction: DVec3,
    /// In the units of all pictures.
    pub irradiance: [f64; 3],
}

/// A sun that shines in through one of the windows (those of an interior, by their outward normals), or none.
pub fn sun(windows: &[Window], inside: DVec3, dice: &mut Dice) -> Option<Sun> {
    if windows.is_empty() || dice.chance(0.25) {
        return None;
    }
    let [middle, along, up] = dice.pick(windows);
    let normal = along.cross(up).normalize();
    let outward = if normal.dot(middle - inside) < 0.0 { -normal } else { normal };
    let azimuth = outward.z.atan2(outward.x) + dice.between(-0.85, 0.85);
    let elevation = dice.between(18.0, 50.0f64).to_radians();
    let direction = dvec3(azimuth.cos() * elevation.cos(), elevation.sin(), azimuth.sin() * elevation.cos());
    // redder and weaker near the horizon
    let air = 1.0 - 0.25 / elevation.sin().max(0.3);
    let strength = dice.between(25.0, 60.0);
    let irradiance = [strength * air.powf(0.6), strength * air * 0.95, strength * air.powf(1.8) * 0.88];
    Some(Sun { direction, irradiance: irradiance.map(|v| (v * 100.0).round() / 100.0) })
}

/// The sky as a latitude/longitude panorama of radiance: clear, cloudy or grey, over the ground.
pub fn sky(dice: &mut Dice) -> Picture {
    let (grey, strength, seed) = (dice.unit().powi(2), dice.between(0.7, 1.6), dice.next() >> 8);
    let ground = dvec3(0.5, 0.46, 0.36).lerp(dvec3(0.3, 0.45, 0.2), dice.unit()) * dice.between(2.0, 5.0);
    let mut picture = Picture::new(WIDTH, WIDTH / 2);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        let (x, y) = ((i % WIDTH) as f64 + 0.5, (i / WIDTH) as f64 + 0.5);
        let height = (PI * (0.5 - y / (WIDTH / 2) as f64)).sin();
        let turn = x / WIDTH as f64;
        let radiance = if height < 0.0 {
            ground * (1.0 + 0.3 * cloud(dvec2(turn, 0.5 + 0.5 * height), [16, 8], 3, seed))
        } else {
            let clear = dvec3(3.9, 4.2, 4.6).lerp(dvec3(0.95, 1.6, 3.0), height.sqrt());
            let veil = cloud(dvec2(turn, 0.5 / (0.25 + height)), [6, 3], 4, seed ^ 1) * (6.0 * height).min(1.0);
            clear.lerp(dvec3(4.6, 4.5, 4.3), (1.6 * veil + grey).clamp(0.0, 1.0))
        };
        *pixel = (radiance * strength).as_vec3();
    }
    picture
}
