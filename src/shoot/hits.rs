//! What each cell of a probe sees: the geometric half of shooting.

use glam::{Mat3, Vec2, Vec3};
use rayon::prelude::*;

use super::Chart;
use crate::scene::{Face, Paint, Ray, Scene, Surface};
use std::sync::{Arc, OnceLock};

/// A point this share of a cell's width behind a facet that faces its way may be hidden by it: facets of a curved surface
/// are a little behind each other.
const HIDDEN: f32 = 0.1;

/// The same for a surface that faces another way, as a wall does to a floor: what rounding leaves of a cell's plane.
const HIDDEN_ACROSS: f32 = 2e-3;

/// Normals whose cosine is less are not of one surface.
const LEAST_HOLD: f32 = 0.8;

/// A point that is so close to a cell's place, as a share of its height over the surface, is joined to it without a ray.
const TOGETHER: f32 = 1e-3;

/// Rays shorter than this are taken for the tripod or a probe that touches a wall, metres.
const NEAREST_M: f32 = 1e-3;

/// Cells of a row whose rays are cast together.
const STRIP: usize = 32;

/// The surfaces that a probe sees, one per cell of its chart. Holds no light.
pub struct Hits {
    /// The probe's place, local metres.
    pub origin: Vec3,
    /// From the program's axes to the probe's.
    pub to_probe: Mat3,
    /// Where each cell looks.
    pub chart: Chart,
    pub(super) cells: Vec<CellHit>,
    /// A direction towards the sun, and which cells it shines on: all lightings of a site share one.
    pub(super) sunlit: OnceLock<(Vec3, Arc<[Sunlit]>)>,
}

/// Whether the sun shines on a cell's surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Sunlit {
    /// In shade.
    #[default]
    No,
    /// In direct sun.
    Yes,
    /// The edge of a shadow runs through the cell.
    Partly,
}

/// What one cell sees; 16 bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct CellHit {
    /// Surface normal towards the probe, octahedral.
    pub(super) normal: u32,
    /// The surface's plane: normal · (point − probe), metres, below zero; infinite where nothing was hit.
    pub(super) plane: f32,
    /// Albedo averaged over the cell's footprint, 0..=1 in 65535 steps.
    pub(super) albedo: [u16; 3],
    /// Share of the cell that sees this very surface, 0..=1 in 65535 steps: low beside a depth edge.
    pub(super) purity: u16,
}

impl CellHit {
    const MISS: Self = Self { normal: 0, plane: f32::INFINITY, albedo: [0; 3], purity: 0 };

    pub(super) fn is_hit(&self) -> bool {
        self.plane.is_finite()
    }

    /// The cosine between this cell's normal and that of a point (relative to the probe) that lies on this cell's plane
    /// within a tolerance in metres; −1 where it does not.
    pub(super) fn facing(&self, point: Vec3, normal: Vec3, tolerance_m: f32) -> f32 {
        let n = unpack_normal(self.normal);
        if (n.dot(point) - self.plane).abs() < tolerance_m { n.dot(normal) } else { -1.0 }
    }

    /// [`facing`](Self::facing) for a point of a surface whose normal, and that normal packed, are given: neighbours
    /// mostly share it.
    #[inline]
    pub(super) fn facing_packed(&self, point: Vec3, normal: Vec3, packed: u32, tolerance_m: f32) -> f32 {
        if self.normal == packed {
            return if (normal.dot(point) - self.plane).abs() < tolerance_m { 1.0 } else { -1.0 };
        }
        self.facing(point, normal, tolerance_m)
    }
}

