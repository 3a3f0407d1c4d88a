//! Models that are odd, broken or extreme: each is read right or refused with a clear message, never a panic.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "support/readers.rs"]
mod readers;
mod support;

use clerestory::scene::{self, Health, Ray, Scene, SceneError};
use clerestory::site::Site;
use glam::{DVec3, Vec2, Vec3};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;
use support::data::shared;
use support::{encoded, png};
use tempfile::TempDir;

/// A folder with a site file around a model; `site` are further lines of the `[site]` table.
fn folder(site: &str, files: &[(&str, &[u8])]) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    let text = format!("[site]\nname = \"t\"\n{site}\n[model]\npath = \"m.obj\"\n");
    fs::write(dir.path().join("site.toml"), text).unwrap();
    for (name, bytes) in files {
        fs::write(dir.path().join(name), bytes).unwrap();
    }
    dir
}

fn load(dir: &Path) -> Result<(Scene, Health), SceneError> {
    let site = Site::load(dir).unwrap();
    let mut health = Health::default();
    let scene = scene::load(&site, &mut health)?;
    Ok((scene, health))
}

const METRES_Z: &str = "units = \"m\"\nup = \"z\"";

fn load_obj(obj: &str) -> Result<(Scene, Health), SceneError> {
    load(folder(METRES_Z, &[("m.obj", obj.as_bytes())]).path())
}

