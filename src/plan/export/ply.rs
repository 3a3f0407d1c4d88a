//! The model's surface coloured by how it is seen, as a PLY file that MeshLab and CloudCompare open.

use glam::Vec3;
use std::collections::HashMap;
use std::io::{self, Write};

use super::tables::Outward;
use crate::plan::stations::result::SurfacePlan;

/// What a colour means: the same as on the sheets.
const OUTSIDE: [u8; 3] = [200, 200, 200];
const UNREACHABLE: [u8; 3] = [0, 0, 0];
const UNSEEN: [u8; 3] = [213, 94, 0];
const SEEN: [[u8; 3]; 3] = [[240, 228, 66], [86, 180, 233], [0, 114, 178]];

/// A vertex: its place, by its bits in the model's axes and units, and its colour.
type Vertex = ([u64; 3], [u8; 3]);

struct Face {
    corners: [u32; 3],
    stations: u8,
    /// Degrees; −1 where it is not seen.
    incidence: f32,
}

/// Writes `coverage.ply` (binary, little-endian): the model's surface in pieces, in the model's axes and units. Vertices
/// are coloured by the number of stations that see their piece (vermilion none, yellow 1, sky blue 2, blue 3 and more;
/// black what no allowed place sees; grey what does not face the rooms); pieces of one colour share theirs. Faces have
/// `stations`, the same number as `quality`, and `incidence`, the best angle of incidence in degrees (−1: not seen).
/// Triangles that no station sees any of, and that are of one colour, stay whole. Coordinates are single precision,
/// unless the model lies so far from its origin that this would show (beyond 1000 units).
///
/// # Errors
///
/// If writing fails.
pub fn write(plan: &SurfacePlan<'_>, out: &Outward, file: &mut impl Write) -> io::Result<()> {
    let (vertices, faces) = mesh(plan, out);
    let farthest = vertices.iter().flat_map(|v| v.0).map(|v| f64::from_bits(v).abs()).fold(0.0, f64::max);
    let double = farthest > 1000.0;
    let kind = if double { "double" } else { "float" };
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\ncomment stations: how many stations see a face; incidence: degrees, -1 \
         unseen\ncomment grey outside, black unreachable, vermilion unseen, yellow 1, sky blue 2, blue 3 or \
         more\nelement vertex {}\nproperty {kind} x\nproperty {kind} y\nproperty {kind} z\nproperty uchar \
         red\nproperty uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int \
         vertex_indices\nproperty uchar stations\nproperty float incidence\nproperty float quality\nend_header\n",
        vertices.len(),
        faces.len()
    )?;
    for (place, colour) in &vertices {
        for v in place.map(f64::from_bits) {
            if double { file.write_all(&v.to_le_bytes()) } else { file.write_all(&(v as f32).to_le_bytes()) }?;
        }
        file.write_all(colour)?;
    }
    for face in &faces {
        file.write_all(&[3])?;
        face.corners.iter().try_for_each(|c| file.write_all(&(*c as i32).to_le_bytes()))?;
        file.write_all(&[face.stations])?;
        file.write_all(&face.incidence.to_le_bytes())?;
        file.write_all(&f32::from(face.stations).to_le_bytes())?;
    }
    Ok(())
}

fn mesh(plan: &SurfacePlan<'_>, out: &Outward) -> (Vec<Vertex>, Vec<Face>) {
    let SurfacePlan { surface, seen, .. } = plan;
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    let mut numbers: HashMap<Vertex, u32> = HashMap::new();
    let mut add = |corners: [Vec3; 3], patch: usize| {
        let colour = colour(plan, patch);
        let corners = corners.map(|corner| {
            let p = out.frame.point_out(corner.as_dvec3() + out.origin);
            // no two zeros
            let vertex = (p.to_array().map(|v| (v + 0.0).to_bits()), colour);
            *numbers.entry(vertex).or_insert_with(|| {
                vertices.push(vertex);
                vertices.len() as u32 - 1
            })
        });
        let stations = seen.stations[patch];
        let angle = || seen.cosine[patch].clamp(0.0, 1.0).acos().to_degrees();
        faces.push(Face { corners, stations, incidence: if stations == 0 { -1.0 } else { angle() } });
    };
    for triangle in 0..surface.scene.mesh.triangles.len() as u32 {
        let patches = surface.patches.of(triangle);
        let alike = |p: usize| seen.stations[p] == 0 && colour(plan, p) == colour(plan, patches.start);
        if patches.clone().all(alike) {
            add(surface.scene.mesh.corners(triangle), patches.start);
        } else {
            patches.for_each(|p| add(surface.patches.corners(&surface.scene.mesh, p), p));
        }
    }
    (vertices, faces)
}

fn colour(plan: &SurfacePlan<'_>, patch: usize) -> [u8; 3] {
    match (plan.interior[patch], plan.reachable[patch], plan.seen.stations[patch]) {
        (false, false, _) => OUTSIDE,
        (_, false, _) => UNREACHABLE,
        (_, _, 0) => UNSEEN,
        (_, _, n) => SEEN[usize::from(n).min(3) - 1],
    }
}
