//! What a model's file says of its own frame.

use glam::DVec3;
use std::io::Read;
use std::path::Path;

use super::guess::Hints;
use crate::scene::{Mesh, ModelFormat};
use crate::site::metres_in;

/// What the format and the head of a model's file tell.
pub(super) fn of_file(path: &Path, mesh: &Mesh) -> Hints {
    /// By how much to believe a format's rule, and a habit, in natural logarithms.
    const RULE: f64 = 4.0;
    const HABIT: f64 = 0.7;
    let (axis, metres_per_unit) = match ModelFormat::of(path) {
        Some(ModelFormat::Gltf) => ((DVec3::Y, RULE), Some((1.0, "glTF is in metres"))),
        Some(ModelFormat::E57) => ((DVec3::Z, RULE), Some((1.0, "E57 is in metres"))),
        Some(ModelFormat::Ply) => ((DVec3::Z, HABIT), None),
        Some(ModelFormat::Obj) | None => ((if is_scan(mesh) { DVec3::Z } else { DVec3::Y }, HABIT), obj_unit(path)),
    };
    Hints { axis, metres_per_unit, eyes: Vec::new(), ups: Vec::new() }
}

/// Whether a mesh looks fused from a scan: one material, coloured or bare, of many triangles.
fn is_scan(mesh: &Mesh) -> bool {
    const MANY: usize = 20_000;
    mesh.triangles.len() > MANY && mesh.materials.windows(2).all(|w| w[0] == w[1])
}

/// The unit that an exporter wrote into an OBJ file's first comments, as 3ds Max does: `# File units = centimeters`.
fn obj_unit(path: &Path) -> Option<(f64, &'static str)> {
    let mut head = Vec::new();
    std::fs::File::open(path).ok()?.take(4096).read_to_end(&mut head).ok()?;
    let head = String::from_utf8_lossy(&head).to_lowercase();
    let comments = head.lines().filter_map(|l| l.trim().strip_prefix('#'));
    let unit =
        comments.filter_map(|c| Some(c.split_once("units")?.1.trim_matches([' ', '=', ':', '.', '\t']))).next()?;
    Some((metres_in(unit)?, "the file's first lines say so"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exporters_comment_tells_the_unit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        let unit = |text: &str| {
            std::fs::write(&path, text).unwrap();
            obj_unit(&path).map(|u| u.0)
        };
        assert_eq!(unit("# 3ds Max Wavefront OBJ Exporter\n# File units = centimeters\nv 0 0 0\n"), Some(0.01));
        assert_eq!(unit("# units: inch\n"), Some(0.0254));
        assert_eq!([unit("v 0 0 0\n"), unit("# units = parsecs\n")], [None; 2]);
    }
}
