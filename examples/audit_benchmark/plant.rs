//! Plants faults in a model: what the auditor is given differs from what was photographed.

use clerestory::scene::{Material, Mesh, Scene};
use glam::{Mat2, Vec2, Vec3};

/// What to do to the part of the model inside a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    Rotate90,
    Rotate180,
    Mirror,
    Shift(f32),
    Scale(f32),
    Recolour,
    Swap,
    /// The model lacks a tile of this thickness that is in the photographs: planted by sinking the model's surface.
    Displace(f32),
    /// A hole in the model.
    Hole,
    /// A box that is not there, of this size.
    Extra(f32),
    /// Everything small inside the box is taken out of the model.
    Missing,
    /// The same, moved sideways.
    Move(f32),
}

impl Fault {
    pub fn is_texture(self) -> bool {
        use Fault::*;
        matches!(self, Rotate90 | Rotate180 | Mirror | Shift(_) | Scale(_) | Recolour | Swap)
    }

    /// What the auditor should call it.
    pub fn names(self) -> &'static [&'static str] {
        match self {
            Fault::Rotate90 | Fault::Rotate180 => &["rotated"],
            Fault::Mirror => &["mirrored"],
            Fault::Shift(_) => &["shifted"],
            Fault::Scale(_) => &["scaled"],
            Fault::Recolour => &["recoloured"],
            Fault::Swap => &["changed", "recoloured"],
            Fault::Displace(_) => &["moved", "missing"],
            Fault::Hole | Fault::Missing => &["missing"],
            Fault::Extra(_) => &["extra"],
            Fault::Move(_) => &["moved", "extra", "missing"],
        }
    }

    /// Faults of one kind are much alike to find.
    pub fn kind(self) -> &'static str {
        match self {
            Fault::Rotate90 | Fault::Rotate180 | Fault::Mirror => "turned or mirrored",
            Fault::Shift(_) | Fault::Scale(_) => "scaled or shifted",
            Fault::Recolour | Fault::Swap => "another picture or colour",
            Fault::Displace(d) if d.abs() > 0.07 => "wall moved 10 cm",
            Fault::Displace(_) => "wall moved 1 to 5 cm",
            Fault::Hole => "opening that is not there",
            Fault::Extra(_) => "object that only the model has",
            Fault::Missing => "object missing from the model",
            Fault::Move(_) => "object moved",
        }
    }

    pub fn title(self) -> String {
        match self {
            Fault::Displace(d) => format!("wall moved {:.0} cm", d.abs() * 100.0),
            Fault::Shift(_) => "shifted".into(),
            Fault::Scale(_) => "scaled".into(),
            Fault::Extra(_) => "object extra".into(),
            Fault::Missing => "object missing".into(),
            Fault::Move(_) => "object moved".into(),
            Fault::Rotate90 => "rotated 90".into(),
            Fault::Rotate180 => "rotated 180".into(),
            other => format!("{other:?}").to_lowercase(),
        }
    }
}

/// A box on a surface: middle, normal, and half its sides along two axes and the normal.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub middle: Vec3,
    pub normal: Vec3,
    pub half: f32,
    pub depth: f32,
}

impl Place {
    /// Whether a point lies in the box, but for `slack` metres.
    pub fn holds(&self, point: Vec3, slack: f32) -> bool {
        let [u, v, n] = self.axes().map(|a| a.dot(point - self.middle).abs());
        u.max(v) <= self.half + slack && n <= self.depth + slack
    }

    /// Two directions in the surface, and its normal.
    pub fn axes(&self) -> [Vec3; 3] {
        let up = if self.normal.z.abs() > 0.9 { Vec3::Y } else { Vec3::Z };
        let u = up.cross(self.normal).normalize();
        [u, self.normal.cross(u), self.normal]
    }
}

