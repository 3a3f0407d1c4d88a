//! Geometry from PLY files (Turk, *The PLY Polygon File Format*, 1994), the one door to ply-rs-bw: ASCII and binary of both
//! byte orders, colours of vertices, texture coordinates of vertices or of faces, faces of any number of corners,
//! triangle strips.

use glam::{DVec3, Vec2, Vec3};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Header, Property, PropertyAccess, PropertyAccessResult as Access};
use smallvec::SmallVec;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Chain, Cursor, Read};
use std::path::Path;

use super::error::SceneError;
use super::model::{ImportedModel, Map, ModelMaterial, UNKNOWN_ALBEDO, centre};
use super::{Mesh, polygon, text};
use crate::memory::{self, OverLimit};
use crate::site::Frame;

/// A vertex as the file has it.
struct Vertex {
    position: DVec3,
    /// 0..=1; NaN without a colour.
    colour: Vec3,
    /// NaN without.
    uv: Vec2,
}

/// A face as the file has it, small since there are many.
#[derive(Default)]
struct Face {
    /// [`NONE`] for what is less than 0.
    corners: SmallVec<[u32; 3]>,
    /// Two numbers a corner, or none.
    uvs: Box<[f32]>,
    /// Which of the texture files.
    picture: u32,
    /// Whether it has a colour of its own.
    coloured: bool,
}

/// What no vertex is numbered by.
const NONE: u32 = u32::MAX;

/// An element of no use here.
struct Ignored;

/// A property's value as a number, and its greatest where it is a share stored as a whole number.
fn scalar(property: &Property) -> Option<(f64, f64)> {
    Some(match *property {
        Property::Char(v) => (f64::from(v), 127.0),
        Property::UChar(v) => (f64::from(v), 255.0),
        Property::Short(v) => (f64::from(v), 32_767.0),
        Property::UShort(v) => (f64::from(v), 65_535.0),
        Property::Int(v) => (f64::from(v), 255.0),
        Property::UInt(v) => (f64::from(v), 255.0),
        Property::Float(v) => (f64::from(v), 1.0),
        Property::Double(v) => (v, 1.0),
        _ => return None,
    })
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { position: DVec3::NAN, colour: Vec3::NAN, uv: Vec2::NAN }
    }

    fn set_property(&mut self, name: &str, property: Property) -> Access {
        let Some((value, most)) = scalar(&property) else { return Access::Ignored };
        let share = (value / most) as f32;
        match name {
            "x" => self.position.x = value,
            "y" => self.position.y = value,
            "z" => self.position.z = value,
            "red" | "r" | "diffuse_red" => self.colour.x = share,
            "green" | "g" | "diffuse_green" => self.colour.y = share,
            "blue" | "b" | "diffuse_blue" => self.colour.z = share,
            "u" | "s" | "texture_u" | "texture_s" => self.uv.x = value as f32,
            "v" | "t" | "texture_v" | "texture_t" => self.uv.y = value as f32,
            _ => return Access::Ignored,
        }
        Access::Set
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> Access {
        match (name, property) {
            ("vertex_indices" | "vertex_index", Property::ListChar(v)) => self.corners = from(v),
            ("vertex_indices" | "vertex_index", Property::ListUChar(v)) => self.corners = from(v),
            ("vertex_indices" | "vertex_index", Property::ListShort(v)) => self.corners = from(v),
            ("vertex_indices" | "vertex_index", Property::ListUShort(v)) => self.corners = from(v),
            ("vertex_indices" | "vertex_index", Property::ListInt(v)) => self.corners = from(v),
            ("vertex_indices" | "vertex_index", Property::ListUInt(v)) => self.corners = from(v),
            ("texcoord", Property::ListFloat(v)) => self.uvs = v.into_boxed_slice(),
            ("texcoord", Property::ListDouble(v)) => self.uvs = v.into_iter().map(|v| v as f32).collect(),
            ("red" | "r" | "diffuse_red", _) => self.coloured = true,
            ("texnumber", property) => self.picture = scalar(&property).map_or(0, |(value, _)| value as u32),
            _ => return Access::Ignored,
        }
        Access::Set
    }
}

