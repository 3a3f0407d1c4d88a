//! Geometry from OBJ files, whatever way they are spelled.
//!
//! Normals, points and lines are left out, indices checked, and corners that name the same position and texture coordinates
//! become one vertex within a run of faces of one material.

mod statements;

use glam::{DVec3, Vec2, Vec3};
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::path::Path;

use super::error::SceneError;
use super::model::{ImportedModel, centre};
use super::polygon;
use crate::site::Frame;
use statements::{Fault, Statements, shorten};

/// Faces after which a new run begins, so that the table of its corners stays small.
const RUN: u32 = 1 << 20;

/// In place of texture coordinates where a corner has none.
const NONE: u32 = u32::MAX;

/// Reads an OBJ file, brings it into metres and the program's axes, and centres it.
pub(super) fn read(path: &Path, frame: &Frame) -> Result<ImportedModel, SceneError> {
    let malformed = |line, problem| SceneError::Malformed { path: path.to_owned(), line, problem };
    let file = File::open(path).map_err(|e| SceneError::io(path, &e))?;
    let mut statements = Statements::new(file);
    let mut obj = Obj::default();
    obj.model.material_names.push(None);
    obj.take_all(&mut statements).map_err(|fault| match fault {
        Fault::Io(e) => SceneError::io(path, &e),
        Fault::NotObj(found) => SceneError::NotAModel { path: path.to_owned(), found },
        Fault::Line(problem) => malformed(statements.line, problem),
    })?;
    obj.settle(frame).map_err(|problem| malformed(0, problem))
}

/// What the statements so far say.
#[derive(Default)]
struct Obj {
    positions: Vec<DVec3>,
    /// One for each position, or none while none has a colour.
    colours: Vec<Vec3>,
    texcoords: Vec<Vec2>,
    /// Where the position and the texture coordinates of each of the model's vertices stand.
    vertices: Vec<[u32; 2]>,
    /// Number of corners, and material.
    faces: Vec<(u32, u32)>,
    /// The vertices of all faces.
    corners: Vec<u32>,
    material: u32,
    /// Of the run: its material, whether corners have texture coordinates, and how many faces it has.
    run: (u32, bool, u32),
    /// The vertices of the run.
    known: HashMap<[u32; 2], u32>,
    /// Materials by name; number 0 is for faces before any.
    numbers: BTreeMap<String, u32>,
    /// The model, but for its shape.
    model: ImportedModel,
}

impl Obj {
    fn take_all(&mut self, statements: &mut Statements<File>) -> Result<(), Fault> {
        while let Some(text) = statements.next()? {
            self.take(text)?;
        }
        Ok(())
    }

    fn take(&mut self, text: &str) -> Result<(), Fault> {
        let oddities = &mut self.model.oddities;
        let (keyword, rest) = text.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((text, ""));
        match keyword {
            "v" => {
                oddities.vertices += 1;
                let Some((position, colour)) = vertex(uncommented(rest)) else {
                    return Err(Fault::Line(format!("expected v and three numbers, found “{}”", shorten(text))));
                };
                oddities.coloured += u64::from(colour.is_some());
                if colour.is_some() || !self.colours.is_empty() {
                    self.colours.resize(self.positions.len(), Vec3::ONE);
                    self.colours.push(colour.unwrap_or(Vec3::ONE));
                }
                self.positions.push(position);
            }
            "vt" => {
                // `vt u`, `vt u v` or `vt u v w`
                let mut words = uncommented(rest).split_ascii_whitespace();
                let [u, v] = [words.next().and_then(number), words.next().map_or(Some(0.0), number)];
                let (Some(u), Some(v)) = (u, v) else {
                    return Err(Fault::Line(format!("expected vt and two numbers, found “{}”", shorten(text))));
                };
                self.texcoords.push(Vec2::new(u as f32, v as f32));
            }
            "f" | "fo" => self.face(uncommented(rest))?,
            "usemtl" => self.material = self.named(rest.trim()),
            "mtllib" => self.model.libraries.push(rest.trim().to_owned()),
            "p" => oddities.points += 1,
            "l" => oddities.lines += 1,
            "curv" | "curv2" | "surf" => oddities.free_form += 1,
            "newmtl" if self.positions.is_empty() => return Err(Fault::NotObj("a material (MTL) file".to_owned())),
            _ => {}
        }
        Ok(())
    }

    fn named(&mut self, name: &str) -> u32 {
        if name.is_empty() {
            return 0;
        }
        if let Some(&number) = self.numbers.get(name) {
            return number;
        }
        let number = self.model.material_names.len() as u32;
        self.model.material_names.push(Some(name.to_owned()));
        self.numbers.insert(name.to_owned(), number);
        number
    }

