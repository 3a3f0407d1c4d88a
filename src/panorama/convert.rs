//! From one projection and size to another.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::projection::latlong;
use super::{Panorama, Picture, Projection};

/// The most samples along a target pixel's side.
const MAX_SAMPLES: usize = 32;

/// The panorama as a camera with the same axes but another projection would have taken it, `width × height` pixels.
///
/// Each pixel is the mean over a grid of samples fine enough that no source pixel under it is stepped over (at least
/// 2 × 2, at most 32 × 32). What the panorama does not show takes no part; pixels that see nothing are black.
pub fn convert(panorama: &Panorama, target: Projection, width: usize, height: usize) -> Picture {
    resampled(panorama, target, width, height).0
}

/// As [`convert`], and whether the panorama shows the middle of each pixel.
fn resampled(panorama: &Panorama, target: Projection, width: usize, height: usize) -> (Picture, Vec<bool>) {
    let direction = halves(target, width, height);
    let least = rim(panorama);
    let shown = |columns: usize, rows: usize, first: usize| -> Vec<bool> {
        let row = |y: usize| (0..columns).map(move |x| (2 * x + first, 2 * y + first));
        let shows = |(i, k)| direction(i, k).is_some_and(|d| d.y >= least && panorama.shows(d));
        (0..rows).into_par_iter().flat_map_iter(row).map(shows).collect()
    };
    let (corners, middles) = (shown(width + 1, height + 1, 0), shown(width, height, 1));
    let mut picture = Picture::new(width, height);
    picture.pixels.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            // a panorama may show little of the sphere: what lies beside it costs nothing more
            let beside = [y, y + 1].iter().all(|y| !corners[y * (width + 1) + x] && !corners[y * (width + 1) + x + 1]);
            if beside && !middles[y * width + x] {
                continue;
            }
            let n = samples(panorama, target.solid_angle(width, height, x, y), direction(2 * x + 1, 2 * y + 1));
            let (mut sum, mut count) = (DVec3::ZERO, 0);
            for i in 0..n * n {
                let sub = |k: usize| (k as f64 + 0.5) / n as f64;
                let d = target.direction(width, height, x as f64 + sub(i % n), y as f64 + sub(i / n));
                if let Some(radiance) = d.and_then(|d| panorama.shown(d)) {
                    sum += radiance.as_dvec3();
                    count += 1;
                }
            }
            if count > 0 {
                *pixel = (sum / f64::from(count)).as_vec3();
            }
        }
    });
    (picture, middles)
}

/// The cosine of the angle from forward beyond which a photograph shows nothing; −1 of what may show all directions.
fn rim(panorama: &Panorama) -> f64 {
    const EVERYTHING: f64 = -1.0;
    let Projection::Camera(model) = panorama.projection else { return EVERYTHING };
    let (w, h) = (panorama.picture().width, panorama.picture().height);
    // the lens takes a frame's inside to the inside of what it takes the frame itself to
    let sides = (0..=w).flat_map(|x| [(x, 0), (x, h)]).chain((0..=h).flat_map(|y| [(0, y), (w, y)]));
    let angle = |(x, y)| panorama.projection.direction(w, h, x as f64, y as f64).map(|d| d.y.clamp(-1.0, 1.0).acos());
    let Some(most) = sides.map(angle).try_fold(0.0, |most, a| Some(f64::max(most, a?))) else { return EVERYTHING };
    // from one place on the frame to the next it may be as much as a pixel farther
    let pixel = model.stretch(w, h).recip() / model.focal;
    (most + pixel.max_element()).min(PI).cos()
}

/// The directions of a picture's places half a pixel apart: even ones are pixels' corners, odd ones their middles.
fn halves(target: Projection, width: usize, height: usize) -> impl Fn(usize, usize) -> Option<DVec3> {
    let half = |i: usize| 0.5 * i as f64;
    // the angles of a latitude/longitude picture are those of its columns and rows
    let table = (target == Projection::LatLong).then(|| {
        let columns: Vec<_> = (0..=2 * width).map(|i| latlong::longitude(width, half(i))).collect();
        let rows: Vec<_> = (0..=2 * height).map(|k| latlong::zenith_angle(height, half(k))).collect();
        (columns, rows)
    });
    move |i, k| match &table {
        Some((columns, rows)) => Some(latlong::at(columns[i], rows[k])),
        None => target.direction(width, height, half(i), half(k)),
    }
}

