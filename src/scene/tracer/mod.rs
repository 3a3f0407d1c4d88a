//! Ray casting: the one door to obvhs.
//!
//! obvhs builds the tree; laid out anew it carries packets of rays that start at one point ([`packet`]), and with four
//! children a node single rays ([`bvh4`]). Both end in one triangle test ([`triangle`]), so a ray gets the same hit, to
//! the bit, whichever way it goes.

mod build;
mod bvh2;
mod bvh4;
mod hit;
mod packet;
mod triangle;

pub use hit::{Hit, Ray};

use glam::Vec3;

use super::mesh::Mesh;
use bvh2::Bvh2;
use bvh4::Bvh4;
use hit::Triangles;
use packet::{PACKET, RayPacket};

/// Finds the nearest hit or any hit. Watertight: no ray slips between two triangles that share an edge. Where triangles
/// lie in one another (are hit at distances that share all but their last 7 of 24 bits: up to 0.15 mm apart at 10 m), one
/// that faces the ray by its winding counts before one that does not, and then the lowest index in the mesh, whatever
/// rounding says.
pub struct Tracer {
    triangles: Triangles,
    bvh2: Bvh2,
    bvh4: Bvh4,
}

/// What stood in the way of a ray: nothing so far, or a triangle.
#[derive(Clone, Copy, Debug, Default)]
pub struct Occluder(Option<usize>);

impl Tracer {
    /// Builds the trees over all triangles of a clean mesh, on as many threads as the current rayon pool has. The
    /// trees do not depend on how many these are.
    pub fn new(mesh: &Mesh) -> Self {
        let (triangles, bvh2, bvh4) = build::build(mesh);
        Self { triangles, bvh2, bvh4 }
    }

    /// The same over the triangles that `keep` marks only; hits keep the whole mesh's indices.
    pub fn over(mesh: &Mesh, keep: &[bool]) -> Self {
        let kept: Vec<u32> = (0..mesh.triangles.len() as u32).filter(|&t| keep[t as usize]).collect();
        let part = Mesh {
            positions: mesh.positions.clone(),
            triangles: kept.iter().map(|&t| mesh.triangles[t as usize]).collect(),
            ..Mesh::default()
        };
        let mut tracer = Self::new(&part);
        for id in &mut tracer.triangles.ids {
            *id = kept[*id as usize];
        }
        tracer
    }

    /// The nearest hit farther than `t_min` metres.
    pub fn closest(&self, ray: &Ray, t_min: f32) -> Option<Hit> {
        self.bvh4.closest(&self.triangles, ray, t_min)
    }

    /// Whether anything stands on the ray farther than `t_min` and nearer than `t_max` metres.
    pub fn occluded(&self, ray: &Ray, t_min: f32, t_max: f32) -> bool {
        self.bvh4.occluder(&self.triangles, ray, t_min, t_max).is_some()
    }

    /// [`Tracer::occluded`], asking first what stood in the way of another ray: rays that follow each other are mostly
    /// stopped by one thing. Keeps in `last` what stops this one.
    pub fn occluded_again(&self, ray: &Ray, t_min: f32, t_max: f32, last: &mut Occluder) -> bool {
        if last.0.is_some_and(|slot| self.triangles.stops(slot, ray, t_min, t_max)) {
            return true;
        }
        let found = self.bvh4.occluder(&self.triangles, ray, t_min, t_max);
        last.0 = found.or(last.0);
        found.is_some()
    }

    /// The nearest hits farther than `t_min` metres of many rays from one point, exactly as [`Tracer::closest`] finds
    /// them, but several times faster where rays that follow each other in `directions` stay close together: give tiles of
    /// 64 rays (8×8 pixels, or 4×4 with four samples each), best in 2×2 blocks. Rays that spread out are cast one by
    /// one. Directions have unit length; `hits` must be as long as `directions` (what is longer is left as it is).
    pub fn closest_packet(&self, origin: Vec3, directions: &[Vec3], t_min: f32, hits: &mut [Option<Hit>]) {
        for (directions, hits) in directions.chunks(PACKET).zip(hits.chunks_mut(PACKET)) {
            match RayPacket::new(origin, directions) {
                Some(packet) => packet.closest(&self.bvh2, &self.triangles, t_min, hits),
                None => {
                    for (&direction, hit) in directions.iter().zip(hits) {
                        *hit = self.closest(&Ray { origin, direction }, t_min);
                    }
                }
            }
        }
    }

    /// Bytes that the trees and the triangles in them take.
    pub fn bytes(&self) -> usize {
        size_of_val(self.bvh2.pairs.as_slice())
            + size_of_val(self.bvh4.0.as_slice())
            + size_of_val(self.triangles.corners.as_slice())
            + size_of_val(self.triangles.ids.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::triangles;

    fn pile(count: usize, step: f32) -> Mesh {
        let at = |i: usize| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + Vec3::Z * (i as f32 * step));
        triangles(&(0..count).map(at).collect::<Vec<_>>())
    }

    #[test]
    fn a_very_deep_tree_still_finds_the_first_of_equals() {
        let tracer = Tracer::new(&pile(4000, 0.0));
        let ray = Ray { origin: Vec3::new(0.2, 0.2, 3.0), direction: Vec3::NEG_Z };
        assert_eq!(tracer.closest(&ray, 0.0), Some(Hit { t: 3.0, triangle: 0 }));
        assert_eq!(tracer.closest(&ray, 3.0), None);
        assert!(
            tracer.occluded(&ray, 0.0, 3.5) && !tracer.occluded(&ray, 0.0, 3.0) && !tracer.occluded(&ray, 3.0, 9.0)
        );
    }

    #[test]
    fn twenty_thousand_nearly_coincident_triangles_build() {
        let tracer = Tracer::new(&pile(20_000, 1e-7));
        let ray = Ray { origin: Vec3::new(0.2, 0.2, -3.0), direction: Vec3::Z };
        assert_eq!(tracer.closest(&ray, 0.0), Some(Hit { t: 3.0, triangle: 0 }));
        let mut hits = [None; 3];
        tracer.closest_packet(ray.origin, &[Vec3::Z; 3], 0.0, &mut hits);
        assert_eq!(hits, [Some(Hit { t: 3.0, triangle: 0 }); 3]);
    }

    #[test]
    fn a_triangle_takes_at_most_110_bytes() {
        let mesh = pile(1000, 0.01);
        assert!(Tracer::new(&mesh).bytes() <= 110 * mesh.triangles.len());
    }
}
