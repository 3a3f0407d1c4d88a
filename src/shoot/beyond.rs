//! Light from where the model has nothing and nobody tells: the open top of a scan, its holes, what no probe sees through a window.
//!
//! A scan seldom has the lamps and windows that light it, and photographs taken by hand seldom show them. What records
//! measure does not lie, though: at their places what arrives from all that is known, and the rest from beyond, add up to
//! their irradiance. That gives the mean radiance of what lies beyond. In a room with windows few records see much of it; but what
//! probes see of the sky tells of the directions beside.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

use super::Light;
use super::light::Beyond;
use super::records::shaded;
use crate::scene::{Ray, Scene};
use crate::sphere::across;
use crate::statistics::median;

/// Records asked, about, and rays from each.
const PLACES: usize = 384;
const RAYS: usize = 64;

/// A record that sees less of what lies beyond says nothing of it.
const LEAST_SHARE: f32 = 0.1;

/// So many have to say something.
const FEWEST: usize = 16;

/// Directions by which light from nearby ones is guessed: cells of equal solid angles, columns around and rows of equal height.
const COLUMNS: usize = 128;
const ROWS: usize = 64;

impl Light {
    /// Radiance from a direction in which the model has nothing and nobody tells, such as the open top of a scan, or what a window shows
    /// only from where no probe stands: what the light on records asks for; where too few see any of it, what is told of directions nearby.
    pub fn beyond(&self, scene: &Scene, direction: Vec3) -> Vec3 {
        // by one thread: one that waits for others here might be given work that asks for this very light, and wait for itself
        match self.beyond.get_or_init(|| measured(scene, self).map_or_else(|| guessed(self), Beyond::Even)) {
            Beyond::Even(radiance) => *radiance,
            Beyond::Directions(all) => all[cell(direction)],
        }
    }
}

/// What lies beyond, as radiance that is the same from all such directions: per channel the median over records of what
/// they have above what known surfaces and the known sky send them. `None` where too few records see any of it.
fn measured(scene: &Scene, light: &Light) -> Option<Vec3> {
    let mean = light.mean_radiance();
    let asked: Vec<(Vec3, Vec3, Vec3)> = shaded(&light.records, PLACES).collect();
    let told: Vec<Option<Vec3>> =
        asked.iter().map(|&(point, normal, e)| balance(scene, light, mean, point, normal, e)).collect();
    let told: Vec<Vec3> = told.into_iter().flatten().collect();
    let channel = |c: usize| median(told.iter().map(|t| t[c])).unwrap_or(0.0).clamp(0.0, f32::MAX);
    (told.len() >= FEWEST).then(|| Vec3::new(channel(0), channel(1), channel(2)))
}

/// What is told of directions nearby, by their distance (Shepard, *A two-dimensional interpolation function for irregularly-spaced
/// data*, 1968): of those on the same side of the horizon, if there are any. Black where nothing is told at all: from a closed room nobody
/// sees what is outside.
fn guessed(light: &Light) -> Beyond {
    let all: Vec<Vec3> = (0..COLUMNS * ROWS).map(direction).collect();
    let told: Vec<(Vec3, Vec3)> = all.iter().filter_map(|d| Some((*d, light.told_sky(*d)?))).collect();
    let (up, down): (Vec<_>, Vec<_>) = told.iter().copied().partition(|(d, _)| d.z > 0.0);
    let guess = |d: &Vec3| {
        let near = if d.z > 0.0 { &up } else { &down };
        let near = if near.is_empty() { &told } else { near };
        let (sum, weights) = near.iter().fold((Vec3::ZERO, 0.0), |(sum, weights), (known, radiance)| {
            let weight = d.distance_squared(*known).max(1e-4).powi(-2);
            (sum + weight * *radiance, weights + weight)
        });
        if weights > 0.0 { sum / weights } else { Vec3::ZERO }
    };
    Beyond::Directions(all.iter().map(|d| light.told_sky(*d).unwrap_or_else(|| guess(d))).collect())
}

/// The cell of the grid that a direction lies in.
fn cell(direction: Vec3) -> usize {
    let column = (direction.y.atan2(direction.x) / TAU).rem_euclid(1.0) * COLUMNS as f32;
    let row = (0.5 - 0.5 * direction.z) * ROWS as f32;
    (row as usize).min(ROWS - 1) * COLUMNS + (column as usize).min(COLUMNS - 1)
}

/// The middle of a cell. All cells have the same solid angle.
fn direction(cell: usize) -> Vec3 {
    let (sin, cos) = (((cell % COLUMNS) as f32 + 0.5) * TAU / COLUMNS as f32).sin_cos();
    let z = 1.0 - 2.0 * ((cell / COLUMNS) as f32 + 0.5) / ROWS as f32;
    let across = (1.0 - z * z).sqrt();
    Vec3::new(across * cos, across * sin, z)
}

/// What one record says of the radiance beyond.
fn balance(scene: &Scene, light: &Light, mean: Vec3, point: Vec3, normal: Vec3, e: Vec3) -> Option<Vec3> {
    let (tangent, bitangent) = across(normal);
    let origin = point + normal * (1e-3 + 1e-5 * point.abs().max_element());
    let (mut known, mut open) = (Vec3::ZERO, 0usize);
    for k in 0..RAYS {
        // a cosine's share each: a golden spiral on the disc below
        let u = (k as f32 + 0.5) / RAYS as f32;
        let (sin, cos) = (k as f32 * TAU * 0.381_966_01).sin_cos();
        let direction = (tangent * cos + bitangent * sin) * u.sqrt() + normal * (1.0 - u).sqrt();
        let ray = Ray { origin, direction };
        match scene.tracer.closest(&ray, 1e-4) {
            Some(hit) => {
                let s = scene.surface(&ray, &hit);
                let e = light.nearest(scene, s.position, s.normal);
                let sent = e.map(|e| e * scene.filtered_albedo(s.triangle, s.barycentric, 0.1 * hit.t) / PI);
                known += sent.unwrap_or(mean);
            }
            None => match light.told_sky(direction) {
                Some(radiance) => known += radiance,
                None => open += 1,
            },
        }
    }
    let share = open as f32 / RAYS as f32;
    (share > LEAST_SHARE).then(|| (e / PI - known / RAYS as f32) / share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cell_has_its_own_middle() {
        assert!((0..COLUMNS * ROWS).all(|k| cell(direction(k)) == k && (direction(k).length() - 1.0).abs() < 1e-5));
        assert!([Vec3::Z, -Vec3::Z, Vec3::X, -Vec3::Y].iter().all(|d| direction(cell(*d)).dot(*d) > 0.97));
    }
}
