//! What a reader of model files gives: triangles and materials as the file has them.

use glam::{DVec3, Vec3};
use std::path::PathBuf;
use std::sync::Arc;

use super::{Mesh, Wrap};
use crate::site::Frame;
use crate::statistics;

/// The grey of a surface whose material is not known.
pub(super) const UNKNOWN_ALBEDO: f32 = 0.5;

/// A model file's triangles, not yet cleaned.
#[derive(Default)]
pub(super) struct ImportedModel {
    /// What positions are relative to: metres in the program's axes.
    pub(super) origin: DVec3,
    /// Positions are not finite where the file's numbers are not; of vertices without texture coordinates these are NaN, of
    /// those without a colour it is white. Polygons are cut into triangles.
    pub(super) mesh: Mesh,
    /// Names of materials; `None` for faces without one.
    pub(super) material_names: Vec<Option<String>>,
    /// Files of materials that an OBJ file names after `mtllib`.
    pub(super) libraries: Vec<String>,
    /// Materials that the model file itself holds.
    pub(super) own: Vec<ModelMaterial>,
    /// Other files that were read, such as buffers.
    pub(super) files: Vec<PathBuf>,
    /// What was passed over.
    pub(super) oddities: Oddities,
}

/// Counts of what a model file holds and import passes over or mends.
#[derive(Clone, Debug, Default)]
pub(super) struct Oddities {
    pub(super) points_and_lines: u64,
    /// Faces of fewer than three corners.
    pub(super) short_faces: u64,
    /// Statements of curves and free-form surfaces.
    pub(super) free_form: u64,
    /// Vertices with a colour.
    pub(super) coloured: u64,
    /// All vertices.
    pub(super) vertices: u64,
    /// Faces with more corners than can be cut properly, cut as a fan.
    pub(super) fans: u64,
    /// Colours were 0..=255 and were scaled.
    pub(super) byte_colours: bool,
    /// What else was passed over, a sentence each.
    pub(super) others: Vec<String>,
}

/// A material as its file tells it.
#[derive(Clone, Debug, Default)]
pub(super) struct ModelMaterial {
    /// Its name, blanks inside kept.
    pub(super) name: String,
    /// Linear diffuse reflectance, 0..=1.
    pub(super) albedo: Vec3,
    /// Radiance sent out.
    pub(super) emission: Vec3,
    /// The picture that multiplies the albedo.
    pub(super) map: Option<Map>,
    /// What cuts holes into it.
    pub(super) cutout: Option<Cutout>,
}

/// A picture that tells where there is a surface and where there is a hole.
#[derive(Clone, Debug)]
pub(super) struct Cutout {
    /// The picture; `None` for the one that paints the surface.
    pub(super) map: Option<Map>,
    /// What of the picture tells it.
    pub(super) channel: Channel,
    /// What it is multiplied with.
    pub(super) factor: f32,
    /// From where on there is a surface.
    pub(super) cutoff: f32,
}

/// What of a picture tells how opaque a texel is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    /// Its alpha.
    Alpha,
    /// Its brightness.
    Grey,
    /// Its alpha where it has one, else its brightness.
    Either,
}

/// A texture as a material names it.
#[derive(Clone, Debug, Default)]
pub(super) struct Map {
    /// The name as written, options taken off.
    pub(super) name: String,
    /// The file that names it, and the line in it.
    pub(super) file: PathBuf,
    /// Line, from 1; 0 where the file has no lines.
    pub(super) line: usize,
    /// The material's albedo where the picture cannot be had.
    pub(super) plain_albedo: Vec3,
    /// The picture's file, where it stands in the model's.
    pub(super) embedded: Option<Arc<[u8]>>,
    /// How it goes on beyond its edges, across and down.
    pub(super) wrap: [Wrap; 2],
}

impl ImportedModel {
    /// Adds vertices, in the file's axes and units; gives the index of the first.
    ///
    /// # Errors
    ///
    /// More vertices than an index can tell apart.
    pub(super) fn add_vertices(&mut self, points: impl Iterator<Item = DVec3>, frame: &Frame) -> Result<u32, String> {
        let first = self.mesh.positions.len();
        self.mesh.positions.extend(points.map(|p| (frame.point_in(p) - self.origin).as_vec3()));
        match u32::try_from(self.mesh.positions.len()) {
            Ok(_) => Ok(first as u32),
            Err(_) => Err("the model has more than 4294967295 vertices".to_owned()),
        }
    }

    /// Scales colours that some scanners' programs write as 0..=255, and gives white to vertices without one. What is only a
    /// little above 1 was sharpened or rounded, and is clamped.
    pub(super) fn settle_colours(&mut self) {
        let colours = &mut self.mesh.colours;
        if colours.iter().any(|c| c.max_element() > 2.0) {
            self.oddities.byte_colours = true;
            colours.iter_mut().for_each(|c| *c /= 255.0);
        }
        for c in colours {
            *c = if c.is_finite() { c.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ONE };
        }
    }
}

/// From here on, in metres, single precision tells no half millimetre apart.
const FAR: f64 = 4096.0;

/// The middle of all finite vertices in whole metres, in the program's axes; where some are so far off that the rest would
/// be rounded, the median along each axis.
pub(super) fn centre(points: impl Iterator<Item = DVec3> + Clone, frame: &Frame) -> DVec3 {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for p in points.clone().filter(|p| p.is_finite()) {
        (low, high) = (low.min(p), high.max(p));
    }
    let mut middle = frame.point_in(0.5 * low + 0.5 * high);
    if (frame.point_in(high) - middle).length() >= FAR {
        let median =
            |axis: usize| statistics::median(points.clone().filter(|p| p.is_finite()).map(|p| p[axis])).unwrap_or(0.0);
        middle = frame.point_in(DVec3::new(median(0), median(1), median(2)));
    }
    let middle = middle.round();
    if middle.is_finite() { middle } else { DVec3::ZERO }
}