/// Cuts the triangles that cross the box and says for each triangle of the new mesh whether it lies inside.
fn cut(mesh: &Mesh, place: &Place) -> (Mesh, Vec<bool>) {
    let axes = place.axes();
    let half = [place.half, place.half, place.depth];
    let mut out = Mesh {
        positions: mesh.positions.clone(),
        uvs: mesh.uvs.clone(),
        colours: mesh.colours.clone(),
        triangles: vec![],
        materials: vec![],
    };
    let mut inside = vec![];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let material = mesh.materials[t];
        let far = |sign: f32, k: usize| {
            corners.iter().all(|&c| sign * axes[k].dot(mesh.positions[c as usize] - place.middle) > half[k])
        };
        if (0..3).any(|k| far(1.0, k) || far(-1.0, k)) {
            out.triangles.push(*corners);
            out.materials.push(material);
            inside.push(false);
            continue;
        }
        let mut polygon: Vec<u32> = corners.to_vec();
        for k in 0..3 {
            for sign in [1.0, -1.0] {
                let side = |out: &Mesh, c: u32| half[k] - sign * axes[k].dot(out.positions[c as usize] - place.middle);
                let (mut kept, mut rest) = (vec![], vec![]);
                for i in 0..polygon.len() {
                    let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
                    let (da, db) = (side(&out, a), side(&out, b));
                    if da >= 0.0 {
                        kept.push(a)
                    } else {
                        rest.push(a)
                    }
                    if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
                        let f = da / (da - db);
                        let c = out.positions.len() as u32;
                        let (pa, pb) = (out.positions[a as usize], out.positions[b as usize]);
                        out.positions.push(pa + (pb - pa) * f);
                        if !out.uvs.is_empty() {
                            let (ua, ub) = (out.uvs[a as usize], out.uvs[b as usize]);
                            out.uvs.push(ua + (ub - ua) * f);
                        }
                        if !out.colours.is_empty() {
                            let (ca, cb) = (out.colours[a as usize], out.colours[b as usize]);
                            out.colours.push(ca + (cb - ca) * f);
                        }
                        kept.push(c);
                        rest.push(c);
                    }
                }
                put(&mut out, &mut inside, &rest, material, false);
                polygon = kept;
            }
        }
        put(&mut out, &mut inside, &polygon, material, true);
    }
    (out, inside)
}

fn put(out: &mut Mesh, inside: &mut Vec<bool>, polygon: &[u32], material: u32, is_inside: bool) {
    for k in 2..polygon.len() {
        let t = [polygon[0], polygon[k - 1], polygon[k]];
        let [a, b, c] = t.map(|i| out.positions[i as usize]);
        if (b - a).cross(c - a).length() > 1e-9 {
            out.triangles.push(t);
            out.materials.push(material);
            inside.push(is_inside);
        }
    }
}