/// Samples along a side for a target pixel of that solid angle, from the source pixel under its centre.
fn samples(panorama: &Panorama, target: f64, centre: Option<DVec3>) -> usize {
    let source = panorama.picture();
    let (w, h) = (source.width, source.height);
    let Some(p) = centre.and_then(|d| panorama.projection.pixel(w, h, d)) else { return 4 };
    let (x, y) = ((p.x as usize).min(w - 1), (p.y as usize).min(h - 1));
    let under = panorama.projection.solid_angle(w, h, x, y);
    let ratio = if under > 0.0 { (target / under).sqrt() } else { 1.0 };
    ((1.5 * ratio).ceil() as usize).clamp(2, MAX_SAMPLES)
}

/// The picture in latitude/longitude, its equator as fine as the picture's centre; NaN where it shows nothing, or a pixel that is
/// no light, so that this never becomes light.
pub fn latlong(mut picture: Picture, projection: Projection) -> Picture {
    if projection == Projection::LatLong {
        return picture;
    }
    // others may average to what looks like light
    picture.pixels.iter_mut().filter(|p| !Picture::valid(**p)).for_each(|p| *p = Vec3::NAN);
    let panorama = Panorama::as_stored(picture, projection, DMat3::IDENTITY);
    let (width, height) = latlong_size(&panorama);
    let (mut out, shown) = resampled(&panorama, Projection::LatLong, width, height);
    out.pixels.iter_mut().zip(shown).filter(|(_, shown)| !shown).for_each(|(pixel, _)| *pixel = Vec3::NAN);
    out
}

/// A latitude/longitude size whose equator is as fine as the panorama's centre.
pub(super) fn latlong_size(panorama: &Panorama) -> (usize, usize) {
    let (w, h) = (panorama.picture().width, panorama.picture().height);
    let forward = panorama.projection.pixel(w, h, DVec3::Y);
    let (x, y) = forward.map_or((0, 0), |p| ((p.x as usize).min(w - 1), (p.y as usize).min(h - 1)));
    let side = panorama.projection.solid_angle(w, h, x, y).sqrt();
    let height = (0.5 * TAU / side).ceil().clamp(16.0, 4096.0) as usize;
    (2 * height, height)
}

/// The picture averaged down to a smaller size; a pixel that lies across several takes part in each with its overlap.
pub(super) fn shrink(picture: &Picture, width: usize, height: usize) -> Picture {
    let across = |row: &[Vec3]| average(row.len(), width, |i| row[i]);
    let narrow: Vec<Vec<Vec3>> = picture.pixels.par_chunks(picture.width).map(across).collect();
    let columns: Vec<Vec<Vec3>> =
        (0..width).into_par_iter().map(|x| average(picture.height, height, |y| narrow[y][x])).collect();
    let pixels = (0..width * height).map(|i| columns[i % width][i / width]).collect();
    Picture { width, height, pixels }
}

