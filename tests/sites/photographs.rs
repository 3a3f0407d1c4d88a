//! Photographs and cameras as they come: formats, EXIF, masks, lenses, pose files, picked points.
#![allow(clippy::unwrap_used)]

use crate::support::closed_box;
use crate::support::program::clerestory;
use clerestory::panorama::{self, Layer, Picture, write_exr};
use clerestory::photograph::{Fitness, Photograph};
use clerestory::render::{Irradiance, Lit, ShadingPoint, Source, render};
use clerestory::scene::{self, Health};
use clerestory::site::{Camera, CameraSource, Lens, Site};
use clerestory::study::{compare, hidden};
use clerestory::volume::Nearby;
use glam::{DVec2, DVec3, Vec3};
use image::{ImageBuffer, ImageEncoder, Luma, Rgb};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const HEAD: &str = "[site]\nname = \"t\"\nunits = \"m\"\nup = \"z\"\n[model]\npath = \"m.obj\"\n";
const VIEW: &str = "[[view]]\nname = \"v\"\nposition = [3, 2, 1.6]\nlook_at = [6, 2.5, 1.5]\n";

/// A room of 6 × 5 × 4 m.
fn folder() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("m.obj"), closed_box(6, 5, 4)).unwrap();
    dir
}

fn site(dir: &TempDir, rest: &str) -> Result<Site, String> {
    fs::write(dir.path().join("site.toml"), format!("{HEAD}{rest}")).unwrap();
    Site::load(dir.path()).map_err(|e| e.to_string())
}

/// A grey JPEG of this size with an orientation and a 35 mm focal length in its EXIF data; its left half is white.
fn jpeg(path: &Path, width: u32, height: u32, orientation: u8, focal_35mm: u8) {
    // two TIFF entries: 0x112 orientation, 0x8769 the place of a directory with 0xa405 FocalLengthIn35mmFilm
    let mut exif = b"II*\0\x08\0\0\0\x02\0".to_vec();
    exif.extend([0x12, 0x01, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0]);
    exif.extend([0x69, 0x87, 4, 0, 1, 0, 0, 0, 38, 0, 0, 0]);
    exif.extend([0, 0, 0, 0, 1, 0, 0x05, 0xa4, 3, 0, 1, 0, 0, 0, focal_35mm, 0, 0, 0, 0, 0, 0, 0]);
    write_jpeg(path, exif, &ImageBuffer::from_fn(width, height, |x, _| Rgb([if x < width / 2 { 255 } else { 60 }; 3])));
}

fn write_jpeg(path: &Path, exif: Vec<u8>, picture: &image::RgbImage) {
    let mut encoder = image::codecs::jpeg::JpegEncoder::new(fs::File::create(path).unwrap());
    encoder.set_exif_metadata(exif).unwrap();
    encoder.write_image(picture, picture.width(), picture.height(), image::ExtendedColorType::Rgb8).unwrap();
}

