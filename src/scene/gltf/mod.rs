//! Geometry and materials from glTF 2.0, text and binary (Khronos Group, *glTF 2.0 Specification*), the one door to the crate
//! gltf.
//!
//! Taken: triangles, strips and fans under all nodes' transforms, colours of vertices, the base colour's factor and
//! picture with its set of texture coordinates, sampler, alpha mask and `KHR_texture_transform`, and light sent out; whole
//! numbers by `KHR_mesh_quantization`. What else a file holds says nothing of a diffuse surface, or is named in a warning.

mod document;
mod materials;

use glam::{DMat4, DVec3, Mat4, Vec2, Vec3, Vec4};
use gltf::accessor::{DataType, Item};
use gltf::material::AlphaMode;
use gltf::mesh::Mode;
use gltf::{Accessor, Document, Glb, Semantic};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use super::error::SceneError;
use super::model::{ImportedModel, centre};
use super::polygon;
use crate::memory;
use crate::site::Frame;
use crate::site::files::find_loosely;
use document::{File, KNOWN, document, embedded, unescaped};
use materials::{moved, uv_set};

/// Reads a glTF file and its buffers, brings it into metres and the program's axes, and centres it.
///
/// # Errors
///
/// A file that cannot be read, is not valid glTF 2.0, or needs an extension that is not known here.
pub(super) fn read(path: &Path, frame: &Frame) -> Result<ImportedModel, SceneError> {
    let bytes = std::fs::read(path).map_err(|e| SceneError::io(path, &e))?;
    // the crate checks most, but not all that a damaged file may hold
    let read = catch_unwind(AssertUnwindSafe(|| {
        let (json, blob) = if bytes.starts_with(b"glTF") {
            // the crate takes its own header's length off without a look
            if bytes.get(8..12).is_none_or(|length| length[0] < 12 && length[1..] == [0; 3]) {
                return Err("its header is damaged".to_owned());
            }
            let Glb { json, bin, .. } = Glb::from_slice(&bytes).map_err(|e| e.to_string())?;
            (json, bin.map(Cow::into_owned))
        } else {
            (Cow::Borrowed(&bytes[..]), None)
        };
        let document = document(&json)?;
        File::open(path, document, blob)?.model(frame)
    }));
    read.unwrap_or_else(|_| Err("the file is damaged: its parts contradict each other".to_owned()))
        .map_err(|problem| SceneError::malformed(path, problem))
}

/// The most vectors that an accessor without data may stand for.
const ZEROS: usize = 1 << 16;

/// A primitive where a node puts it.
struct Placed<'a> {
    primitive: gltf::Primitive<'a>,
    to_scene: DMat4,
}

impl Placed<'_> {
    /// About how much memory it takes while it is read: a mesh may be placed any number of times.
    fn bytes(&self) -> u64 {
        /// A vertex as it is read and as it is kept, and a corner of a triangle.
        const BYTES: [u64; 2] = [72, 12];
        let vertices = self.primitive.get(&Semantic::Positions).map_or(0, |a| a.count());
        let corners = self.primitive.indices().map_or(vertices, |a| a.count());
        BYTES[0] * vertices as u64 + BYTES[1] * corners as u64
    }
}

impl<'a> File<'a> {
    fn open(path: &'a Path, document: Document, mut blob: Option<Vec<u8>>) -> Result<Self, String> {
        let (mut buffers, mut files) = (Vec::new(), Vec::new());
        for buffer in document.buffers() {
            let bytes = match buffer.source() {
                gltf::buffer::Source::Bin => blob.take().ok_or("its binary part is missing")?,
                gltf::buffer::Source::Uri(uri) => fetched(path, uri, &mut files)?,
            };
            if bytes.len() < buffer.length() {
                return Err(format!("buffer {} holds {} bytes of {}", buffer.index(), bytes.len(), buffer.length()));
            }
            buffers.push(bytes);
        }
        let held: usize = buffers.iter().map(Vec::len).sum();
        let lies = document.accessors().find(|a| {
            let view = a.view().map_or(usize::MAX, |v| v.offset().saturating_add(v.length()));
            // without a view all is zero, and takes no room in the file
            a.count() > held.max(ZEROS) || (a.view().is_some() && (a.count() > held || view > held))
        });
        if let Some(accessor) = lies {
            return Err(format!("accessor {} counts more than its buffer holds", accessor.index()));
        }
        Ok(Self { path, document, buffers, files })
    }

