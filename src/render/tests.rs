//! What a frame makes of small scenes.

use glam::{DMat3, DVec3, Vec2, Vec3};

use super::{Irradiance, Lit, ShadingPoint, Source, render};
use crate::scene::{Material, Mesh, Scene, Texture};
use crate::site::{Camera, Pose};
use crate::volume::Nearby;

/// The same light everywhere.
struct Even;

impl Irradiance for Even {
    fn at(&self, _: &ShadingPoint, _: &mut Nearby) -> Lit {
        Lit::known(Vec3::ONE, Source::Record, 1.0)
    }

    fn sky(&self, _: Vec3) -> Vec3 {
        Vec3::ZERO
    }
}

#[test]
fn each_sample_counts_once_where_triangles_carry_each_other_on_here_and_there() {
    // a wall of two triangles of one grey, whose mappings agree only near x = 0, where their slanted edge runs
    let mut mesh = Mesh::default();
    let corner = |x: f32, z: f32| Vec3::new(x, 1.0, z);
    let (low, high) = (corner(-0.2, -1.0), corner(0.2, 1.0));
    for (corners, scale) in [([low, high, corner(-1.0, 0.0)], 1.0), ([high, low, corner(1.0, 0.0)], 1.1)] {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.uvs.extend(corners.map(|p| Vec2::new(scale * p.x, p.z)));
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.materials.push(0);
    }
    let grey = Texture::new(String::new(), 64, 64, vec![[100, 100, 100, 255]; 64 * 64]);
    let material = Material { name: String::new(), albedo: Vec3::ONE, texture: Some(0), emission: Vec3::ZERO };
    let scene = Scene::new(mesh, vec![material], vec![grey], DVec3::ZERO);
    let camera = Camera::with_fov(Pose { position: DVec3::ZERO, rotation: DMat3::IDENTITY }, 64, 64, 10.0);
    let albedo = scene.albedo(0, Vec2::splat(0.2));
    for (i, seen) in render(&scene, &Even, &camera, 16, &|_, _| ()).albedo.pixels.iter().enumerate() {
        assert!(((*seen - albedo) / albedo).abs().max_element() < 1e-4, "{} {}: {seen} not {albedo}", i % 64, i / 64);
    }
}
