//! The irradiance volume (paper, section 4.2): light where no probe sees.
//!
//! The paper averages the records inside each cell and lets neighbouring cells fill the empty ones. That spreads sun
//! patches and leaks through walls. Here the empty places are filled by what actually lights them: rays cast from a
//! place on the unseen surface find the surfaces that probes did see, whose radiance is known, and other unseen places,
//! with which they exchange light until it settles.

mod anchors;
mod gather;
mod grid;
mod guide;

pub use anchors::{Anchor, Anchors, Weighted};
pub use gather::{Emitters, gather, scout};
pub use grid::Grid;
pub use guide::Guide;

use glam::Vec3;

use crate::scene::Scene;

/// Irradiance at anchors on unseen surfaces.
pub struct Volume {
    /// Where the values are.
    pub anchors: Anchors,
    /// Per anchor the vector irradiance of each channel: E(n) = n · vector; zero where not gathered.
    pub vectors: Vec<[Vec3; 3]>,
    /// Whether an anchor's value was gathered.
    pub known: Vec<bool>,
}

impl Volume {
    /// Irradiance on a surface; `None` where no anchor nearby knows.
    pub fn irradiance(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<Vec3> {
        let mut found = Vec::new();
        self.anchors.around(point, normal, &mut found);
        let mut sum = Vec3::ZERO;
        let mut total = 0.0;
        let best = found.iter().find(|f| self.known[f.1 as usize])?.0;
        let mut rays = 0;
        for &(weight, anchor) in &found {
            if weight < 0.02 * best || rays >= 6 {
                break;
            }
            if !self.known[anchor as usize] {
                continue;
            }
            rays += 1;
            if self.anchors.sees(scene, anchor, point, normal) {
                let v = &self.vectors[anchor as usize];
                sum += Vec3::new(v[0].dot(normal), v[1].dot(normal), v[2].dot(normal)).max(Vec3::ZERO) * weight;
                total += weight;
            }
        }
        (total > 0.0).then(|| sum / total)
    }
}