impl Hits {
    /// Casts one ray per cell from `origin`, then looks closer where neighbouring cells see different surfaces.
    pub fn shoot(scene: &Scene, origin: Vec3, to_world: Mat3, chart: Chart) -> Self {
        let mut cells = vec![CellHit::MISS; chart.len()];
        let rows: Vec<(usize, &mut [CellHit])> = split_rows(&chart, &mut cells);
        rows.into_par_iter().for_each(|(row, cells)| {
            let mut found = [None; STRIP];
            let middle = chart.middles(row);
            let mut face: Option<(Face, Paint)> = None;
            for (strip, cells) in cells.chunks_mut(STRIP).enumerate() {
                let first = strip * STRIP;
                let middles: Vec<Vec3> = (0..cells.len()).map(|x| middle(first + x)).collect();
                let directions: Vec<Vec3> = middles.iter().map(|&d| to_world * d).collect();
                found.fill(None);
                scene.tracer.closest_packet(origin, &directions, NEAREST_M, &mut found);
                for (x, cell) in cells.iter_mut().enumerate() {
                    let Some(hit) = &found[x] else { continue };
                    // cells beside each other mostly see one triangle
                    if face.is_none_or(|(face, _)| face.triangle != hit.triangle) {
                        let next = scene.face(hit.triangle);
                        face = Some((next, scene.paint(&next, true)));
                    }
                    let Some((face, paint)) = &face else { continue };
                    let surface = face.surface(&Ray { origin, direction: directions[x] }, hit.t);
                    let (right, down) = chart.steps(row, middles[x]);
                    let steps = [directions[x], to_world * right, to_world * down];
                    *cell = see(origin, steps, face, paint, &surface);
                }
            }
        });
        let mut hits = Self { origin, to_probe: to_world.transpose(), chart, cells, sunlit: OnceLock::new() };
        let rows = 0..hits.chart.rows();
        let purities: Vec<Vec<u16>> = rows.into_par_iter().map(|row| hits.purities_along(scene, row)).collect();
        for (cell, purity) in hits.cells.iter_mut().zip(purities.into_iter().flatten()) {
            cell.purity = purity;
        }
        hits
    }

    /// How fine this probe's records are on a surface: the solid angle of a square metre of it, in steradians; not
    /// above zero where the surface faces away.
    pub fn fineness(&self, point: Vec3, normal: Vec3) -> f32 {
        let p = point - self.origin;
        let d2 = p.length_squared();
        -normal.dot(p) / (d2 * d2.sqrt()).max(1e-12)
    }

    /// The cell nearest to a point of a surface, if this probe sees it there.
    pub fn find(&self, scene: &Scene, point: Vec3, normal: Vec3) -> Option<u32> {
        let p = point - self.origin;
        if normal.dot(p) >= 0.0 {
            return None;
        }
        let place = self.chart.place(self.to_probe * p)?;
        let tolerance = p.length() * self.chart.cell_angle();
        let around = self.chart.around(place);
        let (mut behind, mut best) = (false, (0.0, None));
        // neighbours mostly share a normal
        let mut known = (self.cells[around[0].0].normal, unpack_normal(self.cells[around[0].0].normal));
        let mut on = [false; 4];
        for (on, (cell, _)) in on.iter_mut().zip(around) {
            let hit = &self.cells[cell];
            if hit.normal != known.0 {
                known = (hit.normal, unpack_normal(hit.normal));
            }
            let (off, facing) = (known.1.dot(p) - hit.plane, known.1.dot(normal));
            behind |= hit.is_hit() && hides(off, facing, tolerance);
            *on = hit.purity > u16::MAX / 2 && off.abs() < tolerance && facing > LEAST_HOLD;
        }
        for ((cell, kernel), on) in around.into_iter().zip(on) {
            if kernel > best.0 && on && (!behind || self.joined(scene, cell, point, normal, tolerance)) {
                best = (kernel, Some(cell as u32));
            }
        }
        best.1
    }

    /// The place, local metres, and the unit normal of the surface that a cell sees; not finite where it sees none.
    pub(super) fn place(&self, cell: u32) -> (Vec3, Vec3) {
        let hit = &self.cells[cell as usize];
        let normal = unpack_normal(hit.normal);
        let d = self.to_probe.transpose() * self.chart.middle_of(cell as usize);
        (self.origin + d * (hit.plane / normal.dot(d)), normal)
    }