fn from<T: TryInto<u32>>(list: Vec<T>) -> SmallVec<[u32; 3]> {
    list.into_iter().map(|corner| corner.try_into().unwrap_or(NONE)).collect()
}

impl PropertyAccess for Ignored {
    fn new() -> Self {
        Self
    }
}

/// Reads a PLY file, brings it into metres and the program's axes, and centres it.
///
/// # Errors
///
/// A file that cannot be read, is damaged, or has points but no faces.
pub(super) fn read(path: &Path, frame: &Frame) -> Result<ImportedModel, SceneError> {
    let malformed = |problem: String| SceneError::malformed(path, problem);
    let fault = |e: ParseError| {
        let (line, said) = (e.line().unwrap_or(0), e.to_string());
        let said = said.lines().next().unwrap_or_default();
        let problem = said.strip_prefix(&format!("Line {line}: ")).unwrap_or(said).trim_end_matches('.').to_owned();
        SceneError::Malformed { path: path.to_owned(), line, problem }
    };
    let file = File::open(path).map_err(|e| SceneError::io(path, &e))?;
    let bytes = file.metadata().map_err(|e| SceneError::io(path, &e))?.len();
    let mut reader = Reader::new(decoded(BufReader::new(file)).map_err(|e| SceneError::io(path, &e))?);
    let header = Parser::<Ignored>::new().read_header(&mut reader).map_err(fault)?;
    let (mut vertices, mut faces, mut strips, mut others) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for element in header.elements.values() {
        // each takes a byte at least: a header alone must not eat the machine
        if element.count as u64 > bytes || (element.properties.is_empty() && element.count > 0) {
            return Err(malformed(format!(
                "{} “{}” are announced, more than the file holds",
                element.count, element.name
            )));
        }
    }
    check_memory(&header, bytes).map_err(|over| SceneError::Memory { path: path.to_owned(), over })?;
    for element in header.elements.values() {
        match element.name.as_str() {
            "vertex" => vertices = elements::<Vertex>(&mut reader, element, &header).map_err(fault)?,
            "face" => faces = elements::<Face>(&mut reader, element, &header).map_err(fault)?,
            "tristrips" => strips = elements::<Face>(&mut reader, element, &header).map_err(fault)?,
            name => {
                elements::<Ignored>(&mut reader, element, &header).map_err(fault)?;
                others.push(format!("Elements “{name}” ignored: {}.", element.count));
            }
        }
    }
    faces.extend(strips.iter().flat_map(triangles));
    if faces.is_empty() && !vertices.is_empty() {
        let problem = format!(
            "it is a cloud of {} points without faces, and light needs surfaces. Mesh it first, as MeshLab's screened \
             Poisson reconstruction or CloudCompare's Poisson plugin does",
            vertices.len()
        );
        return Err(malformed(problem));
    }
    let mut model = meshed(&vertices, &faces, frame).map_err(malformed)?;
    name_materials(&mut model, path, &header);
    if faces.iter().any(|f| f.coloured) {
        others.push("Colours of faces are passed over: save them as colours of vertices.".to_owned());
    }
    model.oddities.others = others;
    Ok(model)
}

/// Whether what the head announces may be held in memory. What takes its room in the file, too, is no small file that stands
/// for much.
fn check_memory(header: &Header, bytes: u64) -> Result<(), OverLimit> {
    /// Faces of a text file take eight bytes at least.
    const HONEST: u64 = 8;
    let size = |element: &ElementDef| match element.name.as_str() {
        "vertex" => size_of::<Vertex>(),
        "face" | "tristrips" => size_of::<Face>(),
        _ => 0,
    };
    let all = header.elements.values().map(|e| (e.count as u64).saturating_mul(size(e) as u64));
    let needed = all.fold(0, u64::saturating_add);
    if needed > HONEST.saturating_mul(bytes) { memory::check(needed) } else { Ok(()) }
}

