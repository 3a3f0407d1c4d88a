//! Distances from a station to walls that a tape measure can check.

use glam::{DVec2, Vec3};

use crate::scene::{Ray, Scene};

/// A distance to a wall, taped level at probe height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckDistance {
    /// Where the wall is met, local metres.
    pub to: DVec2,
    /// Metres.
    pub metres: f64,
}

/// Directions that are tried.
const DIRECTIONS: usize = 720;
/// Walls farther than this are not taped, metres.
const LONGEST_M: f32 = 30.0;

/// Up to three distances: to the nearest wall, to the nearest across from that direction (60° to 120° off), and to the
/// nearest behind (more than 120° off). Each is met squarely, within 5°.
pub fn check_distances(scene: &Scene, station: Vec3) -> Vec<CheckDistance> {
    let angle = |i: usize| i as f32 / DIRECTIONS as f32 * std::f32::consts::TAU;
    let mut walls: Vec<(f32, f32)> = Vec::new();
    for i in 0..DIRECTIONS {
        let (sin, cos) = angle(i).sin_cos();
        let ray = Ray { origin: station, direction: Vec3::new(cos, sin, 0.0) };
        let Some(hit) = scene.tracer.closest(&ray, 1e-3).filter(|h| h.t <= LONGEST_M) else { continue };
        let normal = scene.mesh.normal(hit.triangle);
        // a tape's end is held against something upright that faces it
        if normal.z.abs() < 0.3 && normal.dot(ray.direction).abs() > 0.996 {
            walls.push((hit.t, angle(i)));
        }
    }
    walls.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let Some(&(_, first)) = walls.first() else { return Vec::new() };
    let off = |a: f32| {
        let d = (a - first).rem_euclid(std::f32::consts::TAU).to_degrees();
        d.min(360.0 - d)
    };
    let bands: [fn(f32) -> bool; 3] = [|d| d < 1e-3, |d| (60.0..=120.0).contains(&d), |d| d > 120.0];
    let best = |band: &fn(f32) -> bool| walls.iter().find(|(_, a)| band(off(*a)));
    bands
        .iter()
        .filter_map(best)
        .map(|&(t, a)| CheckDistance {
            to: station.truncate().as_dvec2() + f64::from(t) * DVec2::from_angle(f64::from(a)),
            metres: f64::from(t),
        })
        .collect()
}
