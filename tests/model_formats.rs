//! A model is the same scene whether it comes as OBJ, PLY or glTF; damaged files are refused with a clear message, never a panic.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use clerestory::scene::{self, Health, Ray, Scene, SceneError};
use clerestory::site::Site;
use glam::{Vec2, Vec3};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A folder with a site file around a model of this name.
fn site_of(folder: &Path, model: &str, up: &str) -> Site {
    let text = format!("[site]\nunits = \"m\"\nup = \"{up}\"\n[model]\npath = '{model}'\n");
    fs::write(folder.join("site.toml"), text).unwrap();
    Site::load(folder).unwrap()
}

fn load(folder: &Path, model: &str, up: &str) -> Result<(Scene, Health), SceneError> {
    let mut health = Health::default();
    let scene = scene::load(&site_of(folder, model, up), &mut health)?;
    Ok((scene, health))
}

fn load_bytes(name: &str, bytes: &[u8]) -> Result<(Scene, Health), SceneError> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(name), bytes).unwrap();
    load(folder.path(), name, "z")
}

/// What rays in all directions find: distance and albedo.
fn seen(scene: &Scene, from: Vec3) -> Vec<Option<(f32, Vec3)>> {
    (0..4000)
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f32 / 4000.0;
            let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
            let direction = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
            let ray = Ray { origin: from, direction };
            let hit = scene.tracer.closest(&ray, 0.0)?;
            let s = scene.surface(&ray, &hit);
            Some((hit.t, scene.albedo(hit.triangle, s.barycentric) + scene.emission(hit.triangle)))
        })
        .collect()
}

fn assert_alike(a: &[Option<(f32, Vec3)>], b: &[Option<(f32, Vec3)>]) {
    assert!(a.iter().flatten().count() > a.len() / 2);
    let other = a.iter().zip(b).filter(|(a, b)| match (a, b) {
        (Some(a), Some(b)) => (a.0 - b.0).abs() > 1e-4 * a.0 || a.1.distance(b.1) > 2e-3,
        (None, None) => false,
        _ => true,
    });
    // a ray along an edge may find either side
    let count = other.count();
    assert!(count <= a.len() / 500, "{count} of {} rays differ", a.len());
}

fn chapel() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("sites/chapel/model")
}

/// The chapel's materials as glTF has them, and its pictures.
fn materials_of_chapel(names: &[String]) -> (Vec<Value>, Vec<String>) {
    let text = fs::read_to_string(chapel().join("chapel.mtl")).unwrap();
    /// Kd, Ke and map_Kd.
    type Look = (Vec<f32>, Vec<f32>, Option<String>);
    let mut of: BTreeMap<String, Look> = BTreeMap::new();
    let mut last = String::new();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers = || words[1..].iter().map(|w| w.parse().unwrap()).collect::<Vec<f32>>();
        match words.first() {
            Some(&"newmtl") => {
                last = words[1].to_owned();
                of.insert(last.clone(), (vec![1.0; 3], vec![0.0; 3], None));
            }
            Some(&"Kd") => of.get_mut(&last).unwrap().0 = numbers(),
            Some(&"Ke") => of.get_mut(&last).unwrap().1 = numbers(),
            Some(&"map_Kd") => of.get_mut(&last).unwrap().2 = Some(words[1].to_owned()),
            _ => {}
        }
    }
    let mut pictures = Vec::new();
    let material = |name: &String| {
        // no face is without a material
        let Some((kd, ke, picture)) = of.get(name) else { return json!({ "name": name }) };
        let mut pbr = json!({ "baseColorFactor": [kd[0], kd[1], kd[2], 1.0] });
        if let Some(picture) = picture {
            let index = pictures.iter().position(|p| p == picture).unwrap_or_else(|| {
                pictures.push(picture.clone());
                pictures.len() - 1
            });
            pbr["baseColorTexture"] = json!({ "index": index });
        }
        json!({ "name": name, "pbrMetallicRoughness": pbr, "emissiveFactor": ke })
    };
    let all = names.iter().map(material).collect();
    (all, pictures)
}

