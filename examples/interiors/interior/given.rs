//! The model that the program is given: the true one as a modeller or a scanner would have got it.
//!
//! Vertices are off by millimetres, smoothly; the mesh is cut differently; pictures are blurred, of another size and
//! somewhat off in colour. A scan is dense and has colours at its vertices instead of pictures, and their noise.

use glam::{DVec2, DVec3, dvec2, dvec3};
use image::imageops::{FilterType, blur, resize};
use image::{Rgb, RgbImage};
use std::collections::HashMap;
use std::fmt::Write;

use super::dice::Dice;
use crate::common::mesh::{Finish, Model};
use crate::common::pattern::{encode, hash};

/// How a model differs from the true one.
#[derive(Clone, Copy, Debug)]
pub struct Departure {
    /// Root mean square length by which vertices are off, smoothly, metres.
    pub warp: f64,
    /// Longest edge, metres.
    pub edge: f64,
    /// Whether it is a scan.
    pub scan: bool,
    /// Standard deviation of the pictures' blur, in texels of the true pictures.
    pub blur: f64,
    /// Size of the pictures, as a share of the true ones'.
    pub size: f64,
    /// Largest share by which a picture's colour is off, in each channel.
    pub tint: f64,
    /// Decides what chance decides.
    pub seed: u64,
}

impl Departure {
    /// A departure by seed of a model with so much surface (m²); a scan of it has about `triangles`.
    pub fn new(area: f64, scan: Option<f64>, dice: &mut Dice) -> Self {
        Self {
            warp: dice.between(0.001, 0.003),
            // bisected to the longest edge e, triangles have on average about 0.11 e², many of them being slivers
            edge: scan.map_or_else(|| dice.between(0.3, 1.2), |n| (area / n / 0.11).sqrt().max(0.02)),
            scan: scan.is_some(),
            blur: dice.between(0.6, 1.8),
            size: dice.between(0.4, 0.9),
            tint: dice.between(0.01, 0.06),
            seed: dice.next() >> 8,
        }
    }

    /// How far a point is off.
    pub fn shift(&self, p: DVec3) -> DVec3 {
        // value noise has a variance of 0.034 an axis: both octaves and three axes together 0.36²
        let octave = |wave: f64, salt: u64| {
            dvec3(0.0, 1.0, 2.0).map(|axis| smooth(p / wave, self.seed ^ salt ^ (axis as u64) << 20) - 0.5)
        };
        (octave(0.7, 1) + 0.5 * octave(0.25, 2)) * (self.warp / 0.36)
    }

    /// A picture as the given model has it.
    pub fn picture(&self, name: &str, truth: &RgbImage) -> RgbImage {
        let mut dice = Dice::new(self.seed, name);
        let size = |n: u32| ((f64::from(n) * self.size).round() as u32).max(4);
        let soft = blur(truth, self.blur as f32);
        let mut out = resize(&soft, size(truth.width()), size(truth.height()), FilterType::Triangle);
        let tint = self.tinting(&mut dice);
        for p in out.pixels_mut() {
            *p = Rgb([0, 1, 2].map(|c| encode(decode(p.0[c]) * tint[c])));
        }
        out
    }

    fn tinting(&self, dice: &mut Dice) -> [f64; 3] {
        let all = dice.between(-1.0, 1.0);
        [0; 3].map(|_| 1.0 + self.tint * (0.6 * all + 0.4 * dice.between(-1.0, 1.0)))
    }

