//! A photograph without its lens's distortion, as a pinhole camera with the same axis would have taken it.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use crate::panorama::{CameraModel, Distortion, Lens, Picture};

/// Tangents beyond this are left to panoramas: 68° from the axis.
const WIDEST: f64 = 2.5;

/// The most pixels, as a multiple of the photograph's: a barrel's corners are drawn out far.
const MOST: f64 = 4.0;

/// The pinhole camera that shows all that a perspective lens shows, with its focal lengths, so that pixels at the axis
/// keep their size; `None` for a fisheye, or where a plane would have to be too large.
pub fn pinhole_of(model: &CameraModel) -> Option<CameraModel> {
    if model.lens == Lens::Fisheye {
        return None;
    }
    if model.is_pinhole() {
        return Some(*model);
    }
    let [width, height] = model.size.map(f64::from);
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    const STEPS: u32 = 64;
    for i in 0..=STEPS {
        let s = f64::from(i) / f64::from(STEPS);
        for (x, y) in [(s * width, 0.0), (s * width, height), (0.0, s * height), (width, s * height)] {
            let d = model.direction(x, y);
            let tangents = DVec2::new(d.x, -d.z) / d.y;
            (low, high) = (low.min(tangents), high.max(tangents));
        }
    }
    let corner = (low * model.focal).floor();
    let size = (high * model.focal).ceil() - corner;
    let fits = low.min_element() > -WIDEST && high.max_element() < WIDEST;
    (fits && size.x * size.y <= MOST * width * height).then(|| CameraModel {
        size: [size.x as u32, size.y as u32],
        lens: Lens::Perspective,
        focal: model.focal,
        centre: -corner,
        skew: 0.0,
        distortion: Distortion::default(),
    })
}

/// The photograph as the pinhole camera takes it: the mean of 2 × 2 samples a pixel, each interpolated between the four
/// nearest pixels. Where the photograph shows nothing, or a pixel that is no light, it is NaN.
pub fn undistorted(picture: &Picture, model: &CameraModel, pinhole: &CameraModel) -> Picture {
    let (width, height) = (pinhole.size[0] as usize, pinhole.size[1] as usize);
    let stretch = model.stretch(picture.width, picture.height);
    let mut out = Picture::new(width, height);
    out.pixels.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let mut sum = DVec3::ZERO;
            for (dx, dy) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
                let d = pinhole.direction(x as f64 + dx, y as f64 + dy);
                sum += model.pixel(d).map_or(DVec3::NAN, |p| bilinear(picture, p * stretch).as_dvec3());
            }
            *pixel = (0.25 * sum).as_vec3();
        }
    });
    out
}

/// The value at pixel coordinates between the four nearest pixels; NaN outside the frame.
fn bilinear(picture: &Picture, p: DVec2) -> Vec3 {
    let (w, h) = (picture.width as f64, picture.height as f64);
    if !(0.0..=w).contains(&p.x) || !(0.0..=h).contains(&p.y) {
        return Vec3::NAN;
    }
    let q = (p - 0.5).clamp(DVec2::ZERO, DVec2::new(w - 1.0, h - 1.0));
    let (x0, y0) = (q.x as usize, q.y as usize);
    let (x1, y1) = ((x0 + 1).min(picture.width - 1), (y0 + 1).min(picture.height - 1));
    let f = (q - q.floor()).as_vec2();
    let row = |y: usize| picture.pixels[y * picture.width + x0].lerp(picture.pixels[y * picture.width + x1], f.x);
    row(y0).lerp(row(y1), f.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn barrel() -> CameraModel {
        let mut model = CameraModel::with_fov([160, 120], 60.0);
        model.centre = DVec2::new(83.0, 57.0);
        model.focal.x *= 1.02;
        model.distortion = Distortion::brown([-0.12, 0.02, 0.0, 0.0], [0.002, -0.001]);
        model
    }

    /// A smooth function of direction.
    fn light(d: DVec3) -> Vec3 {
        Vec3::new(1.0 + d.x as f32, 1.0 + d.z as f32, 1.0 + (3.0 * d.x * d.z) as f32)
    }

    #[test]
    fn a_barrel_is_straightened() {
        let model = barrel();
        let mut photo = Picture::new(320, 240); // twice the calibrated size
        for (i, p) in photo.pixels.iter_mut().enumerate() {
            let (x, y) = ((i % 320) as f64 + 0.5, (i / 320) as f64 + 0.5);
            *p = light(model.direction(0.5 * x, 0.5 * y));
        }
        let pinhole = pinhole_of(&model).unwrap();
        let straight = undistorted(&photo, &model, &pinhole);
        let mut shown = 0;
        for (i, p) in straight.pixels.iter().enumerate() {
            let (x, y) = ((i % straight.width) as f64 + 0.5, (i / straight.width) as f64 + 0.5);
            let d = pinhole.direction(x, y);
            let inside = |m: DVec2| m.cmpge(DVec2::ONE).all() && m.x <= 159.0 && m.y <= 119.0;
            match model.pixel(d) {
                Some(m) if inside(m) => assert!(p.distance(light(d)) < 2e-4, "({x}, {y}): {p}"),
                Some(m) if m.cmpge(DVec2::splat(-1.0)).all() && m.x <= 161.0 && m.y <= 121.0 => {}
                _ => assert!(p.is_nan(), "({x}, {y}) is outside: {p}"),
            }
            shown += usize::from(!p.is_nan());
        }
        // the undistorted frame is larger, but not by much
        assert!(shown > 160 * 120 && straight.pixels.len() < 2 * 160 * 120, "{shown} of {}", straight.pixels.len());
    }

    #[test]
    fn what_a_plane_cannot_hold_is_left_to_panoramas() {
        let mut fisheye = barrel();
        fisheye.lens = Lens::Fisheye;
        assert_eq!(pinhole_of(&fisheye), None);
        let mut wide = CameraModel::with_fov([100, 100], 150.0);
        wide.skew = 0.1;
        assert_eq!(pinhole_of(&wide), None);
    }

    #[test]
    fn pixels_that_are_no_light_stay_none() {
        let model = barrel();
        let mut photo = Picture::new(160, 120);
        photo.pixels.fill(Vec3::ONE);
        photo.pixels[60 * 160 + 80] = Vec3::splat(f32::NAN);
        let pinhole = pinhole_of(&model).unwrap();
        let straight = undistorted(&photo, &model, &pinhole);
        let at = pinhole.pixel(model.direction(80.5, 60.5)).unwrap();
        assert!(straight.pixels[at.y as usize * straight.width + at.x as usize].is_nan());
    }
}