/// The scene with a fault in it: in the box, or in the triangles of `object` where those are given.
pub fn plant(scene: &Scene, fault: Fault, place: &Place, object: Option<&[bool]>) -> Scene {
    let (mut mesh, inside) = match object {
        Some(object) => (scene.mesh.clone(), object.to_vec()),
        None => cut(&scene.mesh, place),
    };
    let mut materials = scene.materials.clone();
    let chosen: Vec<usize> = (0..inside.len()).filter(|t| inside[*t]).collect();
    // own corners, so that nothing outside changes
    for &t in &chosen {
        for k in 0..3 {
            let c = mesh.triangles[t][k] as usize;
            mesh.positions.push(mesh.positions[c]);
            if !mesh.uvs.is_empty() {
                mesh.uvs.push(mesh.uvs[c]);
            }
            if !mesh.colours.is_empty() {
                mesh.colours.push(mesh.colours[c]);
            }
            mesh.triangles[t][k] = mesh.positions.len() as u32 - 1;
        }
    }
    let corners: Vec<usize> = chosen.iter().flat_map(|&t| mesh.triangles[t].map(|c| c as usize)).collect();
    match fault {
        Fault::Recolour if !mesh.colours.is_empty() => {
            corners.iter().for_each(|&c| mesh.colours[c] *= Vec3::new(1.0, 0.75, 0.5));
        }
        Fault::Recolour | Fault::Swap => {
            for &t in &chosen {
                let mut m: Material = materials[mesh.materials[t] as usize].clone();
                if fault == Fault::Recolour {
                    m.albedo *= Vec3::new(1.0, 0.75, 0.5);
                } else {
                    let other = (0..materials.len())
                        .map(|k| &materials[(mesh.materials[t] as usize + 1 + k) % materials.len()])
                        .find(|o| o.texture.is_some() && o.texture != m.texture);
                    m.texture = other.and_then(|o| o.texture);
                }
                m.name += "_fault";
                let id = materials.iter().position(|o| o.name == m.name).unwrap_or_else(|| {
                    materials.push(m);
                    materials.len() - 1
                });
                mesh.materials[t] = id as u32;
            }
        }
        Fault::Rotate90 | Fault::Rotate180 | Fault::Mirror | Fault::Shift(_) | Fault::Scale(_) => {
            let (m, shift) = match fault {
                Fault::Rotate90 => (Mat2::from_cols(Vec2::Y, Vec2::NEG_X), Vec2::ZERO),
                Fault::Rotate180 => (Mat2::from_diagonal(Vec2::NEG_ONE), Vec2::ZERO),
                Fault::Mirror => (Mat2::from_diagonal(Vec2::new(-1.0, 1.0)), Vec2::ZERO),
                Fault::Shift(s) => (Mat2::IDENTITY, Vec2::new(s, 0.6 * s)),
                Fault::Scale(s) => (Mat2::from_diagonal(Vec2::splat(s)), Vec2::ZERO),
                _ => unreachable!(),
            };
            if mesh.uvs.is_empty() {
                lay_colours(&mut mesh, &corners, place, m, shift);
                return Scene::new(mesh, materials, scene.textures.clone(), scene.origin);
            }
            let middle = corners.iter().map(|&c| mesh.uvs[c]).sum::<Vec2>() / corners.len().max(1) as f32;
            for &c in &corners {
                mesh.uvs[c] = middle + m * (mesh.uvs[c] - middle) + shift;
            }
        }
        Fault::Displace(d) => corners.iter().for_each(|&c| mesh.positions[c] += place.normal * d),
        Fault::Move(d) => {
            let [u, ..] = place.axes();
            corners.iter().for_each(|&c| mesh.positions[c] += u * d);
        }
        Fault::Missing if !mesh.colours.is_empty() && object.is_some() => flatten(&mut mesh, &inside, &corners),
        Fault::Hole | Fault::Missing => {
            let keep = |t: usize| !inside[t];
            let triangles = (0..inside.len()).filter(|t| keep(*t)).map(|t| mesh.triangles[t]).collect();
            mesh.materials = (0..inside.len()).filter(|t| keep(*t)).map(|t| mesh.materials[t]).collect();
            mesh.triangles = triangles;
        }
        Fault::Extra(size) => {
            let [u, v, n] = place.axes();
            let material = chosen.first().map_or(0, |t| mesh.materials[*t]);
            let mut m = materials[material as usize].clone();
            m.name += "_extra";
            m.albedo *= Vec3::new(0.7, 0.65, 0.6);
            materials.push(m);
            let at = |i: u32| {
                let s = |bit: u32| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
                place.middle + (u * s(0) + v * s(1) + n * (s(2) + 0.5)) * size
            };
            let base = mesh.positions.len() as u32;
            for i in 0..8 {
                mesh.positions.push(at(i));
                if !mesh.uvs.is_empty() {
                    mesh.uvs.push(Vec2::new((i & 1) as f32, (i >> 1 & 1) as f32 + (i >> 2 & 1) as f32));
                }
                if !mesh.colours.is_empty() {
                    mesh.colours.push(Vec3::ONE);
                }
            }
            for [a, b, c, d] in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]] {
                for t in [[a, b, c], [a, c, d]] {
                    mesh.triangles.push(t.map(|i: u32| base + i));
                    mesh.materials.push(materials.len() as u32 - 1);
                }
            }
        }
    }
    Scene::new(mesh, materials, scene.textures.clone(), scene.origin)
}