/// A file whose head is UTF-8, which the parser wants: other programs name pictures in Latin-1.
fn decoded(mut file: BufReader<File>) -> io::Result<Text> {
    /// No head is longer.
    const HEAD: u64 = 1 << 20;
    let mut head = Vec::new();
    loop {
        let begin = head.len();
        let read = (&mut file).take(HEAD.saturating_sub(begin as u64)).read_until(b'\n', &mut head)?;
        if read == 0 || head[begin..].trim_ascii() == b"end_header" {
            break;
        }
    }
    Ok(Cursor::new(text::of(&head).into_owned().into_bytes()).chain(file))
}

type Text = Chain<Cursor<Vec<u8>>, BufReader<File>>;

/// The triangles of strips, of which −1 ends each.
fn triangles(strips: &Face) -> impl Iterator<Item = Face> {
    let all = strips.corners.split(|corner| *corner == NONE).flat_map(polygon::strip);
    all.map(|corners| Face { corners: SmallVec::from(corners), ..Face::default() })
}

fn elements<E: PropertyAccess>(
    reader: &mut Reader<Text>,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, ParseError> {
    Parser::<E>::new().read_payload_for_element(reader, element, header)
}

/// Cuts faces into triangles. Texture coordinates of a face give its corners vertices of their own.
fn meshed(vertices: &[Vertex], faces: &[Face], frame: &Frame) -> Result<ImportedModel, String> {
    let mut model =
        ImportedModel { origin: centre(vertices.iter().map(|v| v.position), frame), ..ImportedModel::default() };
    let mapped = faces.iter().any(|f| !f.uvs.is_empty());
    let some_uv = mapped || vertices.iter().any(|v| v.uv.is_finite());
    let some_colour = vertices.iter().any(|v| v.colour.is_finite());
    let add = |model: &mut ImportedModel, vertex: &Vertex, uv: Vec2| -> Result<u32, String> {
        let index = model.add_vertices(std::iter::once(vertex.position), frame)?;
        if some_uv {
            model.mesh.uvs.push(uv);
        }
        if some_colour {
            model.mesh.colours.push(vertex.colour);
        }
        Ok(index)
    };
    if !mapped {
        for vertex in vertices {
            add(&mut model, vertex, vertex.uv)?;
        }
    }
    model.oddities.vertices = vertices.len() as u64;
    model.oddities.coloured = vertices.iter().filter(|v| v.colour.is_finite()).count() as u64;
    let mut corners: Vec<u32> = Vec::new();
    for (number, face) in faces.iter().enumerate() {
        if face.corners.len() < 3 {
            model.oddities.short_faces += 1;
            continue;
        }
        corners.clear();
        for (k, &i) in face.corners.iter().enumerate() {
            let vertex = vertices.get(i as usize).ok_or_else(|| match i {
                NONE => format!("face {number} names a vertex below 0"),
                _ => format!("face {number} names vertex {i} of {}", vertices.len()),
            })?;
            let uv = face.uvs.get(2 * k..2 * k + 2).map(Vec2::from_slice);
            corners.push(if mapped { add(&mut model, vertex, uv.unwrap_or(Vec2::NAN))? } else { i });
        }
        let Mesh { positions, triangles, materials, .. } = &mut model.mesh;
        let mut add = |t: [u32; 3]| {
            triangles.push(t);
            materials.push(face.picture);
        };
        if !polygon::triangulate(&corners, |i| positions[i as usize].as_dvec3(), &mut add) {
            model.oddities.fans += 1;
        }
    }
    model.settle_colours();
    Ok(model)
}

/// A material for each picture that a comment `TextureFile` names, or none.
fn name_materials(model: &mut ImportedModel, path: &Path, header: &Header) {
    let pictures = header.comments.iter().filter_map(|c| c.trim().strip_prefix("TextureFile").map(str::trim));
    for name in pictures {
        let (name, plain_albedo) = (name.to_owned(), Vec3::splat(UNKNOWN_ALBEDO));
        let map = Some(Map { name: name.clone(), file: path.to_owned(), plain_albedo, ..Map::default() });
        model.material_names.push(Some(name.clone()));
        model.own.push(ModelMaterial { name, albedo: Vec3::ONE, map, ..ModelMaterial::default() });
    }
    if model.material_names.is_empty() {
        model.material_names.push(None);
    }
    let last = model.material_names.len() as u32 - 1;
    model.mesh.materials.iter_mut().for_each(|m| *m = (*m).min(last));
}