#[test]
fn every_format_becomes_linear_light_with_its_ends_marked() {
    let dir = folder();
    // four bars: black, an eighth, a half and all of the range, encoded
    let bars = [0.0f32, 0.125, 0.5, 1.0];
    let linear = |v: f32| panorama::srgb_to_linear(v);
    let (w, h) = (40, 30);
    let bar = |x: u32| bars[(x * 4 / w) as usize];
    let at = |name: &str| dir.path().join(name);
    let coded = ImageBuffer::from_fn(w, h, |x, _| Rgb([(bar(x) * 255.0).round() as u8; 3]));
    ["8.png", "8.tif", "8.jpg"].iter().for_each(|name| coded.save(at(name)).unwrap());
    ImageBuffer::from_fn(w, h, |x, _| Rgb([(bar(x) * 65535.0).round() as u16; 3])).save(at("16.png")).unwrap();
    ImageBuffer::from_fn(w, h, |x, _| Luma([(bar(x) * 65535.0).round() as u16])).save(at("16.tif")).unwrap();
    let floats = ImageBuffer::from_fn(w, h, |x, _| Rgb([linear(bar(x)); 3]));
    floats.save(at("float.tif")).unwrap();
    image::codecs::hdr::HdrEncoder::new(fs::File::create(at("x.hdr")).unwrap())
        .encode(&floats.pixels().copied().collect::<Vec<_>>(), w as usize, h as usize)
        .unwrap();
    let mut picture = Picture::new(w as usize, h as usize);
    for (i, p) in picture.pixels.iter_mut().enumerate() {
        *p = Vec3::splat(linear(bar(i as u32 % w)));
    }
    picture.pixels[5] = Vec3::new(f32::NAN, 0.0, 0.0);
    write_exr(&at("x.exr"), 40, 30, &[Layer::rgb("radiance", &picture)], None).unwrap();
    for (name, tolerance) in [
        ("8.png", 0.003),
        ("8.tif", 0.003),
        ("8.jpg", 0.02),
        ("16.png", 1e-5),
        ("16.tif", 1e-5),
        ("float.tif", 1e-6),
        ("x.hdr", 0.004),
        ("x.exr", 1e-6),
    ] {
        let site = site(&dir, &format!("{VIEW}fov_y = 60\nphoto = \"{name}\"\n")).unwrap();
        let photo = Photograph::of(&site.views[0]).unwrap().unwrap();
        assert_eq!((photo.picture.width, photo.picture.height), (40, 30), "{name}");
        let expected = [Fitness::Dark, Fitness::Good, Fitness::Good, Fitness::Clipped];
        for (i, (&value, expected)) in bars.iter().zip(expected).enumerate() {
            let pixel = 15 * 40 + 10 * i + 5;
            let found = photo.picture.pixels[pixel];
            assert!((found - Vec3::splat(linear(value))).abs().max_element() <= tolerance, "{name} {value}: {found}");
            assert_eq!(photo.fitness[pixel], expected, "{name} {value}");
        }
        assert_eq!(photo.fitness[5] == Fitness::Invalid, name == "x.exr");
        assert!(photo.share(Fitness::Good) > 0.45);
    }
}

#[test]
fn a_portrait_photograph_is_set_upright_and_its_focal_length_heeded() {
    let dir = folder();
    // 36 × 24 mm of film: 50 mm see 43.6 degrees along 40 mm … here a picture of 3:2 held upright
    jpeg(&dir.path().join("p.jpg"), 60, 40, 6, 50);
    let f = 50.0 / 43.2666 * 60f64.hypot(40.0);
    let fov = 2.0 * (0.5 * 60.0 / f).atan().to_degrees();
    let right = site(&dir, &format!("{VIEW}fov_y = {fov}\nphoto = \"p.jpg\"\n")).unwrap();
    assert!(right.warnings.is_empty(), "{:?}", right.warnings);
    let view = &right.views[0];
    assert_eq!((view.camera.width, view.camera.height), (40, 60));
    let photo = Photograph::of(view).unwrap().unwrap();
    assert_eq!((photo.picture.width, photo.exif.focal_35mm), (40, Some(50.0)));
    // what was left is on top
    assert_eq!((photo.fitness[5 * 40 + 20], photo.fitness[55 * 40 + 20]), (Fitness::Clipped, Fitness::Good));
    let wrong = site(&dir, &format!("{VIEW}fov_y = {}\nphoto = \"p.jpg\"\n", 0.7 * fov)).unwrap();
    assert!(
        wrong.warnings[0].contains("50 mm (35 mm film)") && wrong.warnings[0].contains("cropped"),
        "{:?}",
        wrong.warnings
    );
}

/// Irradiance π everywhere, a black sky.
struct Even;

impl Irradiance for Even {
    fn at(&self, _: &ShadingPoint, _: &mut Nearby) -> Lit {
        Lit::known(Vec3::splat(std::f32::consts::PI), Source::Record, 1.0)
    }

    fn sky(&self, _: Vec3) -> Vec3 {
        Vec3::ZERO
    }
}

