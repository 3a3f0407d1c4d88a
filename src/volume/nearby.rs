//! What look-ups found last.

use glam::Vec3;

use super::cache_points::{ENOUGH, Weighted};
use super::filled::Filled;

/// Scratch space for look-ups, and what the last of them found: points close by mostly see the same.
#[derive(Clone, Debug, Default)]
pub struct Nearby {
    pub(super) around: Vec<Weighted>,
    pub(super) seen: Recent<VisiblePoints>,
    pub(super) gathered: Recent<Filled>,
}

impl Nearby {
    /// Forgets what was found.
    pub fn clear(&mut self) {
        self.seen.slots.fill(None);
        self.gathered.slots.fill(None);
    }
}

/// The cache points that a point takes its value from.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct VisiblePoints {
    cache_points: [u32; ENOUGH],
    count: u8,
}

impl VisiblePoints {
    pub(super) fn push(&mut self, cache_point: u32) {
        self.cache_points[usize::from(self.count)] = cache_point;
        self.count += 1;
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = u32> {
        self.cache_points.into_iter().take(usize::from(self.count))
    }
}

/// What was found for points of surfaces, the last few of them.
#[derive(Clone, Debug)]
pub(super) struct Recent<T> {
    slots: Vec<Option<(Vec3, Vec3, T)>>,
}

impl<T> Default for Recent<T> {
    fn default() -> Self {
        Self { slots: Vec::new() }
    }
}

impl<T: Copy> Recent<T> {
    /// Things kept; a power of two.
    const SLOTS: usize = 128;

    /// What was found for a point of the same surface less than `close_m` away.
    pub(super) fn get(&self, point: Vec3, normal: Vec3, close_m: f32) -> Option<T> {
        /// Normals whose cosine is less are not of one surface.
        const SAME: f32 = 0.99;
        let (near, theirs, what) = (*self.slots.get(slot(point, normal, close_m))?)?;
        (theirs.dot(normal) > SAME && near.distance_squared(point) < close_m * close_m).then_some(what)
    }

    /// Keeps what was found for a point.
    pub(super) fn put(&mut self, point: Vec3, normal: Vec3, close_m: f32, what: T) {
        if self.slots.is_empty() {
            self.slots = vec![None; Self::SLOTS];
        }
        self.slots[slot(point, normal, close_m)] = Some((point, normal, what));
    }
}

/// Where a point's findings are kept: by the cube of side `close_m` that it lies in, and the way that its surface faces.
fn slot(point: Vec3, normal: Vec3, close_m: f32) -> usize {
    let cube = (point / close_m).floor().as_ivec3();
    let facing = (normal * 1.5).round().as_ivec3();
    let part = |cube: i32, facing: i32, prime: u32| (cube.wrapping_add(5 * facing) as u32).wrapping_mul(prime);
    let hash =
        part(cube.x, facing.x, 73_856_093) ^ part(cube.y, facing.y, 19_349_663) ^ part(cube.z, facing.z, 83_492_791);
    ((hash ^ (hash >> 15)) as usize) % Recent::<()>::SLOTS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_found_serves_points_close_by_on_the_same_surface_only() {
        let mut recent = Recent::default();
        let (point, normal) = (Vec3::new(4e6, -0.31, 2.02), Vec3::Z);
        assert!(recent.get(point, normal, 0.1).is_none());
        recent.put(point, normal, 0.1, 7);
        assert_eq!(recent.get(point + Vec3::new(0.0, 0.005, 0.01), normal, 0.1), Some(7));
        for (point, normal) in [(point + Vec3::Y * 0.2, normal), (point, Vec3::X), (point, -Vec3::Z)] {
            assert_eq!(recent.get(point, normal, 0.1), None::<i32>);
        }
    }
}
