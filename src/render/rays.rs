//! The primary rays of a camera.

use glam::{DVec2, Vec2, Vec3};

use crate::scene::Hit;
use crate::site::Camera;

/// A sample's ray, and what it meets first.
#[derive(Clone, Copy, Default)]
pub(crate) struct Cast {
    pub(crate) direction: Vec3,
    pub(crate) hit: Option<Hit>,
}

/// Directions of a camera's rays, fast for a lens without distortion.
pub struct PrimaryRays {
    camera: Camera,
    /// Direction of pixel (0, 0)'s corner, and its change per pixel to the right and down, for a perfect pinhole.
    pinhole: Option<[Vec3; 3]>,
    /// Places of the samples inside a pixel, 0..1.
    pub offsets: Vec<Vec2>,
}

impl PrimaryRays {
    /// The rays of a camera with so many samples a pixel, spread evenly under a box filter: a grid where the number is a
    /// square, else Roberts's additive recurrence.
    pub fn new(camera: &Camera, samples: u32) -> Self {
        let side = f64::from(samples).sqrt() as u32;
        let offsets = if side * side == samples {
            let at = |i: u32| (i as f32 + 0.5) / side as f32;
            (0..samples).map(|s| Vec2::new(at(s % side), at(s / side))).collect()
        } else {
            let at = |s: u32, step: f64| (0.5 + f64::from(s) * step).fract() as f32;
            (0..samples).map(|s| Vec2::new(at(s, 0.754_877_666_246_693), at(s, 0.569_840_290_998_053))).collect()
        };
        let pinhole = camera.is_pinhole().then(|| {
            let m = camera.pose.rotation;
            let right = m.x_axis / camera.focal.x;
            let down = -m.z_axis / camera.focal.y;
            let corner = m.y_axis - right * camera.centre.x - down * camera.centre.y;
            [corner.as_vec3(), right.as_vec3(), down.as_vec3()]
        });
        Self { camera: *camera, pinhole, offsets }
    }

    /// Unit direction of a sample of a pixel.
    #[inline]
    pub fn direction(&self, x: usize, y: usize, sample: usize) -> Vec3 {
        self.towards(Vec2::new(x as f32, y as f32) + self.offsets[sample])
    }

    /// Unit direction of the middle of a pixel, and how it changes over one pixel to the right and down, but for what
    /// is along it.
    #[inline]
    pub fn middle(&self, x: usize, y: usize) -> (Vec3, [Vec3; 2]) {
        let at = Vec2::new(x as f32, y as f32) + 0.5;
        match &self.pinhole {
            Some([corner, right, down]) => {
                let d = *corner + *right * at.x + *down * at.y;
                let scale = d.length_recip();
                (d * scale, [*right * scale, *down * scale])
            }
            None => {
                let change = |half: Vec2| self.towards(at + half) - self.towards(at - half);
                (self.towards(at), [change(0.5 * Vec2::X), change(0.5 * Vec2::Y)])
            }
        }
    }

    #[inline]
    fn towards(&self, at: Vec2) -> Vec3 {
        match &self.pinhole {
            Some([corner, right, down]) => (*corner + *right * at.x + *down * at.y).normalize(),
            None => {
                let at: DVec2 = at.as_dvec2();
                self.camera.direction(at.x, at.y).as_vec3()
            }
        }
    }
}
