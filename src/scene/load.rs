//! From a site's model files to a scene that rays can be cast at.

use glam::Vec3;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::health::{self, Health};
use super::mtl::{self, Map, MtlMaterial};
use super::{Material, Mesh, Scene, Texture, obj};
use crate::site::Site;
use crate::site::files::find_loosely;

/// Why a model could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file could not be read.
    #[error("{}: {why}. Check the name and your right to read it", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What happened.
        why: String,
    },
    /// A line of the model makes no sense.
    #[error("{}:{line}: {problem}. Export the model again, or correct the line", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What was found and what was expected.
        problem: String,
    },
    /// The file is not a model this program reads.
    #[error("{}: expected a Wavefront OBJ model, found {found}. Export the model as OBJ with its MTL file", path.display())]
    NotObj {
        /// The file.
        path: PathBuf,
        /// What it seems to be.
        found: String,
    },
    /// The model has no triangle that could be used.
    #[error("{}: the model has no usable triangle ({why}). Export its faces", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// What became of what it holds.
        why: String,
    },
    /// A texture is broken or too large.
    #[error("{}: the picture cannot be used: {why}. Save it again as PNG, JPEG or TIFF of at most {} pixels a side", path.display(), super::texture::MAX_SIDE)]
    Texture {
        /// The file.
        path: PathBuf,
        /// What happened.
        why: String,
    },
}

impl SceneError {
    pub(super) fn io(path: &Path, error: &std::io::Error) -> Self {
        Self::Unreadable { path: path.to_owned(), why: error.to_string() }
    }
}

/// Loads a site's model: geometry in local metres, materials, textures, and the ray caster over them. `health` gets
/// what was odd.
///
/// # Errors
///
/// Unreadable, malformed or empty models, and pictures that are broken or too large.
pub fn load(site: &Site, health: &mut Health) -> Result<Scene, SceneError> {
    let model = obj::read(&site.model, &site.frame)?;
    let folder = site.model.parent().unwrap_or(Path::new(""));
    let library = libraries(folder, &model.libraries, health);
    let (materials, maps) = materials(&model.material_names, &library, health);
    let (textures, indices) = textures(folder, &maps, health)?;
    let materials = materials
        .into_iter()
        .zip(&maps)
        .map(|(m, map)| Material { texture: map.as_ref().and_then(|m| indices.get(&m.name).copied()), ..m })
        .collect();
    let mut mesh = Mesh {
        positions: model.positions,
        uvs: model.uvs,
        colours: model.colours,
        triangles: model.triangles,
        materials: model.materials,
    };
    health::clean(&mut mesh, health);
    Ok(Scene::new(mesh, materials, textures, model.origin))
}

/// All materials of all MTL files the model names.
fn libraries(folder: &Path, names: &[String], health: &mut Health) -> BTreeMap<String, MtlMaterial> {
    let mut all = BTreeMap::new();
    for name in names {
        let path = folder.join(name);
        match std::fs::read(&path) {
            Ok(bytes) => {
                for material in mtl::read(&path, &String::from_utf8_lossy(&bytes), &mut health.warnings) {
                    all.insert(material.name.clone(), material);
                }
            }
            Err(e) => health.warnings.push(format!("{}: the material file cannot be read ({e}).", path.display())),
        }
    }
    all
}

fn materials(
    names: &[Option<String>],
    library: &BTreeMap<String, MtlMaterial>,
    health: &mut Health,
) -> (Vec<Material>, Vec<Option<Map>>) {
    let mut materials = Vec::new();
    let mut maps = Vec::new();
    for name in names {
        let found = name.as_ref().and_then(|n| library.get(n));
        if let (Some(name), None) = (name, found) {
            health
                .warnings
                .push(format!("The model uses material “{name}”, which no material file holds: grey 0.5 is taken."));
        }
        let name = name.clone().unwrap_or_default();
        materials.push(Material {
            name,
            albedo: found.map_or(Vec3::splat(mtl::UNKNOWN_ALBEDO), |m| m.albedo),
            texture: None,
            emission: found.map_or(Vec3::ZERO, |m| m.emission),
        });
        maps.push(found.and_then(|m| m.map.clone()));
    }
    (materials, maps)
}

/// Decodes each picture once; the map tells which texture a name became.
fn textures(
    folder: &Path,
    maps: &[Option<Map>],
    health: &mut Health,
) -> Result<(Vec<Texture>, BTreeMap<String, u32>), SceneError> {
    let mut paths: Vec<PathBuf> = Vec::new();
    let mut indices = BTreeMap::new();
    for map in maps.iter().flatten() {
        if indices.contains_key(&map.name) {
            continue;
        }
        let place = format!("{}:{}", map.file.display(), map.line);
        let exact = folder.join(&map.name);
        let path = if exact.is_file() {
            exact
        } else if let Some(near) = find_loosely(folder, &map.name) {
            health.warnings.push(format!(
                "{place}: there is no picture “{}”; “{}” is taken.",
                map.name,
                near.display()
            ));
            near
        } else {
            health.warnings.push(format!("{place}: there is no picture “{}”: the plain colour is taken.", map.name));
            continue;
        };
        let index = paths.iter().position(|p| *p == path).unwrap_or_else(|| {
            paths.push(path);
            paths.len() - 1
        });
        indices.insert(map.name.clone(), index as u32);
    }
    let textures = paths.par_iter().map(|p| Texture::load(p)).collect::<Result<_, _>>()?;
    Ok((textures, indices))
}
