//! From a site's model files to a scene that rays can be cast at.

use glam::{DVec3, Vec3};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::error::SceneError;
use super::health::{self, Health};
use super::model::{ImportedModel, Map, ModelMaterial, UNKNOWN_ALBEDO};
use super::pictures::{self, Decoded, Spared};
use super::texture::cutout::{self, Mask};
use super::{Material, Mesh, Scene, Tracer, e57, gltf, mtl, obj, ply, text};
use crate::panorama::srgb_to_linear;
use crate::site::files::{find_loosely, foreign_model};
use crate::site::{Frame, Site, Up, VertexColours};

/// Loads a site's model: geometry in local metres, materials, textures, and the ray caster over them. `health` gets
/// what was odd. Colours of vertices are decoded as the site has them.
///
/// # Errors
///
/// Unreadable, malformed or empty models, and pictures that are damaged or too large. Missing materials and pictures
/// are warnings.
pub fn load(site: &Site, health: &mut Health) -> Result<Scene, SceneError> {
    load_without(site, health, |_, _| None).map(|(scene, _)| scene)
}

/// [`load`], without what nobody can see: `marks` is given the clean mesh and its origin, and marks triangles to leave
/// out of the ray caster, with the pictures that only they have. `None` where nothing was left out.
///
/// # Errors
///
/// As [`load`].
pub fn load_without(
    site: &Site,
    health: &mut Health,
    marks: impl FnOnce(&Mesh, DVec3) -> Option<Vec<bool>>,
) -> Result<(Scene, Option<Spared>), SceneError> {
    let mut model = read(&site.model, &site.frame)?;
    health.files.append(&mut model.files);
    if site.vertex_colours == VertexColours::Srgb {
        model.mesh.colours.iter_mut().for_each(|c| *c = c.map(srgb_to_linear));
    }
    warn_of_oddities(&model, health);
    let folder = site.model.parent().unwrap_or(Path::new(""));
    let library = library(&site.model, folder, &model, health);
    let used = used(&model.mesh.materials, model.material_names.len());
    let (mut materials, maps) = materials(&model, &used, &library, health);
    let mut mesh = model.mesh;
    if !matches!(ModelFormat::of(&site.model), Some(ModelFormat::Gltf | ModelFormat::E57)) {
        warn_of_paint_twice(&mesh, &materials, &maps, health);
    }
    let told = std::mem::take(&mut health.warnings);
    health::clean(&mut mesh, health);
    cut_out(&mut mesh, &model.material_names, &used, &library, folder, health);
    // what cleaning says comes after what is said of pictures
    let of_cleaning = std::mem::replace(&mut health.warnings, told);
    let keep: Option<Vec<bool>> =
        marks(&mesh, model.origin).filter(|m| m.contains(&true)).map(|m| m.iter().map(|m| !m).collect());
    let reached = match &keep {
        Some(keep) => {
            let kept = mesh.materials.iter().zip(keep).filter(|(_, kept)| **kept).map(|(m, _)| m);
            self::used(kept, materials.len())
        }
        None => vec![true; materials.len()],
    };
    let Decoded { textures, indices, spared } = pictures::decoded(folder, &maps, &reached, health)?;
    for ((material, map), texture) in materials.iter_mut().zip(&maps).zip(indices) {
        material.texture = texture;
        if let (Some(map), None) = (map, texture) {
            material.albedo = map.plain_albedo;
        }
    }
    health.warnings.extend(of_cleaning);
    if mesh.triangles.is_empty() {
        let why = format!(
            "{} vertices, {} triangles, {} of them without area, {} not finite",
            model.oddities.vertices, health.triangles_read, health.zero_area, health.not_finite
        );
        return Err(SceneError::Empty { path: site.model.clone(), why });
    }
    health::settle_uvs(&mut mesh, &mut materials, &textures, health);
    let start = Instant::now();
    let tracer = keep.as_ref().map_or_else(|| Tracer::new(&mesh), |keep| Tracer::over(&mesh, keep));
    let build_s = start.elapsed().as_secs_f64();
    let spared = keep.map(|keep| {
        let kept = keep.iter().filter(|k| **k).count();
        let triangles = keep.len() - kept;
        let ratio = triangles as f64 / kept.max(1) as f64;
        let bytes = spared.bytes + (ratio * tracer.bytes() as f64) as u64;
        Spared { triangles, seconds: spared.seconds + ratio * build_s, bytes, ..spared }
    });
    let scene = Scene { mesh, materials, textures, origin: model.origin, tracer };
    health::measure(&scene, &site.frame, health);
    Ok((scene, spared))
}

/// The clean triangles of a model file in its own axes and units, less the point that is given with them.
///
/// # Errors
///
/// As [`load`].
pub fn mesh_of(path: &Path) -> Result<(Mesh, DVec3), SceneError> {
    let own = Frame { metres_per_unit: 1.0, up: Up::Z, north_deg: 0.0 };
    let ImportedModel { origin, mut mesh, .. } = read(path, &own)?;
    let mut health = Health::default();
    health::clean(&mut mesh, &mut health);
    if mesh.triangles.is_empty() {
        return Err(SceneError::Empty { path: path.to_owned(), why: format!("{} triangles", health.triangles_read) });
    }
    Ok((mesh, origin))
}

