//! Cuts every triangle of an OBJ model into n × n, to see that pictures do not depend on how finely a model is cut.
//!
//! `cargo run --release --example subdivide -- IN.obj OUT.obj N`. Polygons are fanned; texture coordinates go along;
//! materials keep their names (put the MTL file and its pictures beside OUT.obj). Normals are left out: nothing reads
//! them.

#![allow(clippy::print_stdout, reason = "its result goes to the console")]

use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Write};

use glam::DVec3;

type Fault = Box<dyn std::error::Error>;

/// A corner: its position, and its texture coordinates where it has some.
type Corner = (DVec3, Option<DVec3>);

fn main() -> Result<(), Fault> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output, n] = arguments.as_slice() else { return Err("usage: subdivide IN.obj OUT.obj N".into()) };
    let n: usize = n.parse()?;
    if n == 0 {
        return Err("N must be at least 1".into());
    }
    let mut out = BufWriter::new(File::create(output)?);
    let (mut places, mut pictures) = (Vec::new(), Vec::new());
    let (mut written, mut textured) = (0usize, 0usize);
    let mut triangles = 0usize;
    for line in BufReader::new(File::open(input)?).lines() {
        let line = line?;
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => places.push(vector(words)?),
            Some("vt") => pictures.push(vector(words)?),
            Some("f") => {
                let face = words.map(|w| corner(w, &places, &pictures)).collect::<Result<Vec<_>, _>>()?;
                for k in 2..face.len() {
                    cut(&mut out, [face[0], face[k - 1], face[k]], n, &mut written, &mut textured)?;
                    triangles += n * n;
                }
            }
            Some("mtllib" | "usemtl" | "o" | "g") => writeln!(out, "{line}")?,
            _ => {}
        }
    }
    out.flush()?;
    println!("{triangles} triangles");
    Ok(())
}

fn vector<'a>(words: impl Iterator<Item = &'a str>) -> Result<DVec3, Fault> {
    let mut all = [0.0; 3];
    for (slot, word) in all.iter_mut().zip(words) {
        *slot = word.parse()?;
    }
    Ok(DVec3::from(all))
}

/// The corner that a face names as v, v/vt, v//vn or v/vt/vn; negative numbers count from the end.
fn corner(word: &str, places: &[DVec3], pictures: &[DVec3]) -> Result<Corner, Fault> {
    let at = |all: &[DVec3], number: &str| -> Result<DVec3, Fault> {
        let number: isize = number.parse()?;
        let index = if number < 0 { all.len() as isize + number } else { number - 1 };
        all.get(index as usize).copied().ok_or_else(|| format!("“{word}” names a vertex that is not there").into())
    };
    let mut parts = word.split('/');
    let place = at(places, parts.next().unwrap_or_default())?;
    let picture = parts.next().filter(|p| !p.is_empty()).map(|p| at(pictures, p)).transpose()?;
    Ok((place, picture))
}

/// Writes a triangle as n × n smaller ones.
fn cut(
    out: &mut impl Write,
    corners: [Corner; 3],
    n: usize,
    written: &mut usize,
    textured: &mut usize,
) -> std::io::Result<()> {
    // row i holds i + 1 points, from the first corner down to the opposite edge; weights are the same whichever
    // triangle an edge belongs to but for rounding, which is far below an f32's
    let [a, b, c] = corners;
    for i in 0..=n {
        for j in 0..=i {
            let weights = [(n - i) as f64, (i - j) as f64, j as f64].map(|w| w / n as f64);
            let mix = |p: [DVec3; 3]| p[0] * weights[0] + p[1] * weights[1] + p[2] * weights[2];
            let p = mix([a.0, b.0, c.0]);
            writeln!(out, "v {:.9} {:.9} {:.9}", p.x, p.y, p.z)?;
            if let (Some(ta), Some(tb), Some(tc)) = (a.1, b.1, c.1) {
                let t = mix([ta, tb, tc]);
                writeln!(out, "vt {:.9} {:.9}", t.x, t.y)?;
            }
        }
    }
    let has_picture = corners.iter().all(|c| c.1.is_some());
    let name = |i: usize, j: usize| {
        let k = i * (i + 1) / 2 + j + 1;
        if has_picture { format!("{}/{}", *written + k, *textured + k) } else { format!("{}", *written + k) }
    };
    for i in 0..n {
        for j in 0..=i {
            writeln!(out, "f {} {} {}", name(i, j), name(i + 1, j), name(i + 1, j + 1))?;
            if j < i {
                writeln!(out, "f {} {} {}", name(i, j), name(i + 1, j + 1), name(i, j + 1))?;
            }
        }
    }
    let points = (n + 1) * (n + 2) / 2;
    *written += points;
    *textured += if has_picture { points } else { 0 };
    Ok(())
}
