//! Geometry from OBJ files: the one door to tobj.
//!
//! tobj parses numbers and unites equal corners; [`sanitise`] feeds it only lines that it gets right. Each run of faces
//! becomes a tobj model whose name carries the run's material, so that runs stay short and memory small.

mod sanitise;

use glam::{DVec3, Vec2};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use super::error::SceneError;
use super::model::{ImportedModel, centre};
use super::{Mesh, polygon};
use crate::site::Frame;
use sanitise::Sanitised;

/// Reads an OBJ file, brings it into metres and the program's axes, and centres it.
pub(super) fn read(path: &Path, frame: &Frame) -> Result<ImportedModel, SceneError> {
    let (models, sanitised) = match parse(path, false)? {
        Some(done) => done,
        // tobj keeps colours in step with vertices only if all have one
        None => {
            parse(path, true)?.ok_or_else(|| SceneError::malformed(path, "vertex colours cannot be told".to_owned()))?
        }
    };
    let mut model = ImportedModel {
        origin: centre(models.iter().flat_map(|m| m.mesh.positions.chunks_exact(3)).map(DVec3::from_slice), frame),
        material_names: sanitised.materials,
        libraries: sanitised.libraries,
        oddities: sanitised.oddities,
        ..ImportedModel::default()
    };
    reserve(&mut model.mesh, &models);
    for part in models {
        append(&mut model, frame, part).map_err(|problem| SceneError::malformed(path, problem))?;
    }
    model.settle_colours();
    Ok(model)
}

/// What tobj made of the file, and what the reader before it kept.
type Parsed = (Vec<tobj::Model>, Sanitised<File>);

/// Lets tobj parse the sanitised text; `None` where `colours` is needed and was not asked for.
fn parse(path: &Path, colours: bool) -> Result<Option<Parsed>, SceneError> {
    let file = File::open(path).map_err(|e| SceneError::io(path, &e))?;
    let mut sanitised = Sanitised::new(file, colours);
    let options = tobj::LoadOptions { single_index: true, ..tobj::LoadOptions::default() };
    let no_materials = |_: &Path| Ok((Vec::new(), Default::default()));
    let parsed = tobj::load_obj_buf(&mut BufReader::new(&mut sanitised), &options, no_materials);
    match (parsed, sanitised.fault.take()) {
        (_, Some(sanitise::Fault::NeedsColours)) => Ok(None),
        (_, Some(sanitise::Fault::Io(e))) => Err(SceneError::io(path, &e)),
        (_, Some(sanitise::Fault::NotObj(found))) => {
            let cure = "Export it as glTF (.glb), as PLY, or as OBJ with its MTL file";
            Err(SceneError::NotAModel { path: path.to_owned(), found, cure })
        }
        (_, Some(sanitise::Fault::Line(problem))) => {
            Err(SceneError::Malformed { path: path.to_owned(), line: sanitised.line, problem })
        }
        (Ok((models, _)), None) => Ok(Some((models, sanitised))),
        (Err(error), None) => {
            let problem = explain(&error, &sanitised.statement());
            Err(SceneError::Malformed { path: path.to_owned(), line: sanitised.line, problem })
        }
    }
}

fn explain(error: &tobj::LoadError, statement: &str) -> String {
    let expected = match error {
        tobj::LoadError::PositionParseError => "expected v and three numbers",
        tobj::LoadError::TexcoordParseError => "expected vt and two numbers",
        tobj::LoadError::ColorParseError => "expected v, three numbers and a colour of three numbers",
        _ => return format!("“{statement}” cannot be read ({error})"),
    };
    format!("{expected}, found “{statement}”")
}

fn reserve(mesh: &mut Mesh, parts: &[tobj::Model]) {
    let count = |f: fn(&tobj::Mesh) -> usize| parts.iter().map(|p| f(&p.mesh)).sum::<usize>();
    let vertices = count(|m| m.positions.len() / 3);
    mesh.positions.reserve_exact(vertices);
    if parts.iter().any(|p| !p.mesh.texcoords.is_empty()) {
        mesh.uvs.reserve_exact(vertices);
    }
    if parts.iter().any(|p| !p.mesh.vertex_color.is_empty()) {
        mesh.colours.reserve_exact(vertices);
    }
    let triangles = count(|m| m.indices.len().saturating_sub(2 * m.face_arities.len()).max(m.indices.len() / 3));
    mesh.triangles.reserve_exact(triangles);
    mesh.materials.reserve_exact(triangles);
}

/// Adds one run of faces.
fn append(model: &mut ImportedModel, frame: &Frame, part: tobj::Model) -> Result<(), String> {
    let run = part.mesh;
    // the name is ours: see `sanitise`
    let material = part.name.parse().unwrap_or(0);
    let base = model.add_vertices(run.positions.chunks_exact(3).map(DVec3::from_slice), frame)?;
    let mesh = &mut model.mesh;
    // every corner of a run has texture coordinates, or none has
    if mesh.uvs.capacity() > 0 {
        mesh.uvs.extend(run.texcoords.chunks_exact(2).map(|t| Vec2::new(t[0] as f32, t[1] as f32)));
        mesh.uvs.resize(mesh.positions.len(), Vec2::NAN);
    }
    mesh.colours.extend(run.vertex_color.chunks_exact(3).map(|c| DVec3::from_slice(c).as_vec3()));
    let mut add = |corners: [u32; 3]| {
        mesh.triangles.push(corners.map(|i| base + i));
        mesh.materials.push(material);
    };
    if run.face_arities.is_empty() {
        run.indices.chunks_exact(3).for_each(|t| add([t[0], t[1], t[2]]));
        return Ok(());
    }
    let point = |i: u32| frame.point_in(DVec3::from_slice(&run.positions[3 * i as usize..])) - model.origin;
    let mut indices = &run.indices[..];
    for arity in run.face_arities {
        let (face, rest) = indices.split_at(arity as usize);
        indices = rest;
        if !polygon::triangulate(face, point, &mut add) {
            model.oddities.fans += 1;
        }
    }
    Ok(())
}