/// `from` values averaged down to `to` cells of equal length.
fn average(from: usize, to: usize, value: impl Fn(usize) -> Vec3) -> Vec<Vec3> {
    let step = from as f64 / to as f64;
    let cell = |k: usize| {
        let (start, end) = (k as f64 * step, ((k + 1) as f64 * step).min(from as f64));
        let overlap = |i: usize| (end.min(i as f64 + 1.0) - start.max(i as f64)).max(0.0);
        let parts = (start as usize..(end.ceil() as usize).min(from)).map(|i| value(i).as_dvec3() * overlap(i));
        (parts.sum::<DVec3>() / (end - start)).as_vec3()
    };
    (0..to).map(cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::{CameraModel, Distortion, Lens};
    use glam::DVec2;

    /// A smooth function on the sphere with something in every direction.
    fn light(d: DVec3) -> Vec3 {
        Vec3::new(1.0 + d.x as f32, 1.5 + (d.y * d.z) as f32, 2.0 - (d.z * d.z) as f32)
    }

    fn picture_of(projection: Projection, width: usize, height: usize) -> Picture {
        let mut picture = Picture::new(width, height);
        for y in 0..height {
            for x in 0..width {
                if let Some(d) = projection.direction(width, height, x as f64 + 0.5, y as f64 + 0.5) {
                    picture.pixels[y * width + x] = light(d);
                }
            }
        }
        picture
    }

    #[test]
    fn every_projection_shows_the_same_world() {
        let cases = [
            (Projection::LatLong, 256, 128),
            (Projection::Angular, 256, 256),
            (Projection::MirrorBall, 512, 512),
            (Projection::CubeCross, 192, 256),
            (Projection::CubeCross, 256, 192),
        ];
        let rotation = DMat3::from_rotation_z(1.0);
        for (source, w, h) in cases {
            let panorama = Panorama::new(picture_of(source, w, h), source, rotation);
            for (target, w, h) in cases {
                let (w, h) = (w / 4, h / 4);
                let got = convert(&panorama, target, w, h);
                for (i, pixel) in got.pixels.iter().enumerate() {
                    let Some(d) = target.direction(w, h, (i % w) as f64 + 0.5, (i / w) as f64 + 0.5) else { continue };
                    // near its rim the ball squeezes half the world into a few pixels
                    let (blunt, sharp) = (Projection::MirrorBall, 0.03);
                    let most = if (source == blunt || target == blunt) && d.y < -0.7 { 0.5 } else { sharp };
                    assert!(
                        pixel.distance(light(d)) < most,
                        "{source:?} → {target:?} at {d}: {pixel} for {}",
                        light(d)
                    );
                }
            }
        }
    }

    #[test]
    fn a_photograph_is_shown_to_its_corners() {
        let mut barrel = CameraModel::with_fov([60, 40], 63.0);
        barrel.centre.x += 7.0;
        barrel.distortion = Distortion::brown([-0.1, 0.01, 0.0, 0.0], [0.01, -0.02]);
        let fisheye =
            CameraModel { lens: Lens::Fisheye, focal: DVec2::splat(20.0), distortion: Distortion::default(), ..barrel };
        let photographs =
            [Projection::Perspective { fov_y: 1.1 }, Projection::Camera(barrel), Projection::Camera(fisheye)];
        for projection in photographs {
            let panorama = Panorama::new(Picture::new(60, 40), projection, DMat3::IDENTITY);
            assert!(rim(&panorama) > -1.0);
            let (w, h) = (720, 360);
            let (_, shown) = resampled(&panorama, Projection::LatLong, w, h);
            let middle = |i: usize| latlong::direction(w, h, (i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
            assert!((0..w * h).all(|i| shown[i] == panorama.shows(middle(i))), "{projection:?}");
        }
    }

    #[test]
    fn pixels_that_are_no_light_stay_none() {
        let mut picture = picture_of(Projection::Angular, 64, 64);
        let none = [(31, 31, f32::NAN), (50, 31, -1.0), (31, 50, f32::INFINITY)];
        none.iter().for_each(|&(x, y, value)| picture.pixels[y * 64 + x] = Vec3::splat(value));
        let around = latlong(picture, Projection::Angular);
        let (w, h) = (around.width, around.height);
        for (i, pixel) in around.pixels.iter().enumerate() {
            let d = latlong::direction(w, h, (i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
            let p = Projection::Angular.pixel(64, 64, d).unwrap();
            let off = |&(x, y, _): &(usize, usize, f32)| (p - DVec2::new(x as f64, y as f64) - 0.5).abs().max_element();
            let off = none.iter().map(off).fold(f64::INFINITY, f64::min);
            // the pixels beside them, of which they are a part, are lost as well
            assert!(if off < 0.5 { pixel.is_nan() } else { off < 4.0 || Picture::valid(*pixel) }, "{p}: {pixel}");
        }
    }

    #[test]
    fn shrinking_keeps_the_mean() {
        let picture = picture_of(Projection::LatLong, 97, 53);
        let small = shrink(&picture, 40, 20);
        let mean = |p: &Picture| p.pixels.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / p.pixels.len() as f64;
        assert!(mean(&picture).distance(mean(&small)) < 1e-6);
    }
}
