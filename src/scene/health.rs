//! What is wrong with a mesh, and the cleaning that import does.

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use serde::Serialize;

use super::{Material, Mesh, Scene, Texture};
use crate::site::Frame;

/// A triangle lower than this part of its longest side has no area: in single precision its normal would be noise.
const THINNEST: f32 = 1e-6;

/// What import found and did, in numbers and in sentences.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Health {
    /// Sentences a modeller understands, in the order of finding.
    pub warnings: Vec<String>,
    /// Triangles in the file, polygons already cut.
    pub triangles_read: usize,
    /// Triangles left after cleaning.
    pub triangles: usize,
    /// Left out: a corner is NaN or infinite.
    pub not_finite: usize,
    /// Left out: no area.
    pub zero_area: usize,
    /// Left out: the same three corners as another triangle, in any order.
    pub duplicates: usize,
    /// Those among the duplicates whose material differs from the one that was kept.
    pub duplicates_in_other_material: usize,
    /// Triangles of a textured material without texture coordinates.
    pub without_uvs: usize,
    /// Least and greatest corner, in the model's own axes and units.
    pub bounds: [[f64; 3]; 2],
    /// Extent east, north and up in metres.
    pub size_m: [f64; 3],
    /// Area of each material in use, largest first.
    pub areas: Vec<MaterialArea>,
    /// Material files and pictures that were read beside the model.
    #[serde(skip)]
    pub files: Vec<std::path::PathBuf>,
}

/// How much of the model a material covers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialArea {
    /// The name in the MTL file; empty for faces before any `usemtl`.
    pub material: String,
    /// Square metres, one side.
    pub area_m2: f64,
    /// Triangles.
    pub triangles: usize,
}

/// How triangles meet; corners at the same position count as one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Edges {
    /// All edges.
    pub total: usize,
    /// Edges of one triangle: rims, holes, cracks.
    pub open: usize,
    /// Edges of three or more triangles.
    pub non_manifold: usize,
    /// Edges of two triangles that are wound against each other: one of them is inside out.
    pub inverted: usize,
}

/// Leaves out triangles that are not finite, have no area or coincide, and tells how many. Afterwards all numbers
/// in the mesh are finite; order is kept.
pub(super) fn clean(mesh: &mut Mesh, health: &mut Health) {
    health.triangles_read = mesh.triangles.len();
    let mut keep = vec![true; mesh.triangles.len()];
    for (keep, triangle) in keep.iter_mut().zip(0u32..) {
        let corners = mesh.corners(triangle);
        if !corners.iter().all(|c| c.is_finite()) {
            *keep = false;
            health.not_finite += 1;
        } else if has_no_area(corners) {
            *keep = false;
            health.zero_area += 1;
        }
    }
    drop_duplicates(mesh, &mut keep, health);
    retain(&mut mesh.triangles, &keep);
    retain(&mut mesh.materials, &keep);
    for position in mesh.positions.iter_mut().filter(|p| !p.is_finite()) {
        *position = Vec3::ZERO;
    }
    health.triangles = mesh.triangles.len();
    warn_of_dropped(health);
}

fn has_no_area([a, b, c]: [Vec3; 3]) -> bool {
    let (u, v, w) = (b - a, c - a, c - b);
    let longest = u.length_squared().max(v.length_squared()).max(w.length_squared());
    // also true where the squares overflow or underflow
    let height = u.cross(v).length() / longest;
    height.is_nan() || height <= THINNEST
}

fn retain<T>(items: &mut Vec<T>, keep: &[bool]) {
    let mut kept = keep.iter();
    items.retain(|_| kept.next().copied().unwrap_or(true));
    items.shrink_to_fit();
}

