//! The generator of random interiors: sites that load without a fault, the same bytes each time, poses in the open.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on")]

use crate::interior::hand_held::fusion::{Frame, Volume};
use crate::interior::light::{Field, sunlight};
use crate::interior::pictures::lamps;
use crate::interior::shade::seen;
use crate::interior::{Kind, Options};
use crate::support::{contents, load, on_threads};
use clerestory::panorama;
use clerestory::reference::{Eye, Lights, ReferenceSettings, irradiance};
use clerestory::scene::{self, Health, Ray, Scene};
use clerestory::site::{Pictures, Pose, Site};
use glam::{DMat3, DVec3, Vec3};
use std::path::Path;

/// As small as can be: what is made is looked at, not how good it looks.
fn tiny(seed: u64) -> Options {
    Options {
        seed,
        probe_width: 32,
        photo_size: [24, 16],
        samples: 1,
        links: 6,
        texels: 12.0,
        scan_triangles: 4e3,
        pictures: true,
        eight_bit: true,
        hand_held: false,
    }
}

/// Distance to what stands in a direction.
fn distance(scene: &Scene, from: Vec3, direction: Vec3) -> f32 {
    scene.tracer.closest(&Ray { origin: from, direction }, 0.0).map_or(f32::INFINITY, |h| h.t)
}

#[test]
fn each_kind_loads_and_is_lit_and_its_stations_stand_in_the_open() {
    for seed in 0..5 {
        let folder = tempfile::tempdir().unwrap();
        crate::interior::write(folder.path(), &tiny(seed)).unwrap();
        let (site, scene) = load(&folder.path().join("site.toml"));
        let (truth, true_scene) = load(&folder.path().join("truth/site.toml"));
        load(&folder.path().join("site_8bit.toml"));
        assert!(site.probes.len() >= 2 && site.views.len() >= 2, "seed {seed}");
        for (given, known) in site.probes.iter().zip(&truth.probes) {
            assert_eq!(given.pose.position, known.pose.position, "the poses given are the true ones");
            let at = true_scene.local(known.pose.position);
            let down = distance(&true_scene, at, Vec3::NEG_Z);
            assert!((1.1..1.9).contains(&down), "seed {seed}: {} hangs {down} m above what is below", known.name);
            assert!([Vec3::X, Vec3::Y, -Vec3::X, -Vec3::Y].iter().all(|d| distance(&true_scene, at, *d) > 0.35));
            // the given model is off by millimetres, not by more
            let off = down - distance(&scene, scene.local(given.pose.position), Vec3::NEG_Z);
            assert!(off.abs() < 0.012, "seed {seed}: the floor is {off} m off");
            let picture = panorama::read(&known.pictures[0].path).unwrap();
            let lit = picture.pixels.iter().filter(|p| p.max_element() > 0.0).count();
            assert!(lit * 100 > picture.pixels.len() * 98, "seed {seed}: {lit} pixels have light");
        }
        let (given, known) = (scene.mesh.positions.len(), true_scene.mesh.positions.len());
        assert!(given > known, "seed {seed}: {known} vertices became {given}");
    }
}

#[test]
fn the_same_seed_writes_the_same_bytes_on_any_number_of_threads() {
    let write = |options: &Options, threads: usize| {
        let folder = tempfile::tempdir().unwrap();
        on_threads(threads, || crate::interior::write(folder.path(), options).map_err(|e| e.to_string())).unwrap();
        contents(folder.path())
    };
    let (once, again) = (write(&tiny(4), 1), write(&tiny(4), 2));
    assert_eq!(once.keys().collect::<Vec<_>>(), again.keys().collect::<Vec<_>>());
    assert!(once.iter().all(|(name, bytes)| again[name] == *bytes), "two threads write other bytes than one");
    let other = write(&Options { pictures: false, ..tiny(9) }, 2);
    let model = Path::new("truth/model.obj");
    assert!(once[model] != other[model], "another seed is another place");
}

