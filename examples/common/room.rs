// The room of the examples in the documentation.

/// A closed room of 4 × 3 × 2.5 m with its corner at the origin, of a grey that reflects half of the light.
pub fn room() -> clerestory::scene::Scene {
    use clerestory::glam::{DVec3, Vec3};
    use clerestory::scene::{Material, Mesh, Scene};
    let corner = |i: u32| Vec3::new((i & 1) as f32 * 4.0, (i >> 1 & 1) as f32 * 3.0, (i >> 2) as f32 * 2.5);
    let sides = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let materials = vec![0; triangles.len()];
    let mesh = Mesh { positions: (0..8).map(corner).collect(), triangles, materials, ..Mesh::default() };
    let grey = Material { name: "plaster".into(), albedo: Vec3::splat(0.5), texture: None, emission: Vec3::ZERO };
    Scene::new(mesh, vec![grey], Vec::new(), DVec3::ZERO)
}
