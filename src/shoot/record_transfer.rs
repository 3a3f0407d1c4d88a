//! Records as linear functions of what a probe's cells measure.

use glam::{Vec3, Vec3A};
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::Arc;

use super::hits::{Hits, Sunlit};
use super::records::{Estimate, Records, measured, measured_as};
use crate::lists::Lists;
use crate::panorama::{Picture, Radiometry};

/// Some records of one probe, each as E = s ∘ Σ w m over cells, where m is what a cell measured: albedo × radiance where it
/// sees a surface, radiance where it sees the sky. The weights are those that one picture's [`Records`] have.
pub struct RecordTransfer {
    hits: Arc<Hits>,
    radiometry: Radiometry,
    /// Per record the cells that it is made of, each with its weight.
    terms: Lists<(u32, f32)>,
    /// Per record s = π ÷ Σ w ρ²; infinite in a channel that the surface does not reflect.
    scale: Vec<Vec3>,
    /// Which cells of surface the sun shines on; empty where nobody names it.
    sunlit: Vec<Sunlit>,
}

impl RecordTransfer {
    /// The records of some cells, as `picture` made them.
    pub fn new(records: &Records, picture: &Picture, radiometry: Radiometry, sun: Option<Vec3>, cells: &[u32]) -> Self {
        let hits = records.hits.clone();
        let measured = measured(&hits.chart, picture, &radiometry);
        let sunlit = sun.map(|_| records.records.iter().map(|r| r.sunlit).collect::<Vec<_>>());
        let estimate = Estimate::new(&hits, &measured, sunlit.as_deref());
        let one = |&cell: &u32| -> (Vec<(u32, f32)>, Vec3) {
            let mut terms = Vec::with_capacity(9);
            if !hits.cells[cell as usize].is_hit() {
                terms.push((cell, 1.0));
                return (terms, Vec3::ONE);
            }
            let (row, x) = hits.chart.row_of(cell as usize);
            let mut rho2 = Vec3::ZERO;
            estimate.record(row, x, hits.chart.middle(row, x), |other, weight| {
                let rho = hits.cells[other].albedo();
                rho2 += rho * rho * weight;
                terms.push((other as u32, weight));
            });
            (terms, rho2.map(|r| if r > 0.0 { PI / r } else { f32::INFINITY }))
        };
        let all: Vec<_> = cells.par_iter().map(one).collect();
        let mut terms = Lists::default();
        all.iter().for_each(|(own, _)| terms.push(own));
        let scale = all.into_iter().map(|(_, scale)| scale).collect();
        let mut sunlit = sunlit.unwrap_or_default();
        // the sky is neither
        sunlit.iter_mut().zip(&hits.cells).filter(|c| !c.1.is_hit()).for_each(|c| *c.0 = Sunlit::Partly);
        Self { hits, radiometry, terms, scale, sunlit }
    }

    /// Which cells of surface the sun shines on; empty where nobody names it.
    pub(crate) fn sunlit(&self) -> &[Sunlit] {
        &self.sunlit
    }

    /// What each cell measures in a picture of the same size: m of [`RecordTransfer`]; zero for bad pixels.
    pub fn measure(&self, picture: &Picture) -> Vec<Vec3A> {
        measured_as(&self.hits.chart, picture, &self.radiometry, |cell, measured| {
            let (l, hit) = (measured.map_or(Vec3::ZERO, |m| m.radiance), &self.hits.cells[cell]);
            Vec3A::from(if hit.is_hit() { hit.albedo() * l } else { l })
        })
    }

    /// The records' irradiance (the sky's radiance), from what the cells measured.
    pub fn light(&self, measured: &[Vec3A]) -> Vec<Vec3A> {
        let one = |(record, scale): (usize, &Vec3)| {
            let sum: Vec3A =
                self.terms.get(record).iter().map(|&(cell, weight)| measured[cell as usize] * weight).sum();
            if scale.is_finite() {
                return (sum * Vec3A::from(*scale)).min(Vec3A::splat(f32::MAX));
            }
            // as in a record: a channel that is not reflected is as the mean of the others
            let known = |c: &usize| scale[*c].is_finite();
            let count = (0..3).filter(known).count().max(1) as f32;
            let mean = (0..3).filter(known).map(|c| (sum[c] * scale[c]).min(f32::MAX) / count).sum::<f32>();
            Vec3A::from([0, 1, 2].map(|c| if known(&c) { (sum[c] * scale[c]).min(f32::MAX) } else { mean }))
        };
        self.scale.par_iter().with_min_len(4096).enumerate().map(one).collect()
    }
}