#[test]
fn renders_are_seen_through_the_lens() {
    let dir = folder();
    for (lens, shows_all) in [
        ("fov_y = 70\nk1 = -0.12\nk2 = 0.02\np1 = 0.003\np2 = -0.002\n", true),
        ("fx = 40\nk1 = -0.6\n", false),
        ("projection = \"fisheye\"\nfov_y = 180\nk1 = 0.02\n", true),
        ("projection = \"fisheye\"\nfov_y = 330\n", false),
    ] {
        let site = site(&dir, &format!("{VIEW}size = [64, 48]\n{lens}")).unwrap();
        let camera = &site.views[0].camera;
        assert_eq!(camera.lens == Lens::Fisheye, lens.contains("fisheye"));
        let scene = scene::load(&site, &mut Health::default()).unwrap();
        let frame = render(&scene, &Even, camera, 1, &|_, _| {});
        let mut dark = 0;
        for (i, depth) in frame.depth.iter().enumerate() {
            let (x, y) = ((i % 64) as f64 + 0.5, (i / 64) as f64 + 0.5);
            if !camera.shows(x, y) {
                dark += 1;
                assert!(
                    depth.is_infinite() && frame.radiance.pixels[i] == Vec3::ZERO && frame.source[i] == Source::None
                );
                continue;
            }
            let point = camera.pose.position + camera.direction(x, y) * f64::from(*depth);
            let inside = (DVec3::new(3.0, 2.5, 2.0) - point).abs();
            let on_a_wall = (inside - DVec3::new(3.0, 2.5, 2.0)).abs().min_element() < 1e-4;
            assert!(on_a_wall && camera.project(point).unwrap().distance(DVec2::new(x, y)) < 0.01, "{lens} ({x}, {y})");
        }
        assert_eq!(dark == 0, shows_all, "{lens}: {dark}");
    }
}

#[test]
fn a_mask_keeps_people_out_of_comparisons() {
    let dir = folder();
    // a mask of half the view's size, dark in its left half
    ImageBuffer::from_fn(32, 24, |x, _| Luma([if x < 16 { 10u8 } else { 200 }]))
        .save(dir.path().join("m.png"))
        .unwrap();
    let site = site(&dir, &format!("{VIEW}size = [64, 48]\nfov_y = 70\nmask = \"m.png\"\n")).unwrap();
    let view = &site.views[0];
    let scene = scene::load(&site, &mut Health::default()).unwrap();
    let frame = render(&scene, &Even, &view.camera, 1, &|_, _| {});
    let mut photo = frame.radiance.clone();
    for (i, p) in photo.pixels.iter_mut().enumerate().filter(|(i, _)| i % 64 < 32) {
        *p = Vec3::splat((i % 7) as f32 * 3.0);
    }
    let mask = clerestory::photograph::left_out(view).unwrap().unwrap();
    assert!(mask.iter().enumerate().all(|(i, out)| *out == (i % 64 < 32)));
    let hidden = hidden(&scene, &[scene.local(view.camera.pose.position)], &view.camera);
    let with = compare(&hidden, &view.camera, &frame, &photo, Some(&mask)).unwrap().all;
    let without = compare(&hidden, &view.camera, &frame, &photo, None).unwrap().all;
    assert!(with.flip < 1e-6 && with.relmse == 0.0 && with.share == 0.5, "{with:?}");
    assert!(without.flip > 0.1 && without.relmse > 0.1 && without.share == 1.0, "{without:?}");
    assert!(compare(&hidden, &view.camera, &frame, &photo, Some(&mask[1..])).is_none());
}

/// `match` lines for corners and marks of the room as a camera shows them.
fn matches(camera: &Camera, points: &[[f64; 3]]) -> String {
    points.iter().fold(String::from("match = [\n"), |mut text, p| {
        let pixel = camera.project(DVec3::from_array(*p)).unwrap();
        let _ = writeln!(text, "  {{ pixel = [{:.2}, {:.2}], point = {p:?} }},", pixel.x, pixel.y);
        text
    }) + "]\n"
}

const MARKS: [[f64; 3]; 8] = [
    [6.0, 1.0, 0.6],
    [6.0, 3.5, 0.7],
    [6.0, 3.4, 2.6],
    [6.0, 0.9, 2.7],
    [5.0, 1.5, 0.4],
    [4.6, 2.9, 0.9],
    [5.2, 2.4, 2.4],
    [4.8, 1.9, 1.5],
];

