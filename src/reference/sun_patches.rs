//! Sun patches as lights to sample.
//!
//! In an interior most light has bounced off a few small patches where the sun falls in, which paths hardly ever meet by
//! chance. The sun's rays are parallel, so a patch is a set of cells of a grid across them: a ray along a cell drawn at
//! random lands on a sunlit point, whose reflected light is then taken like an emitter's. (A light path of one bounce
//! joined to an eye path, Veach 1997, chapter 10; the grid keeps it to rays that come in.)
//!
//! Which cells matter is learnt beforehand, by paths from where pictures are taken. That is only about noise: cells never drawn are
//! still met by chance, at full weight.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::random::{Sampler, pick};
use super::vertex::{Vertex, clear, cosine_direction, off_surface, trace};
use crate::scene::{Ray, Scene};
use crate::site::Sun;

/// Cells along each side of the grid.
const CELLS: usize = 512;

/// Paths to learn from: chunks of so many, and the surfaces each may meet.
const CHUNKS: u64 = 128;
const CHUNK: u32 = 1024;
const STEPS: u32 = 4;

/// A grid across the sun's rays and how likely each cell is drawn.
pub(super) struct SunPatches {
    towards: Vec3,
    across: [Vec3; 2],
    /// The grid's corner and a cell's size, in metres along `across`.
    low: Vec2,
    cell: Vec2,
    /// Rays start this far along `towards`, before all of the model.
    before: f32,
    /// Cells that may be drawn, and the running sum of their probabilities.
    cells: Vec<u32>,
    cumulative: Vec<f32>,
    /// Probability per square metre across the rays, of every cell.
    density: Vec<f32>,
}

impl SunPatches {
    /// Learns where the sun falls on what lights pictures taken at `eyes` (local metres). `None` where it falls nowhere.
    pub(super) fn new(scene: &Scene, sun: &Sun, eyes: &[Vec3]) -> Option<Self> {
        let towards = sun.direction;
        let (a, b) = towards.any_orthonormal_pair();
        let flat = |p: Vec3| Vec2::new(p.dot(a), p.dot(b));
        let (mut low, mut high, mut before) = (Vec2::INFINITY, Vec2::NEG_INFINITY, f32::NEG_INFINITY);
        for p in scene.mesh.triangles.iter().flatten().map(|&i| scene.mesh.positions[i as usize]) {
            low = low.min(flat(p));
            high = high.max(flat(p));
            before = before.max(p.dot(towards));
        }
        let cell = ((high - low) / CELLS as f32).max(Vec2::splat(1e-4));
        if !cell.is_finite() {
            return None;
        }
        let mut patches = Self {
            towards,
            across: [a, b],
            low,
            cell,
            before: before + 1.0,
            cells: Vec::new(),
            cumulative: Vec::new(),
            density: vec![0.0; CELLS * CELLS],
        };
        patches.learn(scene, eyes);
        (!patches.cells.is_empty()).then_some(patches)
    }

    /// Follows paths from the eyes and counts which cells light what they meet.
    fn learn(&mut self, scene: &Scene, eyes: &[Vec3]) {
        if eyes.is_empty() {
            return;
        }
        // Whole numbers, so that the sum does not depend on who adds first
        let found: Vec<Vec<(usize, u64)>> = (0..CHUNKS)
            .into_par_iter()
            .map(|chunk| {
                let mut found = Vec::new();
                for index in 0..CHUNK {
                    let sampler = Sampler::new(0, chunk, index, CHUNK);
                    self.lesson(scene, eyes[index as usize % eyes.len()], &sampler, &mut found);
                }
                found
            })
            .collect();
        let mut weight = vec![0_u64; CELLS * CELLS];
        for (cell, light) in found.into_iter().flatten() {
            weight[cell] += light;
        }
        let smooth = spread(&weight);
        let total: u64 = smooth.iter().sum();
        let area = f64::from(self.cell.x) * f64::from(self.cell.y);
        let mut sum = 0;
        for (i, &w) in smooth.iter().enumerate().filter(|(_, w)| **w > 0) {
            sum += w;
            self.cells.push(i as u32);
            self.cumulative.push((sum as f64 / total as f64) as f32);
            self.density[i] = (w as f64 / total as f64 / area) as f32;
        }
        if let Some(last) = self.cumulative.last_mut() {
            *last = 1.0;
        }
    }

    /// Which cells light what one random path meets, and how much of their light comes back along it.
    fn lesson(&self, scene: &Scene, eye: Vec3, sampler: &Sampler, found: &mut Vec<(usize, u64)>) {
        let u = sampler.pair(0);
        let z = 1.0 - 2.0 * u.y;
        let (sin, cos) = (u.x * std::f32::consts::TAU).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        let mut ray = Ray { origin: eye, direction: Vec3::new(r * cos, r * sin, z) };
        let mut throughput = Vec3::ONE;
        for step in 0..STEPS {
            let Some(met) = trace(scene, &ray) else { return };
            throughput *= met.albedo;
            let start = off_surface(met.position, met.normal);
            // What the eye itself sees in the sun needs no sampling
            let cosine = if step > 0 { met.normal.dot(self.towards) } else { 0.0 };
            if cosine > 0.0
                && clear(scene, start, self.towards, f32::INFINITY)
                && let Some(cell) = self.cell_of(met.position)
            {
                found.push((cell, (1024.0 * throughput.element_sum() * cosine) as u64));
            }
            ray = Ray { origin: start, direction: cosine_direction(met.normal, sampler.pair(step + 1)) };
        }
    }

    fn cell_of(&self, point: Vec3) -> Option<usize> {
        let p = (Vec2::new(point.dot(self.across[0]), point.dot(self.across[1])) - self.low) / self.cell;
        let last = (CELLS - 1) as f32;
        let p = p.floor().clamp(Vec2::ZERO, Vec2::splat(last));
        p.is_finite().then(|| p.y as usize * CELLS + p.x as usize)
    }

    /// A sunlit point, drawn at random, and its probability per square metre of surface; `u` in the unit square. `None`
    /// where the ray meets nothing.
    pub(super) fn sample(&self, scene: &Scene, u: Vec2) -> Option<(Vertex, f32)> {
        let (i, within) = pick(&self.cumulative, u.x);
        let cell = self.cells[i] as usize;
        let at = self.low + self.cell * Vec2::new((cell % CELLS) as f32 + within, (cell / CELLS) as f32 + u.y);
        let origin = self.across[0] * at.x + self.across[1] * at.y + self.towards * self.before;
        let vertex = trace(scene, &Ray { origin, direction: -self.towards })?;
        let density = self.density(&vertex);
        (density > 0.0).then_some((vertex, density))
    }

    /// Probability per square metre of surface with which [`SunPatches::sample`] finds a sunlit point.
    pub(super) fn density(&self, vertex: &Vertex) -> f32 {
        let across = self.cell_of(vertex.position).map_or(0.0, |cell| self.density[cell]);
        across * vertex.normal.dot(self.towards).max(0.0)
    }
}

/// Every cell's weight and its eight neighbours', so that patches have no holes where few rays fell.
fn spread(weight: &[u64]) -> Vec<u64> {
    let near = |i: usize| i.saturating_sub(1)..(i + 2).min(CELLS);
    (0..CELLS * CELLS)
        .map(|i| near(i / CELLS).flat_map(|y| near(i % CELLS).map(move |x| weight[y * CELLS + x])).sum())
        .collect()
}