/// Marks all but the first of triangles with the same corners.
fn drop_duplicates(mesh: &Mesh, keep: &mut [bool], health: &mut Health) {
    let welded = mesh.welded();
    let corners = |t: u32| {
        let mut corners = mesh.triangles[t as usize].map(|i| welded[i as usize]);
        corners.sort_unstable();
        corners
    };
    let all = (0..mesh.triangles.len() as u32).into_par_iter();
    let mut order: Vec<([u32; 3], u32)> = all.filter(|&t| keep[t as usize]).map(|t| (corners(t), t)).collect();
    order.par_sort_unstable();
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        let material = |&(_, triangle): &([u32; 3], u32)| mesh.materials[triangle as usize];
        for duplicate in &same[1..] {
            keep[duplicate.1 as usize] = false;
            health.duplicates += 1;
            health.duplicates_in_other_material += usize::from(material(duplicate) != material(&same[0]));
        }
    }
}

fn warn_of_dropped(health: &mut Health) {
    let mut warn = |count: usize, what: &str| {
        if count > 0 {
            let triangles = if count == 1 { "triangle" } else { "triangles" };
            health.warnings.push(format!("{count} {triangles} {what}"));
        }
    };
    warn(health.not_finite, "with a corner that is NaN or infinite left out.");
    warn(health.zero_area, "without area left out.");
    warn(health.duplicates, "left out that coincide exactly with another one (doubled faces).");
    warn(
        health.duplicates_in_other_material,
        "of these had another material than the coinciding one that was kept (the first in the file).",
    );
}

/// Gives triangles of textured materials that have no texture coordinates a copy of their material in the picture's
/// mean colour, and makes all texture coordinates finite.
pub(super) fn settle_uvs(mesh: &mut Mesh, materials: &mut Vec<Material>, textures: &[Texture], health: &mut Health) {
    let mut plain = vec![None; materials.len()];
    for triangle in 0..mesh.triangles.len() {
        let material = mesh.materials[triangle] as usize;
        let mapped = mesh.uv(triangle as u32, Vec2::splat(1.0 / 3.0)).is_some_and(Vec2::is_finite);
        let (false, Some(texture)) = (mapped, materials[material].texture) else { continue };
        health.without_uvs += 1;
        let copy = *plain[material].get_or_insert_with(|| {
            // past the pyramid's top there is one texel left, the mean
            let mean = textures[texture as usize].sample(Vec2::ZERO, f32::from(u8::MAX));
            let albedo = materials[material].albedo * mean;
            materials.push(Material { albedo, texture: None, ..materials[material].clone() });
            materials.len() as u32 - 1
        });
        mesh.materials[triangle] = copy;
    }
    for uv in mesh.uvs.iter_mut().filter(|uv| !uv.is_finite()) {
        *uv = Vec2::ZERO;
    }
    if health.without_uvs > 0 {
        health.warnings.push(format!(
            "Triangles of textured materials have no texture coordinates ({}): the picture's mean colour is taken. Unwrap them.",
            health.without_uvs
        ));
    }
}

/// Extent and areas.
pub(super) fn measure(scene: &Scene, frame: &Frame, health: &mut Health) {
    let (low, high) = scene.mesh.bounds();
    let corners = [low, high].map(|p| frame.point_out(p.as_dvec3() + scene.origin));
    // turning axes may swap which corner is the lesser
    health.bounds = [corners[0].min(corners[1]).to_array(), corners[0].max(corners[1]).to_array()];
    let size: DVec3 = (high - low).as_dvec3();
    health.size_m = size.to_array();
    let across = size.length();
    if !(0.5..=10_000.0).contains(&across) && health.triangles > 0 {
        health.warnings.push(format!(
            "The model is {across:.3} m across: check site.units, and look for stray triangles far from the rest."
        ));
    }
    health.areas = areas(&scene.mesh, &scene.materials);
}

fn areas(mesh: &Mesh, materials: &[Material]) -> Vec<MaterialArea> {
    let mut areas: Vec<MaterialArea> =
        materials.iter().map(|m| MaterialArea { material: m.name.clone(), area_m2: 0.0, triangles: 0 }).collect();
    for (triangle, &material) in (0u32..).zip(&mesh.materials) {
        let area = &mut areas[material as usize];
        area.area_m2 += f64::from(mesh.area(triangle));
        area.triangles += 1;
    }
    areas.retain(|a| a.triangles > 0);
    areas.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
    areas
}