#[test]
fn a_view_is_posed_from_picked_points_and_check_tells_how_well() {
    let dir = folder();
    let known = site(&dir, &format!("{VIEW}size = [640, 480]\nfov_y = 60\nk1 = -0.1\n")).unwrap().views[0].camera;
    let head = "[[view]]\nname = \"v\"\nsize = [640, 480]\n";
    let solved = format!("{head}fov_y = 60\nk1 = -0.1\n{}", matches(&known, &MARKS[..6]));
    let found = site(&dir, &solved).unwrap();
    let view = &found.views[0];
    assert!(view.camera.pose.position.distance(known.pose.position) < 1e-3, "{}", view.camera.pose.position);
    let CameraSource::Matches(resection) = &view.source else { panic!("not from matches") };
    assert!(resection.rms_px < 0.01 && resection.focal_sd_px.is_none() && resection.residuals_px.len() == 6);
    let text = clerestory(&[&"check", &dir.path()], &[]).text();
    for part in ["View v (matches)", "at [3.000, 2.000, 1.600]", "uncertain by ±", "0.00 in the root mean square"] {
        assert!(text.contains(part), "{part} expected in\n{text}");
    }
    let json = clerestory(&[&"check", &"--json", &dir.path()], &[]).json();
    assert_eq!(json["views"][0]["source"], "matches");
    assert_eq!(json["views"][0]["residuals_px"].as_array().unwrap().len(), 6);
    assert!((json["views"][0]["position"][0].as_f64().unwrap() - 3.0).abs() < 1e-3);

    // without a field of view the focal length is found as well
    let found = site(&dir, &format!("{head}k1 = -0.1\n{}", matches(&known, &MARKS))).unwrap();
    assert!((found.views[0].camera.focal.y / known.focal.y - 1.0).abs() < 1e-3);
    let faults = [
        (format!("{head}{}", matches(&known, &MARKS[..5])), 11, "5 pairs of pixel and point, but 6 are needed"),
        (format!("{head}fov_y = 60\n{}", matches(&known, &MARKS[..3])), 12, "4 are needed. Add pairs"),
        (
            format!("{head}fov_y = 60\nheading = 3\n{}", matches(&known, &MARKS)),
            11,
            "an orientation without a position",
        ),
        (format!("{head}fov_y = 60\n"), 7, "at least four match pairs"),
        (format!("{head}fov_y = 60\n{}", matches(&known, &[MARKS[0]; 4])), 13, "pairs 1 and 2 are at the same place"),
        (
            format!(
                "{head}fov_y = 60\nk1 = -0.1\n{}",
                matches(&known, &MARKS).replace("point = [6.0", "point = [-6.0")
            ),
            0,
            "no camera shows the points there",
        ),
    ];
    for (text, line, part) in faults {
        let error = site(&dir, &text).unwrap_err();
        let place = line == 0 || error.contains(&format!("site.toml:{line}:"));
        assert!(place && error.contains(part), "line {line}, {part} expected in: {error}\n{text}");
    }
    // a slip of the hand is named, and does not hide
    let slipped = matches(&known, &MARKS).replacen("[6.0, 1.0, 0.6]", "[6.0, 1.2, 0.6]", 1);
    let found = site(&dir, &format!("{head}fov_y = 60\nk1 = -0.1\n{slipped}")).unwrap();
    assert!(found.warnings.iter().any(|w| w.contains("pair 1 misses")), "{:?}", found.warnings);
}

/// COLMAP's files for cameras that stand as `camera` does: sizes, and names.
fn colmap(dir: &Path, camera: &Camera, size: [u32; 2], names: &[&str]) {
    fs::create_dir_all(dir).unwrap();
    let f = camera.focal.x;
    let c = [0.5 * f64::from(size[0]), 0.5 * f64::from(size[1])];
    fs::write(dir.join("cameras.txt"), format!("1 SIMPLE_PINHOLE {} {} {f} {} {}\n", size[0], size[1], c[0], c[1]))
        .unwrap();
    let m = camera.pose.rotation;
    // right, down, forward
    let to_world = glam::DMat3::from_cols(m.x_axis, -m.z_axis, m.y_axis);
    let q = glam::DQuat::from_mat3(&to_world.transpose());
    let t = -(to_world.transpose() * camera.pose.position);
    let text = names.iter().enumerate().fold(String::new(), |mut text, (i, name)| {
        let _ = writeln!(text, "{i} {} {} {} {} {} {} {} 1 {name}\n", q.w, q.x, q.y, q.z, t.x, t.y, t.z);
        text
    });
    fs::write(dir.join("images.txt"), text).unwrap();
}