/// A scene as a glTF document and its buffer: a primitive a material, and half of the turn into glTF's axes in a node.
fn gltf(scene: &Scene, binary: bool) -> (Value, Vec<u8>) {
    let names: Vec<String> = scene.materials.iter().map(|m| m.name.clone()).collect();
    let (materials, pictures) = materials_of_chapel(&names);
    let (mut bytes, mut views, mut accessors, mut primitives) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mesh = &scene.mesh;
    let mut add = |data: Vec<u8>, count: usize, kind: &str, component: u32| {
        views.push(json!({ "buffer": 0, "byteOffset": bytes.len(), "byteLength": data.len() }));
        let accessor =
            json!({ "bufferView": views.len() - 1, "componentType": component, "count": count, "type": kind });
        accessors.push(accessor);
        bytes.extend(data);
        accessors.len() - 1
    };
    let floats = |v: &[f32]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    // the node below adds 1 in x and turns back from z up
    let positions: Vec<f32> = mesh.positions.iter().flat_map(|p| [p.x - 1.0, p.y, p.z]).collect();
    let of_positions = add(floats(&positions), mesh.positions.len(), "VEC3", 5126);
    let uvs: Vec<f32> = mesh.uvs.iter().flat_map(|t| [t.x, 1.0 - t.y]).collect();
    let of_uvs = add(floats(&uvs), mesh.uvs.len(), "VEC2", 5126);
    for material in 0..names.len() {
        let of = |t: &(&[u32; 3], &u32)| *t.1 as usize == material;
        let corners: Vec<u32> = mesh.triangles.iter().zip(&mesh.materials).filter(of).flat_map(|(t, _)| *t).collect();
        if corners.is_empty() {
            continue;
        }
        let indices = corners.iter().flat_map(|i| i.to_le_bytes()).collect();
        let of_indices = add(indices, corners.len(), "SCALAR", 5125);
        primitives.push(json!({
            "attributes": { "POSITION": of_positions, "TEXCOORD_0": of_uvs },
            "indices": of_indices,
            "material": material,
        }));
    }
    let (low, high) = positions.chunks(3).fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| {
        (l.min(Vec3::from_slice(p)), h.max(Vec3::from_slice(p)))
    });
    accessors[of_positions]["min"] = json!(low.to_array());
    accessors[of_positions]["max"] = json!(high.to_array());
    // in the binary container pictures stand in the buffer, too
    let picture = |name: &String| {
        if !binary {
            return json!({ "uri": name });
        }
        let data = fs::read(chapel().join(name)).unwrap();
        views.push(json!({ "buffer": 0, "byteOffset": bytes.len(), "byteLength": data.len() }));
        bytes.extend(data);
        json!({ "bufferView": views.len() - 1, "mimeType": "image/jpeg" })
    };
    let images: Vec<Value> = pictures.iter().map(picture).collect();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let mut buffer = json!({ "byteLength": bytes.len() });
    if !binary {
        buffer["uri"] = json!("the%20buffer.bin");
    }
    let document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "rotation": [-half, 0.0, 0.0, half], "children": [1] }, { "translation": [1.0, 0.0, 0.0], "mesh": 0 }],
        "meshes": [{ "primitives": primitives }],
        "materials": materials,
        "textures": (0..pictures.len()).map(|i| json!({ "source": i })).collect::<Vec<_>>(),
        "images": images,
        "buffers": [buffer],
        "bufferViews": views,
        "accessors": accessors,
    });
    (document, bytes)
}

/// The binary container around a document and its buffer.
fn glb(document: &Value, mut buffer: Vec<u8>) -> Vec<u8> {
    let mut text = serde_json::to_vec(document).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let mut all = b"glTF".to_vec();
    let length = 12 + 8 + text.len() + 8 + buffer.len();
    for word in [2, length as u32, text.len() as u32] {
        all.extend(u32::to_le_bytes(word));
    }
    all.extend(b"JSON");
    all.extend(text);
    all.extend(u32::to_le_bytes(buffer.len() as u32));
    all.extend(b"BIN\0");
    all.extend(buffer);
    all
}

