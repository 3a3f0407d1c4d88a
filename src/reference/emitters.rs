//! Emissive triangles as a light to sample: chosen by power, then uniformly over the area. Both sides emit.

use glam::{Vec2, Vec3};

use super::random::pick;
use crate::scene::Scene;

/// Every emissive triangle of a scene.
pub(super) struct Emitters {
    triangles: Vec<u32>,
    /// Running sum of the probabilities; the last is 1.
    cumulative: Vec<f32>,
    /// Probability per square metre of a point of each triangle of the mesh; 0 for what does not emit.
    density: Vec<f32>,
}

/// A point on an emitter.
pub(super) struct EmitterPoint {
    pub(super) position: Vec3,
    /// Unit, by the winding.
    pub(super) normal: Vec3,
    pub(super) radiance: Vec3,
    /// Probability per square metre.
    pub(super) density: f32,
}

impl Emitters {
    /// The emitters of a scene, or `None` where nothing emits.
    pub(super) fn new(scene: &Scene) -> Option<Self> {
        let mesh = &scene.mesh;
        let power = |t: u32| f64::from(scene.emission(t).element_sum() * mesh.area(t));
        let triangles: Vec<u32> = (0..mesh.triangles.len() as u32).filter(|&t| power(t) > 0.0).collect();
        let total: f64 = triangles.iter().map(|&t| power(t)).sum();
        if triangles.is_empty() || !total.is_finite() {
            return None;
        }
        let mut density = vec![0.0; mesh.triangles.len()];
        let mut sum = 0.0;
        let mut cumulative = Vec::with_capacity(triangles.len());
        for &t in &triangles {
            let p = power(t) / total;
            sum += p;
            cumulative.push(sum as f32);
            density[t as usize] = (p / f64::from(mesh.area(t))) as f32;
        }
        if let Some(last) = cumulative.last_mut() {
            *last = 1.0;
        }
        Some(Self { triangles, cumulative, density })
    }

    /// A random point; `u` in the unit square.
    pub(super) fn sample(&self, scene: &Scene, u: Vec2) -> EmitterPoint {
        let (i, within) = pick(&self.cumulative, u.x);
        let triangle = self.triangles[i];
        let [a, b, c] = scene.mesh.corners(triangle);
        // Turk, Generating random points in triangles, Graphics Gems, 1990
        let r = within.sqrt();
        EmitterPoint {
            position: a * (1.0 - r) + b * (r * (1.0 - u.y)) + c * (r * u.y),
            normal: scene.mesh.normal(triangle),
            radiance: scene.emission(triangle),
            density: self.density[triangle as usize],
        }
    }

    /// Probability per square metre with which [`Emitters::sample`] finds a point of a triangle.
    pub(super) fn density(&self, triangle: u32) -> f32 {
        self.density[triangle as usize]
    }
}
