//! Geometry from OBJ files: the one door to tobj.

use glam::{DVec3, Vec2, Vec3};
use std::collections::BTreeMap;
use std::io::BufReader;
use std::path::Path;

use super::load::SceneError;
use crate::site::Frame;

/// An OBJ file's triangles, not yet cleaned.
pub(super) struct Model {
    pub(super) origin: DVec3,
    pub(super) positions: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) colours: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) materials: Vec<u32>,
    pub(super) material_names: Vec<Option<String>>,
    pub(super) libraries: Vec<String>,
}

pub(super) fn read(path: &Path, frame: &Frame) -> Result<Model, SceneError> {
    let file = std::fs::File::open(path).map_err(|e| SceneError::io(path, &e))?;
    let libraries = std::cell::RefCell::new(Vec::new());
    let mut names: BTreeMap<String, usize> = BTreeMap::new();
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ignore_points: true, ignore_lines: true };
    let text = std::fs::read_to_string(path).map_err(|e| SceneError::io(path, &e))?;
    let mut material_names: Vec<Option<String>> = vec![None];
    for line in text.lines() {
        if let Some(name) = line.trim().strip_prefix("usemtl ") {
            names.entry(name.trim().to_owned()).or_insert_with(|| {
                material_names.push(Some(name.trim().to_owned()));
                material_names.len() - 1
            });
        }
    }
    let (models, _) = tobj::load_obj_buf(&mut BufReader::new(file), &options, |p| {
        libraries.borrow_mut().push(p.to_string_lossy().into_owned());
        let list = material_names.iter().flatten().map(|n| tobj::Material { name: n.clone(), ..Default::default() });
        let list: Vec<_> = list.collect();
        let map = list.iter().enumerate().map(|(i, m)| (m.name.clone(), i)).collect();
        Ok((list, map))
    })
    .map_err(|e| SceneError::Malformed { path: path.to_owned(), line: 0, problem: e.to_string() })?;
    let mut model = Model {
        origin: DVec3::ZERO,
        positions: vec![],
        uvs: vec![],
        colours: vec![],
        triangles: vec![],
        materials: vec![],
        material_names,
        libraries: libraries.into_inner(),
    };
    for m in models {
        let base = model.positions.len() as u32;
        for p in m.mesh.positions.chunks_exact(3) {
            model.positions.push(frame.point_in(DVec3::new(p[0], p[1], p[2])).as_vec3());
        }
        if m.mesh.texcoords.is_empty() {
            model.uvs.resize(model.positions.len(), Vec2::ZERO);
        }
        model.uvs.extend(m.mesh.texcoords.chunks_exact(2).map(|t| Vec2::new(t[0] as f32, t[1] as f32)));
        for t in m.mesh.indices.chunks_exact(3) {
            model.triangles.push([t[0] + base, t[1] + base, t[2] + base]);
            model.materials.push(m.mesh.material_id.map_or(0, |i| i as u32 + 1));
        }
    }
    Ok(model)
}
