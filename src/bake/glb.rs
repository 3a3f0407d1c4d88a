//! A baked model as binary glTF (Khronos Group, *glTF 2.0 Specification*): textures as base colour, light as vertex colour,
//! drawn without shading (`KHR_materials_unlit`).

use glam::Vec3;
use serde_json::{Map, Value, json};
use std::f32::consts::PI;
use std::io::Write;
use std::path::Path;

use super::{BakeError, Baked};
use crate::atomic_write::write_atomically;
use crate::scene::{Scene, Wrap};

/// A place farther from the site's origin than this, metres, would shake in a viewer's single precision: the file then stays
/// local and its extras say where it lies.
const FAR_M: f64 = 1e4;

const FLOAT: u32 = 5126;
const SHORT: u32 = 5123;
const INDEX: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// The binary chunk and the parts of the document that name it.
#[derive(Default)]
struct Chunk {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Chunk {
    /// Adds bytes as a view; gives its index.
    fn view(&mut self, bytes: impl IntoIterator<Item = u8>, target: Option<u32>) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        let mut view = json!({"buffer": 0, "byteOffset": offset, "byteLength": self.bytes.len() - offset});
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.views.push(view);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.len() - 1
    }

    /// Adds what reads a view; gives its index.
    fn accessor(&mut self, view: usize, kind: &str, component: u32, count: usize) -> usize {
        self.accessors.push(json!({"bufferView": view, "componentType": component, "count": count, "type": kind}));
        self.accessors.len() - 1
    }

    /// Adds values of so many numbers; gives the accessor's index.
    fn floats<const N: usize>(&mut self, kind: &str, values: impl ExactSizeIterator<Item = [f32; N]>) -> usize {
        let count = values.len();
        let view = self.view(values.flatten().flat_map(f32::to_le_bytes), Some(VERTICES));
        self.accessor(view, kind, FLOAT, count)
    }
}

/// glTF has y up: a local point or a direction there.
fn y_up(p: Vec3) -> [f32; 3] {
    [p.x, p.z, -p.y + 0.0]
}

/// A colour as 16-bit codes, opaque: the format wants 0..=1 and four bytes' alignment.
fn colour(c: Vec3) -> impl Iterator<Item = u8> {
    let [r, g, b] = (c.clamp(Vec3::ZERO, Vec3::ONE) * 65535.0 + 0.5).to_array().map(|c| c as u16);
    [r, g, b, u16::MAX].into_iter().flat_map(u16::to_le_bytes)
}