#[test]
fn the_chapel_is_the_same_as_obj_gltf_and_glb() {
    let folder = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(chapel()).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
    }
    let (obj, of_obj) = load(folder.path(), "chapel.obj", "y").unwrap();
    let from = obj.local(glam::DVec3::new(3.6, 0.3, 1.6));
    let expected = seen(&obj, from);
    let (document, buffer) = gltf(&obj, false);
    fs::write(folder.path().join("c.gltf"), serde_json::to_vec(&document).unwrap()).unwrap();
    fs::write(folder.path().join("the buffer.bin"), &buffer).unwrap();
    let (document, buffer) = gltf(&obj, true);
    fs::write(folder.path().join("c.glb"), glb(&document, buffer)).unwrap();
    for name in ["c.gltf", "c.glb"] {
        let (scene, health) = load(folder.path(), name, "y").unwrap();
        assert_eq!(health.triangles, of_obj.triangles);
        let pictures = |h: &Health| h.files.iter().filter(|f| f.extension().is_some_and(|e| e == "jpg")).count();
        assert_eq!(pictures(&health), if name == "c.glb" { 0 } else { pictures(&of_obj) });
        assert!(health.warnings.iter().all(|w| of_obj.warnings.contains(w)), "{:?}", health.warnings);
        // what was written is local to the first scene's origin
        let at = from.as_dvec3() - scene.origin;
        assert_alike(&expected, &seen(&scene, at.as_vec3()));
    }
}

/// A coloured pyramid on a pentagon, in one encoding of PLY.
fn pyramid(encoding: &str) -> Vec<u8> {
    let corners: Vec<[f32; 3]> = (0..5)
        .map(|k| (k as f32 * std::f32::consts::TAU / 5.0).sin_cos())
        .map(|(sin, cos)| [cos, sin, 0.0])
        .chain([[0.0, 0.0, 2.0]])
        .collect();
    let faces: Vec<Vec<i32>> =
        std::iter::once(vec![4, 3, 2, 1, 0]).chain((0..5).map(|k| vec![k, (k + 1) % 5, 5])).collect();
    let mut out = format!(
        "ply\nformat {encoding} 1.0\ncomment made here\nelement vertex 6\nproperty float x\nproperty double y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float quality\n\
         element face 6\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    let big = encoding.contains("big");
    let ordered = |mut bytes: Vec<u8>| {
        if big {
            bytes.reverse();
        }
        bytes
    };
    for (k, p) in corners.iter().enumerate() {
        let colour = [255, 51 * k as u8, 102];
        if encoding == "ascii" {
            out.extend(format!("{} {} {} {} {} {} 0.5\n", p[0], p[1], p[2], colour[0], colour[1], colour[2]).bytes());
        } else {
            out.extend(ordered(p[0].to_le_bytes().to_vec()));
            out.extend(ordered(f64::from(p[1]).to_le_bytes().to_vec()));
            out.extend(ordered(p[2].to_le_bytes().to_vec()));
            out.extend(colour);
            out.extend(ordered(0.5f32.to_le_bytes().to_vec()));
        }
    }
    for face in &faces {
        if encoding == "ascii" {
            let words: Vec<String> = face.iter().map(i32::to_string).collect();
            out.extend(format!("{} {}\n", face.len(), words.join(" ")).bytes());
        } else {
            out.push(face.len() as u8);
            face.iter().for_each(|i| out.extend(ordered(i.to_le_bytes().to_vec())));
        }
    }
    out
}

#[test]
fn a_coloured_ply_is_the_same_in_every_encoding() {
    let mut first = None;
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        // known by its first bytes, whatever it is called
        let (scene, health) = load_bytes("m.model", &pyramid(encoding)).unwrap();
        assert_eq!((health.triangles, &health.warnings[..]), (8, &[][..]), "{encoding}");
        let found = seen(&scene, scene.local(glam::DVec3::new(0.0, 0.0, 0.5)));
        assert!(found.iter().all(Option::is_some), "closed");
        // colours are what they are, not half of it
        assert!(found.iter().flatten().all(|(_, a)| a.x == 1.0 && (a.z - 0.4).abs() < 1e-6), "{encoding}");
        assert_alike(first.get_or_insert(found.clone()), &found);
    }
}

