//! Scenes for tests.

use glam::{DVec3, Vec3};

use super::{Material, Mesh, Scene};

/// Triangles, each with corners of its own.
pub(crate) fn triangles(all: &[[Vec3; 3]]) -> Mesh {
    let corners = (0..all.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh { positions: all.concat(), triangles: corners, materials: vec![0; all.len()], ..Mesh::default() }
}

/// Parallelograms: a corner and two edges each.
pub(crate) fn parallelograms(all: &[(Vec3, Vec3, Vec3)]) -> Mesh {
    let mut mesh = Mesh::default();
    for &(corner, u, v) in all {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([corner, corner + u, corner + u + v, corner + v]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        mesh.materials.extend([0, 0]);
    }
    mesh
}

/// Closed boxes by their least and greatest corners, fronts outwards.
pub(crate) fn boxes(all: &[(Vec3, Vec3)]) -> Mesh {
    let mut mesh = Mesh::default();
    for &(low, high) in all {
        let first = mesh.positions.len() as u32;
        let side = |i: u32, axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
        mesh.positions.extend((0..8).map(|i| Vec3::new(side(i, 0), side(i, 1), side(i, 2))));
        for [a, b, c, d] in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            mesh.triangles.extend([[a, b, c], [a, c, d]].map(|t| t.map(|i: u32| first + i)));
            mesh.materials.extend([0, 0]);
        }
    }
    mesh
}

/// A mesh of one grey.
pub(crate) fn grey(mesh: Mesh, albedo: f32) -> Scene {
    let material = Material { name: String::new(), albedo: Vec3::splat(albedo), texture: None, emission: Vec3::ZERO };
    Scene::new(mesh, vec![material], Vec::new(), DVec3::ZERO)
}
