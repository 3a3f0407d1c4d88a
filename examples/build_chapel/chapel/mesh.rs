//! A polygon mesh that writes itself as OBJ and MTL.

use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::fmt::Write;

/// What a surface is finished with.
#[derive(Debug, PartialEq)]
pub struct Finish {
    /// Name in the MTL file.
    pub name: &'static str,
    /// Linear diffuse reflectance, multiplied by the texture.
    pub kd: [f64; 3],
    /// Picture beside the MTL file.
    pub texture: Option<&'static str>,
    /// Metres that the picture spans along u and v.
    pub tile: DVec2,
    /// Whether u has to run along the longer side of a piece (wood).
    pub grain: bool,
}

/// One polygon: corner indices into positions and texture coordinates.
pub struct Face {
    /// What it is finished with.
    pub finish: &'static Finish,
    /// Position and texture-coordinate index of each corner, counter-clockwise seen from the air.
    pub corners: Vec<[u32; 2]>,
}

/// A mesh of named objects, y up, metres.
#[derive(Default)]
pub struct Model {
    /// Positions in units of 0.1 mm, each once.
    pub positions: Vec<[i32; 3]>,
    /// Texture coordinates in units of 10⁻⁴, each once.
    pub uvs: Vec<[i32; 2]>,
    /// Object names and their polygons, in order.
    pub objects: Vec<(String, Vec<Face>)>,
    position_index: HashMap<[i32; 3], u32>,
    uv_index: HashMap<[i32; 2], u32>,
}

impl Model {
    /// Starts an object; the polygons that follow are its.
    pub fn object(&mut self, name: &str) {
        self.objects.push((name.to_string(), Vec::new()));
    }

    /// Adds a polygon whose corners run counter-clockwise seen from the air; `metres` are its texture coordinates in
    /// metres. Corners that coincide after rounding are merged, and what has fewer than three left is dropped.
    pub fn face(&mut self, finish: &'static Finish, points: &[DVec3], metres: &[DVec2]) {
        let mut corners: Vec<[u32; 2]> = Vec::with_capacity(points.len());
        for (&p, &m) in points.iter().zip(metres) {
            let position = index(&mut self.positions, &mut self.position_index, (p * 1e4).to_array().map(round));
            if corners.last().is_none_or(|last| last[0] != position) {
                let uv = index(&mut self.uvs, &mut self.uv_index, (m / finish.tile * 1e4).to_array().map(round));
                corners.push([position, uv]);
            }
        }
        if corners.len() > 1 && corners[0][0] == corners[corners.len() - 1][0] {
            corners.pop();
        }
        if corners.len() >= 3
            && let Some((_, faces)) = self.objects.last_mut()
        {
            faces.push(Face { finish, corners });
        }
    }

    /// The same, turned so that the polygon faces `towards`.
    pub fn face_towards(&mut self, finish: &'static Finish, towards: DVec3, points: &[DVec3], metres: &[DVec2]) {
        if normal(points).dot(towards) >= 0.0 {
            self.face(finish, points, metres);
        } else {
            let points: Vec<_> = points.iter().rev().copied().collect();
            let metres: Vec<_> = metres.iter().rev().copied().collect();
            self.face(finish, &points, &metres);
        }
    }

    /// How many triangles the polygons make.
    pub fn triangles(&self) -> usize {
        self.objects.iter().flat_map(|(_, faces)| faces).map(|f| f.corners.len() - 2).sum()
    }

    /// The OBJ file.
    pub fn obj(&self, mtl: &str) -> String {
        let mut out = format!("# A small chapel of our own making; metres, y up, north = -z\nmtllib {mtl}\n");
        for p in &self.positions {
            let _ = writeln!(out, "v {} {} {}", number(p[0]), number(p[1]), number(p[2]));
        }
        for t in &self.uvs {
            let _ = writeln!(out, "vt {} {}", number(t[0]), number(t[1]));
        }
        for (name, faces) in &self.objects {
            let _ = writeln!(out, "o {name}");
            let mut finish = "";
            for face in faces {
                if face.finish.name != finish {
                    finish = face.finish.name;
                    let _ = writeln!(out, "usemtl {finish}");
                }
                out.push('f');
                for [v, t] in &face.corners {
                    let _ = write!(out, " {}/{}", v + 1, t + 1);
                }
                out.push('\n');
            }
        }
        out
    }

    /// The finishes used, in order of first use.
    pub fn finishes(&self) -> Vec<&'static Finish> {
        let mut used: Vec<&'static Finish> = Vec::new();
        for face in self.objects.iter().flat_map(|(_, faces)| faces) {
            if !used.contains(&face.finish) {
                used.push(face.finish);
            }
        }
        used
    }

    /// The MTL file.
    pub fn mtl(&self) -> String {
        let mut out = String::from("# Kd is linear; a picture (sRGB) multiplies it\n");
        for finish in self.finishes() {
            let [r, g, b] = finish.kd;
            let _ = writeln!(out, "\nnewmtl {}\nKd {r} {g} {b}", finish.name);
            if let Some(texture) = finish.texture {
                let _ = writeln!(out, "map_Kd {texture}");
            }
        }
        out
    }
}

/// Area vector of a polygon (Newell), of any length.
pub fn normal(points: &[DVec3]) -> DVec3 {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| a.cross(*b)).sum()
}

fn round(v: f64) -> i32 {
    v.round() as i32
}

/// A number in units of 10⁻⁴ as a decimal without trailing zeros.
fn number(v: i32) -> String {
    let text = format!("{}{}.{:04}", if v < 0 { "-" } else { "" }, v.abs() / 10_000, v.abs() % 10_000);
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

fn index<K: std::hash::Hash + Eq + Copy>(list: &mut Vec<K>, seen: &mut HashMap<K, u32>, key: K) -> u32 {
    *seen.entry(key).or_insert_with(|| {
        list.push(key);
        list.len() as u32 - 1
    })
}
