//! A baked model as PLY, for MeshLab and CloudCompare.

use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::PI;
use std::io::Write;
use std::path::Path;

use super::{BakeError, Baked, Vertex};
use crate::atomic_write::write_atomically;
use crate::scene::Scene;
use crate::site::Frame;

/// Writes one lighting of a baked model as binary little-endian PLY in the model's own axes and units. Vertices have the
/// colour that they are seen in at the bake's exposure, their irradiance (`e_red`, `e_green`, `e_blue`), `probes` (how many
/// see it; 0: none does), `source` (as in `render --layers`) and `agreement`.
///
/// # Errors
///
/// The file system's refusal.
pub fn write_ply(
    path: &Path,
    scene: &Scene,
    frame: &Frame,
    baked: &Baked,
    lighting: usize,
    command: &str,
) -> Result<(), BakeError> {
    let io = |source| BakeError::Io { path: path.to_owned(), source };
    let place = |p: Vec3| frame.point_out(p.as_dvec3() + scene.origin).to_array();
    let farthest = baked.vertices.iter().flat_map(|v| place(v.position)).fold(0.0, |far: f64, v| far.max(v.abs()));
    // where single precision would show
    let double = farthest > 1000.0;
    let kind = if double { "double" } else { "float" };
    let mut material_of = vec![None; baked.vertices.len()];
    for (m, ends) in baked.materials.windows(2).enumerate() {
        let triangles = &baked.triangles[ends[0] as usize..ends[1] as usize];
        triangles.iter().flatten().for_each(|v| material_of[*v as usize] = Some(m));
    }
    let albedo = |(v, material): (&Vertex, &Option<usize>)| {
        let Some(material) = *material else { return Vec3::ZERO };
        let (plain, texture) = scene.materials[material].with_white_lamps();
        // averaged over a few texels: a vertex stands for what is around it
        let texel = texture.map_or(Vec3::ONE, |t| scene.textures[t as usize].sample(v.uv, 2.0));
        plain * texel * v.colour
    };
    let albedo: Vec<Vec3> = baked.vertices.par_iter().zip(&material_of).map(albedo).collect();
    write_atomically(path, io, |file| {
        let head = format!(
            "ply\nformat binary_little_endian 1.0\ncomment {}\ncomment probes: how many see a vertex, 0: none does; source: \
             1 records, 2 volume, 3 neighbours\nelement vertex {}\nproperty {kind} x\nproperty {kind} y\nproperty {kind} \
             z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float e_red\nproperty float \
             e_green\nproperty float e_blue\nproperty uchar probes\nproperty uchar source\nproperty float \
             agreement\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            command.replace(['\n', '\r'], " "),
            baked.vertices.len(),
            baked.triangles.len()
        );
        let mut bytes = head.into_bytes();
        let exposure = baked.exposures[lighting];
        for ((v, e), albedo) in baked.vertices.iter().zip(&baked.irradiance[lighting]).zip(&albedo) {
            for x in place(v.position) {
                if double { bytes.extend(x.to_le_bytes()) } else { bytes.extend((x as f32).to_le_bytes()) }
            }
            bytes.extend((exposure.show(*albedo * *e / PI) * 255.0 + 0.5).to_array().map(|c| c as u8));
            e.to_array().iter().for_each(|c| bytes.extend(c.to_le_bytes()));
            bytes.extend([v.seen_by, v.source as u8]);
            bytes.extend(v.agreement.to_le_bytes());
            if bytes.len() > 1 << 20 {
                file.write_all(&bytes).map_err(io)?;
                bytes.clear();
            }
        }
        for t in &baked.triangles {
            bytes.push(3);
            t.iter().for_each(|v| bytes.extend((*v as i32).to_le_bytes()));
        }
        file.write_all(&bytes).map_err(io)
    })
}
