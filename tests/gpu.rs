//! Baked models drawn by a graphics card, against closed forms and against rays cast at the same triangles.

#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "helpers of tests may panic like tests, and say what is skipped"
)]

mod support;

use clerestory::bake::{BakeSettings, Baked, Vertex, bake};
use clerestory::gpu::{Drawer, GpuError};
use clerestory::panorama::{self, Exposure, Panorama, Picture, Projection};
use clerestory::render::{Options, PrimaryRays, Source};
use clerestory::scene::{Material, Mesh, Ray, Scene, Texture, Tracer};
use clerestory::site::{Camera, Pose};
use clerestory::study::flip;
use clerestory::volume::VolumeSettings;
use glam::{DMat3, DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;
use std::path::Path;
use support::program::clerestory;
use support::{HIGH, Plan, chapel, closed, grey, load, v};

/// A drawer, or nothing where the machine has no graphics card, not even one in software.
fn drawer(scene: &Scene, baked: &Baked) -> Option<Drawer> {
    match Drawer::new(scene, baked, 0) {
        Err(GpuError::NoAdapter { why }) => {
            println!("skipped: no graphics card ({why})");
            None
        }
        drawer => Some(drawer.unwrap()),
    }
}

/// A baked model as rays see it.
struct Reference<'a> {
    scene: &'a Scene,
    baked: &'a Baked,
    tracer: Tracer,
    sky: Panorama,
}

impl<'a> Reference<'a> {
    fn new(scene: &'a Scene, baked: &'a Baked) -> Self {
        let positions = baked.vertices.iter().map(|v| v.position).collect();
        let mesh = Mesh { positions, triangles: baked.triangles.clone(), ..Mesh::default() };
        let sky = Panorama::new(baked.skies[0].clone(), Projection::LatLong, DMat3::IDENTITY);
        Self { scene, baked, tracer: Tracer::new(&mesh), sky }
    }

    /// One ray a sample, back faces passed through.
    fn draw(&self, camera: &Camera, samples: u32) -> Picture {
        let rays = PrimaryRays::new(camera, samples);
        let origin = self.scene.local(camera.pose.position);
        let mut picture = Picture::new(camera.width as usize, camera.height as usize);
        let width = picture.width;
        let step = 1.0 / (samples as f32).sqrt();
        picture.pixels.par_iter_mut().enumerate().for_each(|(i, pixel)| {
            let (x, y) = (i % width, i / width);
            let (_, [right, down]) = rays.middle(x, y);
            let sum: Vec3 = (0..rays.offsets.len())
                .map(|s| self.radiance(origin, rays.direction(x, y, s), [right * step, down * step]))
                .sum();
            *pixel = sum / samples as f32;
        });
        picture
    }

    /// What comes back along a ray; `beside` leads to the next sample's ray to the right and down.
    fn radiance(&self, origin: Vec3, direction: Vec3, beside: [Vec3; 2]) -> Vec3 {
        let mut from = 1e-3;
        while let Some(hit) = self.tracer.closest(&Ray { origin, direction }, from) {
            let corners = self.baked.triangles[hit.triangle as usize].map(|v| &self.baked.vertices[v as usize]);
            let [a, b, c] = corners.map(|v| v.position);
            let normal = (b - a).cross(c - a);
            if normal.dot(direction) < 0.0 {
                return self.shade(hit.triangle, corners, origin, direction, beside);
            }
            from = hit.t;
        }
        self.sky.radiance(direction)
    }

