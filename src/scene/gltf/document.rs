//! The document of a glTF file, checked as far as it is used.

use base64::Engine;
use gltf::Document;
use gltf::json::Root;
use gltf::json::validation::{Error as Fault, Validate};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Extensions that a file may not be read without, and that are known here.
pub(super) const KNOWN: [&str; 4] =
    ["KHR_texture_transform", "KHR_materials_unlit", "KHR_materials_emissive_strength", QUANTIZATION];

/// Positions and texture coordinates as whole numbers, which the crate does not know.
const QUANTIZATION: &str = "KHR_mesh_quantization";

/// A checked document.
pub(super) fn document(json: &[u8]) -> Result<Document, String> {
    let root = serde_json::from_slice(json).or_else(|e| forgiving(json).ok_or_else(|| e.to_string()))?;
    let root: Root = root;
    let unknown: Vec<&str> =
        root.extensions_required.iter().map(String::as_str).filter(|e| !KNOWN.contains(e)).collect();
    if !unknown.is_empty() {
        return Err(format!("it cannot be read without {}. Export it without", unknown.join(", ")));
    }
    // the crate looks positions up before it has looked whether they are there
    let mut named = root.meshes.iter().flat_map(|m| &m.primitives).flat_map(|p| p.attributes.values());
    if let Some(wrong) = named.find(|accessor| accessor.value() >= root.accessors.len()) {
        return Err(format!("a mesh names accessor {} of {}", wrong.value(), root.accessors.len()));
    }
    let mut faults = Vec::new();
    root.validate(&root, gltf::json::Path::new, &mut |path, fault| faults.push((path().to_string(), fault)));
    // the extensions are known here if not to the crate; an accessor without a view is all zeros; and a primitive may have
    // no positions, a texture no picture
    let optional = |path: &str| {
        path.starts_with("accessors[") && path.ends_with("].bufferView")
            || path.starts_with("meshes[") && path.ends_with("attributes[\"POSITION\"]")
            || path.starts_with("textures[") && path.ends_with("].source")
    };
    faults.retain(|(path, fault)| match fault {
        Fault::Unsupported => !path.starts_with("extensionsRequired"),
        Fault::Missing => !optional(path),
        _ => true,
    });
    if faults.is_empty() {
        return Ok(Document::from_json_without_validation(root));
    }
    let said = faults.iter().take(3).map(|(path, fault)| format!("{path}: {fault}")).collect::<Vec<_>>().join("; ");
    Err(format!("it is no valid glTF ({said})"))
}

/// A document that the crate is too strict for: whole numbers may be written as 1.0, and animations, of no use here, need
/// not name a node.
fn forgiving(json: &[u8]) -> Option<Root> {
    fn whole(value: &mut Value) {
        match value {
            Value::Array(list) => list.iter_mut().for_each(whole),
            Value::Object(map) => map.values_mut().for_each(whole),
            Value::Number(n) => {
                // up to here floats tell whole numbers apart
                let number = n.as_f64().filter(|v| n.is_f64() && v.fract() == 0.0 && v.abs() < 9e15);
                if let Some(v) = number {
                    *value = (v as i64).into();
                }
            }
            _ => {}
        }
    }
    let mut value: Value = serde_json::from_slice(json).ok()?;
    value.as_object_mut()?.remove("animations");
    whole(&mut value);
    serde_json::from_value(value).ok()
}

/// A file with its buffers.
pub(super) struct File<'a> {
    pub(super) path: &'a Path,
    pub(super) document: Document,
    pub(super) buffers: Vec<Vec<u8>>,
    pub(super) files: Vec<PathBuf>,
}

/// The bytes of an address that holds them (RFC 2397).
pub(super) fn embedded(uri: &str) -> Result<Vec<u8>, String> {
    let (_, text) = uri.split_once(";base64,").ok_or("an address “data:” that is not base64")?;
    base64::engine::general_purpose::STANDARD.decode(text).map_err(|e| format!("broken base64 ({e})"))
}

/// An address's `%20` and the like as the characters they stand for.
pub(super) fn unescaped(uri: &str) -> String {
    percent_encoding::percent_decode_str(uri).decode_utf8_lossy().into_owned()
}
