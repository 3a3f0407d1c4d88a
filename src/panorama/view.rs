//! A picture with a projection and an orientation: radiance by direction.

use glam::{DMat3, DVec2, DVec3, Mat3, Vec3};
use rayon::prelude::*;

use super::projection::cube;
use super::projection::latlong::{bilinear, latlong_pixel_fast};
use super::{Picture, Projection};

/// Radiance from all directions (or those its projection shows) around a point.
#[derive(Clone, Debug)]
pub struct Panorama {
    picture: Picture,
    /// How pixels map to directions in the camera's axes.
    pub(super) projection: Projection,
    /// From the camera's axes to the program's.
    pub(super) rotation: DMat3,
    pub(super) to_camera: Mat3,
    /// Which pixels' middles show something; empty where all do.
    shown: Vec<bool>,
}

impl Panorama {
    /// A panorama from a picture; `rotation` takes the camera's axes (+x right, +y forward, +z up) to the program's.
    /// Pixels that are no light (see [`Picture::valid`]) become black; a picture without pixels is black all over.
    pub fn new(picture: Picture, projection: Projection, rotation: DMat3) -> Self {
        Self::as_stored(picture.cleaned(), projection, rotation)
    }

    /// The same with all pixels as they are, also those that are no light.
    pub(super) fn as_stored(picture: Picture, projection: Projection, rotation: DMat3) -> Self {
        let picture = if picture.pixels.is_empty() { Picture::new(1, 1) } else { picture };
        let to_camera = rotation.transpose().as_mat3();
        let (w, h) = (picture.width, picture.height);
        let projection = projection.calibrated(w, h);
        let middle = |i: usize| projection.direction(w, h, (i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
        let shown = match projection {
            Projection::LatLong => Vec::new(),
            Projection::Camera(model) if model.is_pinhole() => Vec::new(),
            _ => (0..w * h).into_par_iter().map(|i| middle(i).is_some()).collect(),
        };
        Self { picture, projection, rotation, to_camera, shown }
    }

    /// Whether the picture shows a direction in the camera's axes.
    pub fn shows(&self, local: DVec3) -> bool {
        self.projection.pixel(self.picture.width, self.picture.height, local).is_some()
    }

    /// The pixels, without invalid ones.
    pub fn picture(&self) -> &Picture {
        &self.picture
    }

    /// Radiance that arrives from direction `d` (program's axes, unit), interpolated between the four nearest pixel
    /// centres; zero where the picture shows nothing. Latitude/longitude wraps around and across the poles; elsewhere
    /// only pixels that show something (in a cube cross: of the same face) take part.
    pub fn radiance(&self, d: Vec3) -> Vec3 {
        let local = self.to_camera * d;
        if self.projection == Projection::LatLong {
            let (w, h) = (self.picture.width as f32, self.picture.height as f32);
            return bilinear(&self.picture, latlong_pixel_fast(local, w, h));
        }
        self.shown(local.as_dvec3()).unwrap_or(Vec3::ZERO)
    }

    /// Radiance from a direction in the camera's axes; `None` where the picture does not show it.
    pub fn shown(&self, local: DVec3) -> Option<Vec3> {
        let p = self.projection.pixel(self.picture.width, self.picture.height, local)?;
        match self.projection {
            Projection::LatLong => Some(bilinear(&self.picture, p.as_vec2())),
            _ => Some(self.bilinear_shown(p)),
        }
    }

    /// Radiance at pixel coordinates, from those of the four nearest pixels that show something beside it.
    fn bilinear_shown(&self, p: DVec2) -> Vec3 {
        let (w, h) = (self.picture.width, self.picture.height);
        let face = |x: f64, y: f64| match self.projection {
            Projection::CubeCross => cube::face_at(w, h, x, y),
            _ => Some(0),
        };
        let here = face(p.x, p.y);
        let corner = (p - 0.5).floor();
        let fraction = p - 0.5 - corner;
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let (x, y) = (corner.x + dx, corner.y + dy);
            if x < 0.0 || y < 0.0 || x >= w as f64 || y >= h as f64 || face(x + 0.5, y + 0.5) != here {
                continue;
            }
            if self.shown.get(y as usize * w + x as usize) == Some(&false) {
                continue;
            }
            let weight = (1.0 - (fraction.x - dx).abs()) * (1.0 - (fraction.y - dy).abs());
            sum += self.picture.pixels[y as usize * w + x as usize].as_dvec3() * weight;
            weights += weight;
        }
        if weights > 0.0 { (sum / weights).as_vec3() } else { Vec3::ZERO }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixel_centres_keep_their_values_and_poles_are_continuous() {
        let mut picture = Picture::new(16, 8);
        for (i, p) in picture.pixels.iter_mut().enumerate() {
            *p = Vec3::new(i as f32, (i * 7 % 13) as f32, 1.0);
        }
        let rotation = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(0.3);
        let panorama = Panorama::new(picture.clone(), Projection::LatLong, rotation);
        for y in 0..8 {
            for x in 0..16 {
                let d = Projection::LatLong.direction(16, 8, x as f64 + 0.5, y as f64 + 0.5).unwrap();
                let got = panorama.radiance((rotation * d).as_vec3());
                assert!(got.distance(picture.pixels[y * 16 + x]) < 1e-2, "({x}, {y}): {got}");
            }
        }
        // either side of the pole and of the seam
        for (a, b) in
            [((3.0, 1e-4), (11.0, 1e-4)), ((5.0, 8.0 - 1e-4), (13.0, 8.0 - 1e-4)), ((1e-4, 3.0), (16.0 - 1e-4, 3.0))]
        {
            let at = |(x, y)| {
                let d = Projection::LatLong.direction(16, 8, x, y).unwrap();
                panorama.radiance((rotation * d).as_vec3())
            };
            assert!(at(a).distance(at(b)) < 0.02, "{} {}", at(a), at(b));
        }
    }

    #[test]
    fn nothing_is_black() {
        let panorama = Panorama::new(Picture::new(0, 0), Projection::LatLong, DMat3::IDENTITY);
        assert_eq!(panorama.radiance(Vec3::X), Vec3::ZERO);
    }

    #[test]
    fn what_a_projection_does_not_show_takes_no_part() {
        for projection in [Projection::Angular, Projection::MirrorBall, Projection::Fisheye, Projection::CubeCross] {
            let (w, h) = if projection == Projection::CubeCross { (30, 40) } else { (40, 40) };
            let mut picture = Picture::new(w, h);
            for y in 0..h {
                for x in 0..w {
                    let shown = projection.direction(w, h, x as f64 + 0.5, y as f64 + 0.5).is_some();
                    picture.pixels[y * w + x] = if shown { Vec3::ONE } else { Vec3::splat(1e6) };
                }
            }
            let panorama = Panorama::new(picture, projection, DMat3::IDENTITY);
            for i in 0..500 {
                let d = Projection::LatLong.direction(500, 7, f64::from(i), f64::from(i % 7) + 0.5).unwrap();
                let got = panorama.radiance(d.as_vec3());
                let expected = if projection.pixel(w, h, d).is_some() { 1.0 } else { 0.0 };
                assert!((got.x - expected).abs() < 1e-5, "{projection:?} {d}: {got}");
            }
        }
    }
}