    fn model(self, frame: &Frame) -> Result<ImportedModel, String> {
        let mut model = ImportedModel::default();
        let placed = self.placed();
        memory::check(placed.iter().map(Placed::bytes).fold(0, u64::saturating_add))
            .map_err(|over| over.to_string())?;
        let points = placed.iter().map(|p| self.points(p)).collect::<Result<Vec<_>, String>>()?;
        model.origin = centre(points.iter().flatten().copied(), frame);
        // faces without a material come first
        model.material_names.push(None);
        for material in self.document.materials() {
            let own = self.material(&material, &mut model.oddities.others);
            model.material_names.push(Some(own.name.clone()));
            model.own.push(own);
        }
        let some_uv = placed.iter().any(|p| uv_set(&p.primitive).is_some());
        let some_colour = placed.iter().any(|p| p.primitive.get(&Semantic::Colors(0)).is_some());
        for (placed, points) in placed.iter().zip(points) {
            self.add(&mut model, placed, points, frame, [some_uv, some_colour])?;
        }
        model.settle_colours();
        let morphs = placed.iter().any(|p| p.primitive.morph_targets().len() > 0);
        let see_through = self.document.materials().any(|m| m.alpha_mode() == AlphaMode::Blend);
        let odd = [
            (morphs, "morph targets (bodies stand as they are modelled)"),
            (see_through, "see-through surfaces (they are taken as closed)"),
            (self.document.skins().len() > 0, "skins (bodies stand as they are modelled)"),
        ];
        let passed =
            odd.iter().filter(|odd| odd.0).map(|(_, what)| format!("The model has {what}, which is passed over."));
        model.oddities.others.extend(passed);
        let unknown: BTreeSet<&str> = self.document.extensions_used().filter(|e| !KNOWN.contains(e)).collect();
        if !unknown.is_empty() {
            let names = unknown.into_iter().collect::<Vec<_>>().join(", ");
            model.oddities.others.push(format!("Extensions of glTF passed over: {names}."));
        }
        model.files = self.files;
        Ok(model)
    }