/// A model with its materials, and a picture under this name.
fn load_textured(obj: &str, mtl: &str, name: &str, picture: &[u8]) -> Result<(Scene, Health), SceneError> {
    let files = [("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes()), (name, picture)];
    load(folder(METRES_Z, &files).path())
}

fn load_with_mtl(obj: &str, mtl: &str) -> (Scene, Health) {
    load_textured(obj, mtl, "none.png", b"").unwrap()
}

fn message(result: Result<(Scene, Health), SceneError>) -> String {
    result.err().expect("an error").to_string()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// A folder with a site file around a model elsewhere.
fn site_around(model: &Path, up: &str) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    let model = model.canonicalize().unwrap();
    let text = format!("[site]\nunits = \"m\"\nup = \"{up}\"\n[model]\npath = '{}'\n", model.display());
    fs::write(dir.path().join("site.toml"), text).unwrap();
    dir
}

/// Loads a file as a site's model on a thread of its own and gives it ten seconds.
fn load_in_time(path: &Path) -> Result<(usize, Vec<String>), String> {
    let dir = site_around(path, "y");
    let (done, wait) = mpsc::channel();
    std::thread::spawn(move || {
        let result = load(dir.path());
        // nobody waits any more after a time-out
        let _ = done.send(result.map(|(s, h)| (s.mesh.triangles.len(), h.warnings)).map_err(|e| e.to_string()));
    });
    match wait.recv_timeout(Duration::from_secs(10)) {
        Ok(result) => result,
        Err(e) => panic!("{}: {e}", path.display()),
    }
}

#[test]
fn every_cursed_file_is_read_or_refused_clearly() {
    let Some(folder) = shared("cursed/obj") else { return };
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    let mut read = 0;
    for file in &files {
        match load_in_time(file) {
            Ok((triangles, warnings)) => {
                read += 1;
                println!("{}: {triangles} {warnings:?}", file.display());
            }
            Err(message) => {
                println!("{message}");
                let name = file.file_name().unwrap().to_string_lossy();
                assert!(message.contains(&*name) && message.len() > name.len() + 30, "{message}");
            }
        }
    }
    assert!(files.len() > 80 && read > 40, "{read} of {}", files.len());
}

#[test]
fn cursed_files_give_known_counts() {
    let Some(folder) = shared("cursed/obj") else { return };
    let counts = [
        ("cube.obj", 12),
        ("cube-vertexcol.obj", 12),
        ("cube_with_vertexcolors.obj", 12),
        ("cube-vertex-w-component.obj", 12),
        ("box_without_lineending.obj", 12),
        ("testmixed.obj", 12),
        ("issue-161-inconsistent-f.obj", 12),
        ("only_a_part_of_vertexcolors.obj", 3),
        ("number_formats.obj", 0),
        ("issue-319-003.obj", 8),
        ("issue-235-usemtl-then-o.obj", 2),
        ("multiple_spaces.obj", 1),
        ("leading-decimal-dot-issue-201.obj", 1),
        ("smoothing-group-two-squares.obj", 3),
    ];
    for (name, expected) in counts {
        let found = load_in_time(&folder.join(name)).map_or(0, |(triangles, _)| triangles);
        assert_eq!(found, expected, "{name}");
    }
}

#[test]
fn models_of_interiors_load_with_sane_health() {
    let Some(models) = shared("models") else { return };
    let cases = [
        ("sibenik/sibenik_merged.obj", "y", 75_000..81_000, 30.0..60.0),
        ("ctk_church/CTK_Church.obj", "z", 1_100..1_235, 20.0..100.0),
        ("copyroom/copyroom_c2000_opt.obj", "y", 30_000..30_948, 3.0..20.0),
    ];
    for (name, up, triangles, across_m) in cases {
        let (scene, health) = load(site_around(&models.join(name), up).path()).unwrap();
        println!("{name}: {health:?}");
        assert!(triangles.contains(&health.triangles), "{name}: {}", health.triangles);
        assert!(across_m.contains(&DVec3::from_array(health.size_m).length()), "{name}: {:?}", health.size_m);
        assert_eq!(health.not_finite, 0);
        assert!(health.areas.iter().all(|a| a.area_m2.is_finite() && a.area_m2 > 0.0));
        let edges = scene::edges(&scene.mesh);
        assert!(edges.total > health.triangles && edges.inverted * 10 < edges.total, "{name}: {edges:?}");
        assert!(scene.mesh.positions.iter().all(|p| p.is_finite()));
    }
}

#[test]
fn other_formats_are_named() {
    let cases: [(&[u8], &str); 5] = [
        (b"solid name\nfacet normal 0 0 1\n", "STL"),
        (b"\xfe\xff\0v\0 \x001", "UTF-16"),
        (b"Kaydara FBX Binary  \0", "FBX"),
        (b"# made\nnewmtl a\nKd 1 1 1\n", "material (MTL)"),
        (b"\x7fELF\0\0\0", "binary"),
    ];
    for (bytes, kind) in cases {
        let text = message(load(folder(METRES_Z, &[("m.obj", bytes)]).path()));
        assert!(text.contains(kind) && text.contains("expected an OBJ, PLY, glTF or E57 model"), "{text}");
    }
}

#[test]
fn faults_name_their_line() {
    let cases = [
        ("v 0 0\n", ":1: expected v and three numbers"),
        ("v 0 0 zero\n", ":1: expected v and three numbers, found “v 0 0 zero”"),
        ("# one\n\nv 0 0 0 1 nought\nvt\n", ":4: expected vt"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", ":4: the face names vertex 9, but 3 come before it"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", ":4: the face names vertex -4"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", ":4: the face names vertex 0"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n", ":4: the face names texture coordinate 1, but 0"),
        ("v 0 0 0\nv 1 0 0 \\\n\nv 0 1 0\nf a b c\n", ":5: expected a face of vertex numbers, found “a”"),
        ("v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 x\r", ":4: expected a face"),
        ("v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 x\r\n", ":4: expected a face"),
    ];
    for (obj, expected) in cases {
        let text = message(load_obj(obj));
        assert!(text.contains("m.obj") && text.contains(expected), "{text}\nis not\n{expected}");
    }
    assert!(message(load_obj("")).contains("no usable triangle (0 vertices"));
    assert!(message(load_obj("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")).contains("1 of them without area"));
}

#[test]
fn traps_of_the_format_are_cured() {
    // continued lines, a byte that is no UTF-8, a comment behind a face, points and lines, indices counted back, a
    // weight, a texture coordinate of one number, a corner without one
    let mut obj =
        b"# caf\xe9\ng caf\xe9\nv 0 0 \\\n 0\nv 2 0 0 2\nv 1 1 0\nv 0 1 0\nvt 0.25\nvt 1 0\nvt 1 1\nvt 0 1\n".to_vec();
    obj.extend(b"p 1 2\nl 1 2 3\nvn 0 0 1\nf -4/-4/1 -3/-3/1 -2/3/1 # front\nf 1/1 3/3 4\nf 1 2\n");
    let (scene, health) = load(folder(METRES_Z, &[("m.obj", &obj)]).path()).unwrap();
    assert_eq!(scene.mesh.triangles.len(), 2);
    assert_eq!(health.size_m, [1.0, 1.0, 0.0]);
    assert_eq!(scene.mesh.uv(0, Vec2::ZERO), Some(Vec2::new(0.25, 0.0)));
    assert_eq!(scene.mesh.uv(0, Vec2::Y), Some(Vec2::ONE));
    let text = health.warnings.join("\n");
    assert!(
        text.contains("ignored, as only faces have a surface: 2")
            && text.contains("fewer than three corners ignored: 1"),
        "{text}"
    );
}

#[test]
fn vertex_colours_may_be_missing_or_bytes() {
    let obj = "v 0 0 0\nv 1 0 0 1 0.5 0.25\nv 1 1 0 0 0 1\nv 0 1 0\nf 1 2 3 4\n";
    let (scene, health) = load_obj(obj).unwrap();
    let at = |p: Vec3| {
        let i = scene.mesh.positions.iter().position(|q| (*q + scene.origin.as_vec3()).distance(p) < 1e-6).unwrap();
        scene.mesh.colours[i]
    };
    assert_eq!(at(Vec3::ZERO), Vec3::ONE);
    assert_eq!(at(Vec3::X), Vec3::new(1.0, 0.5, 0.25));
    assert!(health.warnings[0].contains("as white, while others have one: 2"));
    let bytes = obj.replace("1 0.5 0.25", "255 51 0").replace("0 0 1\n", "0 0 255\n");
    let (scene, health) = load_obj(&bytes).unwrap();
    assert!(scene.mesh.colours.iter().any(|c| c.distance(Vec3::new(1.0, 0.2, 0.0)) < 1e-6));
    assert!(health.warnings.iter().any(|w| w.contains("0 to 255")));
}

#[test]
fn not_finite_vertices_cost_only_their_triangles() {
    let obj = format!("{SQUARE}v 1.#QNAN 0 0\nv inf 0 0\nv 1e300 0 0\nf 1 2 3\nf 1 2 5\nf 1 2 6\nf 1 3 4\nf 1 5 4\n");
    let (scene, health) = load_obj(&obj.replace("v 1e300 0 0\n", "")).unwrap();
    assert_eq!((health.triangles, health.not_finite), (2, 3));
    assert!(scene.mesh.positions.iter().all(|p| p.is_finite()));
    assert_eq!(health.size_m, [1.0, 1.0, 0.0]);
    // among texture coordinates they cost no triangle
    let (scene, _) =
        load_obj(&format!("{SQUARE}vt -1.#IND 0\nvt 1 nan(ind)\nvt 1 1\nf 1/1 2/2 3/3\nf 1 3 4\n")).unwrap();
    assert!(scene.mesh.triangles.len() == 2 && scene.mesh.uvs.iter().all(|uv| uv.is_finite()));
}

#[test]
fn coincident_triangles_load_and_leave_one() {
    let mut obj = SQUARE.to_owned();
    for i in 0..20_000 {
        obj.push_str(["f 1 2 3\n", "f 3 2 1\n", "f 2 3 1\n"][i % 3]);
    }
    // unshared corners at the same places
    for i in 0..20_000 {
        let n = 5 + 3 * i;
        let _ = write!(obj, "v 0 0 0\nv 1 1 0\nv 0 1 0\nf {n} {} {}\n", n + 1, n + 2);
    }
    let (scene, health) = load_obj(&obj).unwrap();
    assert_eq!((scene.mesh.triangles.len(), health.duplicates), (2, 39_998));
}

/// One triangle 10,000 km off had moved all others by up to 20 cm, and made boxes of the ray caster metres wide.
#[test]
fn a_stray_triangle_moves_nothing_else() {
    let mut text = String::new();
    for (i, j) in (0..20).flat_map(|i| (0..20).map(move |j| (f64::from(i) * 0.123, f64::from(j) * 0.0571))) {
        writeln!(text, "v {i} {j} 0.7\nv {} {j} 0.7\nv {i} {} 0.7\nf -3 -2 -1", i + 0.1, j + 0.05).unwrap();
    }
    let alone = load_obj(&text).unwrap().0;
    let (scene, _) = load_obj(&format!("{text}v 1e7 1e7 0\nv 1.1e7 1e7 0\nv 1e7 1.1e7 0\nf -3 -2 -1\n")).unwrap();
    assert_eq!(scene.mesh.triangles.len(), alone.mesh.triangles.len() + 1);
    let place = |scene: &Scene, i: usize| scene.mesh.positions[i].as_dvec3() + scene.origin;
    let most = (0..1200).map(|i| place(&scene, i).distance(place(&alone, i))).fold(0.0, f64::max);
    assert!(most < 1e-6, "{most} m");
    let ray = Ray { origin: scene.local(DVec3::new(0.03, 0.01, 0.0)), direction: Vec3::Z };
    let hit = scene.tracer.closest(&ray, 1e-3).unwrap();
    assert!((hit.t - 0.7).abs() < 1e-5 && hit.triangle == 0);
}

/// What fuzzing begins with is read; what it found, and seeds that are cut short, are read or refused.
#[test]
fn seeds_are_read_and_past_crashes_do_no_harm() {
    let home = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz");
    let files = |kind: &str, reader: &str| {
        let entries = fs::read_dir(home.join(kind).join(reader)).into_iter().flatten();
        let mut files: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
        files.sort();
        files
    };
    if !home.is_dir() {
        println!("skipped: {} is not there", home.display());
        return;
    }
    let own = tempfile::tempdir().unwrap();
    for reader in readers::READERS {
        let seeds = files("seeds", reader);
        assert!(!seeds.is_empty(), "{reader} has no seed");
        for seed in seeds {
            let bytes = fs::read(&seed).unwrap();
            readers::read(reader, &bytes, own.path()).unwrap_or_else(|e| panic!("{}: {e}", seed.display()));
            for cut in 0..8 {
                let _ = readers::read(reader, &bytes[..bytes.len() * cut / 8], own.path());
            }
        }
        for crash in files("crashes", reader) {
            println!("{}", crash.display());
            let _ = readers::read(reader, &fs::read(&crash).unwrap(), own.path());
        }
    }
}

/// A 2 m square on the ground in national-grid coordinates keeps its size to micrometres, and the same ray meets it
/// at the same place as in a local model.
#[test]
fn far_coordinates_keep_their_precision() {
    let far = "v 5000000.000001 4000000.0 120.0\nv 5000002.000001 4000000.0 120.0\nv 5000002.000001 4000002.0 120.0\n\
               v 5000000.000001 4000002.0 120.0\nf 1 2 3 4\n";
    let (scene, health) = load_obj(far).unwrap();
    for corner in &scene.mesh.positions {
        let side = (*corner - scene.mesh.positions[0]).abs();
        assert!(side.to_array().iter().all(|s| s.abs() < 1e-6 || (s - 2.0).abs() < 1e-6), "{side}");
    }
    assert!((health.bounds[1][0] - 5_000_002.000_001).abs() < 1e-6);
    let eye = scene.local(DVec3::new(5_000_001.5, 4_000_000.5, 123.0));
    let ray = Ray { origin: eye, direction: Vec3::NEG_Z };
    let hit = scene.tracer.closest(&ray, 0.0).unwrap();
    assert!((hit.t - 3.0).abs() < 1e-5);
}

#[test]
fn units_and_axes_are_brought_in_once() {
    let obj = "v 1000 2000 -3000\nv 2000 2000 -3000\nv 1000 2000 -4000\nf 1 2 3\n";
    let corner = |site: &str| {
        let (scene, health) = load(folder(site, &[("m.obj", obj.as_bytes())]).path()).unwrap();
        (scene.mesh.positions[0].as_dvec3() + scene.origin, health.bounds[0], health.size_m)
    };
    let (p, low, size) = corner("units = \"mm\"\nup = \"y\"");
    assert!(p.distance(DVec3::new(1.0, 3.0, 2.0)) < 1e-6, "{p}");
    assert!(DVec3::from_array(low).distance(DVec3::new(1000.0, 2000.0, -4000.0)) < 1e-3, "{low:?}");
    assert!(DVec3::from_array(size).distance(DVec3::new(1.0, 1.0, 0.0)) < 1e-6);
    let (p, _, _) = corner("units = \"cm\"\nup = \"z\"");
    assert!(p.distance(DVec3::new(10.0, 20.0, -30.0)) < 1e-5, "{p}");
    let (p, _, _) = corner("units = 0.5\nup = \"z\"");
    assert!(p.distance(DVec3::new(500.0, 1000.0, -1500.0)) < 1e-3, "{p}");
}

const TEXTURED: &str =
    "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a b\nf 1/1 2/2 3/3 4/4\n";

/// The albedo and emission of the first triangle, and all warnings.
fn with_texture(mtl: &str, picture: &str) -> (Vec3, Vec3, String) {
    let (scene, health) = load_textured(TEXTURED, mtl, picture, &png(4, 4, [188; 3])).unwrap();
    (scene.albedo(0, Vec2::splat(0.3)), scene.emission(0), health.warnings.join("\n"))
}

#[test]
fn materials_are_forgiven_what_exporters_do() {
    let half = 0.502_886_5; // 188 of 255 decoded from sRGB
    let cases: [(&str, &str, f32, &str); 14] = [
        ("newmtl a b\nKd 1 1 1\nmap_Kd wood floor.png\n", "wood floor.png", half, ""),
        ("newmtl a b\nKd .5 .5 .5\nmap_Kd -s 1 1 1 -o 0 0 -mm 0 1 -clamp off w.png\n", "w.png", 0.5 * half, ""),
        // a picture of one grey as a mask, and one that is not there
        ("newmtl a b\nKd .5 .5 .5\nmap_d -imfchan l w.png\n", "w.png", 0.5, "Cut-out pictures: 0 triangles cut"),
        ("newmtl a b\nKd .5 .5 .5\nmap_d none.png\n", "w.png", 0.5, "there is no picture “none.png”"),
        ("newmtl a b\nmap_Kd -s 2 2 w.png\n", "w.png", half, "m.mtl:2: material “a b” scales"),
        ("newmtl a b\nKd 0 0 0\nmap_Kd w.png\n", "w.png", half, "m.mtl:3: material “a b” has Kd 0 0 0 beside"),
        ("newmtl a b\nKd 1 1 1\nmap_Kd Textures\\W.PNG\n", "w.png", half, "“Textures\\W.PNG”"),
        ("newmtl a b\nKd 0.25 0.25 0.25\nmap_Kd none.png\n", "w.png", 0.25, "the plain colour is taken"),
        ("newmtl a b\nKd 2 2 2\n", "w.png", 1.0, "m.mtl:2: material “a b” has Kd 2 2 2"),
        ("newmtl a b\nKd 0.3\n", "w.png", 0.3, ""),
        ("newmtl a b\nKd 0.3 0.3\n", "w.png", 0.3, "two numbers"),
        ("newmtl a b\nKd spectral file.rfl 1\n", "w.png", 0.5, "m.mtl:2: material “a b” has “Kd spectral"),
        ("newmtl a b\nKd 0.3 0.3 0.3\nd 0.5\n", "w.png", 0.3, "transparent"),
        ("newmtl other\nKd 0.3 0.3 0.3\n", "w.png", 0.5, "No material file holds material “a b”"),
    ];
    for (mtl, picture, expected, warning) in cases {
        let (albedo, _, warnings) = with_texture(mtl, picture);
        assert!((albedo - Vec3::splat(expected)).abs().max_element() < 1e-4, "{mtl}: {albedo}");
        assert!(if warning.is_empty() { warnings.is_empty() } else { warnings.contains(warning) }, "{mtl}: {warnings}");
    }
    assert_eq!(with_texture("newmtl a b\nKe 5 4 3\n", "w.png").1, Vec3::new(5.0, 4.0, 3.0));
    let mtl = "newmtl a b\nmap_Kd -clamp on w.png\n";
    let (scene, _) = load_textured(TEXTURED, mtl, "w.png", &png(4, 4, [188; 3])).unwrap();
    assert_eq!(scene.textures[0].wrap(), [clerestory::scene::Wrap::Clamp; 2]);
}

#[test]
fn material_files_are_found_with_blanks_and_several_on_a_line() {
    let obj = |libraries: &str| format!("mtllib {libraries}\n{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n");
    let a = b"newmtl a\nKd 0.1 0.1 0.1\n";
    let b = b"newmtl b\nKd 0.9 0.9 0.9\n";
    for libraries in
        ["one file.mtl two.mtl", "one\\ file.mtl two.mtl", "two.mtl one file.mtl", "one file.mtl\nmtllib two.mtl"]
    {
        let obj = obj(libraries);
        let files: [(&str, &[u8]); 3] = [("m.obj", obj.as_bytes()), ("one file.mtl", a), ("two.mtl", b)];
        let (scene, health) = load(folder(METRES_Z, &files).path()).unwrap();
        assert_eq!(health.warnings, Vec::<String>::new(), "{libraries}");
        let albedo = [0, 1].map(|t| scene.albedo(t, Vec2::ZERO).x);
        assert_eq!(albedo, [0.1, 0.9]);
    }
    let (scene, health) = load_obj(&obj("lost.mtl")).unwrap();
    assert!(health.warnings[0].contains("lost.mtl") && health.warnings.len() == 3, "{:?}", health.warnings);
    assert_eq!(scene.albedo(0, Vec2::ZERO), Vec3::splat(0.5));
}

#[test]
fn a_textured_face_without_coordinates_takes_the_mean_colour() {
    let obj = TEXTURED.replace("f 1/1 2/2 3/3 4/4", "f 1/1 2/2 3/3\nf 1 3 4");
    let mtl = "newmtl a b\nKd 0.5 0.5 0.5\nmap_Kd w.png\n";
    let (scene, health) = load_textured(&obj, mtl, "w.png", &png(2, 2, [188; 3])).unwrap();
    assert_eq!((health.without_uvs, scene.mesh.materials[0] != scene.mesh.materials[1]), (1, true));
    // both are 0.5 times the picture, which is of one colour
    for triangle in [0, 1] {
        assert!((scene.albedo(triangle, Vec2::splat(0.2)).x - 0.251_443).abs() < 1e-3);
    }
}

/// A header that claims a picture of 60000 × 60000 pixels, and one that is cut short.
#[test]
fn hostile_pictures_are_errors() {
    let mtl = "newmtl a b\nmap_Kd w.png\n";
    let mut bomb = png(4, 4, [9; 3]);
    bomb[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
    let crc = crc32(&bomb[12..29]).to_be_bytes();
    bomb[29..33].copy_from_slice(&crc);
    let short = &png(64, 64, [9; 3])[..60];
    for bytes in [&bomb[..], short] {
        let text = message(load_textured(TEXTURED, mtl, "w.png", bytes));
        assert!(text.contains("w.png: the picture cannot be used"), "{text}");
    }
    let mtl = "newmtl a b\nmap_Kd w.tga\n";
    let (_, health) = load_textured(TEXTURED, mtl, "w.tga", b"no picture at all").unwrap();
    assert!(health.warnings[0].contains("not a PNG, JPEG or TIFF picture"));
}

/// PNG's checksum (ISO 3309).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}

#[test]
fn concave_faces_are_cut_properly() {
    let l = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 2 3 4 5 6 1\n";
    let (scene, health) = load_obj(l).unwrap();
    assert_eq!(health.triangles, 4);
    assert!((health.areas[0].area_m2 - 3.0).abs() < 1e-6);
    let below = Ray { origin: scene.local(DVec3::new(1.5, 1.5, 1.0)), direction: Vec3::NEG_Z };
    assert_eq!(scene.tracer.closest(&below, 0.0), None);
}

#[test]
fn a_model_without_a_library_line_takes_the_file_beside_it() {
    let (scene, health) = load_with_mtl(&format!("{SQUARE}usemtl x\nf 1 2 3\n"), "newmtl x\nKd 0.7 0.7 0.7\n");
    assert!((scene.albedo(0, Vec2::ZERO).x - 0.7).abs() < 1e-6);
    assert!(health.warnings[0].contains("names no material file"));
}

#[test]
fn pictures_of_one_name_in_two_folders_stay_apart() {
    let obj = format!(
        "mtllib a/a.mtl\nmtllib b/b.mtl\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nusemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/2 4/3\n"
    );
    let dir = folder(METRES_Z, &[("m.obj", obj.as_bytes())]);
    for (name, grey) in [("a", 255), ("b", 188)] {
        let sub = dir.path().join(name);
        fs::create_dir(&sub).unwrap();
        fs::write(sub.join(format!("{name}.mtl")), format!("newmtl {name}\nmap_Kd diffuse.png\n")).unwrap();
        fs::write(sub.join("diffuse.png"), png(4, 4, [grey; 3])).unwrap();
    }
    let (scene, health) = load(dir.path()).unwrap();
    assert_eq!(health.warnings, Vec::<String>::new());
    let [a, b] = [0, 1].map(|t| scene.albedo(t, Vec2::splat(0.3)).x);
    assert!((a - 1.0).abs() < 1e-4 && (b - 0.502_886_5).abs() < 1e-4, "{a} {b}");
}

#[test]
fn text_may_be_latin_1_begin_with_a_mark_and_end_lines_in_cr() {
    let obj = format!("mtllib m.mtl\n{SQUARE}usemtl T\u{fc}r\nf 1 2 3\nusemtl T\u{f6}r\nf 1 3 4\n");
    let mtl = "newmtl T\u{fc}r\nKd .1 .1 .1\nnewmtl T\u{f6}r\nKd .9 .9 .9\n";
    let latin_1 = |text: &str| text.chars().map(|c| c as u8).collect::<Vec<u8>>();
    let marked = format!("\u{feff}{mtl}").into_bytes();
    let only_cr = format!("# made by hand\n{mtl}").replace('\n', "\r").into_bytes();
    let cases = [
        (latin_1(&obj), latin_1(mtl)),
        (latin_1(&obj), mtl.as_bytes().to_vec()),
        (obj.clone().into_bytes(), marked),
        (obj.clone().into_bytes(), only_cr),
    ];
    for (obj, mtl) in cases {
        let (scene, health) = load(folder(METRES_Z, &[("m.obj", &obj), ("m.mtl", &mtl)]).path()).unwrap();
        assert_eq!(health.warnings, Vec::<String>::new());
        assert_eq!([0, 1].map(|t| scene.albedo(t, Vec2::ZERO).x), [0.1, 0.9]);
    }
}

#[test]
fn only_alpha_cuts_holes_where_one_picture_paints_and_masks() {
    let count = |mtl: &str, picture: &[u8]| {
        let mask = png(4, 4, [0; 3]);
        let files =
            [("m.obj", TEXTURED.as_bytes()), ("m.mtl", mtl.as_bytes()), ("w.png", picture), ("d.png", &mask[..])];
        load(folder(METRES_Z, &files).path()).map_or(0, |(scene, _)| scene.mesh.triangles.len())
    };
    let both = "newmtl a b\nmap_d w.png\nmap_Kd w.png\n";
    assert_eq!(count(both, &png(4, 4, [40; 3])), 2);
    // its alpha, and a dark mask of its own, hide all
    let clear = encoded(&image::RgbaImage::from_pixel(4, 4, image::Rgba([200, 200, 200, 0])).into());
    assert_eq!(count(both, &clear), 0);
    assert_eq!(count("newmtl a b\nmap_Kd w.png\nmap_d d.png\n", &png(4, 4, [200; 3])), 0);
}

#[test]
fn a_colour_a_little_above_1_does_not_darken_all() {
    let obj = "v 0 0 0 0.5 0.5 0.5\nv 1 0 0 1.02 0.5 0.5\nv 1 1 0 0.5 0.5 0.5\nf 1 2 3\n";
    let (scene, health) = load_obj(obj).unwrap();
    assert_eq!(health.warnings, Vec::<String>::new());
    let has = |wanted: Vec3| scene.mesh.colours.iter().any(|c| c.distance(wanted) < 1e-6);
    assert!(has(Vec3::splat(0.5)) && has(Vec3::new(1.0, 0.5, 0.5)), "{:?}", scene.mesh.colours);
}

#[test]
fn material_files_of_another_machine_and_in_quotes_are_found() {
    for (library, told) in [("C:\\Users\\me\\m.mtl", 1), ("\"m.mtl\"", 0), ("C:\\My Models\\m.mtl", 1)] {
        let obj = format!("mtllib {library}\n{SQUARE}usemtl a\nf 1 2 3\n");
        let (scene, health) = load_with_mtl(&obj, "newmtl a\nKd 0.1 0.1 0.1\n");
        assert_eq!(scene.albedo(0, Vec2::ZERO).x, 0.1, "{library}");
        assert_eq!(health.warnings.len(), told, "{:?}", health.warnings);
    }
}

#[test]
fn colours_beside_a_picture_are_told() {
    let white = TEXTURED.replace(" 0\nv", " 0 1 1 1\nv");
    let grey = white.replace(" 1 1 1\n", " 0.5 0.5 0.5\n");
    for (obj, told) in [(TEXTURED, false), (white.as_str(), false), (grey.as_str(), true)] {
        let mtl = "newmtl a b\nmap_Kd w.png\n";
        let (_, health) = load_textured(obj, mtl, "w.png", &png(4, 4, [188; 3])).unwrap();
        let said = health.warnings.iter().any(|w| w.contains("multiplied with pictures, on material “a b”"));
        assert_eq!(said, told, "{obj}: {:?}", health.warnings);
    }
}
