//! What the model has behind a region: if that is what the photograph shows, the region's surface is not there.

use glam::Vec3;

use crate::audit::observe::geometry_buffer::{GeometryBuffer, NONE};
use crate::audit::picture::regions::{Region, at_most};
use crate::audit::view::{AuditScene, Observations};
use crate::scene::{Hit, Ray, Scene};

/// Mean cost of the region as it is and of what the model has behind it, if it has anything there: small behind means
/// that the region's surface is not there at all.
pub(crate) fn behind(prepared: &AuditScene, observed: &Observations, region: &Region) -> Option<(f32, f32)> {
    /// Surfaces behind that are tried: a box has a back, too.
    const LAYERS: usize = 3;
    let s = &observed.surfaces;
    let (mut here, mut behind, mut count) = (0.0f64, 0.0f64, 0u32);
    for i in at_most(&region.pixels, 2000) {
        if s.triangle[i] == NONE {
            continue;
        }
        // where the photograph has edges, half a pixel beside is no difference
        let variance = 0.01 + 0.25 * slope(&observed.log_photo, i, s.width);
        let cost = |point: Vec3, all: bool| {
            let costs = prepared.probes.iter().enumerate().filter_map(|(k, probe)| {
                if all && observed.sights.of[k][i].is_none() {
                    return None;
                }
                let l = probe.log_radiance(point, 0) + observed.radiometry.gains[k];
                let d = (l - observed.log_photo[i]).length_squared() / 3.0;
                d.is_finite().then_some((d / variance).min(16.0))
            });
            costs.fold(None, |best: Option<f32>, c| Some(best.map_or(c, |b| b.min(c))))
        };
        let Some(mine) = cost(s.position[i], true) else { continue };
        let mut best: Option<f32> = None;
        for (ray, hit) in layers(prepared.scene, s, i).take(LAYERS) {
            if let Some(c) = cost(ray.origin + ray.direction * hit.t, false) {
                best = Some(best.map_or(c, |b| b.min(c)));
            }
        }
        if let Some(best) = best {
            here += f64::from(mine);
            behind += f64::from(best);
            count += 1;
        }
    }
    (count > 20).then(|| ((here / f64::from(count)) as f32, (behind / f64::from(count)) as f32))
}

/// What a pixel's ray meets behind its surface, one after another.
fn layers(scene: &Scene, s: &GeometryBuffer, i: usize) -> impl Iterator<Item = (Ray, Hit)> {
    let ray = Ray { origin: s.origin, direction: s.ray[i] };
    let mut t = s.distance[i];
    std::iter::from_fn(move || {
        let hit = scene.tracer.closest(&ray, t + 1e-3 + 1e-4 * t)?;
        t = hit.t;
        Some((ray, hit))
    })
}

/// Mean squared difference of a pixel's logarithm from its neighbours'.
fn slope(log: &[Vec3], i: usize, width: usize) -> f32 {
    let around = [i.wrapping_sub(1), i + 1, i.wrapping_sub(width), i + width];
    let squares = around.iter().filter_map(|j| log.get(*j)).map(|o| (*o - log[i]).length_squared() / 3.0);
    squares.filter(|d| d.is_finite()).sum::<f32>() / 4.0
}
