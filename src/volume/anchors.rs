//! Where the irradiance volume keeps its values: on the surfaces inside each cell, one per side they face.

use glam::{IVec3, Vec2, Vec3};

use super::Grid;
use crate::scene::{Ray, Scene};

/// A place on a surface that stands for the part of it inside one cell.
#[derive(Clone, Copy, Debug)]
pub struct Anchor {
    /// Local metres, on the surface.
    pub position: Vec3,
    /// Unit normal of the side it stands for.
    pub normal: Vec3,
}

/// All anchors of a scene, found by cell.
pub struct Anchors {
    /// The cells.
    pub grid: Grid,
    /// Sorted by cell.
    pub list: Vec<Anchor>,
    /// Per cell, index of its first anchor; one more at the end.
    starts: Vec<u32>,
}

/// How far an anchor speaks, in cells.
const REACH: f32 = 1.75;

/// How well an anchor speaks for a point, with its index.
pub type Weighted = (f32, u32);

impl Anchors {
    /// Puts anchors on all surfaces, both sides: per cell and main direction (26 of them) the sample nearest to the
    /// middle of the cell, out of about eight samples per cell face of area.
    pub fn over(scene: &Scene, grid: Grid) -> Self {
        let mesh = &scene.mesh;
        let spacing = f64::from(grid.cell_m * grid.cell_m) / 8.0;
        let mut best: Vec<(u64, f32, Anchor)> = Vec::new();
        let mut area = 0.0;
        let mut taken = 0u64;
        for triangle in 0..mesh.triangles.len() as u32 {
            area += f64::from(mesh.area(triangle));
            let [a, b, c] = mesh.corners(triangle);
            let n = mesh.normal(triangle);
            // systematic sampling: one sample each time the running area passes another `spacing`
            while area > (taken as f64 + 0.5) * spacing {
                taken += 1;
                let u = plastic(taken);
                let u = if u.x + u.y > 1.0 { Vec2::ONE - u } else { u };
                let position = a + (b - a) * u.x + (c - a) * u.y;
                let cell = grid.cell(position);
                let Some(index) = grid.index(cell) else { continue };
                let off = (position - grid.centre(cell)).length_squared();
                for normal in [n, -n] {
                    let key = (index as u64) * 27 + main_direction(normal);
                    best.push((key, off, Anchor { position, normal }));
                }
            }
        }
        best.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        best.dedup_by_key(|b| b.0);
        let mut starts = vec![0u32; grid.len() + 1];
        for (key, ..) in &best {
            starts[(key / 27) as usize + 1] += 1;
        }
        for i in 0..grid.len() {
            starts[i + 1] += starts[i];
        }
        Self { grid, list: best.into_iter().map(|b| b.2).collect(), starts }
    }

    /// The anchors around a point whose side agrees with `normal`, with weights that fall to zero 1.5 cells away, so that
    /// they hardly jump where a cell comes in or goes out:
    /// nearest, best aligned and least off the point's own plane count most.
    pub fn around(&self, point: Vec3, normal: Vec3, found: &mut Vec<Weighted>) {
        found.clear();
        let middle = self.grid.place(point).floor().as_ivec3();
        for i in 0..27 {
            let cell = middle + IVec3::new(i % 3, i / 3 % 3, i / 9) - 1;
            let Some(index) = self.grid.index(cell) else { continue };
            for j in self.starts[index]..self.starts[index + 1] {
                let weight = self.weight(j, point, normal);
                if weight > 0.0 {
                    found.push((weight, j));
                }
            }
        }
        found.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    }

    /// The anchors that points (position, normal) would take values from, each once, in order.
    pub fn near(&self, points: &[(Vec3, Vec3)]) -> Vec<u32> {
        let mut all = Vec::new();
        let mut found = Vec::new();
        for &(point, normal) in points {
            self.around(point, normal, &mut found);
            all.extend(found.iter().take(8).map(|f| f.1));
        }
        all.sort_unstable();
        all.dedup();
        all
    }

    fn weight(&self, anchor: u32, point: Vec3, normal: Vec3) -> f32 {
        let anchor = &self.list[anchor as usize];
        let facing = anchor.normal.dot(normal);
        if facing < 0.3 {
            return 0.0;
        }
        let d = point - anchor.position;
        let near = 1.0 - d.length() / (REACH * self.grid.cell_m);
        if near <= 0.0 {
            return 0.0;
        }
        let off_plane = (anchor.normal.dot(d).abs() + normal.dot(d).abs()) / self.grid.cell_m;
        near * near * facing * facing / (0.05 + off_plane)
    }

    /// How far above a surface its light is gathered, metres: past doubled walls, and small against a cell.
    pub fn lift(&self) -> f32 {
        0.02 * self.grid.cell_m
    }

    /// Whether nothing stands between a point and an anchor, seen from just above both surfaces.
    pub fn sees(&self, scene: &Scene, anchor: u32, point: Vec3, normal: Vec3) -> bool {
        let anchor = &self.list[anchor as usize];
        let lift = self.lift();
        let (from, to) = (point + normal * lift, anchor.position + anchor.normal * lift);
        let d = to - from;
        let length = d.length();
        length < 2.0 * lift || !scene.tracer.occluded(&Ray { origin: from, direction: d / length }, 0.0, length)
    }
}

/// Which of the 26 directions from a cube's middle to its faces, edges and corners a normal is nearest to, in 0..27.
fn main_direction(n: Vec3) -> u64 {
    // tan 22.5°: a component counts where it is more than that share of the greatest
    let limit = 0.414 * n.abs().max_element();
    let digit = |v: f32| if v > limit { 2 } else { u64::from(v >= -limit) };
    digit(n.x) * 9 + digit(n.y) * 3 + digit(n.z)
}

/// Point `i` of the two-dimensional additive recurrence on the plastic number: evenly spread over the unit square.
pub(super) fn plastic(i: u64) -> Vec2 {
    const A: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let at = |a: f64| ((i as f64 * a).fract()) as f32;
    Vec2::new(at(A[0]), at(A[1]))
}