/// Writes one lighting of a baked model: y up, metres, `COLOR_0` = exposure × irradiance ÷ π × the model's own vertex
/// colours, so that base colour × `COLOR_0` is exposed radiance. The format ends at 1: above 0.8 of white light is
/// [bent](crate::panorama::Exposure::bend). `notes` become the asset's extras.
///
/// # Errors
///
/// A picture that cannot be encoded, a model larger than the format's 4 GiB, or the file system's refusal.
pub fn write_glb(
    path: &Path,
    scene: &Scene,
    baked: &Baked,
    lighting: usize,
    mut notes: Map<String, Value>,
) -> Result<(), BakeError> {
    let exposure = baked.exposures[lighting];
    let mut chunk = Chunk::default();
    let (mut meshes, mut nodes, mut materials) = (Vec::new(), Vec::new(), Vec::new());
    let (mut images, mut textures, mut samplers) = (Vec::new(), Vec::new(), Vec::new());
    let mut image_of = vec![None; scene.textures.len()];
    let mut first = 0u32;
    for (m, ends) in baked.materials.windows(2).enumerate().filter(|(_, ends)| ends[0] < ends[1]) {
        let triangles = &baked.triangles[ends[0] as usize..ends[1] as usize];
        // vertices are sorted by material, too
        let last = triangles.iter().flatten().max().map_or(first, |v| v + 1);
        let own = first as usize..last as usize;
        let vertices = &baked.vertices[own.clone()];
        let (low, high) = vertices.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), v| {
            let p = Vec3::from(y_up(v.position));
            (low.min(p), high.max(p))
        });
        let positions = chunk.floats("VEC3", vertices.iter().map(|v| y_up(v.position)));
        chunk.accessors[positions]["min"] = json!(low.to_array());
        chunk.accessors[positions]["max"] = json!(high.to_array());
        let light = baked.irradiance[lighting][own].iter().zip(vertices);
        let codes = light.flat_map(|(e, v)| colour(exposure.bend(*e / PI) * v.colour));
        let view = chunk.view(codes, Some(VERTICES));
        let colours = chunk.accessor(view, "VEC4", SHORT, vertices.len());
        chunk.accessors[colours]["normalized"] = true.into();
        let mut attributes = json!({"POSITION": positions, "COLOR_0": colours});
        let material = &scene.materials[m];
        let (albedo, texture) = material.with_white_lamps();
        let albedo = albedo.clamp(Vec3::ZERO, Vec3::ONE);
        let mut pbr = json!({
            "baseColorFactor": [albedo.x, albedo.y, albedo.z, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0
        });
        if let Some(t) = texture {
            // v runs down
            attributes["TEXCOORD_0"] = chunk.floats("VEC2", vertices.iter().map(|v| [v.uv.x, 1.0 - v.uv.y])).into();
            let texture = &scene.textures[t as usize];
            let image = match image_of[t as usize] {
                Some(known) => known,
                None => {
                    let (bytes, kind) =
                        texture.encoded().map_err(|why| BakeError::Picture { name: texture.name.clone(), why })?;
                    let view = chunk.view(bytes.iter().copied(), None);
                    images.push(json!({"name": texture.name, "bufferView": view, "mimeType": kind}));
                    let mut entry = json!({"source": images.len() - 1});
                    if texture.wrap() != [Wrap::Repeat; 2] {
                        let [s, t] = texture.wrap().map(Wrap::code);
                        samplers.push(json!({"wrapS": s, "wrapT": t}));
                        entry["sampler"] = (samplers.len() - 1).into();
                    }
                    textures.push(entry);
                    image_of[t as usize] = Some(textures.len() - 1);
                    textures.len() - 1
                }
            };
            pbr["baseColorTexture"] = json!({"index": image});
        }
        let numbers = triangles.iter().flatten().flat_map(|v| (v - first).to_le_bytes());
        let view = chunk.view(numbers, Some(INDICES));
        let indices = chunk.accessor(view, "SCALAR", INDEX, 3 * triangles.len());
        let name = if material.name.is_empty() { "without material" } else { &material.name };
        materials.push(json!({"name": name, "pbrMetallicRoughness": pbr, "extensions": {"KHR_materials_unlit": {}}}));
        meshes.push(json!({
            "name": name,
            "primitives": [{"attributes": attributes, "indices": indices, "material": materials.len() - 1}]
        }));
        nodes.push(json!({"name": name, "mesh": meshes.len() - 1}));
        first = last;
    }
    let origin = [scene.origin.x, scene.origin.z, -scene.origin.y + 0.0];
    let children: Vec<usize> = (0..nodes.len()).collect();
    let mut root = json!({"name": "model", "children": children});
    if origin.iter().all(|v| v.abs() < FAR_M) {
        root["translation"] = json!(origin);
    } else {
        notes.insert("origin_m".into(), json!(origin));
    }
    nodes.push(root);
    notes.insert("lighting".into(), baked.lightings[lighting].clone().into());
    notes.insert("exposure".into(), exposure.0.into());
    let mut document = json!({
        "asset": {"version": "2.0", "generator": concat!("clerestory ", env!("CARGO_PKG_VERSION")), "extras": notes},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [nodes.len() - 1]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "accessors": chunk.accessors,
        "bufferViews": chunk.views,
        "buffers": [{"byteLength": chunk.bytes.len()}],
    });
    if !images.is_empty() {
        document["images"] = images.into();
        document["textures"] = textures.into();
        if !samplers.is_empty() {
            document["samplers"] = samplers.into();
        }
    }
    write(path, &document, &chunk.bytes)
}

/// The file: a header, the document padded with blanks, the binary chunk.
fn write(path: &Path, document: &Value, bytes: &[u8]) -> Result<(), BakeError> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + bytes.len();
    let Ok(total) = u32::try_from(total) else { return Err(BakeError::TooLarge { path: path.to_owned() }) };
    let io = |source| BakeError::Io { path: path.to_owned(), source };
    write_atomically(path, io, |file| {
        let heads = [total, text.len() as u32, bytes.len() as u32].map(u32::to_le_bytes);
        let parts: [&[u8]; 9] =
            [b"glTF", &[2, 0, 0, 0], &heads[0], &heads[1], b"JSON", &text, &heads[2], b"BIN\0", bytes];
        parts.into_iter().try_for_each(|part| file.write_all(part)).map_err(io)
    })
}