/// The formats of models that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelFormat {
    /// Wavefront OBJ.
    Obj,
    /// PLY, ASCII or binary.
    Ply,
    /// glTF 2.0, text or binary.
    Gltf,
    /// Laser scans, ASTM E57.
    E57,
}

impl ModelFormat {
    /// A file's format by its first bytes, else by its name; `None` where neither tells, as of any text.
    pub fn of(path: &Path) -> Option<Self> {
        let mut head = [0; 4];
        let begun = std::fs::File::open(path).and_then(|mut file| file.read(&mut head)).unwrap_or(0);
        let ending = path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_ascii_lowercase());
        match (&head[..begun], ending.as_str()) {
            ([b'p', b'l', b'y', b'\n' | b'\r'], _) => Some(Self::Ply),
            (b"ASTM", _) | (_, "e57") => Some(Self::E57),
            (b"glTF", _) | (_, "gltf" | "glb") => Some(Self::Gltf),
            (_, "obj") => Some(Self::Obj),
            _ => None,
        }
    }
}

/// Reads a model file, whatever its format.
fn read(path: &Path, frame: &Frame) -> Result<ImportedModel, SceneError> {
    match ModelFormat::of(path) {
        Some(ModelFormat::Ply) => ply::read(path, frame),
        Some(ModelFormat::Gltf) => gltf::read(path, frame),
        Some(ModelFormat::E57) => e57::read(path, frame),
        Some(ModelFormat::Obj) => obj::read(path, frame),
        None => match foreign_model(path) {
            Some((what, cure)) => Err(SceneError::NotAModel { path: path.to_owned(), found: what.to_owned(), cure }),
            None => obj::read(path, frame),
        },
    }
}

fn warn_of_oddities(model: &ImportedModel, health: &mut Health) {
    let o = &model.oddities;
    health.warnings.extend(o.others.iter().cloned());
    let mut warn = |count: u64, what: &str| {
        if count > 0 {
            health.warnings.push(format!("{what}: {count}."));
        }
    };
    warn(o.points_and_lines, "Point and line elements ignored, as only faces have a surface");
    warn(o.short_faces, "Faces with fewer than three corners ignored");
    warn(o.free_form, "Free-form curves and surfaces ignored (export them as polygons)");
    warn(o.fans, "Faces that cross themselves, or with corners on a line or very many, cut only roughly");
    if o.coloured > 0 && o.coloured < o.vertices {
        warn(o.vertices - o.coloured, "Vertices without a colour, taken as white, while others have one");
    }
    if o.byte_colours {
        health.warnings.push("Vertex colours are above 2: they are taken as 0 to 255.".to_owned());
    }
}

/// Tells of materials that have a picture and, at their corners, colours: glTF says what both give, other formats do not.
fn warn_of_paint_twice(mesh: &Mesh, materials: &[Material], maps: &[Option<Map>], health: &mut Health) {
    let coloured =
        |triangle: &[u32; 3]| triangle.iter().any(|i| mesh.colours.get(*i as usize).is_some_and(|c| *c != Vec3::ONE));
    let mut both = vec![false; materials.len()];
    for (triangle, &material) in mesh.triangles.iter().zip(&mesh.materials) {
        let material = material as usize;
        if maps.get(material).is_some_and(Option::is_some) && !both[material] && coloured(triangle) {
            both[material] = true;
        }
    }
    let mut names = materials.iter().zip(&both).filter(|(_, both)| **both).map(|(m, _)| m.name.as_str());
    let Some(first) = names.next() else { return };
    let others = match names.count() {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    health.warnings.push(format!(
        "Vertex colours are multiplied with pictures, on material “{first}”{others}. If both show the same paint, \
         surfaces are too dark: export the model with one of them."
    ));
}

/// All materials of all MTL files the model names, by name.
fn library(
    model_file: &Path,
    folder: &Path,
    model: &ImportedModel,
    health: &mut Health,
) -> BTreeMap<String, ModelMaterial> {
    let mut all: BTreeMap<_, _> = model.own.iter().map(|m| (m.name.clone(), m.clone())).collect();
    for path in library_files(model_file, folder, model, health) {
        match std::fs::read(&path) {
            Ok(bytes) => {
                health.files.push(path.clone());
                for material in mtl::read(&path, &text::lines(&bytes), &mut health.warnings) {
                    let name = material.name.clone();
                    if all.insert(name.clone(), material).is_some() {
                        health
                            .warnings
                            .push(format!("{}: material “{name}” comes twice: the last counts.", path.display()));
                    }
                }
            }
            Err(e) => health.warnings.push(format!("{}: the material file cannot be read ({e}).", path.display())),
        }
    }
    all
}

/// The MTL files that exist, in order, each once.
fn library_files(model_file: &Path, folder: &Path, model: &ImportedModel, health: &mut Health) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for names in &model.libraries {
        let (found, missing) = split_names(folder, names, &mut health.warnings);
        for name in missing {
            health.warnings.push(format!("There is no material file “{}”.", folder.join(name).display()));
        }
        files.extend(found);
    }
    if model.libraries.is_empty() && model.own.is_empty() && model.material_names.len() > 1 {
        let beside = model_file.with_extension("mtl");
        if beside.is_file() {
            health.warnings.push(format!("The model names no material file: “{}” is taken.", beside.display()));
            files.push(beside);
        }
    }
    let mut known = BTreeSet::new();
    files.retain(|file| known.insert(file.clone()));
    files
}

