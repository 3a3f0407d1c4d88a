//! The model's surface cut into small patches.

use glam::Vec3;

use crate::scene::Mesh;

/// All triangles, each cut evenly into n² alike ones.
pub struct Patches {
    /// Per triangle: how many cuts along a side, n.
    cuts: Vec<u16>,
    /// Per triangle: its first patch; one more than there are triangles.
    starts: Vec<u32>,
}

impl Patches {
    /// Cuts a mesh into patches with sides of about `side_m` metres, larger where that would be more than `most`.
    pub fn new(mesh: &Mesh, side_m: f32, most: usize) -> Self {
        let longest: Vec<f32> = (0..mesh.triangles.len() as u32)
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                a.distance(b).max(b.distance(c)).max(c.distance(a))
            })
            .collect();
        let mut side_m = side_m;
        loop {
            let cuts: Vec<u16> = longest.iter().map(|l| (l / side_m).ceil().clamp(1.0, 1000.0) as u16).collect();
            let total: usize = cuts.iter().map(|n| usize::from(*n).pow(2)).sum();
            if total <= most.max(2 * mesh.triangles.len()) {
                let mut starts = vec![0u32];
                starts.extend(cuts.iter().scan(0, |sum, n| {
                    *sum += u32::from(*n).pow(2);
                    Some(*sum)
                }));
                return Self { cuts, starts };
            }
            side_m *= 1.25;
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.starts.last().copied().unwrap_or(0) as usize
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The triangle that a patch is part of.
    pub fn triangle(&self, patch: usize) -> u32 {
        self.starts.partition_point(|s| *s as usize <= patch) as u32 - 1
    }

    /// The patches of a triangle.
    pub fn of(&self, triangle: u32) -> std::ops::Range<usize> {
        self.starts[triangle as usize] as usize..self.starts[triangle as usize + 1] as usize
    }

    /// The patch at a point of a triangle, by the barycentric coordinates of its second and third corner.
    pub fn at(&self, triangle: u32, u: f32, v: f32) -> usize {
        let n = f32::from(self.cuts[triangle as usize]);
        let last = self.cuts[triangle as usize] as usize - 1;
        let (x, y) = ((u * n).clamp(0.0, n), (v * n).clamp(0.0, n));
        let row = (y as usize).min(last);
        let column = (x as usize).min(last - row);
        // the upper half of a rhomb of two patches
        let upper = x - column as f32 + (y - row as f32) > 1.0 && column + row < last;
        let n = last + 1;
        self.starts[triangle as usize] as usize + row * (2 * n - row) + 2 * column + usize::from(upper)
    }

    /// A patch's corners.
    pub fn corners(&self, mesh: &Mesh, patch: usize) -> [Vec3; 3] {
        let triangle = self.triangle(patch);
        let n = usize::from(self.cuts[triangle as usize]);
        let mut rest = patch - self.starts[triangle as usize] as usize;
        let mut row = 0;
        // row r holds 2(n − r) − 1 patches
        while rest >= 2 * (n - row) - 1 {
            rest -= 2 * (n - row) - 1;
            row += 1;
        }
        let (column, upper) = (rest / 2, rest % 2 == 1);
        let [a, b, c] = mesh.corners(triangle);
        let at = |x: usize, y: usize| a + (b - a) * (x as f32 / n as f32) + (c - a) * (y as f32 / n as f32);
        if upper {
            [at(column + 1, row), at(column + 1, row + 1), at(column, row + 1)]
        } else {
            [at(column, row), at(column + 1, row), at(column, row + 1)]
        }
    }

    /// A patch's area in square metres.
    pub fn area(&self, mesh: &Mesh, patch: usize) -> f64 {
        let triangle = self.triangle(patch);
        f64::from(mesh.area(triangle)) / f64::from(self.cuts[triangle as usize]).powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_tile_their_triangle_and_are_found_by_their_middles() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::new(3.0, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.1, 0.1, 0.1)],
            triangles: vec![[0, 1, 3], [0, 1, 2]],
            materials: vec![0, 0],
            ..Mesh::default()
        };
        let patches = Patches::new(&mesh, 0.5, 10_000);
        let n = (0..patches.len()).filter(|p| patches.triangle(*p) == 1).count();
        assert_eq!(n, 64);
        let mut area = 0.0;
        for p in 0..patches.len() {
            let [a, b, c] = patches.corners(&mesh, p);
            let middle = (a + b + c) / 3.0;
            if patches.triangle(p) == 1 {
                area += f64::from((b - a).cross(c - a).z) / 2.0;
                assert_eq!(patches.at(1, middle.x / 3.0, middle.y / 2.0), p);
            }
        }
        assert!((area - 3.0).abs() < 1e-5 && (patches.area(&mesh, patches.len() - 1) - 3.0 / 64.0).abs() < 1e-6);
        assert!(Patches::new(&mesh, 0.01, 50).len() <= 50);
    }
}
