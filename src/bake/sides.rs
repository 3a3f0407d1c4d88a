//! Which sides of a model's triangles people inside can see.

use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::TAU;

use crate::scene::{Ray, Scene};
use crate::sphere::across;

/// Rays from each eye.
const LOOKS: u32 = 1 << 17;

/// Rays from each side, at most and at least, and about so many in all.
const MOST: usize = 8;
const LEAST: usize = 2;
const ALL: usize = 1 << 22;

/// This share of a side's rays must meet inner sides: what lies outside sees little of them, through windows.
const ENCLOSED: f32 = 0.4;

/// Marks sides (front of triangle t: 2 t, back: 2 t + 1; the front is where its corners run counter-clockwise) that can be
/// seen from the eyes, or that mostly see such sides, and so on: all that encloses the rooms in which the eyes are. With no
/// eye, all front sides.
///
/// Of a `scan`, whose surface is open and wound alike, all sides of the kind that the eyes mostly see.
pub(super) fn inner(scene: &Scene, eyes: &[Vec3], scan: bool) -> Vec<bool> {
    let count = 2 * scene.mesh.triangles.len();
    if eyes.is_empty() {
        return (0..count).map(|side| side % 2 == 0).collect();
    }
    let mut inner = vec![false; count];
    for &origin in eyes {
        let seen: Vec<u32> = (0..LOOKS)
            .into_par_iter()
            .filter_map(|k| {
                // a golden spiral around the eye
                let z = 1.0 - 2.0 * (k as f32 + 0.5) / LOOKS as f32;
                let (sin, cos) = (k as f32 * TAU * 0.381_966_01).sin_cos();
                let r = (1.0 - z * z).max(0.0).sqrt();
                side_hit(scene, &Ray { origin, direction: Vec3::new(r * cos, r * sin, z) })
            })
            .collect();
        seen.into_iter().for_each(|side| inner[side as usize] = true);
    }
    if scan {
        /// From this share on one kind of side counts as the seen one.
        const MOSTLY: f64 = 0.7;
        let seen = |kind: usize| inner.iter().skip(kind).step_by(2).filter(|s| **s).count() as f64;
        let fronts = seen(0) / (seen(0) + seen(1)).max(1.0);
        return (0..count).map(|side| if side % 2 == 0 { fronts > 1.0 - MOSTLY } else { fronts < MOSTLY }).collect();
    }
    let rays = (ALL / count).clamp(LEAST, MOST);
    // per side that is not known to be inner the sides that it sees
    let rest = (0..count as u32).into_par_iter().filter(|side| !inner[*side as usize]);
    let mut sees: Vec<(u32, Vec<u32>)> = rest.map(|side| (side, seen_by(scene, side, rays))).collect();
    let enough = (ENCLOSED * rays as f32).ceil() as usize;
    loop {
        let before = sees.len();
        let encloses = |seen: &[u32]| seen.iter().filter(|s| inner[**s as usize]).count() >= enough;
        let (found, rest): (Vec<_>, Vec<_>) = sees.into_iter().partition(|(_, seen)| encloses(seen));
        found.iter().for_each(|(side, _)| inner[*side as usize] = true);
        sees = rest;
        if sees.len() == before || sees.is_empty() {
            return inner;
        }
    }
}

/// The side that a ray meets.
fn side_hit(scene: &Scene, ray: &Ray) -> Option<u32> {
    let hit = scene.tracer.closest(ray, 1e-4)?;
    let back = scene.mesh.normal(hit.triangle).dot(ray.direction) > 0.0;
    Some(2 * hit.triangle + u32::from(back))
}

/// The sides that so many rays from a side meet.
fn seen_by(scene: &Scene, side: u32, rays: usize) -> Vec<u32> {
    let [a, b, c] = scene.mesh.corners(side / 2);
    let normal = scene.mesh.normal(side / 2) * if side.is_multiple_of(2) { 1.0 } else { -1.0 };
    let (tangent, bitangent) = across(normal);
    let lift = 1e-4 + 1e-5 * a.abs().max_element();
    let look = |k: usize| {
        // places and directions by Roberts's recurrence, turned from side to side
        let step = |i: u32, by: f64| ((f64::from(i) * by).fract()) as f32;
        let (u, v) = (step(k as u32 + 1, 0.754_877_666_246_693), step(k as u32 + 1, 0.569_840_290_998_053));
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let origin = a + (b - a) * u + (c - a) * v + normal * lift;
        let out = (k as f32 + 0.5) / rays as f32;
        let (sin, cos) = (TAU * (k as f32 * 0.381_966_01 + step(side, 0.618_033_988_749_895))).sin_cos();
        let flat = (tangent * cos + bitangent * sin) * out.sqrt();
        side_hit(scene, &Ray { origin, direction: flat + normal * (1.0 - out).sqrt() })
    };
    (0..rays).filter_map(look).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::{boxes, grey};

    #[test]
    fn walls_that_rounding_leans_see_the_same() {
        let seen = |lean: f32| -> Vec<Vec<u32>> {
            let room = (Vec3::ZERO, Vec3::new(6.5, 4.5, 3.0));
            let pillars = [1.1, 2.8, 4.3].map(|x| (Vec3::new(x, 1.3, 0.0), Vec3::new(x + 0.6, 2.1, 2.4)));
            let mut mesh = boxes(&[room, pillars[0], pillars[1], pillars[2]]);
            mesh.positions.iter_mut().for_each(|p| *p += Vec3::new(lean, lean, 0.0) * p.z);
            let scene = grey(mesh, 0.5);
            (0..2 * scene.mesh.triangles.len() as u32).map(|side| seen_by(&scene, side, MOST)).collect()
        };
        assert_eq!(seen(1e-6), seen(-1e-6));
    }
}
