//! Equal averages, channel by channel.

use glam::{DVec3, Vec3};

/// Sums irradiance whose unknown channels are NaN; a channel's mean is over the values that know it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mean {
    sum: DVec3,
    count: [u32; 3],
}

impl Mean {
    pub(super) fn add(&mut self, value: Vec3) {
        for c in 0..3 {
            if !value[c].is_nan() {
                self.sum[c] += f64::from(value[c]);
                self.count[c] += 1;
            }
        }
    }

    /// Whether nothing was added.
    pub(super) fn is_empty(&self) -> bool {
        self.count == [0; 3]
    }

    /// The mean of channel `c`, if any value knew it.
    pub(super) fn channel(&self, c: usize) -> Option<f32> {
        (self.count[c] > 0).then(|| (self.sum[c] / f64::from(self.count[c])) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_channels_do_not_count() {
        let mut mean = Mean::default();
        assert!(mean.is_empty());
        mean.add(Vec3::new(1.0, f32::NAN, f32::NAN));
        mean.add(Vec3::new(3.0, 5.0, f32::NAN));
        assert_eq!([0, 1, 2].map(|c| mean.channel(c)), [Some(2.0), Some(5.0), None]);
    }
}