    /// The model, cut to its longest edge and warped.
    pub fn remeshed<'a>(&self, truth: &Model<'a>) -> Model<'a> {
        let mut out = Model::default();
        for (name, faces) in &truth.objects {
            out.object(name);
            for face in faces {
                for k in 1..face.corners.len() - 1 {
                    let corner = |i: usize| {
                        let [p, t] = face.corners[i];
                        (truth.position(p), truth.uv(t) * face.finish.tile)
                    };
                    self.cut([corner(0), corner(k), corner(k + 1)], &mut |triangle| {
                        let points = triangle.map(|c| c.0 + self.shift(c.0));
                        out.face(face.finish, &points, &triangle.map(|c| c.1));
                    });
                }
            }
        }
        out
    }

    /// Halves the longest edge until none is too long. Where an edge is cut depends on its ends alone, so neighbours stay
    /// joined.
    fn cut(&self, triangle: [(DVec3, DVec2); 3], keep: &mut impl FnMut([(DVec3, DVec2); 3])) {
        let length = |i: usize| triangle[i].0.distance_squared(triangle[(i + 1) % 3].0);
        let longest = (0..3).max_by(|&a, &b| length(a).total_cmp(&length(b))).unwrap_or(0);
        if length(longest) <= self.edge * self.edge {
            keep(triangle);
            return;
        }
        let [a, b, c] = [longest, longest + 1, longest + 2].map(|i| triangle[i % 3]);
        let middle = ((a.0 + b.0) * 0.5, (a.1 + b.1) * 0.5);
        self.cut([a, middle, c], keep);
        self.cut([middle, b, c], keep);
    }

    /// The scan as an OBJ file: positions with linear colours, one material.
    pub fn scanned(&self, truth: &Model, pictures: &HashMap<&str, RgbImage>) -> String {
        let mut vertices = String::new();
        let mut triangles = String::new();
        let mut index: HashMap<[i32; 3], u32> = HashMap::new();
        let mut dice = Dice::new(self.seed, "scan");
        for (_, faces) in &truth.objects {
            for face in faces {
                let mut tint = Dice::new(self.seed, &face.finish.name);
                let tint = self.tinting(&mut tint);
                for k in 1..face.corners.len() - 1 {
                    let corner = |i: usize| {
                        let [p, t] = face.corners[i];
                        (truth.position(p), truth.uv(t))
                    };
                    self.cut([corner(0), corner(k), corner(k + 1)], &mut |triangle| {
                        let ids = triangle.map(|(p, uv)| {
                            let key = (p * 2e3).round().as_ivec3().to_array();
                            let next = index.len() as u32 + 1;
                            *index.entry(key).or_insert_with(|| {
                                let jitter = dvec3(dice.normal(), dice.normal(), dice.normal()) * 4e-4;
                                let q = p + self.shift(p) + jitter;
                                let c = colour(face.finish, uv, pictures, tint);
                                let _ = writeln!(
                                    vertices,
                                    "v {:.4} {:.4} {:.4} {:.3} {:.3} {:.3}",
                                    q.x, q.y, q.z, c[0], c[1], c[2]
                                );
                                next
                            })
                        });
                        if ids[0] != ids[1] && ids[1] != ids[2] && ids[2] != ids[0] {
                            let _ = writeln!(triangles, "f {} {} {}", ids[0], ids[1], ids[2]);
                        }
                    });
                }
            }
        }
        format!(
            "# A scan; metres, y up, north = -z; vertex colours are linear\nmtllib model.mtl\n{vertices}usemtl scan\n{triangles}"
        )
    }
}

/// The linear colour of a finish at texture coordinates.
fn colour(finish: &Finish, uv: DVec2, pictures: &HashMap<&str, RgbImage>, tint: [f64; 3]) -> [f64; 3] {
    let Some(picture) = finish.texture.as_deref().and_then(|t| pictures.get(t)) else {
        return [0, 1, 2].map(|c| finish.kd[c] * tint[c]);
    };
    let at = (uv - uv.floor()) * dvec2(f64::from(picture.width()), f64::from(picture.height()));
    let x = (at.x as u32).min(picture.width() - 1);
    let y = picture.height() - 1 - (at.y as u32).min(picture.height() - 1);
    picture.get_pixel(x, y).0.map(decode)
}

/// The linear value of an sRGB code.
fn decode(code: u8) -> f64 {
    f64::from(clerestory::panorama::srgb_to_linear(f32::from(code) / 255.0))
}

/// Smooth noise in 0..1 on a lattice of cubes.
pub fn smooth(p: DVec3, seed: u64) -> f64 {
    let (cell, f) = (p.floor(), p - p.floor());
    let w = f * f * (3.0 - 2.0 * f);
    let mut sum = 0.0;
    for k in 0..8u32 {
        let d = dvec3(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        let q = cell + d;
        let weight = (d * w + (1.0 - d) * (1.0 - w)).element_product();
        sum += weight * hash(q.x as i64, q.y as i64, seed ^ (q.z as i64 as u64).wrapping_mul(0x9E37_79B9));
    }
    sum
}