#[test]
fn cameras_of_a_pose_file_become_views() {
    let dir = folder();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir(at("photos")).unwrap();
    let known = site(&dir, &format!("{VIEW}size = [60, 40]\nfov_y = 50\n")).unwrap().views[0].camera;
    jpeg(&at("photos/a.jpg"), 60, 40, 1, 50);
    jpeg(&at("photos/B.JPG"), 60, 40, 6, 50);
    colmap(&at("sparse"), &known, [60, 40], &["a.jpg", "b.jpg", "gone.jpg"]);
    let table = "[cameras]\npath = \"sparse\"\nphotos = \"photos\"\n";
    let found = site(&dir, table).unwrap();
    let names: Vec<&str> = found.views.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["a", "b"]);
    assert!(
        found.warnings.iter().any(|w| w.contains("1 of 3 photographs") && w.contains("gone.jpg")),
        "{:?}",
        found.warnings
    );
    assert!(matches!(&found.views[0].source, CameraSource::PoseFile(p) if p.ends_with("sparse")));
    let target = DVec3::new(6.0, 2.6, 1.9);
    let pixel = known.project(target).unwrap();
    assert!(found.views[0].camera.project(target).unwrap().distance(pixel) < 1e-9);
    // B lies on its side: its file's pixels are turned clockwise to be shown, and the camera with them
    let upright = &found.views[1].camera;
    assert_eq!((upright.width, upright.height), (40, 60));
    assert!(upright.project(target).unwrap().distance(DVec2::new(40.0 - pixel.y, pixel.x)) < 1e-9);
    let photo = Photograph::of(&found.views[1]).unwrap().unwrap();
    assert_eq!(photo.picture.width, 40);

    // photographs of twice the size have cameras of twice the focal length
    jpeg(&at("photos/a.jpg"), 120, 80, 1, 50);
    let only = format!("{table}only = [\"a\"]\n");
    let found = site(&dir, &only).unwrap();
    assert!(found.warnings.is_empty() && found.views[0].camera.project(target).unwrap().distance(pixel * 2.0) < 1e-9);

    // model axes = 2 × (a quarter turn about z of the file's) + (1, 2, 3)
    let moved =
        site(&dir, &format!("{only}scale = 2\nmatrix = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]\ntranslation = [1, 2, 3]\n"))
            .unwrap();
    let there = |p: DVec3| DVec3::new(-p.y, p.x, p.z) * 2.0 + DVec3::new(1.0, 2.0, 3.0);
    let camera = &moved.views[0].camera;
    assert!(camera.pose.position.distance(there(known.pose.position)) < 1e-9);
    assert!(camera.project(there(target)).unwrap().distance(pixel * 2.0) < 1e-9);
}

#[test]
fn photographs_of_a_pose_file_can_be_probes() {
    let dir = folder();
    let at = |name: &str| dir.path().join(name);
    let known = site(&dir, &format!("{VIEW}size = [60, 40]\nfov_y = 50\n")).unwrap().views[0].camera;
    for name in ["a.jpg", "b.jpg", "c.jpg"] {
        jpeg(&at(name), 60, 40, 1, 50);
    }
    colmap(&at("sparse"), &known, [60, 40], &["a.jpg", "b.jpg", "c.jpg"]);
    let found = |keys: &str| {
        let site = site(&dir, &format!("[cameras]\npath = \"sparse\"\nphotos = \".\"\n{keys}\n")).unwrap();
        let probes: Vec<String> = site.probes.iter().map(|p| p.name.clone()).collect();
        let views: Vec<String> = site.views.iter().map(|v| v.name.clone()).collect();
        (probes.join(" "), views.join(" "), site)
    };
    for (keys, probes, views) in [
        ("probes = [\"a\", \"c.jpg\"]", "a c", "b"),
        ("probes = \"all\"", "a b c", ""),
        ("probes = [\"a\"]\nonly = [\"b\"]", "a", "b"),
        ("probes = [\"a\"]\nonly = [\"a\", \"b\"]", "a", "a b"),
    ] {
        let (p, v, site) = found(keys);
        assert_eq!((p.as_str(), v.as_str()), (probes, views), "{keys}");
        assert!(site.files().iter().any(|f| f.ends_with("sparse/images.txt")));
        let probe = &site.probes[0];
        let direction = probe.pose.rotation.transpose() * (DVec3::new(6.0, 2.6, 1.9) - probe.pose.position);
        let pixel = probe.projection.pixel(60, 40, direction).unwrap();
        assert!(pixel.distance(known.project(DVec3::new(6.0, 2.6, 1.9)).unwrap()) < 1e-9);
    }
    assert_eq!(found("probes = \"all\"\nlighting = \"10:00\"").2.lightings(), ["10:00"]);
    let bad = |keys: &str| site(&dir, &format!("[cameras]\npath = \"sparse\"\nphotos = \".\"\n{keys}\n")).unwrap_err();
    assert!(bad("probes = [\"d\"]").contains("no solved camera “d”"));
    assert!(bad("probes = \"some\"").contains("\"all\", or a list of photographs"));
    assert!(bad("lighting = \"10:00\"").contains("a lighting without probes"));
}