#[test]
fn a_plys_texture_hangs_on_its_faces() {
    let folder = tempfile::tempdir().unwrap();
    let mut picture = image::RgbImage::new(2, 2);
    for (i, rgb) in [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]].into_iter().enumerate() {
        picture.put_pixel(i as u32 % 2, i as u32 / 2, image::Rgb(rgb));
    }
    picture.save(folder.path().join("atlas of it.png")).unwrap();
    let text = "ply\nformat ascii 1.0\ncomment TextureFile atlas of it.png\nelement vertex 4\nproperty float x\n\
                property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                property list uchar float texcoord\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n\
                4 0 1 2 3 8 0 0 1 0 1 1 0 1\n";
    fs::write(folder.path().join("m.ply"), text).unwrap();
    let (scene, health) = load(folder.path(), "m.ply", "z").unwrap();
    assert!(health.warnings.is_empty() && health.files.len() == 1, "{health:?}");
    // v = 0 is the picture's bottom row
    for (at, expected) in
        [([0.25, 0.75], Vec3::X), ([0.75, 0.75], Vec3::Y), ([0.25, 0.25], Vec3::Z), ([0.75, 0.25], Vec3::ONE)]
    {
        let origin = scene.local(glam::DVec3::new(at[0], at[1], 1.0));
        let ray = Ray { origin, direction: Vec3::NEG_Z };
        let hit = scene.tracer.closest(&ray, 0.0).unwrap();
        let Vec2 { x, y } = scene.surface(&ray, &hit).barycentric;
        assert!(scene.albedo(hit.triangle, Vec2::new(x, y)).distance(expected) < 1e-3, "{at:?}");
    }
}

#[test]
fn clouds_and_damaged_files_are_refused_with_what_to_do() {
    let refused = |name: &str, bytes: &[u8], words: &[&str]| {
        let said = load_bytes(name, bytes).err().expect(name).to_string();
        assert!(words.iter().all(|w| said.contains(w)) && said.lines().count() == 1, "{said}");
    };
    let head = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
    refused("m.ply", format!("{head}end_header\n0 0 0\n1 1 1\n").as_bytes(), &["cloud of 2 points", "Mesh it first"]);
    refused("m.ply", format!("{head}end_header\n0 0 0\n1 x 1\n").as_bytes(), &["m.ply:9"]);
    let faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 1 1\n3 0 1 7\n";
    refused("m.ply", format!("{head}{faces}").as_bytes(), &["face 0 names vertex 7 of 2"]);
    let huge = head.replace("vertex 2", "vertex 4000000000");
    refused("m.ply", format!("{huge}end_header\n").as_bytes(), &["4000000000", "more than the file holds"]);
    refused("m.gltf", b"{}", &["m.gltf"]);
    refused("m.glb", b"glTF\x02\0\0\0\x0c\0\0\0", &["m.glb"]);
    let draco = br#"{"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"]}"#;
    refused("m.gltf", draco, &["KHR_draco_mesh_compression", "Export it without"]);
    let lies = r#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":12,"uri":"data:;base64,AAAAAAAAAAAAAAAA"}],
        "bufferViews":[{"buffer":0,"byteLength":12}],"accessors":[{"bufferView":0,"componentType":5126,"count":900000000,
        "type":"VEC3","min":[0,0,0],"max":[0,0,0]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "nodes":[{"mesh":0}]}"#;
    refused("m.gltf", lies.as_bytes(), &["accessor 0 counts more than its buffer holds"]);
}

/// Files of a folder and below with one of these endings.
fn files(folder: &Path, endings: &[&str], all: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, endings, all);
        } else if path.extension().is_some_and(|e| endings.iter().any(|k| e == *k)) {
            all.push(path);
        }
    }
}

#[test]
fn hostile_files_of_others_are_read_or_refused() {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/cursed");
    if !shared.exists() {
        println!("skipped: {} is not there", shared.display());
        return;
    }
    let mut all = Vec::new();
    files(&shared, &["ply", "gltf", "glb"], &mut all);
    all.sort();
    assert!(all.len() > 200);
    let folder = tempfile::tempdir().unwrap();
    let mut opened = Vec::new();
    for path in &all {
        match load(folder.path(), &path.to_string_lossy(), "y") {
            Ok((scene, _)) => {
                assert!(scene.mesh.positions.iter().all(|p| p.is_finite()), "{}", path.display());
                opened.push(path.strip_prefix(&shared).unwrap().display().to_string());
            }
            Err(e) => assert!(!e.to_string().is_empty()),
        }
    }
    println!("{} of {} hold triangles: {opened:?}", opened.len(), all.len());
}
