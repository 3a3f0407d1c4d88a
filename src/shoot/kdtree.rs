//! A k-d tree for radius search (Bentley, *Multidimensional Binary Search Trees Used for Associative Searching*, 1975):
//! the paper's index over its records (section 4.1).
//!
//! The tree is the order in which it keeps its entries. A node is a run of entries, and the entry in its middle is the
//! median along the longest side of the run's box: entries before it lie on one side of it, entries after it on the
//! other. Runs are halved until they are short. So neither pointers nor split positions are stored, only one byte for a
//! node's axis: less than an eighth of a byte an entry beside the entries themselves.

use glam::Vec3;
use rayon::prelude::*;

/// A leaf holds at most this many entries.
const BUCKET: usize = 16;

/// Halves of a run longer than this are sorted side by side.
const PARALLEL: usize = 1 << 14;

/// Values at points, found by their distance from a place.
pub struct KdTree<T> {
    /// In tree order: each node's first half, its median, its second half.
    entries: Vec<(Vec3, T)>,
    /// The axis that each node splits, 0..3; a node before its first half's nodes, and those before its second's.
    axes: Vec<u8>,
}

impl<T: Copy + Send + Sync> KdTree<T> {
    /// Builds a tree over values at points, which may coincide but must be finite. The tree is the same for any number
    /// of threads.
    pub fn new(entries: Vec<(Vec3, T)>) -> Self {
        let mut keys: Vec<(Vec3, u32)> = entries.par_iter().enumerate().map(|(i, e)| (e.0, i as u32)).collect();
        let mut axes = vec![0; (1 << levels(keys.len())) - 1];
        split(&mut keys, &mut axes);
        let entries = keys.par_iter().map(|&(_, i)| entries[i as usize]).collect();
        Self { entries, axes }
    }

    /// Calls `found` with the value and the squared distance of every entry nearer to `point` than `radius`, in an
    /// order that depends on the tree and the point alone.
    pub fn within(&self, point: Vec3, radius: f32, mut found: impl FnMut(&T, f32)) {
        let mut search = Search {
            point,
            radius2: radius * radius,
            found: |value: &T, distance2| {
                found(value, distance2);
                radius * radius
            },
        };
        search.visit(&self.entries, &self.axes, Vec3::ZERO);
    }

    /// The `count` entries with the least squares of how far off they are, least first. `off2` tells these from a value and its squared
    /// distance, no less than it; infinity for what does not count.
    pub fn nearest(&self, point: Vec3, count: usize, off2: impl Fn(&T, f32) -> f32) -> Vec<(f32, T)> {
        let mut nearest: Vec<(f32, T)> = Vec::with_capacity(count.min(self.entries.len()).saturating_add(1));
        let mut search = Search {
            point,
            radius2: f32::INFINITY,
            found: |value: &T, distance2| {
                let off2 = off2(value, distance2);
                if off2 < f32::INFINITY {
                    nearest.insert(nearest.partition_point(|n| n.0 <= off2), (off2, *value));
                    nearest.truncate(count);
                }
                if nearest.len() < count { f32::INFINITY } else { nearest.last().map_or(0.0, |n| n.0) }
            },
        };
        search.visit(&self.entries, &self.axes, Vec3::ZERO);
        nearest
    }

    /// All entries, in tree order.
    pub fn entries(&self) -> &[(Vec3, T)] {
        &self.entries
    }

    /// Bytes held, entries and all.
    pub fn bytes(&self) -> usize {
        size_of_val(self.entries.as_slice()) + self.axes.len()
    }
}

/// How often runs are halved so that leaves hold at most a bucket.
fn levels(entries: usize) -> u32 {
    entries.div_ceil(BUCKET).max(1).next_power_of_two().ilog2()
}

/// Sorts a run of entries into tree order.
fn split(keys: &mut [(Vec3, u32)], axes: &mut [u8]) {
    let Some((axis, below)) = axes.split_first_mut() else { return };
    let longest = longest_side(keys);
    *axis = longest as u8;
    let middle = keys.len() / 2;
    keys.select_nth_unstable_by(middle, |a, b| a.0[longest].total_cmp(&b.0[longest]));
    let parallel = keys.len() > PARALLEL;
    let (first, rest) = keys.split_at_mut(middle);
    let second = &mut rest[1..];
    let (below_first, below_second) = below.split_at_mut(below.len() / 2);
    if parallel {
        rayon::join(|| split(first, below_first), || split(second, below_second));
    } else {
        split(first, below_first);
        split(second, below_second);
    }
}

/// The axis along which points spread most.
fn longest_side(keys: &[(Vec3, u32)]) -> usize {
    let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = keys.iter().fold(start, |(low, high), k| (low.min(k.0), high.max(k.0)));
    (high - low).max_position()
}

/// A ball around a point. What is found in it tells the radius from there on.
struct Search<F> {
    point: Vec3,
    radius2: f32,
    found: F,
}

