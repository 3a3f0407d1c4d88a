//! What a picture usually has at a brightness: noise, coding and softness depend on it.

use glam::Vec3;

use crate::statistics::quantile;

/// Bins of brightness.
pub(crate) const BINS: usize = 8;

/// Which eighth of the picture, by brightness, each pixel is in.
pub(crate) struct Bins {
    pub(crate) of: Vec<usize>,
}

impl Bins {
    /// Of a photograph's logarithm.
    pub(crate) fn new(log_photo: &[Vec3]) -> Self {
        Self::by(&log_photo.iter().map(|p| p.element_sum()).collect::<Vec<f32>>())
    }

    /// By any other value.
    pub(crate) fn by(values: &[f32]) -> Self {
        let mut sorted: Vec<f32> = values.iter().copied().filter(|b| b.is_finite()).collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let limits: Vec<f32> = (1..BINS).filter_map(|k| sorted.get(k * sorted.len() / BINS).copied()).collect();
        Self { of: values.iter().map(|b| limits.partition_point(|l| l < b)).collect() }
    }

    /// Per bin, the value that this share (0..1) of those that count stay below; 0 where none does.
    pub(crate) fn quantile(&self, values: &[f32], share: f64, counts: impl Fn(usize) -> bool) -> [f32; BINS] {
        let mut all: [Vec<f32>; BINS] = Default::default();
        for (i, v) in values.iter().enumerate().filter(|(i, _)| counts(*i)) {
            all[self.of[i]].push(*v);
        }
        all.map(|mut values| quantile(&mut values, share).unwrap_or(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_brightness_has_its_own_usual_value() {
        let photo: Vec<Vec3> = (0..80).map(|i| Vec3::splat(i as f32)).collect();
        let bins = Bins::new(&photo);
        let values: Vec<f32> = (0..80).map(|i| if i < 40 { 1.0 } else { i as f32 }).collect();
        let usual = bins.quantile(&values, 0.5, |i| i != 75);
        assert_eq!((usual[0], usual[3], usual[4]), (1.0, 1.0, 46.0));
        assert!(usual[7] >= 74.0 && bins.quantile(&values, 0.5, |_| false) == [0.0; BINS]);
    }
}