/// The files in a list of names that are separated by blanks and may hold blanks themselves: at each place the longest
/// name that exists, quotes taken off; else a path's last name. Second, what is missing; the whole text where nothing exists.
fn split_names(folder: &Path, names: &str, warnings: &mut Vec<String>) -> (Vec<PathBuf>, Vec<String>) {
    let unescaped = names.replace("\\ ", " ");
    let words: Vec<&str> = unescaped.split_whitespace().collect();
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    let mut from = 0;
    while from < words.len() {
        // a name of more than a few words is a mistake, and trying all would be slow
        let longest = words.len().min(from + 16);
        let name = |to: usize| words[from..to].join(" ").trim_matches('"').to_owned();
        let hit = (from + 1..=longest).rev().find_map(|to| Some((to, find_loosely(folder, &name(to))?)));
        // another machine's path; the shortest, lest it swallow the next
        let elsewhere = || {
            (from + 1..=longest).find_map(|to| {
                let name = name(to);
                let (_, last) = name.rsplit_once(['/', '\\']).filter(|(_, last)| !last.is_empty())?;
                Some((to, find_loosely(folder, last)?, name.clone()))
            })
        };
        let hit = hit.or_else(|| {
            let (to, path, name) = elsewhere()?;
            warnings.push(format!("There is no material file “{name}”: “{}” is taken.", path.display()));
            Some((to, path))
        });
        match hit {
            Some((to, path)) => {
                found.push(path);
                from = to;
            }
            None => {
                missing.push(words[from].to_owned());
                from += 1;
            }
        }
    }
    if found.is_empty() { (found, vec![names.to_owned()]) } else { (found, missing) }
}

/// Which of `count` materials any triangle has.
fn used<'a>(materials: impl IntoIterator<Item = &'a u32>, count: usize) -> Vec<bool> {
    let mut used = vec![false; count];
    materials.into_iter().for_each(|m| used[*m as usize] = true);
    used
}

/// Cuts what pictures hide by their alpha out of the mesh.
fn cut_out(
    mesh: &mut Mesh,
    names: &[Option<String>],
    used: &[bool],
    library: &BTreeMap<String, ModelMaterial>,
    folder: &Path,
    health: &mut Health,
) {
    let mask = |(name, used): (&Option<String>, &bool)| {
        let material = library.get(name.as_ref()?).filter(|_| *used)?;
        let cutout = material.cutout.as_ref()?;
        let picture = match &cutout.map {
            Some(own) => pictures::alone(folder, own, health)?,
            // what is odd about the picture that paints is told when that is loaded
            None => pictures::alone(folder, material.map.as_ref()?, &mut Health::default())?,
        };
        Some(Mask::of(&picture, cutout))
    };
    let masks: Vec<Option<Mask>> = names.iter().zip(used).map(mask).collect();
    if masks.iter().any(Option::is_some) {
        let (before, touched) = (mesh.triangles.len(), cutout::cut(mesh, &masks));
        health.warnings.push(format!(
            "Cut-out pictures: {touched} triangles cut by their alpha, {before} before and {} after.",
            mesh.triangles.len()
        ));
    }
}

/// The materials in the model's order; and which picture each wants.
fn materials(
    model: &ImportedModel,
    used: &[bool],
    library: &BTreeMap<String, ModelMaterial>,
    health: &mut Health,
) -> (Vec<Material>, Vec<Option<Map>>) {
    // what has colours of its own and no material is as bright as they say
    let nameless = if model.mesh.colours.is_empty() { Vec3::splat(UNKNOWN_ALBEDO) } else { Vec3::ONE };
    let one = |(name, used): (&Option<String>, &bool)| {
        let unknown = if name.is_some() { Vec3::splat(UNKNOWN_ALBEDO) } else { nameless };
        let found = name.as_ref().and_then(|n| library.get(n));
        if let (Some(name), None, true) = (name, found, used) {
            health.warnings.push(format!("No material file holds material “{name}”: grey 0.5 is taken."));
        }
        let material = Material {
            name: name.clone().unwrap_or_default(),
            albedo: found.map_or(unknown, |m| m.albedo),
            texture: None,
            emission: found.map_or(Vec3::ZERO, |m| m.emission),
        };
        (material, found.filter(|_| *used).and_then(|m| m.map.clone()))
    };
    model.material_names.iter().zip(used).map(one).unzip()
}
