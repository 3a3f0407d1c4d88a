//! The sky: a hazy blue dome over pale ground, without the sun, so that one picture serves every hour.

use clerestory::panorama::Picture;
use glam::{DVec3, dvec2, dvec3};
use std::f64::consts::PI;

use crate::common::pattern::cloud;

/// Width of the panorama in pixels; it is half as high.
const WIDTH: usize = 256;

/// The sky as a latitude/longitude panorama of radiance.
pub fn picture() -> Picture {
    let mut picture = Picture::new(WIDTH, WIDTH / 2);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        let (x, y) = ((i % WIDTH) as f64 + 0.5, (i / WIDTH) as f64 + 0.5);
        let elevation = PI * (0.5 - y / (WIDTH / 2) as f64);
        *pixel = radiance(x / WIDTH as f64, elevation).as_vec3();
    }
    picture
}

/// Radiance at a turn (0..1 around) and an elevation: brightest at the horizon as on a clear day (CIE sky type 12),
/// with thin clouds; the ground sends back a fifth of what a low sun and the sky give it.
fn radiance(turn: f64, elevation: f64) -> DVec3 {
    let height = elevation.sin();
    if height < 0.0 {
        return dvec3(2.2, 2.0, 1.65) * (1.0 + 0.15 * cloud(dvec2(turn, 0.5 + 0.5 * height), [16, 8], 2, 201));
    }
    let clear = dvec3(3.9, 4.2, 4.6).lerp(dvec3(0.95, 1.6, 3.0), height.sqrt());
    // clouds are seen foreshortened towards the horizon
    let veil = cloud(dvec2(turn, 0.5 / (0.25 + height)), [6, 3], 4, 202) * (6.0 * height).min(1.0);
    clear.lerp(dvec3(4.6, 4.5, 4.3), (1.6 * veil).clamp(0.0, 0.7))
}
