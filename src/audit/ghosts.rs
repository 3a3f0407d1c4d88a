//! Places where a probe sees something else than the photograph because a part of the model that is off its place stands in
//! the probe's way: the surface there is right.

use glam::Vec3;
use std::collections::BTreeMap;

use super::surfaces::NONE;
use super::view::{Maps, Prepared};
use super::{Judged, Kind, Reason, What};
use crate::scene::{Ray, Scene};

/// A part may be off its place by so many times what was measured of it: across the line of sight, or along a normal,
/// only a part of its way shows.
const TIMES: f32 = 4.0;

/// How many of a region's pixels are asked.
const SAMPLES: usize = 300;

/// A region is a ghost if more than this share of its pixels is.
const SHARE: f32 = 0.5;

/// Makes doubts of regions that contradict only such probes as see them past a part of the model that is found to be off its
/// place, closer than that is off.
pub(super) fn doubted(prepared: &Prepared, maps: &Maps, mut judged: Vec<Judged>) -> Vec<Judged> {
    let moved: Vec<(u32, f32)> = judged.iter().filter_map(|j| off_place(prepared, maps, j)).collect();
    for j in judged.iter_mut().filter(|j| j.kind == Kind::Geometry && j.reason == Reason::None) {
        let others = |part: u32| !(j.region.pixels.iter().any(|i| prepared.part(maps.surfaces.triangle[*i]) == part));
        if moved.iter().any(|&(part, reach)| others(part) && ghost(prepared, maps, j, part, reach)) {
            j.reason = Reason::ProbesDisagree;
        }
    }
    judged
}

/// The part that a finding says to be off its place, and how far that may be, metres.
fn off_place(prepared: &Prepared, maps: &Maps, j: &Judged) -> Option<(u32, f32)> {
    let metres = match (j.shift, j.displacement) {
        (Some(s), _) => s.right_m.hypot(s.down_m),
        (None, Some(d)) => d.metres.abs(),
        (None, None) => return None,
    };
    let told = j.kind == Kind::Geometry && j.reason == Reason::None && j.what == What::Moved;
    let mut votes: BTreeMap<u32, usize> = BTreeMap::new();
    for i in &j.region.pixels {
        *votes.entry(prepared.part(maps.surfaces.triangle[*i])).or_default() += 1;
    }
    let (part, _) = votes.into_iter().max_by_key(|(_, n)| *n)?;
    (told && part != NONE).then_some((part, TIMES * metres as f32))
}

/// Whether all probes that can tell the place of a region see most of it past a part.
fn ghost(prepared: &Prepared, maps: &Maps, j: &Judged, part: u32, reach: f32) -> bool {
    let s = &maps.surfaces;
    let (mut past, mut asked) = (0.0f32, 0.0f32);
    for &i in j.region.pixels.iter().step_by(j.region.pixels.len().div_ceil(SAMPLES)) {
        for (_, probe) in prepared.probes.iter().enumerate().filter(|(k, _)| maps.geometry.asks(*k, i)) {
            asked += 1.0;
            if passes(prepared.scene, |t| prepared.part(t) == part, probe.origin, s.position[i], reach) {
                past += 1.0;
            }
        }
    }
    asked > 0.0 && past > SHARE * asked
}

/// Whether the way to a point passes a part of the model within `reach` metres.
fn passes(scene: &Scene, is_part: impl Fn(u32) -> bool, from: Vec3, to: Vec3, reach: f32) -> bool {
    let (length, direction) = ((to - from).length(), (to - from).normalize_or_zero());
    let (a, b) = direction.any_orthonormal_pair();
    // a part thinner than the reach would be missed by its end alone
    [1.0, 0.6, 0.3].into_iter().flat_map(|share| [a, -a, b, -b].map(|side| side * (share * reach))).any(|beside| {
        let ray = Ray { origin: from + beside, direction };
        let mut t = 0.0;
        while let Some(hit) = scene.tracer.closest(&ray, t + 1e-3 + 1e-4 * t).filter(|hit| hit.t < length) {
            if is_part(hit.triangle) {
                return true;
            }
            t = hit.t;
        }
        false
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Mesh};
    use glam::DVec3;

    #[test]
    fn a_way_passes_a_part_within_its_reach() {
        // a post 20 cm wide, 2 m from the eye, before a wall 5 m from it
        let square = |half: f32, y: f32| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| Vec3::new(x * half, y, z * half))
        };
        let mesh = Mesh {
            positions: [square(0.1, 2.0), square(9.0, 5.0)].concat(),
            uvs: vec![],
            colours: vec![],
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
            materials: vec![0; 4],
        };
        let material =
            Material { name: "white".to_owned(), albedo: Vec3::splat(0.5), texture: None, emission: Vec3::ZERO };
        let scene = Scene::new(mesh, vec![material], vec![], DVec3::ZERO);
        let past = |x: f32, reach: f32| passes(&scene, |t| t < 2, Vec3::ZERO, Vec3::new(x, 5.0, 0.0), reach);
        // the way to x on the wall is at two fifths of that beside the post's middle
        assert!(past(0.5, 0.2));
        assert!(!past(1.5, 0.2));
        assert!(past(1.5, 0.6));
        // what lies before the part is not past it
        assert!(!passes(&scene, |t| t < 2, Vec3::ZERO, Vec3::new(0.0, 1.5, 0.0), 0.2));
    }
}
