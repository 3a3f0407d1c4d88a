//! A baked model.

use glam::{Vec2, Vec3};
use std::ops::Range;

use crate::panorama::{Exposure, Picture};
use crate::render::Source;

/// A baked model, local metres.
pub struct Baked {
    /// Names of the lightings.
    pub lightings: Vec<String>,
    /// The vertices.
    pub vertices: Vec<Vertex>,
    /// Irradiance, per lighting one for each vertex; without direct sun where that is kept apart.
    pub irradiance: Vec<Vec<Vec3>>,
    /// Per lighting what the sun adds where it reaches, one for each vertex; empty where it is not kept apart or not known.
    pub sunlight: Vec<Vec<Vec3>>,
    /// Per lighting the direction towards the sun, where it is known.
    pub suns: Vec<Option<Vec3>>,
    /// Triangles, sorted by material; counter-clockwise on the side that they were baked for.
    pub triangles: Vec<[u32; 3]>,
    /// Where each triangle lies in the model.
    pub origins: Vec<Origin>,
    /// Per material (in the scene's order) its first triangle; one more at the end.
    pub materials: Vec<u32>,
    /// The same surface in fewer triangles, as it was before its last cuts: for drawing while something moves. Empty if not asked
    /// for, or if nothing was cut.
    pub coarse: Vec<[u32; 3]>,
    /// Per material its first coarse triangle; one more at the end.
    pub coarse_materials: Vec<u32>,
    /// Per lighting, the geometric mean of the views' exposures; without them, what brings the surface's log-average radiance to
    /// middle grey.
    pub exposures: Vec<Exposure>,
    /// Per view and lighting, what brings the view's picture to middle grey, as its PNG has it; empty if not asked for.
    pub views: Vec<Vec<Exposure>>,
    /// Per lighting the sky, latitude/longitude, the centre column looking along the program's +y.
    pub skies: Vec<Picture>,
    /// Triangles of the model no side of which can be seen from within: left out, but for the shadows that they cast.
    pub hidden: Vec<u32>,
    /// Irradiance and exposure are on one side of a triangle; so many have both.
    pub two_sided: usize,
}

/// Some triangles of a material that lie close together, to be drawn, or left out, together.
pub(crate) struct Run {
    pub(crate) material: usize,
    pub(crate) triangles: Range<u32>,
    /// The box around them: least and greatest corner.
    pub(crate) low: Vec3,
    pub(crate) high: Vec3,
}

impl Baked {
    /// Triangles in runs; per material its first triangle, and one more at the end.
    pub(crate) fn runs(&self, triangles: &[[u32; 3]], materials: &[u32]) -> Vec<Run> {
        /// Triangles of a run.
        const RUN: u32 = 2048;
        let mut runs = Vec::new();
        for (material, ends) in materials.windows(2).enumerate() {
            for first in (ends[0]..ends[1]).step_by(RUN as usize) {
                let run = first..ends[1].min(first + RUN);
                let corners = triangles[run.start as usize..run.end as usize].as_flattened().iter();
                let (low, high) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), v| {
                    let p = self.vertices[*v as usize].position;
                    (low.min(p), high.max(p))
                });
                runs.push(Run { material, triangles: run, low, high });
            }
        }
        runs
    }
}

/// A vertex.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Where it is.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Where light was asked for: a hair beside its place where that is on a rim.
    pub lit_at: Vec3,
    /// Texture coordinates, v = 0 at the picture's bottom row.
    pub uv: Vec2,
    /// Linear colour of the model's own vertices; white where it has none.
    pub colour: Vec3,
    /// Where the light came from.
    pub source: Source,
    /// How far probes agree, 0..=1.
    pub agreement: f32,
    /// The probe that sees it most sharply of those with a picture of the first lighting: its place in the site's list.
    pub probe: Option<u32>,
    /// Number of probes that see it.
    pub seen_by: u8,
}

/// Where a baked triangle lies in the model.
#[derive(Clone, Copy, Debug)]
pub struct Origin {
    /// The side of the model's triangle t: 2 t is its front, 2 t + 1 its back.
    pub side: u32,
    /// Barycentric coordinates of the corners in the model's triangle: of its second and third corner.
    pub at: [Vec2; 3],
}

impl Origin {
    /// How much the corners count at a place (barycentric coordinates in the model's triangle), none less than nothing.
    pub(super) fn weights(&self, place: Vec2) -> [f32; 3] {
        let [a, b, c] = self.at;
        let area = (b - a).perp_dot(c - a);
        let second = ((place - a).perp_dot(c - a) / area).clamp(0.0, 1.0);
        let third = ((b - a).perp_dot(place - a) / area).clamp(0.0, 1.0 - second);
        [1.0 - second - third, second, third]
    }
}