    fn shade(&self, triangle: u32, corners: [&Vertex; 3], origin: Vec3, direction: Vec3, beside: [Vec3; 2]) -> Vec3 {
        let [a, b, c] = corners.map(|v| v.position);
        let (e1, e2) = (b - a, c - a);
        let normal = e1.cross(e2);
        let weights = |direction: Vec3| {
            let place = origin + direction * (normal.dot(a - origin) / normal.dot(direction)) - a;
            let n2 = normal.length_squared();
            let (v, w) = (e2.cross(normal).dot(place) / n2, normal.cross(e1).dot(place) / n2);
            [1.0 - v - w, v, w]
        };
        let here = weights(direction);
        let mixed = |of: &dyn Fn(usize) -> Vec3| (0..3).map(|k| of(k) * here[k]).sum::<Vec3>();
        let vertex = |k: usize| self.baked.triangles[triangle as usize][k] as usize;
        let mut e = mixed(&|k| self.baked.irradiance[0][vertex(k)]);
        if let (Some(sun), false) = (self.baked.suns[0], self.baked.sunlight[0].is_empty()) {
            let place = mixed(&|k| corners[k].position) + normal.normalize() * 2e-3;
            if !self.tracer.occluded(&Ray { origin: place, direction: sun }, 1e-4, f32::INFINITY) {
                e += mixed(&|k| self.baked.sunlight[0][vertex(k)]);
            }
        }
        let material = self.baked.materials.partition_point(|first| *first <= triangle) - 1;
        let material = &self.scene.materials[material];
        if material.emission != Vec3::ZERO {
            return e / PI;
        }
        let uv = |weights: [f32; 3]| (0..3).map(|k| corners[k].uv * weights[k]).sum::<Vec2>();
        let [right, down] = beside.map(|way| uv(weights(direction + way)) - uv(here));
        let texture = material.texture.map(|t| &self.scene.textures[t as usize]);
        let texel = texture.map_or(Vec3::ONE, |t| t.patch(uv(here), right, down, Texture::APART));
        material.albedo * texel * mixed(&|k| corners[k].colour) * e / PI
    }
}

/// A room of 4 × 3 × 2.5 m without a ceiling, baked by hand: irradiance changes evenly from place to place, the floor has vertex
/// colours, the south wall an even picture; the north wall is a lamp, and a board in the middle shows its back.
fn room() -> (Scene, Baked) {
    let (x, y, z) = (Vec3::X * 4.0, Vec3::Y * 3.0, Vec3::Z * 2.5);
    // corner and two edges, counter-clockwise from within; what it is made of
    let quads = [
        (Vec3::ZERO, x, y, 0),
        (Vec3::ZERO, z, x, 1),
        (Vec3::ZERO, y, z, 2),
        (x, z, y, 2),
        (y, x, z, 3),
        (Vec3::new(2.0, 1.0, 0.0), z * 0.5, y * 0.3, 2),
    ];
    let material = |albedo: [f32; 3], texture: Option<u32>, emission: f32| Material {
        name: String::new(),
        albedo: Vec3::from(albedo),
        texture,
        emission: Vec3::splat(emission),
    };
    let materials = vec![
        material([0.6, 0.5, 0.4], None, 0.0),
        material([0.9, 0.8, 0.7], Some(0), 0.0),
        material([0.5, 0.5, 0.5], None, 0.0),
        material([0.1, 0.1, 0.1], Some(0), 1.0),
    ];
    let texture = Texture::new("even".to_owned(), 12, 5, vec![[188, 128, 64, 255]; 60]);
    let mut mesh = Mesh::default();
    let mut baked = Baked {
        lightings: vec![String::new()],
        vertices: Vec::new(),
        irradiance: vec![Vec::new()],
        sunlight: vec![Vec::new()],
        suns: vec![None],
        triangles: Vec::new(),
        origins: Vec::new(),
        materials: vec![0, 2, 4, 10, 12],
        exposures: vec![Exposure(1.0)],
        views: Vec::new(),
        skies: vec![Picture { width: 8, height: 4, pixels: vec![Vec3::new(3.0, 4.0, 5.0); 32] }],
        coarse: Vec::new(),
        coarse_materials: Vec::new(),
        hidden: Vec::new(),
        two_sided: 0,
    };
    for (corner, u, v, material) in [0, 1, 2, 3, 5, 4].map(|i| quads[i]) {
        let first = mesh.positions.len() as u32;
        for (at, uv) in
            [(corner, [0.0, 0.0]), (corner + u, [1.0, 0.0]), (corner + u + v, [1.0, 1.0]), (corner + v, [0.0, 1.0])]
        {
            mesh.positions.push(at);
            mesh.uvs.push(Vec2::from(uv) * 3.0);
            let colour = if material == 0 { colour(at) } else { Vec3::ONE };
            mesh.colours.push(colour);
            let uv = Vec2::from(uv) * 3.0;
            let (normal, source) = (u.cross(v).normalize(), Source::Record);
            baked.vertices.push(Vertex {
                position: at,
                lit_at: at,
                normal,
                uv,
                colour,
                source,
                agreement: 1.0,
                probe: None,
                seen_by: 0,
            });
            baked.irradiance[0].push(irradiance(at));
        }
        for t in [[0, 1, 2], [0, 2, 3]] {
            mesh.triangles.push(t.map(|k| first + k));
            mesh.materials.push(material);
        }
    }
    baked.triangles.clone_from(&mesh.triangles);
    (Scene::new(mesh, materials, vec![texture], DVec3::ZERO), baked)
}

