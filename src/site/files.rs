//! Finding the files that a site or a material names.

use std::fs;
use std::path::{Component, Path, PathBuf};

/// The endings of pictures that are read here.
pub(crate) const PICTURES: [&str; 7] = ["exr", "hdr", "png", "jpg", "jpeg", "tif", "tiff"];

/// Whether a file is a picture that is read here, by its name.
pub(crate) fn is_picture(path: &Path) -> bool {
    path.extension().is_some_and(|e| PICTURES.iter().any(|p| e.eq_ignore_ascii_case(p)))
}

/// Whether a character cannot stand in a file's name on some system.
pub(crate) fn is_unfit_in_names(c: char) -> bool {
    c.is_control() || "/\\:*?\"<>|".contains(c)
}

/// Text as a file's name, without ending, that any system takes; perhaps empty.
pub(crate) fn as_file_name(text: &str) -> String {
    let name: String = text.chars().map(|c| if is_unfit_in_names(c) { '_' } else { c }).collect();
    name.trim_matches([' ', '.']).to_owned()
}

/// Whether a path is really a URL.
pub(crate) fn is_url(text: &str) -> bool {
    let scheme = text.split_once("://").map(|(scheme, _)| scheme);
    scheme.is_some_and(|s| !s.is_empty() && s.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c)))
        || text.starts_with("data:")
        || text.starts_with("file:")
}

/// The file that a path from another machine means, such as `C:\\work\\site\\probes\\a.exr`: its last parts, as many as are there.
pub(crate) fn find_by_end(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    let parts: Vec<&str> = name.split('/').filter(|part| !matches!(*part, "" | "." | "..")).collect();
    (1..parts.len()).find_map(|from| find_loosely(folder, &parts[from..].join("/")))
}

/// What a file is by its name, where it is a model that is not read here, and how to make one of it that is.
pub(crate) fn foreign_model(path: &Path) -> Option<(&'static str, &'static str)> {
    const BY_BLENDER: &str = "Import it into Blender and export it from there with File, Export, glTF 2.0 (.glb)";
    const POINTS: &str = "Points have no surface: in CloudCompare or MeshLab make a mesh of them (Poisson reconstruction) and \
                          save that as PLY; or give the scanner's structured E57";
    let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
    let known = match ending.as_str() {
        "fbx" => ("an FBX scene", BY_BLENDER),
        "usd" | "usda" | "usdc" | "usdz" => ("a USD scene", BY_BLENDER),
        "dae" => ("a COLLADA scene", "Open it in MeshLab and save it as PLY or as OBJ"),
        "stl" => ("an STL mesh, which has no colours", "Open it in MeshLab or Blender and save it as PLY"),
        "las" | "laz" => ("a LAS point cloud", POINTS),
        "xyz" | "pts" | "ptx" | "asc" | "pcd" => ("a point cloud", POINTS),
        "3dm" => ("a Rhino model", "In Rhino: File, Export Selected, as glTF (.glb) or as OBJ with polygon mesh"),
        "skp" => ("a SketchUp model", "In SketchUp: File, Export, 3D Model, as glTF (.glb) or OBJ"),
        "blend" => ("a Blender file", "In Blender: File, Export, glTF 2.0 (.glb)"),
        "ma" | "mb" => ("a Maya scene", "In Maya: File, Export All, as OBJ with materials (plug-in objExport)"),
        "max" => ("a 3ds Max scene", "In 3ds Max: File, Export, as glTF (.glb) or OBJ"),
        "ifc" | "rvt" | "dwg" | "dxf" => ("a drawing or building model", BY_BLENDER),
        _ => return None,
    };
    Some(known)
}

/// Whether a file is a model that is read here, by its name.
pub(crate) fn is_model(path: &Path) -> bool {
    path.extension().is_some_and(|e| ["obj", "ply", "gltf", "glb", "e57"].iter().any(|m| e.eq_ignore_ascii_case(m)))
}

/// The file that `name` means in a folder where the name as written finds nothing: the same with `/` for `\`, and
/// any letter case.
pub(crate) fn find_loosely(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    let mut found = folder.to_owned();
    for part in Path::new(&name).components() {
        let next = found.join(part);
        found = match part {
            Component::Normal(wanted) if !next.exists() => {
                let wanted = wanted.to_string_lossy().to_lowercase();
                let mut names: Vec<_> = fs::read_dir(&found).ok()?.filter_map(|e| Some(e.ok()?.file_name())).collect();
                names.sort();
                found.join(names.into_iter().find(|n| n.to_string_lossy().to_lowercase() == wanted)?)
            }
            _ => next,
        };
    }
    found.is_file().then_some(found)
}
