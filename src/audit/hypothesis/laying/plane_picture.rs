//! What a view shows of the model in a plane, as a texture: a scan has no other.

use glam::{Vec2, Vec3};

use crate::audit::observe::geometry_buffer::NONE;
use crate::audit::observe::uv_islands::Gradient;
use crate::audit::view::Observations;
use crate::panorama::linear_to_code;
use crate::scene::Texture;

/// A plane's picture is so many times as wide as pixels reach from their middle: what was shifted came from beside them.
const PERIOD: f32 = 4.0;

/// Surfaces lie in one plane if they are off it by less than this share of how far they reach from their middle.
const OFF: f32 = 0.25;

/// A plane whose paint as the view shows it is a texture: a scan has no other.
pub(crate) struct Plane {
    origin: Vec3,
    normal: Vec3,
    /// How far pixels reach from the origin, metres.
    reach: f32,
    pub(crate) gradient: Gradient,
}

impl Plane {
    /// That in which most of some pixels lie, if they do; a period is so many times as long as these reach from their middle.
    pub(crate) fn of(observed: &Observations, pixels: &[usize]) -> Option<Self> {
        let s = &observed.surfaces;
        let normal = pixels.iter().map(|i| s.normal[*i]).sum::<Vec3>().try_normalize()?;
        let origin = pixels.iter().map(|i| s.position[*i]).sum::<Vec3>() / pixels.len() as f32;
        let reach = pixels.iter().map(|i| s.position[*i].distance(origin)).fold(0.0, f32::max).max(1e-3);
        // pictures are mirrored along the level lines of walls, and along the building's axes on floors
        let axis = if normal.z.abs() < std::f32::consts::FRAC_1_SQRT_2 { Vec3::Z } else { Vec3::Y };
        let u = axis.cross(normal).normalize();
        let v = normal.cross(u);
        let period = PERIOD * reach;
        let plane = Self { origin, normal, reach, gradient: Gradient::along(u / period, v / period) };
        let held = pixels.iter().filter(|i| plane.holds(observed, **i)).count();
        (4 * held > 3 * pixels.len()).then_some(plane)
    }

    /// Whether a pixel's surface lies in the plane.
    pub(crate) fn holds(&self, observed: &Observations, i: usize) -> bool {
        let s = &observed.surfaces;
        let off = self.normal.dot(s.position[i] - self.origin).abs();
        s.triangle[i] != NONE && off <= OFF * self.reach && s.normal[i].dot(self.normal) > 0.0
    }

    pub(crate) fn at(&self, point: Vec3) -> Vec2 {
        self.gradient.step(point - self.origin) + Vec2::splat(0.5)
    }

    /// The point of it that has such a place in its picture.
    pub(crate) fn point(&self, at: Vec2) -> Vec3 {
        self.origin + self.along(at - Vec2::splat(0.5))
    }

    /// The way on it along which the place changes so.
    pub(crate) fn along(&self, step: Vec2) -> Vec3 {
        let [u, v] = self.gradient.directions();
        u * step.x + v * step.y
    }

    /// The model's albedo on it, where the view shows that, and elsewhere its mean; so many texels wide and high.
    pub(crate) fn picture(&self, observed: &Observations, side: usize) -> Texture {
        let s = &observed.surfaces;
        let albedo = |k: usize| {
            let at = Vec2::new((k % side) as f32 + 0.5, (side - 1 - k / side) as f32 + 0.5) / side as f32 - 0.5;
            let seen = s.project(self.origin + self.along(at)).filter(|p| p.min_element() >= 0.0)?.as_usizevec2();
            let i = (seen.x < s.width && seen.y < s.height).then(|| seen.y * s.width + seen.x)?;
            self.holds(observed, i).then(|| observed.albedo[i])
        };
        let all: Vec<Option<Vec3>> = (0..side * side).map(albedo).collect();
        let known = all.iter().flatten();
        let mean = known.clone().sum::<Vec3>() / known.count().max(1) as f32;
        let code = |a: Vec3| {
            let [r, g, b] = a.to_array().map(linear_to_code);
            [r, g, b, 255]
        };
        let texels = all.into_iter().map(|a| code(a.unwrap_or(mean))).collect();
        Texture::new(String::new(), side, side, texels)
    }
}
