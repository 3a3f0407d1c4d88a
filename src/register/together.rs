//! Pictures speak for each other: what others saw of a surface is what this one should show, shadows, sun patches and all.

use glam::Vec3;
use rayon::prelude::*;

use super::model::{GeometryBuffer, LocalPose};
use super::picture::{Level, log_at};
use crate::scene::Scene;
use crate::statistics::median;

/// A picture at a pose, ready to be asked what it saw of a place.
pub(super) struct Witness<'a> {
    pub(super) level: &'a Level,
    pub(super) pose: LocalPose,
    pub(super) buffer: GeometryBuffer,
}

/// Surfaces seen at a cosine less than this are told too coarsely.
const LEAST_COSINE: f32 = 0.15;

/// How far a place may be from what the model has in the witness's line of sight, as a share of the distance.
const SAME: f32 = 0.02;

impl<'a> Witness<'a> {
    /// A picture at a pose.
    pub(super) fn at(scene: &Scene, level: &'a Level, pose: LocalPose) -> Self {
        Self { level, pose, buffer: GeometryBuffer::cast(scene, &level.raster, &pose) }
    }

    /// Log-luminance that came from a point of a surface (local metres) and how finely it was seen, steradians a square
    /// metre; `None` where the model puts something else before it.
    fn saw(&self, point: Vec3, normal: Vec3) -> Option<(f32, f32)> {
        let way = point - self.pose.origin;
        let distance = way.length();
        let cosine = -normal.dot(way) / distance;
        if cosine < LEAST_COSINE {
            return None;
        }
        let d = self.pose.rotation.transpose() * way;
        let raster = &self.level.raster;
        let [x, y] = raster.place(d)?;
        let cell = (y as usize).min(raster.height - 1) * raster.width + (x as usize).min(raster.width - 1);
        let tolerance = SAME * distance + 1.5 * raster.cell_angle() * distance / cosine;
        if (self.buffer.distance[cell] - distance).abs() > tolerance {
            return None;
        }
        Some((log_at(self.level, d)?, cosine / (distance * distance)))
    }
}

/// What other pictures saw of each cell's surface, as log-luminance in this picture's exposure; NaN where none saw it. Of several the
/// one that saw it most finely.
pub(super) fn seen_by_others(eye: &Witness, others: &[&Witness]) -> Vec<f32> {
    let Witness { level, pose, buffer } = eye;
    let n = level.raster.len();
    let asked: Vec<Option<(usize, f32)>> = (0..n)
        .into_par_iter()
        .map(|i| {
            if !buffer.distance[i].is_finite() || level.weight[i] == 0.0 {
                return None;
            }
            let point = pose.origin + pose.rotation * (level.raster.directions[i] * buffer.distance[i]);
            let normal = pose.rotation * buffer.normal[i];
            let mut best: Option<(usize, f32, f32)> = None;
            for (k, other) in others.iter().enumerate() {
                if let Some((log, fine)) = other.saw(point, normal)
                    && best.is_none_or(|b| fine > b.2)
                {
                    best = Some((k, log, fine));
                }
            }
            best.map(|b| (b.0, b.1))
        })
        .collect();
    // each in this picture's exposure, by the median over what both saw
    let offsets: Vec<f32> = (0..others.len())
        .map(|k| {
            let of_k = |(i, a): (usize, &Option<(usize, f32)>)| a.filter(|a| a.0 == k).map(|a| level.log[i] - a.1);
            median(asked.iter().enumerate().filter_map(of_k)).unwrap_or(0.0)
        })
        .collect();
    asked.into_iter().map(|a| a.map_or(f32::NAN, |(k, log)| log + offsets[k])).collect()
}