    /// Corners as `v`, `v/vt`, `v//vn` or `v/vt/vn`; indices count from 1, or back from the last with a minus.
    fn face(&mut self, rest: &str) -> Result<(), Fault> {
        let corners = || {
            rest.split_ascii_whitespace().map(|corner| {
                let mut indices = corner.split('/');
                (indices.next().unwrap_or(""), indices.next().unwrap_or(""))
            })
        };
        let (count, textured) = corners().fold((0, true), |(n, textured), (_, vt)| (n + 1, textured && !vt.is_empty()));
        if count < 3 {
            self.model.oddities.short_faces += 1;
            return Ok(());
        }
        self.run.2 += 1;
        if (self.run.0, self.run.1) != (self.material, textured) || self.run.2 > RUN {
            self.run = (self.material, textured, 1);
            self.known.clear();
        }
        for (v, vt) in corners() {
            let v = index(v, self.positions.len(), "vertex")?;
            let vt = if textured { index(vt, self.texcoords.len(), "texture coordinate")? } else { NONE };
            let next = self.vertices.len() as u32;
            let vertex = *self.known.entry([v, vt]).or_insert(next);
            if vertex == next {
                self.vertices.push([v, vt]);
            }
            self.corners.push(vertex);
        }
        self.faces.push((count, self.material));
        Ok(())
    }

    /// The model, once its middle is known.
    fn settle(self, frame: &Frame) -> Result<ImportedModel, String> {
        let Self { positions, colours, texcoords, vertices, faces, corners, mut model, .. } = self;
        let points = || vertices.iter().map(|[v, _]| positions[*v as usize]);
        model.origin = centre(points(), frame);
        model.positions.reserve_exact(vertices.len());
        model.add_vertices(points(), frame)?;
        if vertices.iter().any(|[_, vt]| *vt != NONE) {
            model.uvs =
                vertices.iter().map(|[_, vt]| texcoords.get(*vt as usize).copied().unwrap_or(Vec2::NAN)).collect();
        }
        if !colours.is_empty() {
            model.colours = vertices.iter().map(|[v, _]| colours[*v as usize]).collect();
        }
        model.settle_colours();
        let triangles = corners.len() - 2 * faces.len();
        model.triangles.reserve_exact(triangles);
        model.materials.reserve_exact(triangles);
        let local: Vec<DVec3> = points().map(|p| frame.point_in(p) - model.origin).collect();
        let mut corners = &corners[..];
        for (count, material) in faces {
            let (face, rest) = corners.split_at(count as usize);
            corners = rest;
            let cut = polygon::triangulate(face, &local, &mut |triangle| {
                model.triangles.push(triangle);
                model.materials.push(material);
            });
            model.oddities.fans += u64::from(!cut);
        }
        Ok(model)
    }
}

/// `x y z`, `x y z w` or `x y z r g b`.
fn vertex(rest: &str) -> Option<(DVec3, Option<Vec3>)> {
    let mut words = rest.split_ascii_whitespace().map(known_number);
    let position = DVec3::new(number(words.next()?)?, number(words.next()?)?, number(words.next()?)?);
    match (words.next(), words.next(), words.next()) {
        // a weight: the point is divided by it
        (Some(w), None, _) => Some((position / number(w)?, None)),
        (Some(r), Some(g), Some(b)) => {
            let colour = [r, g, b].map(|c| number(c).map(|c| c as f32));
            let [Some(r), Some(g), Some(b)] = colour else { return Some((position, None)) };
            Some((position, Some(Vec3::new(r, g, b))))
        }
        _ => Some((position, None)),
    }
}

fn number(word: &str) -> Option<f64> {
    word.parse().ok()
}

/// An index counted from 0, for one counted from 1 or back from the last.
fn index(word: &str, count: usize, what: &str) -> Result<u32, Fault> {
    let Ok(index) = word.parse::<i64>() else {
        return Err(Fault::Line(format!("expected a face of {what} numbers, found “{}” in it", shorten(word))));
    };
    let from_0 = if index < 0 { index.saturating_add(count as i64) } else { index - 1 };
    match u32::try_from(from_0) {
        Ok(i) if i < NONE && (i as usize) < count => Ok(i),
        _ => {
            let problem = format!("the face names {what} {index}, but {count} come before it, counted from 1");
            Err(Fault::Line(problem))
        }
    }
}

/// What stands before a comment. A `#` inside a word begins none: some compilers print NaN as `1.#QNAN`.
fn uncommented(rest: &str) -> &str {
    rest.find(" #").or_else(|| rest.find("\t#")).map_or(rest, |i| &rest[..i])
}

/// Other spellings of NaN and infinity (`-1.#IND`, `nan(ind)`) as `nan`: their triangles are left out later.
fn known_number(word: &str) -> &str {
    if word.contains(['#', '(']) { "nan" } else { word }
}
