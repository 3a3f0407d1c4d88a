//! A picture that knows where it was taken.

use glam::{DVec2, Vec3};

use crate::panorama::{Coding, Picture, Projection, Radiometry, pixel_across, radius2};
use crate::site::Pose;
use crate::sphere::sphere;

/// A picture of the scene, as its file stores it.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The probe's name.
    pub name: String,
    /// Where it was taken.
    pub pose: Pose,
    /// How its pixels map to directions.
    pub projection: Projection,
    /// Stored values, decoded to linear; what is no light is left out.
    pub picture: Picture,
    /// How the file stores them.
    pub coding: Coding,
    /// The first guess: the site file's gain, or what EXIF says of the exposure.
    pub guess: Radiometry,
    /// As the file names it. Pictures of one camera share a response; all are of one whose files do not name theirs.
    pub camera: Option<String>,
}

/// What a picture stores at some places that lie close together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stored {
    /// Mean.
    pub(super) value: Vec3,
    /// Whether a channel is at the file's end at any of them.
    pub(super) clipped: [bool; 3],
    /// Standard deviation ÷ mean of the sum of channels.
    pub(super) contrast: f32,
    /// Squared distance from the picture's centre.
    pub(super) radius2: f32,
}

impl Shot {
    /// Unit directions, program's axes, spread evenly over the sphere or, for a perspective picture, over its pixels.
    pub(super) fn directions(&self, count: usize) -> Vec<Vec3> {
        if !self.projection.is_photograph() {
            return sphere(count).collect();
        }
        let (w, h) = (self.picture.width, self.picture.height);
        // Roberts's additive recurrence on the plastic number
        let pixel = |i: usize| {
            (DVec2::splat(0.5) + DVec2::new(0.754_877_666_246_693, 0.569_840_290_998_053) * i as f64).fract()
                * DVec2::new(w as f64, h as f64)
        };
        let direction = |p: DVec2| Some((self.pose.rotation * self.projection.direction(w, h, p.x, p.y)?).as_vec3());
        (0..count).filter_map(|i| direction(pixel(i))).collect()
    }

    /// The angle of the picture's middle pixel, radians.
    pub(super) fn pixel_angle(&self) -> f32 {
        let (w, h) = (self.picture.width, self.picture.height);
        self.projection.solid_angle(w, h, w / 2, h / 2).sqrt() as f32
    }

    /// Pixel coordinates of a direction in the program's axes; `None` where the picture does not show it.
    fn pixel(&self, direction: Vec3) -> Option<DVec2> {
        let (w, h) = (self.picture.width, self.picture.height);
        let at = self.projection.pixel(w, h, self.pose.rotation.transpose() * direction.as_dvec3())?;
        (at.cmpge(DVec2::ZERO).all() && at.cmple(DVec2::new(w as f64, h as f64)).all()).then_some(at)
    }

    /// What it stores in some directions from its place; `None` where one of them is outside or no light.
    pub(super) fn stored(&self, directions: &[Vec3]) -> Option<Stored> {
        let (mut sum, mut sum2, mut peak) = (Vec3::ZERO, 0.0, Vec3::ZERO);
        for &direction in directions {
            let at = self.pixel(direction)?;
            let (value, greatest) = self.bilinear(at)?;
            sum += value;
            sum2 += value.element_sum().powi(2);
            peak = peak.max(greatest);
        }
        let n = directions.len() as f32;
        let value = sum / n;
        let mean = value.element_sum();
        let contrast = (sum2 / n - mean * mean).max(0.0).sqrt() / mean.max(f32::MIN_POSITIVE);
        let middle = self.pixel(*directions.first()?)?.as_vec2();
        let radius2 = radius2(self.picture.width, self.picture.height, middle.x, middle.y);
        Some(Stored { value, clipped: (peak.cmpge(Vec3::splat(self.guess.clipped))).into(), contrast, radius2 })
    }

    /// Between the four nearest pixels, and the greatest of them per channel: a clipped one spoils the mean. `None` where
    /// one of them is no light.
    fn bilinear(&self, at: DVec2) -> Option<(Vec3, Vec3)> {
        let (w, h) = (self.picture.width, self.picture.height);
        let wraps = self.projection == Projection::LatLong;
        let corner = (at - 0.5).floor();
        let f = (at - 0.5 - corner).as_vec2();
        let (mut sum, mut greatest) = (Vec3::ZERO, Vec3::ZERO);
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (x, y) = (corner.x as i64 + dx, corner.y as i64 + dy);
            let [x, y] = if wraps {
                pixel_across(w, h, x, y)
            } else {
                [x.clamp(0, w as i64 - 1) as usize, y.clamp(0, h as i64 - 1) as usize]
            };
            let pixel = self.picture.pixels[y * w + x];
            if !Picture::valid(pixel) {
                return None;
            }
            greatest = greatest.max(pixel);
            sum += pixel * (1.0 - (f.x - dx as f32).abs()) * (1.0 - (f.y - dy as f32).abs());
        }
        Some((sum, greatest))
    }
}
