//! A polygon mesh that writes itself as OBJ and MTL.

use glam::{DAffine3, DVec2, DVec3};
use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt::Write;

/// What a surface is finished with.
#[derive(Debug, PartialEq)]
pub struct Finish {
    /// Name in the MTL file.
    pub name: Cow<'static, str>,
    /// Linear diffuse reflectance, multiplied by the texture.
    pub kd: [f64; 3],
    /// Picture beside the MTL file.
    pub texture: Option<Cow<'static, str>>,
    /// Metres that the picture spans along u and v.
    pub tile: DVec2,
    /// Whether u has to run along the longer side of a piece (wood).
    pub grain: bool,
    /// Radiance that it sends out of itself.
    pub emission: [f64; 3],
}

impl Finish {
    /// A picture, `tile` metres large.
    pub const fn textured(name: &'static str, texture: &'static str, tile: DVec2) -> Self {
        let (name, texture) = (Cow::Borrowed(name), Some(Cow::Borrowed(texture)));
        Self { name, kd: [1.0, 1.0, 1.0], texture, tile, grain: false, emission: [0.0; 3] }
    }

    /// The same with u along the longer side of a piece.
    pub const fn grained(mut self) -> Self {
        self.grain = true;
        self
    }

    /// One colour.
    pub const fn plain(name: &'static str, kd: [f64; 3]) -> Self {
        Self { name: Cow::Borrowed(name), kd, texture: None, tile: DVec2::ONE, grain: false, emission: [0.0; 3] }
    }
}

/// One polygon: corner indices into positions and texture coordinates.
pub struct Face<'a> {
    /// What it is finished with.
    pub finish: &'a Finish,
    /// Position and texture-coordinate index of each corner, counter-clockwise seen from the air.
    pub corners: Vec<[u32; 2]>,
}

/// A mesh of named objects, y up, metres.
#[derive(Default)]
pub struct Model<'a> {
    /// Positions in units of 0.1 mm, each once.
    pub positions: Vec<[i32; 3]>,
    /// Texture coordinates in units of 10⁻⁴, each once.
    pub uvs: Vec<[i32; 2]>,
    /// Object names and their polygons, in order.
    pub objects: Vec<(String, Vec<Face<'a>>)>,
    position_index: HashMap<[i32; 3], u32>,
    uv_index: HashMap<[i32; 2], u32>,
}

impl<'a> Model<'a> {
    /// Starts an object; the polygons that follow are its.
    pub fn object(&mut self, name: &str) {
        self.objects.push((name.to_string(), Vec::new()));
    }

    /// Adds a polygon whose corners run counter-clockwise seen from the air; `metres` are its texture coordinates in
    /// metres. Corners that coincide after rounding are merged, and what has fewer than three left is dropped.
    pub fn face(&mut self, finish: &'a Finish, points: &[DVec3], metres: &[DVec2]) {
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
    pub fn face_towards(&mut self, finish: &'a Finish, towards: DVec3, points: &[DVec3], metres: &[DVec2]) {
        if normal(points).dot(towards) >= 0.0 {
            self.face(finish, points, metres);
        } else {
            let points: Vec<_> = points.iter().rev().copied().collect();
            let metres: Vec<_> = metres.iter().rev().copied().collect();
            self.face(finish, &points, &metres);
        }
    }

    /// Adds all of another model as it stands after `place`.
    pub fn add(&mut self, other: &Model<'a>, place: DAffine3) {
        for (name, faces) in &other.objects {
            self.object(name);
            for face in faces {
                let points: Vec<_> =
                    face.corners.iter().map(|c| place.transform_point3(other.position(c[0]))).collect();
                let metres: Vec<_> = face.corners.iter().map(|c| other.uv(c[1]) * face.finish.tile).collect();
                self.face(face.finish, &points, &metres);
            }
        }
    }

    /// A vertex in metres.
    pub fn position(&self, index: u32) -> DVec3 {
        DVec3::from(self.positions[index as usize].map(f64::from)) * 1e-4
    }

    /// Texture coordinates, 0..1 over the picture.
    pub fn uv(&self, index: u32) -> DVec2 {
        DVec2::from(self.uvs[index as usize].map(f64::from)) * 1e-4
    }

    /// How many triangles the polygons make.
    pub fn triangles(&self) -> usize {
        self.objects.iter().flat_map(|(_, faces)| faces).map(|f| f.corners.len() - 2).sum()
    }

    /// The OBJ file, with what it is in its first line.
    pub fn obj(&self, title: &str, mtl: &str) -> String {
        let mut out = format!("# {title}; metres, y up, north = -z\nmtllib {mtl}\n");
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
                    finish = &face.finish.name;
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
    pub fn finishes(&self) -> Vec<&'a Finish> {
        let mut used: Vec<&'a Finish> = Vec::new();
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
            if finish.emission != [0.0; 3] {
                let [r, g, b] = finish.emission;
                let _ = writeln!(out, "Ke {r} {g} {b}");
            }
            if let Some(texture) = &finish.texture {
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