/// Lays the colours of a scan's vertices otherwise in the plane of the box: each takes that of the vertex nearest to where its own place is
/// turned and shifted to.
fn lay_colours(mesh: &mut Mesh, corners: &[usize], place: &Place, turned: Mat2, shift: Vec2) {
    let [u, v, n] = place.axes();
    let flat = |p: Vec3| Vec2::new(u.dot(p - place.middle), v.dot(p - place.middle));
    let cell = place.half / 64.0;
    let key = |p: Vec2| (p / cell).floor().as_ivec2();
    let mut there: std::collections::HashMap<glam::IVec2, (Vec2, Vec3)> = std::collections::HashMap::new();
    for (p, colour) in mesh.positions.iter().zip(&mesh.colours) {
        let at = flat(*p);
        if n.dot(*p - place.middle).abs() < place.depth && at.abs().max_element() < 2.0 * place.half {
            there.entry(key(at)).or_insert((at, *colour));
        }
    }
    let nearest = |p: Vec2| {
        let around = (0..=8).map(|reach: i32| {
            let ring = (-reach..=reach).flat_map(move |y| (-reach..=reach).map(move |x| glam::IVec2::new(x, y)));
            let found = ring.filter(|d| d.abs().max_element() == reach).filter_map(|d| there.get(&(key(p) + d)));
            found.min_by(|a, b| a.0.distance_squared(p).total_cmp(&b.0.distance_squared(p))).map(|f| f.1)
        });
        around.flatten().next()
    };
    let laid: Vec<(usize, Vec3)> = corners
        .iter()
        .filter_map(|&c| Some((c, nearest(turned * flat(mesh.positions[c]) + shift * place.half)?)))
        .collect();
    laid.into_iter().for_each(|(c, colour)| mesh.colours[c] = colour);
}

/// Takes a thing out of a scan, where it is of one piece with what it stands on or hangs at: its vertices are laid into the surface beside
/// it, in that one's colour.
fn flatten(mesh: &mut Mesh, inside: &[bool], corners: &[usize]) {
    /// What is beside the thing, metres.
    const BESIDE: f32 = 0.06;
    let bounds = corners.iter().map(|&c| mesh.positions[c]);
    let (low, high) = bounds.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let others: std::collections::BTreeSet<usize> =
        (0..inside.len()).filter(|t| !inside[*t]).flat_map(|t| mesh.triangles[t].map(|c| c as usize)).collect();
    let beside: Vec<usize> = others
        .into_iter()
        .filter(|&c| (mesh.positions[c].clamp(low, high) - mesh.positions[c]).abs().max_element() < BESIDE)
        .collect();
    // the side of the box at which most of what is beside lies
    let off = |c: usize, axis: usize, end: Vec3| mesh.positions[c][axis] - end[axis];
    let sides = (0..3).flat_map(|axis| [(axis, low), (axis, high)]);
    let at = |(axis, end): (usize, Vec3)| beside.iter().filter(move |&&c| off(c, axis, end).abs() < 0.4 * BESIDE);
    let Some((axis, end)) = sides.max_by_key(|side| at(*side).count()) else { return };
    let base: Vec<usize> = at((axis, end)).copied().collect();
    let count = base.len().max(1) as f32;
    let height = base.iter().map(|&c| mesh.positions[c][axis]).sum::<f32>() / count;
    let colour = base.iter().map(|&c| mesh.colours[c]).sum::<Vec3>() / count;
    for &c in corners {
        mesh.positions[c][axis] = height;
        mesh.colours[c] = colour;
    }
}