/// The light of the room.
fn irradiance(at: Vec3) -> Vec3 {
    Vec3::new(1.0 + at.x, 2.0 + at.y, 3.0 + at.z)
}

/// The colour of its floor.
fn colour(at: Vec3) -> Vec3 {
    Vec3::new(0.2 + 0.2 * at.x, 1.0, 1.0 - 0.3 * at.y)
}

/// What the room sends back along a ray, and which of its sides does.
fn told(from: Vec3, direction: Vec3) -> (usize, Vec3) {
    let size = Vec3::new(4.0, 3.0, 2.5);
    let ends = [Vec3::ZERO, size];
    let side = |c: usize| usize::from(direction[c] > 0.0);
    let far = |c: usize| (ends[side(c)][c] - from[c]) / direction[c];
    let c = (0..3).fold(0, |best, c| if far(c) < far(best) { c } else { best });
    let at = from + direction * far(c);
    let texel = Vec3::new(0.502_886_5, 0.215_860_5, 0.051_269_46); // sRGB 188, 128, 64
    let radiance = match (c, side(c)) {
        (2, 1) => Vec3::new(3.0, 4.0, 5.0),
        (2, _) => Vec3::new(0.6, 0.5, 0.4) * colour(at) * irradiance(at) / PI,
        (1, 0) => Vec3::new(0.9, 0.8, 0.7) * texel * irradiance(at) / PI,
        (1, _) => irradiance(at) / PI,
        _ => 0.5 * irradiance(at) / PI,
    };
    (2 * c + side(c), radiance)
}

/// Radiance as the light that is known makes it, to 10⁻³ in every pixel that shows one side of the room, from the faintest light to the
/// brightest; and again with another light.
#[test]
fn a_room_whose_light_is_known_is_drawn_as_it_is() {
    let (scene, baked) = room();
    let Some(mut drawer) = drawer(&scene, &baked) else { return };
    println!("{}", drawer.adapter());
    let eyes =
        [([3.1, 2.0, 1.2], [0.5, 0.0, 1.0]), ([3.5, 0.4, 0.8], [2.0, 3.0, 1.6]), ([3.0, 1.5, 2.2], [0.0, 1.4, 0.0])];
    for (eye, target) in eyes.map(|(e, t)| (DVec3::from(e), DVec3::from(t))) {
        let camera = Camera::with_fov(Pose::look_at(eye, target), 90, 60, 75.0);
        let rays = PrimaryRays::new(&camera, 9);
        let picture = drawer.draw(&camera, 9).unwrap();
        let mut sides = 0;
        for (i, pixel) in picture.pixels.iter().enumerate() {
            let seen: Vec<_> = (0..9).map(|s| told(eye.as_vec3(), rays.direction(i % 90, i / 90, s))).collect();
            let mean = seen.iter().map(|s| s.1).sum::<Vec3>() / 9.0;
            // where sides meet, a card may round a sample to either
            let one = seen.iter().all(|s| s.0 == seen[0].0);
            let bound = if one { 1e-3 * mean } else { 0.5 * mean.max(Vec3::ONE) + 1.0 };
            assert!((pixel - mean).abs().cmple(bound).all(), "pixel {i}: {pixel} for {mean}");
            sides |= 1 << seen[0].0;
        }
        assert!(u32::count_ones(sides) >= 3, "several sides are seen: {sides:b}");
    }
    let camera = Camera::with_fov(Pose::look_at(DVec3::new(3.1, 2.0, 1.2), DVec3::new(0.5, 0.0, 1.0)), 50, 50, 60.0);
    let first = drawer.draw(&camera, 1).unwrap();
    for scale in [1e9, 1e-6] {
        let light: Vec<Vec3> = baked.irradiance[0].iter().map(|e| *e * scale).collect();
        drawer.relight(&light).unwrap();
        let again = drawer.draw(&camera, 1).unwrap();
        let lit = first.pixels.iter().zip(&again.pixels).filter(|(a, _)| **a != Vec3::new(3.0, 4.0, 5.0));
        assert!(lit.clone().count() > 1000);
        lit.for_each(|(a, b)| assert!((*b / scale - *a).abs().cmple(1e-5 * *a).all(), "{a} {b}"));
    }
}