impl<F> Search<F> {
    /// Visits a node, the nearer half first; `offset` leads from the point to the nearest place of the node's part of space.
    fn visit<T>(&mut self, entries: &[(Vec3, T)], axes: &[u8], offset: Vec3)
    where
        F: FnMut(&T, f32) -> f32,
    {
        let Some((&axis, below)) = axes.split_first() else {
            return self.test(entries);
        };
        let axis = usize::from(axis);
        let (first, rest) = entries.split_at(entries.len() / 2);
        let (median, second) = rest.split_at(1);
        let (below_first, below_second) = below.split_at(below.len() / 2);
        let beyond = self.point[axis] - median[0].0[axis];
        let mut across = offset;
        across[axis] = beyond;
        let (first, second) = ((first, below_first), (second, below_second));
        let (near, far) = if beyond < 0.0 { (first, second) } else { (second, first) };
        self.visit(near.0, near.1, offset);
        self.test(median);
        if across.length_squared() < self.radius2 {
            self.visit(far.0, far.1, across);
        }
    }

    fn test<T>(&mut self, entries: &[(Vec3, T)])
    where
        F: FnMut(&T, f32) -> f32,
    {
        for (position, value) in entries {
            let distance2 = self.point.distance_squared(*position);
            if distance2 < self.radius2 {
                self.radius2 = (self.found)(value, distance2);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn tree(points: &[Vec3]) -> KdTree<u32> {
        KdTree::new(points.iter().copied().zip(0..).collect())
    }

    fn found(tree: &KdTree<u32>, point: Vec3, radius: f32) -> Vec<(u32, f32)> {
        let mut all = Vec::new();
        tree.within(point, radius, |&i, d2| all.push((i, d2)));
        all.sort_unstable_by_key(|f| f.0);
        all
    }

    fn brute_force(points: &[Vec3], point: Vec3, radius: f32) -> Vec<(u32, f32)> {
        let near = |&(_, d2): &(u32, f32)| d2 < radius * radius;
        (0..).zip(points.iter().map(|p| point.distance_squared(*p))).filter(near).collect()
    }

    /// Points on a coarse lattice, so that many coincide or lie on splitting planes.
    fn lattice_point() -> impl Strategy<Value = Vec3> {
        (-6i8..6, -6i8..6, -2i8..2).prop_map(|(x, y, z)| Vec3::new(f32::from(x), f32::from(y), f32::from(z)) * 0.25)
    }

    fn loose_point() -> impl Strategy<Value = Vec3> {
        (-9.0f32..9.0, -9.0f32..9.0, -9.0f32..9.0).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn finds_what_brute_force_finds(
            points in prop::collection::vec(prop_oneof![lattice_point(), loose_point()], 0..400),
            place in prop_oneof![lattice_point(), loose_point()],
            radius in prop_oneof![Just(0.0f32), Just(0.25), 0.0f32..20.0],
        ) {
            prop_assert_eq!(found(&tree(&points), place, radius), brute_force(&points, place, radius));
        }
    }

    proptest! {
        #[test]
        fn the_nearest_are_those_of_all(
            points in prop::collection::vec(prop_oneof![lattice_point(), loose_point()], 0..400),
            place in prop_oneof![lattice_point(), loose_point()],
            count in 1usize..30,
        ) {
            // odd ones do not count, and height counts twice
            let off2 = |i: u32, d2: f32| if i % 2 == 1 { f32::INFINITY } else { d2 + (points[i as usize] - place).z.powi(2) };
            let told: Vec<f32> = tree(&points).nearest(place, count, |&i, d2| off2(i, d2)).iter().map(|n| n.0).collect();
            let mut all: Vec<f32> = (0..points.len() as u32)
                .map(|i| off2(i, place.distance_squared(points[i as usize])))
                .filter(|d| d.is_finite())
                .collect();
            all.sort_by(f32::total_cmp);
            all.truncate(count);
            prop_assert_eq!(told, all);
        }
    }

    #[test]
    fn more_may_be_asked_for_than_there_are() {
        let all = tree(&[Vec3::X, Vec3::ZERO]).nearest(Vec3::ZERO, usize::MAX, |_, distance2| distance2);
        assert_eq!(all, [(0.0, 1), (1.0, 0)]);
        assert!(tree(&[Vec3::X]).nearest(Vec3::ZERO, 0, |_, distance2| distance2).is_empty());
    }

    #[test]
    fn holds_none_one_and_many_at_one_place() {
        assert!(found(&tree(&[]), Vec3::ZERO, f32::INFINITY).is_empty());
        assert_eq!(found(&tree(&[Vec3::X]), Vec3::ZERO, 1.5), [(0, 1.0)]);
        assert!(found(&tree(&[Vec3::X]), Vec3::ZERO, 1.0).is_empty(), "the radius itself is outside");
        let same = tree(&[Vec3::Y; 1000]);
        assert_eq!(found(&same, Vec3::Y, 1e-3).len(), 1000);
        assert!(found(&same, Vec3::ZERO, 0.5).is_empty());
    }

    #[test]
    fn is_small_and_the_same_on_any_number_of_threads() {
        let points: Vec<Vec3> = (0..100_000u64)
            .map(|i| Vec3::new((i * 7919 % 10_007) as f32, (i * 104_729 % 997) as f32, (i % 13) as f32))
            .collect();
        let build = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| tree(&points))
        };
        let (one, three) = (build(1), build(3));
        assert_eq!(one.entries, three.entries);
        assert_eq!(one.axes, three.axes);
        assert!(one.bytes() <= 17 * points.len(), "16 are the entry's own");
    }
}