/// Counts how triangles meet. Takes about 30 bytes a triangle for a while and O(n log n).
pub fn edges(mesh: &Mesh) -> Edges {
    let corner = mesh.welded();
    // the two corners, lesser first, and whether they were swapped
    let mut edges: Vec<(u32, u32, bool)> = mesh
        .triangles
        .par_iter()
        .flat_map_iter(|t| {
            let [a, b, c] = t.map(|i| corner[i as usize]);
            [(a, b), (b, c), (c, a)].map(|(p, q)| if p < q { (p, q, false) } else { (q, p, true) })
        })
        .collect();
    edges.par_sort_unstable();
    let mut counts = Edges::default();
    for around in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        counts.total += 1;
        match around {
            [_] => counts.open += 1,
            [a, b] => counts.inverted += usize::from(a.2 == b.2),
            _ => counts.non_manifold += 1,
        }
    }
    counts
}

impl Edges {
    /// Whether the mesh is wound well enough for fronts and backs to mean something.
    pub(crate) fn winding_is_meaningful(&self) -> bool {
        self.inverted * 20 <= self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::triangles;

    fn mesh(all: &[[[f32; 3]; 3]]) -> Mesh {
        let corners: Vec<[Vec3; 3]> = all.iter().map(|t| t.map(Vec3::from)).collect();
        Mesh { materials: (0..all.len() as u32).map(|i| i % 2).collect(), ..triangles(&corners) }
    }

    const T: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn cleaning_leaves_one_of_coinciding_triangles_in_any_order() {
        let [a, b, c] = T;
        let minus_zero = [-0.0, -0.0, 0.0];
        let mut mesh = mesh(&[[a, b, c], [c, b, a], [b, c, minus_zero], [a, b, [0.0, 1.0, 1e-7]]]);
        let mut health = Health::default();
        clean(&mut mesh, &mut health);
        assert_eq!((health.duplicates, health.duplicates_in_other_material, health.triangles), (2, 1, 2));
        assert_eq!(mesh.triangles, [[0, 1, 2], [9, 10, 11]]);
        assert_eq!(mesh.materials, [0, 1]);
    }

    #[test]
    fn cleaning_leaves_out_what_is_not_finite_or_has_no_area() {
        let [a, b, _] = T;
        let mut mesh = mesh(&[
            T,
            [a, b, [f32::NAN, 0.0, 0.0]],
            [a, b, [0.0, f32::INFINITY, 0.0]],
            [a, b, b],
            [a, b, [0.3, 0.0, 0.0]],
            [a, b, [0.3, 1e-7, 0.0]],
            [a, [1e-30, 0.0, 0.0], [0.0, 1e-30, 0.0]],
        ]);
        let mut health = Health::default();
        clean(&mut mesh, &mut health);
        assert_eq!((health.not_finite, health.zero_area, health.triangles), (2, 4, 1));
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert_eq!(health.warnings.len(), 2);
    }

    /// A tetrahedron is closed; turning one face inverts its three edges, removing it opens them, and a flap on an
    /// edge makes it non-manifold.
    #[test]
    fn edges_are_told_apart() {
        let [a, b, c] = T;
        let d = [0.0, 0.0, 1.0];
        let closed = [[a, c, b], [a, b, d], [b, c, d], [c, a, d]];
        let count = |triangles: &[[[f32; 3]; 3]]| edges(&mesh(triangles));
        assert_eq!(count(&closed), Edges { total: 6, ..Edges::default() });
        let mut turned = closed;
        turned[0].swap(0, 1);
        assert_eq!(count(&turned), Edges { total: 6, inverted: 3, ..Edges::default() });
        assert_eq!(count(&closed[1..]), Edges { total: 6, open: 3, ..Edges::default() });
        let mut flap = closed.to_vec();
        flap.push([a, b, [5.0, -5.0, 0.0]]);
        assert_eq!(count(&flap), Edges { total: 8, open: 2, non_manifold: 1, ..Edges::default() });
    }
}