/// What cannot be drawn is refused, with what to do.
#[test]
fn what_a_card_cannot_draw_is_refused() {
    let (scene, baked) = room();
    let Some(mut drawer) = drawer(&scene, &baked) else { return };
    let pose = Pose::look_at(DVec3::new(3.1, 2.0, 1.2), DVec3::new(0.5, 0.0, 1.0));
    let mut camera = Camera::with_fov(pose, 40, 30, 60.0);
    let told = drawer.draw(&camera, 6).unwrap_err().to_string();
    assert!(told.contains("Take 4 or 9"), "{told}");
    camera.skew = 1.0;
    assert!(matches!(drawer.draw(&camera, 4), Err(GpuError::NotPinhole)));
    assert!(matches!(drawer.relight(&[Vec3::ONE]), Err(GpuError::Vertices { given: 1, expected: 24 })));
    assert!(matches!(Drawer::new(&scene, &baked, 1), Err(GpuError::Lighting { asked: 1, baked: 1 })));
    // a picture in several tiles is that of a camera that sees their seam in its middle
    (camera.skew, camera.height) = (0.0, 2100);
    let tall = drawer.draw(&camera, 4).unwrap();
    (camera.centre.y, camera.height) = (camera.centre.y - 2000.0, 100);
    let seam = drawer.draw(&camera, 4).unwrap();
    let pairs = tall.pixels[2000 * 40..].iter().zip(&seam.pixels);
    let off = pairs.filter(|(a, b)| (**a - **b).abs().max_element() > 1e-4 * b.max_element()).count();
    assert!(off * 100 < seam.pixels.len(), "{off} pixels differ");
}

/// The chapel with few vertices, the sun in their light and apart from it: as rays at the same triangles see it.
#[test]
fn the_chapel_is_drawn_as_rays_see_its_triangles() {
    let (site, scene) = load(&chapel());
    let options = Options {
        lightings: vec![site.lightings()[0].clone()],
        volume: VolumeSettings { cells: 12, rays: 32, ..VolumeSettings::default() },
        ..Options::of(&site)
    };
    for (sun_apart, bound) in [(false, 0.003), (true, 0.01)] {
        let settings =
            BakeSettings { vertices: 12_000, error: 0.3, views: false, sun_apart, ..BakeSettings::default() };
        let baked = bake(&site, &scene, &options, &settings, &|_| ()).unwrap().baked;
        let Some(mut drawer) = drawer(&scene, &baked) else { return };
        let reference = Reference::new(&scene, &baked);
        for view in &site.views {
            let off = flip(&drawer.draw(&view.camera, 4).unwrap(), &reference.draw(&view.camera, 4));
            println!("{}, sun apart {sun_apart}: FLIP {off:.4}", view.name);
            assert!(off <= bound, "{}, sun apart {sun_apart}: FLIP {off}", view.name);
        }
    }
}

/// The program bakes a site and draws its views: a white room that is equally bright all over, a furnace, is so from everywhere,
/// also where walls meet and light comes from the volume.
#[test]
fn the_program_draws_a_sites_views() {
    let plan = Plan::new(closed(DVec3::ZERO, HIGH, 0), &[grey(1.0)])
        .probe(v(2.0, 1.5, 1.2), 64)
        .view(v(1.0, 1.0, 1.0), v(4.0, 2.0, 1.0), 48)
        .view(v(3.0, 2.0, 1.6), v(0.0, 1.0, 1.0), 48);
    let built = plan.build().furnace(&plan, 0.2);
    let folder = built.folder.path();
    let run =
        |more: &[&str]| clerestory(&[&"render", &folder, &"--gpu", &"--json", &"--out", &folder.join("out")], more);
    let done = run(&[]);
    if done.stderr.contains("no graphics card") {
        println!("skipped: {}", done.stderr);
        return;
    }
    let outcome = done.json();
    assert!(outcome["adapter"].as_str().is_some_and(|a| !a.is_empty()));
    let views = outcome["views"].as_array().unwrap();
    assert_eq!(views.len(), 2);
    for view in views {
        assert!(view["draw_s"].as_f64().unwrap() > 0.0 && view["read_s"].as_f64().unwrap() > 0.0);
        let file = Path::new(view["file"].as_str().unwrap());
        assert!(file.with_extension("png").exists());
        let picture = panorama::read(file).unwrap();
        let off = picture.pixels.iter().map(|p| (*p / 0.2 - 1.0).abs().max_element()).fold(0.0, f32::max);
        assert!(off < 0.02, "{}: {off}", file.display());
    }
    let told = run(&["--samples", "5"]).stderr;
    assert!(told.contains("v0") && told.contains("Take 4 or 9"), "{told}");
}