#[test]
fn a_probe_has_the_lens_that_a_view_has() {
    let dir = folder();
    let at = |name: &str| dir.path().join(name);
    jpeg(&at("p.jpg"), 60, 40, 1, 50);
    jpeg(&at("large.jpg"), 120, 80, 1, 50);
    jpeg(&at("square.jpg"), 40, 40, 1, 50);
    let probe = |rest: &str| format!("[[probe]]\nname = \"a\"\nposition = [3, 2, 1.6]\nheading = 20\n{rest}\n");
    for lens in ["fx = 70\nfy = 71\ncx = 31\nk1 = -0.1\np2 = 0.01", "fov_y = 40\ncy = 18", "fov_y = 40"] {
        let image = "image = { \"10:00\" = \"p.jpg\", \"14:30\" = \"large.jpg\" }";
        let view = format!("{}photo = \"p.jpg\"\n", VIEW.replace("look_at = [6, 2.5, 1.5]", "heading = 20"));
        let both = format!("{}{view}{lens}\n", probe(&format!("{image}\nprojection = \"perspective\"\n{lens}")));
        let site = site(&dir, &both).unwrap();
        let (probe, camera) = (&site.probes[0], &site.views[0].camera);
        for (x, y) in [(2.0, 3.0), (30.0, 20.0), (57.0, 38.0)] {
            let d = probe.pose.rotation * probe.projection.direction(60, 40, x, y).unwrap();
            assert!(d.distance(camera.direction(x, y)) < 1e-12, "{lens} ({x}, {y})");
            let twice = probe.pose.rotation * probe.projection.direction(120, 80, 2.0 * x, 2.0 * y).unwrap();
            assert!(d.distance(twice) < 1e-12);
        }
    }
    let bad = |rest: &str| site(&dir, &probe(rest)).unwrap_err();
    assert!(bad("image = \"p.jpg\"\nfx = 70").contains("\"perspective\" or \"fisheye\" only"));
    assert!(bad("image = \"p.jpg\"\nprojection = \"perspective\"\nk1 = 0.1").contains("neither fov_y nor fx"));
    let other = "image = { a = \"p.jpg\", b = \"square.jpg\" }\nprojection = \"perspective\"\nfx = 70";
    assert!(bad(other).contains("in the aspect of the first"));
}

/// A grey JPEG whose EXIF data tells an exposure.
fn exposed(path: &Path, time: [u32; 2], f_number: [u32; 2], iso: u16) {
    let mut exif = b"II*\0\x08\0\0\0\x01\0".to_vec();
    exif.extend([0x69, 0x87, 4, 0, 1, 0, 0, 0, 26, 0, 0, 0, 0, 0, 0, 0]);
    exif.extend([3, 0]);
    exif.extend([0x9a, 0x82, 5, 0, 1, 0, 0, 0, 68, 0, 0, 0]);
    exif.extend([0x9d, 0x82, 5, 0, 1, 0, 0, 0, 76, 0, 0, 0]);
    exif.extend([0x27, 0x88, 3, 0, 1, 0, 0, 0]);
    exif.extend(u32::from(iso).to_le_bytes());
    exif.extend([0; 4]);
    exif.extend([time, f_number].concat().iter().flat_map(|v| v.to_le_bytes()));
    write_jpeg(path, exif, &ImageBuffer::from_pixel(60, 40, Rgb([90; 3])));
}