/// The example's own renderer against the library's unbiased path tracer: light on places all around a probe, what comes
/// straight from the sun left out of both.
#[test]
fn light_is_as_the_path_tracer_has_it() {
    for (seed, kind) in [(1, Kind::Hall), (5, Kind::Rooms)] {
        let folder = tempfile::tempdir().unwrap();
        let drawn = crate::interior::write(folder.path(), &Options { pictures: false, ..tiny(seed) }).unwrap();
        assert_eq!(drawn.kind, kind);
        let site = Site::load_with(&folder.path().join("truth"), Pictures::MayBeMissing).unwrap();
        let scene = scene::load(&site, &mut Health::default()).unwrap();
        let lamps = lamps(&site, &scene, &drawn.windows).unwrap();
        let eye = |width: usize| Eye::Panorama { pose: site.probes[0].pose, width, height: width / 2 };
        let field = Field::new(&scene, &lamps, seen(&scene, &eye(128), 1).into_iter(), 48, seed);
        // smoothing moves light about, so that one place may be off: all around have to agree
        let places: Vec<_> = seen(&scene, &eye(24), 1).into_iter().step_by(3).collect();
        let lights = Lights::load(&site, &scene).unwrap();
        let (mut known, mut square) = (0.0, 0.0);
        for (k, &place) in places.iter().enumerate() {
            let settings = ReferenceSettings { samples: 160, seed: k as u64, ..ReferenceSettings::default() };
            let (all, error) = irradiance(&scene, &lights, place.0, place.1, &settings);
            known += (all - sunlight(&scene, &lamps, place, Vec3::ZERO)).dot(Vec3::ONE);
            square += error.dot(Vec3::ONE).powi(2);
        }
        let noise = square.sqrt();
        let made = places.iter().map(|&(p, n)| field.irradiance(p, n).dot(Vec3::ONE)).sum::<f32>();
        assert!((made - known).abs() < 3.0 * noise + 0.04 * known, "seed {seed}: {made} of {known} ± {noise}");
        assert!(noise < 0.04 * known, "the test would see little: {noise} of {known}");
    }
}

#[test]
fn frames_of_a_plane_are_fused_to_that_plane() {
    let frame = |x: f64| Frame {
        pose: Pose { position: DVec3::new(x, -1.0, 0.02), rotation: DMat3::IDENTITY },
        size: [40, 30],
        focal: 30.0,
        depths: vec![1.0; 40 * 30],
        colours: vec![Vec3::new(0.2, 0.5, 0.7); 40 * 30],
        objects: vec![7; 40 * 30],
    };
    let mut volume = Volume::new(0.03);
    [-0.1, 0.0, 0.1].into_iter().for_each(|x| volume.add(&frame(x)));
    let fused = volume.surface();
    assert!(fused.triangles.len() > 500, "{} triangles", fused.triangles.len());
    assert!(fused.positions.iter().all(|p| p.y.abs() < 1e-3), "the plane is y = 0");
    assert!(fused.colours.iter().all(|c| c.distance(Vec3::new(0.2, 0.5, 0.7)) < 1e-4));
    assert!(fused.objects.iter().all(|o| *o == 7));
    for t in &fused.triangles {
        let [a, b, c] = t.map(|i| fused.positions[i as usize]);
        assert!((b - a).cross(c - a).y < 0.0, "it faces the frames");
    }
}

#[test]
fn a_walk_through_an_interior_gives_a_scan_probes_and_photographs() {
    let folder = tempfile::tempdir().unwrap();
    let options = Options { photo_size: [180, 120], scan_triangles: 4e4, hand_held: true, ..tiny(7) };
    crate::interior::write(folder.path(), &options).unwrap();
    let (site, scene) = load(&folder.path().join("site.toml"));
    let (truth, true_scene) = load(&folder.path().join("truth/site.toml"));
    assert!(site.probes.len() >= 10 && site.views.len() == 3);
    for (given, known) in site.probes.iter().zip(&truth.probes) {
        let off = given.pose.position.distance(known.pose.position);
        assert!(off > 1e-5 && off < 0.03, "tracked {off} m from where it was");
    }
    // a scan's point is near a true surface: a ray from a little before it meets that at about the point
    let middle = true_scene.local(truth.probes[0].pose.position);
    let off = |p: &Vec3| {
        let p = true_scene.local(scene.origin + p.as_dvec3());
        (distance(&true_scene, middle, (p - middle).normalize()) - p.distance(middle)).abs()
    };
    let mut off: Vec<f32> = scene.mesh.positions.iter().map(off).collect();
    off.sort_unstable_by(f32::total_cmp);
    assert!(off[off.len() / 2] < 0.03, "half of the points within {} m", off[off.len() / 2]);
    let objects = std::fs::read_to_string(folder.path().join("truth/objects.txt")).unwrap();
    let model = std::fs::read_to_string(folder.path().join("model/model.obj")).unwrap();
    assert_eq!(objects.lines().count(), model.lines().filter(|l| l.starts_with("v ")).count());
}
