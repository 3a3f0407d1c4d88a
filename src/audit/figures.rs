//! What both tests say of a region as a whole: the figures that it is judged by.

use super::border::Border;
use super::regions::{Region, bounds};
use super::scores::{LOW, Scores};
use super::structure::odds_of;
use super::sweep::{Swept, sweep};
use super::view::{Maps, Prepared};
use crate::statistics::quantile;

/// Odds from which on a region's structure is another than the model's.
pub(super) const REGION_ODDS: f32 = 6.0;

/// With less than this share of the usual structure, it is not the model's.
const OTHER: f32 = 0.5;

/// A region smaller than this share of the picture may fit something by chance.
const SMALL_SHARE: f32 = 5e-3;

/// Less marked by the texture's test is no fault of a picture.
pub(super) const TEXTURED: f32 = 0.25;

/// A region's figures.
pub(super) struct Figures<'a> {
    pub(super) prepared: &'a Prepared<'a>,
    pub(super) maps: &'a Maps,
    pub(super) scores: &'a Scores,
    pub(super) region: &'a Region,
    /// Upper quartiles of the tests' scores.
    pub(super) texture: f32,
    pub(super) geometry: f32,
    pub(super) swept: Swept,
    /// Logarithm of the odds of another structure than the model's, and whether that is told.
    pub(super) odds: f32,
    pub(super) structural: bool,
    /// Shares that the geometry and the texture test mark.
    pub(super) marked: f32,
    pub(super) textured: f32,
    /// How it differs from the same surface beside it, where the texture test marks enough of it.
    pub(super) border: Option<Border>,
    /// More than one probe can tell.
    pub(super) several: bool,
    pub(super) small: bool,
    /// Some probe can tell the place of enough of it.
    pub(super) able: bool,
    /// Its area over its greatest extent, pixels.
    pub(super) thickness: f32,
}

impl<'a> Figures<'a> {
    pub(super) fn of(
        prepared: &'a Prepared,
        maps: &'a Maps,
        scores: &'a Scores,
        region: &'a Region,
        least: usize,
    ) -> Self {
        let n = region.pixels.len() as f32;
        let swept = sweep(prepared, maps, region);
        let (odds, slope) = odds_of(&maps.texture, maps.surfaces.width, &region.pixels);
        let able = region.pixels.iter().map(|i| f32::from(maps.geometry.able[*i])).sum::<f32>() / n;
        let textured = share(region, |i| scores.texture[i] >= LOW);
        let [left, top, right, bottom] = bounds(&region.pixels, maps.surfaces.width);
        Self {
            prepared,
            maps,
            scores,
            region,
            texture: upper(region, &scores.texture),
            geometry: upper(region, &scores.geometry),
            odds,
            structural: odds >= REGION_ODDS && slope < OTHER,
            marked: share(region, |i| scores.geometry[i] >= LOW),
            textured,
            border: if textured >= TEXTURED { Border::of(maps, &scores.surface, region) } else { None },
            several: able >= 1.5,
            small: n < SMALL_SHARE * maps.usable.len() as f32,
            // a part that is large enough speaks for all of it
            able: swept.able >= 0.3 || swept.able * n >= 5.0 * least as f32,
            thickness: n / (right - left).max(bottom - top) as f32,
            swept,
        }
    }

    /// Pixels.
    pub(super) fn size(&self) -> f32 {
        self.region.pixels.len() as f32
    }

    /// Share of the pixels that something holds for.
    pub(super) fn share(&self, holds: impl Fn(usize) -> bool) -> f32 {
        share(self.region, holds)
    }

    /// Upper quartile.
    pub(super) fn upper(&self, values: &[f32]) -> f32 {
        upper(self.region, values)
    }
}

fn share(region: &Region, holds: impl Fn(usize) -> bool) -> f32 {
    region.pixels.iter().filter(|i| holds(**i)).count() as f32 / region.pixels.len() as f32
}

fn upper(region: &Region, values: &[f32]) -> f32 {
    let mut all: Vec<f32> = region.pixels.iter().map(|i| values[*i]).collect();
    quantile(&mut all, 0.75).unwrap_or(0.0)
}
