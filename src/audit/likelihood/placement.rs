//! How far off their places the surfaces of a right model are in a photograph: a hand-held scan is fused to a centimetre or two, a survey to
//! millimetres, and the camera's pose is known to no more.

use rayon::prelude::*;
use std::collections::BTreeMap;

use crate::audit::likelihood::photo_consistency::Geometry;
use crate::audit::likelihood::plane_sweep::{Swept, sweep};
use crate::audit::observe::geometry_buffer::GeometryBuffer;
use crate::audit::observe::probe_view::ProbeView;
use crate::audit::picture::{FEWEST, student};

/// Pixels by which a part's place is told: its own uncertainty is a share of what parts differ by.
const ASKED_PX: usize = 200;

/// A part of a smooth surface.
pub(crate) struct Part {
    /// One of its pixels, and how many tell its place.
    pub(crate) pixel: usize,
    pub(crate) told_px: usize,
    /// Where it fits best, along its normal.
    pub(crate) swept: Swept,
}

/// Where the parts of all surfaces fit best.
pub(crate) struct Placement {
    pub(crate) parts: Vec<Part>,
}

impl Placement {
    /// Sweeps each part of a surface whose place some probe tells.
    pub(crate) fn of(surfaces: &GeometryBuffer, geometry: &Geometry, probes: &[ProbeView]) -> Self {
        let mut parts: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for i in (0..surfaces.label.len()).filter(|i| geometry.tells(*i)) {
            parts.entry(surfaces.part(i)).or_default().push(i);
        }
        let parts: Vec<Vec<usize>> = parts.into_values().filter(|pixels| pixels.len() >= FEWEST).collect();
        let part = |pixels: Vec<usize>| {
            let swept = sweep(surfaces, geometry, probes, pixels.iter().copied(), ASKED_PX);
            Part { pixel: pixels[pixels.len() / 2], told_px: pixels.len(), swept }
        };
        Self { parts: parts.into_par_iter().map(part).collect() }
    }

    /// How far off its place, metres, what is on some pixels (in order) may be without being wrong: two standard deviations of what all others
    /// are off by.
    pub(crate) fn usual_m(&self, pixels: &[usize]) -> f32 {
        let others = self.parts.iter().filter(|part| pixels.binary_search(&part.pixel).is_err());
        let others: Vec<(f64, f64)> =
            others.map(|part| (part.swept.best_m, part.swept.uncertainty_m.powi(2))).collect();
        if others.len() < FEWEST { 0.0 } else { 2.0 * spread(&others) as f32 }
    }
}

/// The standard deviation of what values of known variances differ from zero by beyond these: the likeliest, by Student's distribution,
/// since some are wrong.
fn spread(values: &[(f64, f64)]) -> f64 {
    let unlikely = |spread: f64| -> f64 {
        let of = |(value, variance): &(f64, f64)| {
            let scale = variance + spread * spread;
            0.5 * scale.ln() + student::unlikeliness(value * value / scale, 1.0)
        };
        values.iter().map(of).sum()
    };
    // a tenth of a millimetre to a decimetre
    let steps = (0..=60).map(|k| 1e-4 * 10f64.powf(f64::from(k) / 20.0));
    let tried = std::iter::once(0.0).chain(steps).map(|s| (unlikely(s), s));
    tried.fold((f64::INFINITY, 0.0), |best, one| if one.0 < best.0 { one } else { best }).1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of a bell curve of this standard deviation, each measured with another.
    fn values(spread: f64, measured: f64) -> Vec<(f64, f64)> {
        let mixed = |k: u32| (k ^ (k >> 16)).wrapping_mul(0x045d_9f3b);
        let unit = |k: u32| f64::from(mixed(mixed(k + 1)) >> 8) / f64::from(1u32 << 24);
        let bell = |k: u32| (12 * k..12 * k + 12).map(unit).sum::<f64>() - 6.0;
        (0..200).map(|k| (spread * bell(2 * k) + measured * bell(2 * k + 1), measured * measured)).collect()
    }

    #[test]
    fn what_surfaces_are_off_by_is_told_from_how_well_their_places_are_known() {
        for (off, measured) in [(0.01, 0.003), (0.01, 0.01), (0.002, 0.001)] {
            let mut all = values(off, measured);
            let told = spread(&all);
            assert!((0.5..1.2).contains(&(told / off)), "{told} for {off}");
            // a wall that is wrong is not what others are usually off by
            all.iter_mut().take(40).for_each(|v| v.0 = 0.3);
            assert!(spread(&all) < 3.0 * off, "{} for {off}", spread(&all));
        }
        assert!(spread(&values(0.0, 0.01)) < 0.004);
    }

    #[test]
    fn a_place_says_nothing_of_itself() {
        let swept = |best_m| Swept { best_m, uncertainty_m: 1e-3, parallax: 100.0, here: 1.0, there: 1.0 };
        let part = |pixel| Part { pixel, told_px: 100, swept: swept(if pixel < 30 { 0.1 } else { 0.0 }) };
        let placement = Placement { parts: (0..60).map(part).collect() };
        let own: Vec<usize> = (0..30).collect();
        assert!(placement.usual_m(&own) < 1e-3 && placement.usual_m(&[]) > 1e-2);
        assert_eq!(placement.usual_m(&(0..59).collect::<Vec<_>>()), 0.0);
    }
}
