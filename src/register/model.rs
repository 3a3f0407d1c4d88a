//! What the model shows from a pose, by a picture's cells: shape, albedo, and what the picture should be.

use glam::{Mat3, Quat, Vec3};
use rayon::prelude::*;

use super::picture::Level;
use super::raster::Raster;
use crate::edge_aware::EdgeAware;
use crate::panorama::luminance;
use crate::scene::{Face, Ray, Scene};

/// A pose in the scene's local frame: where the eye is, and its axes in the program's.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalPose {
    pub(super) origin: Vec3,
    pub(super) rotation: Mat3,
}

impl LocalPose {
    /// How far another one's place is, metres, and how far its axes are turned, degrees.
    pub(super) fn off(&self, other: &Self) -> (f32, f32) {
        let turn = Quat::from_mat3(&(self.rotation.transpose() * other.rotation));
        let angle = 2.0 * turn.xyz().length().atan2(turn.w.abs());
        (self.origin.distance(other.origin), angle.to_degrees())
    }
}

/// What the model has in each cell's middle.
pub(super) struct GeometryBuffer {
    /// Distance in metres; infinite where nothing is hit.
    pub(super) distance: Vec<f32>,
    /// Unit normal in the picture's axes.
    pub(super) normal: Vec<Vec3>,
    /// Logarithm of the albedo's luminance, averaged over the cell; 0 where nothing is hit and for lamps.
    pub(super) log_albedo: Vec<f32>,
    /// Whether the cell shows a lamp.
    pub(super) lamp: Vec<bool>,
}

/// Rays shorter than this are taken for the tripod, metres.
const NEAREST_M: f32 = 1e-3;

/// Albedos below this count as this much.
const DARKEST_ALBEDO: f32 = 0.02;

impl GeometryBuffer {
    /// Casts a ray through the middle of each cell.
    pub(super) fn cast(scene: &Scene, raster: &Raster, pose: &LocalPose) -> Self {
        let angle = raster.cell_angle();
        let to_picture = pose.rotation.transpose();
        let rows: Vec<Vec<_>> = raster
            .directions
            .par_chunks(raster.width)
            .map(|row| {
                let mut ready = None;
                // one by one: a dense scan has many triangles between two of them
                let one = |cell: &Vec3| {
                    let direction = pose.rotation * *cell;
                    let ray = Ray { origin: pose.origin, direction };
                    let Some(hit) = scene.tracer.closest(&ray, NEAREST_M) else {
                        return ((f32::INFINITY, Vec3::ZERO), (0.0, false));
                    };
                    if ready.as_ref().is_some_and(|(face, _): &(Face, _)| face.triangle != hit.triangle) {
                        ready = None;
                    }
                    let (face, paint) = ready.get_or_insert_with(|| {
                        let face = scene.face(hit.triangle);
                        let paint = scene.paint(&face, true);
                        (face, paint)
                    });
                    let s = face.surface(&ray, hit.t);
                    let cos = s.normal.dot(direction).abs().max(0.1);
                    let width = hit.t * angle / cos.sqrt();
                    let lamp = scene.emission(hit.triangle) != Vec3::ZERO;
                    let albedo = luminance(paint.albedo(s.barycentric, width)).max(DARKEST_ALBEDO);
                    ((hit.t, to_picture * s.normal), (if lamp { 0.0 } else { albedo.ln() }, lamp))
                };
                row.iter().map(one).collect()
            })
            .collect();
        let ((distance, normal), (log_albedo, lamp)) = rows.into_iter().flatten().unzip();
        Self { distance, normal, log_albedo, lamp }
    }

    /// Whether two cells lie on one smooth surface, on one lamp, or both see nothing.
    pub(super) fn joined(&self, raster: &Raster, i: usize, j: usize) -> bool {
        /// A chord may leave the surface by this sine, and normals differ by this cosine.
        const OFF: f32 = 0.35;
        const TURN: f32 = 0.75;
        let (a, b) = (self.distance[i], self.distance[j]);
        if !a.is_finite() || !b.is_finite() {
            return a.is_finite() == b.is_finite();
        }
        if self.lamp[i] != self.lamp[j] || self.normal[i].dot(self.normal[j]) < TURN {
            return false;
        }
        let chord = raster.directions[j] * b - raster.directions[i] * a;
        let off = self.normal[i].dot(chord).abs().max(self.normal[j].dot(chord).abs());
        // a chord across the line of sight is never shorter than a cell
        off < OFF * chord.length() || off < 0.25 * raster.cell_angle() * a.min(b)
    }

    /// The cells that lie on one smooth surface.
    pub(super) fn surfaces(&self, raster: &Raster) -> EdgeAware {
        EdgeAware::new(raster.width, raster.height, |i, j| self.joined(raster, i, j))
    }

    /// The distance of what stands in front at a cell and its neighbours: what an edge moves with.
    pub(super) fn front(&self, raster: &Raster, i: usize) -> f32 {
        raster.around(i).iter().fold(self.distance[i], |d, &j| d.min(self.distance[j]))
    }
}

/// Standard deviation, radians, over which a surface's irradiance is taken as even.
const EVEN: f32 = 0.2;

/// What the picture should be, and how that changes with what the model has in it.
pub(super) struct Template {
    /// Logarithm of luminance.
    pub(super) value: Vec<f32>,
    /// Change over one cell to the right and down that is the model's: of albedo, and of light across an edge. The light's
    /// own slow change over a surface is not, for it stays with the picture when the pose moves.
    pub(super) slope: [Vec<f32>; 2],
}

/// What the picture should be, given the light that it shows itself: log detail + log irradiance, the latter averaged over
/// each smooth surface around the cell and never across its edges. Edges of texture and of shape stand where the model
/// has them; the light on either side is the picture's own. `detail` is the logarithm of what the light is multiplied by: the model's albedo, or
/// what other pictures saw; NaN where unknown.
pub(super) fn template(surfaces: &EdgeAware, level: &Level, detail: &[f32]) -> Template {
    let raster = &level.raster;
    let n = raster.len();
    let known: Vec<f32> = detail.iter().zip(&level.weight).map(|(d, w)| if d.is_finite() { *w } else { 0.0 }).collect();
    // cells at an edge mix the light of both sides
    let inside = |i: usize| raster.around(i).iter().all(|&j| i == j || surfaces.joined(i, j) || raster.seam(i, j));
    let trusted: Vec<f32> = (0..n).map(|i| if inside(i) { known[i] } else { RIM * known[i] }).collect();
    let light: Vec<f32> =
        level.sharp.iter().zip(detail).map(|(l, a)| if a.is_finite() { l - a } else { 0.0 }).collect();
    let even = surfaces.even_mean(&light, &trusted, EVEN / raster.cell_angle());
    let raw: Vec<f32> = even.iter().zip(detail).map(|(e, a)| if a.is_finite() { e + a } else { f32::NAN }).collect();
    let step = |i: usize, j: usize| {
        if i == j || known[i] == 0.0 || known[j] == 0.0 {
            0.0
        } else if surfaces.joined(i, j) || raster.seam(i, j) {
            detail[j] - detail[i]
        } else {
            raw[j] - raw[i]
        }
    };
    let soft = raster.soften(&raw, &known);
    let slope = [0, 2].map(|axis| {
        let of = |i: usize| {
            let around = raster.around(i);
            0.5 * (step(around[axis], i) + step(i, around[axis + 1]))
        };
        let change: Vec<f32> = (0..n).map(of).collect();
        raster.soften(&change, &known)
    });
    Template { value: soft, slope }
}

/// How much a cell at an edge counts for its surface's light.
const RIM: f32 = 0.1;