#[test]
fn probes_without_gains_get_theirs_from_exif() {
    let dir = folder();
    let at = |name: &str| dir.path().join(name);
    // two stops darker by time, one brighter by aperture, one by sensitivity
    exposed(&at("a.jpg"), [1, 30], [40, 10], 100);
    exposed(&at("b.jpg"), [1, 120], [40, 10], 100);
    exposed(&at("c.jpg"), [1, 30], [28284, 10000], 200);
    jpeg(&at("plain.jpg"), 60, 40, 1, 50);
    let probe = |name: &str, rest: &str| {
        format!(
            "[[probe]]\nname = \"{name}\"\nposition = [3, 2, 1.6]\nprojection = \"perspective\"\nfov_y = 40\n\
             image = \"{name}.jpg\"\n{rest}"
        )
    };
    let gains = |text: &str| site(&dir, text).unwrap().probes.iter().map(|p| p.gain).collect::<Vec<_>>();
    let found = gains(&[probe("a", ""), probe("b", ""), probe("c", "")].concat());
    // exposure values 0, 2, −2 beside the first's
    for (found, expected) in found.iter().zip([1.0, 4.0, 0.25]) {
        assert!((found.x / expected - 1.0).abs() < 1e-3, "{found:?}");
    }
    assert_eq!(
        gains(&[probe("a", ""), probe("b", "gain = 3\n")].concat()),
        [Vec3::ONE, Vec3::splat(3.0)],
        "a person's word counts"
    );
    assert_eq!(gains(&[probe("a", ""), probe("plain", "")].concat()), [Vec3::ONE; 2], "one says nothing");
}

#[test]
fn a_bad_cameras_table_is_one_clear_line() {
    let dir = folder();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir(at("photos")).unwrap();
    let known = site(&dir, &format!("{VIEW}size = [60, 40]\nfov_y = 50\n")).unwrap().views[0].camera;
    colmap(&at("sparse"), &known, [60, 40], &["a.jpg", "b.jpg"]);
    let table = "[cameras]\npath = \"sparse\"\nphotos = \"photos\"\n";
    let none = site(&dir, table).unwrap_err();
    assert!(
        none.contains("site.toml:8:") && none.contains("none of its 2 photographs") && none.contains("a.jpg, b.jpg"),
        "{none}"
    );
    jpeg(&at("photos/a.jpg"), 60, 41, 1, 50);
    jpeg(&at("photos/b.jpg"), 60, 60, 1, 50);
    let shape = site(&dir, table).unwrap_err();
    assert!(
        shape.contains("cameras.path") && shape.contains("60 × 40 pixels in the pose file, but 60 × 41"),
        "{shape}"
    );
    jpeg(&at("photos/a.jpg"), 60, 40, 2, 50);
    assert!(site(&dir, &format!("{table}only = [\"a\"]\n")).unwrap_err().contains("mirrored"));
    jpeg(&at("photos/a.jpg"), 60, 40, 1, 50);
    for (rest, part) in [
        ("only = [\"c\"]\n", "no solved camera “c”"),
        ("scale = -1\n", "a scale above zero"),
        ("rotation = [1, 0, 0, 0]\nmatrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n", "given twice"),
        ("masks = \"none\"\n", "there is nothing at"),
        ("photo = \"x\"\n", "Did you mean `photos`"),
    ] {
        let error = site(&dir, &format!("{table}{rest}")).unwrap_err();
        assert!(error.contains("site.toml:") && error.contains(part), "{part} expected in: {error}");
    }
    let both = format!("{table}only = [\"a\"]\n{}", VIEW.replace("\"v\"", "\"A\"") + "size = [60, 40]\nfov_y = 50\n");
    assert!(site(&dir, &both).unwrap_err().contains("two views named “a”"));
    let error = site(&dir, "[cameras]\npath = \"nowhere\"\n").unwrap_err();
    assert!(error.contains("nothing at") && error.contains("the pose file"), "{error}");
    let images = fs::read_to_string(at("sparse/images.txt")).unwrap();
    fs::write(at("sparse/images.txt"), images.replace(" 1 a.jpg", " 5 a.jpg")).unwrap();
    let error = site(&dir, table).unwrap_err();
    assert!(error.contains("images.txt: line 1: a.jpg has camera 5") && error.lines().count() == 1, "{error}");
    // a chunk on the globe
    fs::write(
        at("c.xml"),
        "<document><chunk><sensors/><cameras/><reference>PROJCS[\"UTM\"]</reference></chunk></document>",
    )
    .unwrap();
    assert!(site(&dir, "[cameras]\npath = \"c.xml\"\n").unwrap_err().contains("Local Coordinates"));
}