    /// All primitives of the default scene, or of all nodes where there is none. Each node is taken once, as a tree has it.
    fn placed(&self) -> Vec<Placed<'_>> {
        let scene = self.document.default_scene().or_else(|| self.document.scenes().next());
        let roots: Vec<gltf::Node> = match scene {
            Some(scene) => scene.nodes().collect(),
            None => {
                let children: BTreeSet<usize> =
                    self.document.nodes().flat_map(|n| n.children().map(|c| c.index()).collect::<Vec<_>>()).collect();
                self.document.nodes().filter(|n| !children.contains(&n.index())).collect()
            }
        };
        let mut seen = BTreeSet::new();
        let mut open: Vec<(gltf::Node, DMat4)> = roots.into_iter().rev().map(|n| (n, DMat4::IDENTITY)).collect();
        let mut all = Vec::new();
        while let Some((node, parent)) = open.pop() {
            if !seen.insert(node.index()) {
                continue;
            }
            let to_scene = parent * Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
            if let Some(mesh) = node.mesh() {
                all.extend(mesh.primitives().map(|primitive| Placed { primitive, to_scene }));
            }
            let mut children: Vec<gltf::Node> = node.children().collect();
            children.reverse();
            open.extend(children.into_iter().map(|c| (c, to_scene)));
        }
        all
    }

    fn points(&self, placed: &Placed) -> Result<Vec<DVec3>, String> {
        let Some(accessor) = placed.primitive.get(&Semantic::Positions) else { return Ok(Vec::new()) };
        let points = self.numbers::<3>(&accessor)?;
        Ok(points.into_iter().map(|p| placed.to_scene.transform_point3(Vec3::from(p).as_dvec3())).collect())
    }

    /// An accessor's vectors as numbers: floats, or whole numbers, which are shares of their greatest where the accessor
    /// says that they are normalised (*glTF 2.0*, 3.6.2.2; `KHR_mesh_quantization`).
    fn numbers<const N: usize>(&self, accessor: &Accessor) -> Result<Vec<[f32; N]>, String>
    where
        [f32; N]: Item,
        [i8; N]: Item,
        [u8; N]: Item,
        [i16; N]: Item,
        [u16; N]: Item,
    {
        let fault = || format!("accessor {} is not made of {N} numbers that can be read", accessor.index());
        if accessor.dimensions().multiplicity() != N {
            return Err(fault());
        }
        if accessor.view().is_none() && accessor.sparse().is_none() {
            return Ok(vec![[0.0; N]; accessor.count()]);
        }
        let share = |most: f32| if accessor.normalized() { (most.recip(), -1.0) } else { (1.0, f32::MIN) };
        macro_rules! whole {
            ($kind:ty) => {{
                let (scale, least) = share(f32::from(<$kind>::MAX));
                let all = self.items::<[$kind; N]>(accessor).ok_or_else(fault)?;
                all.map(|v| v.map(|c| (f32::from(c) * scale).max(least))).collect()
            }};
        }
        Ok(match accessor.data_type() {
            DataType::F32 => self.items::<[f32; N]>(accessor).ok_or_else(fault)?.collect(),
            DataType::I8 => whole!(i8),
            DataType::U8 => whole!(u8),
            DataType::I16 => whole!(i16),
            DataType::U16 => whole!(u16),
            DataType::U32 => return Err(fault()),
        })
    }

    fn items<'s, T: Item>(&'s self, accessor: &Accessor<'s>) -> Option<gltf::accessor::Iter<'s, T>> {
        gltf::accessor::Iter::new(accessor.clone(), |b| self.buffers.get(b.index()).map(Vec::as_slice))
    }

    /// Adds a primitive's triangles.
    fn add(
        &self,
        model: &mut ImportedModel,
        placed: &Placed,
        points: Vec<DVec3>,
        frame: &Frame,
        [some_uv, some_colour]: [bool; 2],
    ) -> Result<(), String> {
        let primitive = &placed.primitive;
        let reader = primitive.reader(|b| self.buffers.get(b.index()).map(Vec::as_slice));
        let first = model.add_vertices(points.into_iter(), frame)?;
        let mesh = &mut model.mesh;
        let (from, count) = (first as usize, mesh.positions.len() - first as usize);
        if some_uv {
            let (set, transform) = uv_set(primitive).unwrap_or((0, None));
            let uvs = primitive.get(&Semantic::TexCoords(set)).map(|a| self.numbers::<2>(&a)).transpose()?;
            // v runs downwards in glTF
            let upright = |uv: [f32; 2]| moved(uv.into(), transform.as_ref()) * Vec2::new(1.0, -1.0) + Vec2::Y;
            mesh.uvs.extend(uvs.unwrap_or_default().into_iter().take(count).map(upright));
            mesh.uvs.resize(from + count, Vec2::NAN);
        }
        model.oddities.vertices += count as u64;
        if some_colour {
            let colours = reader.read_colors(0).map(|c| c.into_rgba_f32());
            mesh.colours.extend(colours.into_iter().flatten().take(count).map(|c| Vec4::from(c).truncate()));
            model.oddities.coloured += (mesh.colours.len() - from) as u64;
            mesh.colours.resize(from + count, Vec3::NAN);
        }
        let corners: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..count as u32).collect(),
        };
        if let Some(wrong) = corners.iter().find(|i| **i as usize >= count) {
            return Err(format!("a face names vertex {wrong} of {count}"));
        }
        let material = primitive.material().index().map_or(0, |i| i as u32 + 1);
        let mut add = |corners: [u32; 3]| {
            mesh.triangles.push(corners.map(|i| first + i));
            mesh.materials.push(material);
        };
        match primitive.mode() {
            Mode::Triangles => corners.as_chunks::<3>().0.iter().for_each(|t| add(*t)),
            Mode::TriangleStrip => polygon::strip(&corners).for_each(add),
            Mode::TriangleFan => polygon::fan(&corners, &mut add),
            Mode::Points => model.oddities.points_and_lines += corners.len() as u64,
            Mode::Lines | Mode::LineLoop | Mode::LineStrip => model.oddities.points_and_lines += 1,
        }
        Ok(())
    }
}

/// A buffer's bytes: from the address itself, or from a file beside the model's.
fn fetched(path: &Path, uri: &str, files: &mut Vec<PathBuf>) -> Result<Vec<u8>, String> {
    if uri.starts_with("data:") {
        return embedded(uri);
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let name = unescaped(uri);
    let file = find_loosely(folder, &name).ok_or_else(|| format!("there is no file “{name}” beside it"))?;
    let bytes = std::fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))?;
    files.push(file);
    Ok(bytes)
}