    /// Whether nothing stands between a point and the place where a cell meets its surface: a wall thinner than a cell
    /// hides what is behind it though its floor runs on. Asked only where another cell nearby [`hides`]
    /// the point.
    pub(super) fn joined(&self, scene: &Scene, cell: usize, point: Vec3, normal: Vec3, tolerance_m: f32) -> bool {
        let hit = &self.cells[cell];
        let n = unpack_normal(hit.normal);
        let d = self.to_probe.transpose() * self.chart.middle_of(cell);
        let lift = 0.5 * tolerance_m;
        let to = self.origin + d * (hit.plane / n.dot(d)) + n * lift;
        clear(scene, point + normal * lift, to, TOGETHER * lift)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let sunlit = self.sunlit.get().map_or(0, |s| s.1.len() * size_of::<Sunlit>());
        self.cells.len() * size_of::<CellHit>() + sunlit
    }

    /// Number of cells that see a surface.
    pub fn count(&self) -> usize {
        self.cells.iter().filter(|c| c.is_hit()).count()
    }

    /// The purity of each cell of a row: 1 within a surface; beside an edge, the share of four rays near the cell's corners
    /// that find the same surface as its centre.
    fn purities_along(&self, scene: &Scene, row: usize) -> Vec<u16> {
        /// Cells of an edge that lie no farther from each other have their rays cast together.
        const NEAR: usize = 8;
        let (origin, to_world) = (self.origin, self.to_probe.transpose());
        let cells = &self.cells[self.chart.row(row)];
        let middle = self.chart.middles(row);
        let mut purities: Vec<u16> = cells.iter().map(|c| if c.is_hit() { u16::MAX } else { 0 }).collect();
        let beside_edge = |x: &usize| cells[*x].is_hit() && self.beside_edge(row, *x, to_world * middle(*x));
        let edge: Vec<usize> = (0..cells.len()).filter(beside_edge).collect();
        let corners = self.chart.corners();
        for group in edge.chunk_by(|a, b| b - a <= NEAR).flat_map(|run| run.chunks(STRIP / corners.len())) {
            let around = |&x: &usize| {
                corners.iter().map(move |(dx, dy)| self.chart.direction(row, x as f32 + dx, row as f32 + dy))
            };
            let directions: Vec<Vec3> = group.iter().flat_map(around).map(|d| to_world * d).collect();
            let mut found = [None; STRIP];
            scene.tracer.closest_packet(origin, &directions, NEAREST_M, &mut found[..directions.len()]);
            let seen: Vec<Option<Surface>> = (found.iter().zip(&directions))
                .map(|(hit, &direction)| Some(scene.surface(&Ray { origin, direction }, hit.as_ref()?)))
                .collect();
            for (&x, seen) in group.iter().zip(seen.chunks(corners.len())) {
                let same = |s: &&Surface| {
                    let p = s.position - origin;
                    cells[x].facing(p, s.normal, 0.5 * p.length() * self.chart.cell_angle()) > LEAST_HOLD
                };
                let same = seen.iter().flatten().filter(same).count();
                purities[x] = (same * usize::from(u16::MAX) / corners.len()) as u16;
            }
        }
        purities
    }

    /// The cells to the left and right of one, above and below it.
    pub(super) fn neighbours(&self, row: usize, x: usize) -> impl Iterator<Item = usize> {
        let chart = &self.chart;
        let here = chart.row(row);
        let n = here.len();
        let wrap = |x: usize| chart.wraps().then_some(here.start + x);
        let left = if x > 0 { Some(here.start + x - 1) } else { wrap(n - 1) };
        let right = if x + 1 < n { Some(here.start + x + 1) } else { wrap(0) };
        let beside = |row: usize| {
            let other = chart.row(row);
            other.start + (x * 2 + 1) * other.len() / (2 * n)
        };
        let above = row.checked_sub(1).map(beside);
        let below = (row + 1 < chart.rows()).then(|| beside(row + 1));
        [left, right, above, below].into_iter().flatten()
    }

    /// Whether a cell's neighbours see another surface; `d` is the direction of its middle.
    fn beside_edge(&self, row: usize, x: usize, d: Vec3) -> bool {
        let parts = self.parts(self.chart.row(row).start + x, d);
        self.neighbours(row, x).any(|j| parts(&self.cells[j]))
    }

