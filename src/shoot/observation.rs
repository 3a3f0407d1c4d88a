//! What records say about a point.

use glam::Vec3;

use super::hits::Sunlit;

/// A weighted mean of irradiance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mean {
    /// Σ w E.
    pub sum: Vec3,
    /// Σ w.
    pub weight: f32,
}

impl Mean {
    pub(super) fn add(&mut self, value: Vec3, weight: f32) {
        self.sum += value * weight;
        self.weight += weight;
    }

    /// The mean; zero where nothing was added.
    pub fn value(&self) -> Vec3 {
        if self.weight > 0.0 { self.sum / self.weight } else { Vec3::ZERO }
    }
}

/// What records say about a point, apart for records in shade, in direct sun, and on the edge of a shadow.
#[derive(Clone, Copy, Debug, Default)]
pub struct Observation {
    /// From records that the sun does not reach.
    pub shade: Mean,
    /// From records in direct sun.
    pub sun: Mean,
    /// From records that a shadow's edge runs through.
    pub edge: Mean,
    /// The weight of records that saw clipped pixels: they say how much light there is at least.
    pub clipped: f32,
    /// Standard deviation ÷ mean of what several probes say, at most 1.
    pub disagreement: f32,
}

impl Observation {
    /// What records say that the sun shines on, or not.
    pub(super) fn of(&mut self, sunlit: Sunlit) -> &mut Mean {
        match sunlit {
            Sunlit::No => &mut self.shade,
            Sunlit::Yes => &mut self.sun,
            Sunlit::Partly => &mut self.edge,
        }
    }

    /// Adds another, `scale` times as heavy.
    pub fn add(&mut self, other: &Self, scale: f32) {
        for (mine, theirs) in
            [(&mut self.shade, &other.shade), (&mut self.sun, &other.sun), (&mut self.edge, &other.edge)]
        {
            mine.sum += theirs.sum * scale;
            mine.weight += theirs.weight * scale;
        }
        self.clipped += other.clipped * scale;
    }

    /// Whether this is no more than a lower bound of the light.
    pub fn is_bound(&self) -> bool {
        /// Share of the weight of clipped records from which on they spoil the mean.
        const SPOILT: f32 = 0.1;
        self.clipped > SPOILT * self.weight()
    }

    /// Total weight: about 1 where a probe sees the point well, 0 where it does not see it.
    pub fn weight(&self) -> f32 {
        self.shade.weight + self.sun.weight + self.edge.weight
    }

    /// How far the probes agree, 0..=1; set by who adds several up.
    pub fn agreement(&self) -> f32 {
        1.0 - self.disagreement
    }

    /// Mean irradiance, whatever the sun does.
    pub fn value(&self) -> Vec3 {
        let weight = self.weight();
        if weight > 0.0 { (self.shade.sum + self.sun.sum + self.edge.sum) / weight } else { Vec3::ZERO }
    }
}