    /// Whether a cell and another one beside it see different surfaces.
    pub(super) fn parted(&self, row: usize, x: usize, other: usize) -> bool {
        let d = self.to_probe.transpose() * self.chart.middle(row, x);
        self.parts(self.chart.row(row).start + x, d)(&self.cells[other])
    }

    /// What tells whether a neighbour sees another surface than a cell does, whose middle lies along `d`.
    fn parts(&self, cell: usize, d: Vec3) -> impl Fn(&CellHit) -> bool {
        let packed = self.cells[cell].normal;
        let normal = unpack_normal(packed);
        let distance = self.cells[cell].plane / normal.dot(d);
        let (p, tolerance) = (d * distance, distance * self.chart.cell_angle());
        // symmetric, and on curved surfaces milder than asking the neighbour's point of this plane
        move |other| !other.is_hit() || other.facing_packed(p, normal, packed, tolerance) <= LEAST_HOLD
    }
}

/// Whether nothing stands between two points, or they are nearer to each other than `together_m`.
#[inline]
pub(crate) fn clear(scene: &Scene, from: Vec3, to: Vec3, together_m: f32) -> bool {
    let way = to - from;
    let length = way.length();
    length < together_m || !scene.tracer.occluded(&Ray { origin: from, direction: way / length }, 0.0, length)
}

/// Whether a surface may hide a point that is `off_m` before its plane (below zero: behind it); `facing` is the cosine
/// between their normals.
#[inline]
pub(super) fn hides(off_m: f32, facing: f32, tolerance_m: f32) -> bool {
    let slack = if facing > LEAST_HOLD { HIDDEN } else { HIDDEN_ACROSS };
    off_m < -slack * tolerance_m
}

/// A cell that sees a surface, with the albedo averaged over its footprint on the surface's plane. `steps` are the direction
/// of the cell's middle and its change to the right and down.
fn see(origin: Vec3, steps: [Vec3; 3], face: &Face, paint: &Paint, surface: &Surface) -> CellHit {
    /// Texels from sample to sample. Whatever is wrong with the albedo stays in the record: finer than a view needs.
    const APART: f32 = 1.0;
    let [middle, right, down] = steps;
    let p = surface.position - origin;
    let albedo = paint.patch(face, surface.barycentric, face.covered(middle, [right, down], p.length()), APART);
    let albedo = albedo.clamp(Vec3::ZERO, Vec3::ONE) * 65535.0 + 0.5;
    let normal = pack_normal(surface.normal);
    CellHit {
        normal,
        // through the very place that was hit, whatever packing did to the normal
        plane: unpack_normal(normal).dot(p),
        albedo: [albedo.x as u16, albedo.y as u16, albedo.z as u16],
        purity: u16::MAX,
    }
}

/// The cells of each row.
pub(super) fn split_rows<'a, T>(chart: &Chart, mut cells: &'a mut [T]) -> Vec<(usize, &'a mut [T])> {
    (0..chart.rows())
        .map(|row| {
            let (head, tail) = std::mem::take(&mut cells).split_at_mut(chart.row(row).len());
            cells = tail;
            (row, head)
        })
        .collect()
}

/// A unit vector in 32 bits: octahedral map (Cigolle et al., *A Survey of Efficient Representations for Independent
/// Unit Vectors*, 2014), error at most 0.004°.
pub(super) fn pack_normal(n: Vec3) -> u32 {
    let n = n / (n.x.abs() + n.y.abs() + n.z.abs());
    let p = if n.z >= 0.0 {
        Vec2::new(n.x, n.y)
    } else {
        Vec2::new((1.0 - n.y.abs()).copysign(n.x), (1.0 - n.x.abs()).copysign(n.y))
    };
    let code = |v: f32| u32::from((v * 32767.0).round() as i16 as u16);
    code(p.x) | code(p.y) << 16
}

/// The unit vector of [`pack_normal`].
#[inline]
pub(super) fn unpack_normal(code: u32) -> Vec3 {
    let x = f32::from(code as u16 as i16) / 32767.0;
    let y = f32::from((code >> 16) as u16 as i16) / 32767.0;
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    Vec3::new(x - fold.copysign(x), y - fold.copysign(y), z).normalize()
}
