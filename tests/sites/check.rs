//! Site files, right and wrong, and the `check` verb.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use crate::support::data::shared;
use crate::support::program::clerestory;
use crate::support::{closed_box, load as load_site};
use clerestory::panorama::Projection;
use clerestory::scene::{self, Health};
use clerestory::site::{Environment, Site, Up};
use glam::{DVec2, DVec3, Vec3};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A complete site in a folder: a room of 6 × 5 × 4 m, panoramas of 2:1 (`p.png`, `q.png`), a square picture, a
/// photograph of 4:3 and a text file.
fn folder(site: &str) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    let put = |name: &str, bytes: &[u8]| fs::write(dir.path().join(name), bytes).unwrap();
    put("site.toml", site.as_bytes());
    put("m.obj", closed_box(6, 5, 4).as_bytes());
    for (name, width, height) in [("p.png", 64, 32), ("q.png", 64, 32), ("square.png", 32, 32), ("photo.png", 40, 30)] {
        image::RgbImage::from_fn(width, height, |x, y| image::Rgb([40 + x as u8, 50 + y as u8, 60 + (x + y) as u8]))
            .save(dir.path().join(name))
            .unwrap();
    }
    put("note.txt", b"not a picture");
    dir
}

const HEAD: &str = "[site]\nname = \"t\"\nunits = \"m\"\nup = \"z\"\n[model]\npath = \"m.obj\"\n";

fn load(rest: &str) -> Site {
    let dir = folder(&format!("{HEAD}{rest}"));
    Site::load(dir.path()).unwrap()
}

fn fault(text: &str) -> String {
    let dir = folder(text);
    Site::load(dir.path()).err().map_or_else(|| panic!("no fault in\n{text}"), |e| e.to_string())
}

const PROBE: &str = "[[probe]]\nname = \"a\"\nposition = [3, 2, 1.6]\n";
const VIEW: &str = "[[view]]\nname = \"v\"\nposition = [3, 2, 1.6]\n";

/// Text of a site file after the head (7 lines), the line at fault, the key, and parts of the message.
#[test]
fn each_fault_names_line_key_and_cure() {
    let probe = |rest: &str| format!("{PROBE}{rest}");
    let good_probe = |rest: &str| format!("{PROBE}image = \"p.png\"\n{rest}");
    let view = |rest: &str| format!("{VIEW}{rest}");
    let good_view = |rest: &str| format!("{VIEW}size = [8, 6]\nfov_y = 60\n{rest}");
    let plan = |rest: &str| format!("[plan]\n{rest}");
    let cases: Vec<(String, usize, &str, &[&str])> = vec![
        // keys and types
        (good_probe("heding = 3"), 11, "probe.a.heding", &["unknown key `heding`", "Did you mean `heading`?"]),
        (good_view("foto = 3"), 12, "view.v.foto", &["unknown key", "Did you mean `photo`?"]),
        ("[plans]\n".into(), 7, "plans", &["unknown key `plans`", "Did you mean `plan`?"]),
        (plan("max_probe = 3"), 8, "plan.max_probe", &["Did you mean `max_probes`?"]),
        (
            good_probe("gain = \"1\""),
            11,
            "probe.a.gain",
            &["expected a number, or three numbers for red, green and blue, found string \"1\""],
        ),
        (probe("image = 3"), 10, "probe.a.image", &["expected a picture's path, or a table"]),
        (view("size = [8]"), 10, "view.v.size", &["expected a list of 2 whole numbers, found 1"]),
        (view("size = [8, 6, 4]"), 10, "view.v.size", &["expected a list of 2 whole numbers, found 3"]),
        (
            "[[probe]]\nname = \"a\"\nposition = [6,6, 1,2, 1,6]\nimage = \"p.png\"\n".into(),
            9,
            "probe.a.position",
            &["expected a list of 3 numbers, found 6", "Did you mean [6.6, 1.2, 1.6]?"],
        ),
        (good_probe("look_at = [6,6, -1,2, 1,6]"), 11, "probe.a.look_at", &["Did you mean [6.6, -1.2, 1.6]?"]),
        (good_probe("rotation = [1, 0, 0]"), 11, "probe.a.rotation", &["list of 4 numbers, found 3"]),
        (good_probe("matrix = [[1, 0, 0], [0, 1, 0]]"), 11, "probe.a.matrix", &["list of 3 lists, found 2"]),
        (good_probe("matrix = [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6]]"), 11, "probe.a.matrix", &["found 4"]),
        (good_probe("heading = 90,5"), 11, "", &["write 1.6 for 1,6"]),
        ("[sun]\ndirection = [0,1, 0,2, 0,9]\nirradiance = [1, 1, 1]\n".into(), 8, "sun.direction", &["0.1, 0.2, 0.9"]),
        ("[environment]\nradiance = [1, 1]\n".into(), 8, "environment.radiance", &["list of 3 numbers, found 2"]),
        (plan("fixed = [[2,5, 3,5]]"), 8, "plan.fixed", &["Did you mean [2.5, 3.5]?"]),
        (plan("keep_out = [[[0, 0], [1,5, 0], [1, 1]]]"), 8, "plan.keep_out", &["list of 2 numbers, found 3"]),
        (plan("vertical_field = [-60, 90, 0]"), 8, "plan.vertical_field", &["list of 2 numbers, found 3"]),
        (view("size = [8.5, 6]"), 10, "view.v.size", &["expected a whole number", "found floating point `8.5`"]),
        (view("size = [-8, 6]"), 10, "view.v.size", &["expected a whole number"]),
        ("[sun]\ndirection = [0, 0, 1]\n".into(), 7, "sun", &["the key `irradiance` is missing"]),
        ("probe = 3\n".into(), 7, "model.probe", &["unknown key `probe`"]),
        (good_probe("name = \"b\""), 11, "", &["duplicate key"]),
        ("[[probe]\n".into(), 7, "", &["unclosed array table", "Close it"]),
        (good_probe("look_at = [1 2, 3]"), 11, "probe.a.look_at", &["a comma is missing between 1 and 2"]),
        (good_probe("look_at = [1,2\n3]"), 12, "", &["a comma is missing before this"]),
        (good_probe("look_at = [1,2,3"), 11, "", &["unclosed array", "Close it"]),
        (probe("image = \"C:\\data\\p.png\""), 10, "probe.a.image", &["single quotes", "Write / between folders"]),
        (probe("image = p.png"), 10, "probe.a.image", &["text in quotes, found p.png"]),
        (
            good_probe("projection = \"lat-long\""),
            11,
            "probe.a.projection",
            &["unknown value", "Did you mean `latlong`?"],
        ),
        // files
        (probe("image = \"none.exr\""), 10, "probe.a.image", &["there is no file", "none.exr"]),
        (probe("image = \"P.PNG\""), 10, "probe.a.image", &["Did you mean “p.png”?"]),
        (probe("image = \"https://a.b/p.exr\""), 10, "probe.a.image", &["found the URL", "Download"]),
        (probe("image = \"file:///p.exr\""), 10, "probe.a.image", &["found the URL"]),
        (probe("image = \"\""), 10, "probe.a.image", &["found empty text"]),
        (probe("image = \".\""), 10, "probe.a.image", &["found the folder"]),
        (probe("image = \"note.txt\""), 10, "probe.a.image", &["cannot be read"]),
        (good_view("photo = \"no.jpg\""), 12, "view.v.photo", &["there is no file"]),
        (good_view("mask = \"no.png\""), 12, "view.v.mask", &["there is no file"]),
        // aspects
        (probe("image = \"square.png\""), 10, "probe.a.image", &["twice as wide as high", "32 × 32"]),
        (good_probe("projection = \"angular\""), 10, "probe.a.image", &["square", "64 × 32"]),
        (good_probe("projection = \"mirror-ball\""), 10, "probe.a.image", &["square"]),
        (good_probe("projection = \"fisheye\""), 10, "probe.a.image", &["square"]),
        (good_probe("projection = \"cube-cross\""), 10, "probe.a.image", &["3 × 4 or 4 × 3"]),
        (good_probe("projection = \"perspective\""), 11, "probe.a.projection", &["needs fov_y or fx"]),
        (good_probe("fov_y = 50"), 11, "probe.a.fov_y", &["\"perspective\" or \"fisheye\" only"]),
        (good_view("photo = \"square.png\""), 12, "view.v.photo", &["aspect", "8 × 6", "32 × 32"]),
        (good_view("mask = \"square.png\""), 12, "view.v.mask", &["aspect"]),
        // poses
        (
            "[[probe]]\nname = \"a\"\nposition = [nan, 0, 0]\nimage = \"p.png\"\n".into(),
            9,
            "probe.a.position",
            &["three finite numbers"],
        ),
        (good_probe("heading = inf"), 11, "probe.a.heading", &["expected a finite number, found inf"]),
        (good_probe("rotation = [1, 1, 0, 0]"), 11, "probe.a.rotation", &["unit quaternion", "length 1.4142"]),
        (good_probe("rotation = [nan, 1, 0, 0]"), 11, "probe.a.rotation", &["unit quaternion"]),
        (good_probe("matrix = [[2, 0, 0], [0, 1, 0], [0, 0, 1]]"), 11, "probe.a.matrix", &["rotation matrix"]),
        (good_probe("matrix = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]"), 11, "probe.a.matrix", &["mirrors"]),
        (good_probe("look_at = [3, 2, 1.6]"), 11, "probe.a.look_at", &["the position itself"]),
        (good_probe("heading = 3\nlook_at = [0, 0, 0]"), 12, "probe.a.look_at", &["given twice"]),
        ("[[probe]]\nname = \"a\"\nimage = \"p.png\"\n".into(), 7, "probe.a", &["`position` is missing"]),
        (PROBE.into(), 7, "probe.a", &["`image` is missing"]),
        // names and lightings
        (format!("{0}{0}", good_probe("")), 12, "probe.a.name", &["two probes named “a”"]),
        (format!("{}{}", good_view(""), good_view("").replace("\"v\"", "\"V\"")), 13, "view.V.name", &["two views"]),
        (good_probe("").replace("\"a\"", "\"a/b\""), 8, "probe.a/b.name", &["it holds '/'"]),
        (good_probe("").replace("\"a\"", "\"..\""), 8, "", &["a blank or a dot"]),
        (good_probe("").replace("\"a\"", "\"nul\""), 8, "probe.nul.name", &["reserved"]),
        (good_probe("").replace("\"a\"", "\" \""), 8, "", &["it is empty"]),
        (probe("image = {}"), 10, "probe.a.image", &["the table of lightings is empty"]),
        (probe("image = { \"\" = \"p.png\" }"), 10, "", &["cannot name a lighting"]),
        (probe("image = { \"10:00\" = \"no.exr\" }"), 10, "probe.a.image.10:00", &["there is no file"]),
        (good_probe("gain = 0"), 11, "probe.a.gain", &["gain above zero, found 0"]),
        (good_probe("gain = [1, -1, 1]"), 11, "probe.a.gain", &["gain above zero, found -1"]),
        (good_probe("gain = [1, 2]"), 11, "probe.a.gain", &["three numbers for red, green and blue", "2"]),
        (good_probe("vignetting = [0.1, 0]"), 11, "probe.a.vignetting", &["perspective"]),
        (good_probe("response = [-4, 2]"), 11, "probe.a.response", &["falls"]),
        // cameras
        (view("size = [0, 6]\nfov_y = 60"), 10, "view.v.size", &["from 1 to 65536", "[0, 6]"]),
        (view("size = [8, 6]\nfov_y = 0"), 11, "view.v.fov_y", &["between 0 and 180 degrees, found 0"]),
        (view("size = [8, 6]\nfov_y = 180"), 11, "view.v.fov_y", &["between 0 and 180"]),
        (view("size = [8, 6]\nfov_y = nan"), 11, "view.v.fov_y", &["found NaN"]),
        (view("size = [8, 6]"), 7, "view.v", &["neither fov_y nor fx"]),
        (good_view("fx = 3"), 11, "view.v.fov_y", &["both fov_y and a focal length"]),
        (view("size = [8, 6]\nfx = -3"), 11, "view.v.fx", &["focal length in pixels above zero"]),
        (view("fov_y = 60"), 7, "view.v", &["`size` is missing"]),
        (
            "[[view]]\nname = \"v\"\nsize = [8, 6]\nfov_y = 60\n".into(),
            7,
            "view.v",
            &["`position` is missing", "match"],
        ),
        (
            good_view("match = [{ pixel = [9, 0], point = [0, 0, 0] }]"),
            12,
            "view.v.match.#1.pixel",
            &["expected a pixel in"],
        ),
        // light
        ("[environment]\nheading = 3\n".into(), 7, "environment", &["neither an image nor a radiance"]),
        ("[environment]\nimage = \"p.png\"\nradiance = [1, 1, 1]\n".into(), 9, "environment.radiance", &["both"]),
        ("[environment]\nradiance = [1, -1, 1]\n".into(), 8, "environment.radiance", &["zero or greater"]),
        ("[environment]\nimage = \"square.png\"\n".into(), 8, "environment.image", &["twice as wide"]),
        ("[sun]\ndirection = [0, 0, 0]\nirradiance = [1, 1, 1]\n".into(), 8, "sun.direction", &["no length"]),
        (
            "[sun]\ndirection = [0, 0, 1]\nirradiance = [1, 1, 1]\n[sun.under.noon]\ndirection = [0, 0, 1]\n\
             irradiance = [1, 1, 1]\n"
                .into(),
            10,
            "",
            &["no probe has a picture of the lighting “noon”"],
        ),
        // plan
        (plan("probe_height = -1"), 8, "plan.probe_height", &["a height in metres above zero"]),
        (plan("incidence = 91"), 8, "plan.incidence", &["at most 90"]),
        (plan("target_coverage = 98"), 8, "plan.target_coverage", &["at most 1, found 98"]),
        (plan("max_probes = 0"), 8, "plan.max_probes", &["at least 1"]),
        (plan("keep_out = [[[0, 0], [1, 1]]]"), 8, "plan.keep_out", &["three corners"]),
        (plan("fixed = [[0, nan]]"), 8, "plan.fixed", &["finite numbers"]),
    ];
    let mut wrong = Vec::new();
    for (rest, line, key, parts) in cases {
        let text = fault(&format!("{HEAD}{rest}"));
        let place = text.contains(&format!("site.toml:{line}:"));
        let named = key.is_empty() || text.contains(&format!(": {key}: "));
        if !place || !named || !parts.iter().all(|p| text.contains(p)) {
            wrong.push(format!("line {line}, key {key:?} and {parts:?} were expected in\n{text}\n"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn faults_of_the_head_and_of_the_file_itself() {
    for (text, parts) in [
        ("[site]\nup = \"z\"\n", vec![":1:1", "`model` is missing", "Add a line [model]"]),
        ("[site]\nunits = \"km\"\n[model]\npath = \"m.obj\"\n", vec![":2:", "site.units", "\"cm\", \"mm\", \"ft\""]),
        ("[site]\nunits = 0\n[model]\npath = \"m.obj\"\n", vec!["site.units", "above zero"]),
        ("[site]\nup = \"w\"\n[model]\npath = \"m.obj\"\n", vec!["site.up", "string \"w\"", "a vector [x, y, z]"]),
        ("[site]\nup = [0, 0, 0]\n[model]\npath = \"m.obj\"\n", vec!["site.up", "expected a direction"]),
        ("[site]\nup = [0,1, 0,2, 0,9]\n[model]\npath = \"m.obj\"\n", vec!["site.up", "[0.1, 0.2, 0.9]"]),
        ("[site]\nunits = \"miles\"\n[model]\npath = \"m.obj\"\n", vec!["site.units", "string \"miles\""]),
        ("[site]\nnorth = nan\n[model]\npath = \"m.obj\"\n", vec!["site.north", "finite"]),
        ("[model]\npath = \"no.obj\"\n", vec![":2:8: model.path", "there is no file"]),
        ("[model]\npath = \"http://x.org/m.obj\"\n", vec!["model.path", "URL"]),
    ] {
        let message = fault(text);
        assert!(parts.iter().all(|p| message.contains(p)), "{message}");
    }
    let missing = Site::load(Path::new("/no/such/folder/site.toml")).unwrap_err().to_string();
    assert!(missing.contains("/no/such/folder/site.toml") && missing.contains("Name a site file"));
    let dir = tempfile::tempdir().unwrap();
    assert!(Site::load(dir.path()).unwrap_err().to_string().contains("site.toml"));
    fs::write(dir.path().join("site.toml"), b"name = \"\xe9\"").unwrap();
    assert!(Site::load(dir.path()).unwrap_err().to_string().contains("UTF-8"));
    assert!(Site::load(Path::new("https://x.org/site.toml")).unwrap_err().to_string().contains("URL"));
}

#[test]
fn orientations_agree_in_every_form() {
    // looking east (heading 90): the camera's right is south, its up is up, its back is west, in a z-up model
    let s = std::f64::consts::FRAC_1_SQRT_2;
    let forms = [
        "heading = 90".to_owned(),
        "look_at = [9, 2, 1.6]".to_owned(),
        "matrix = [[0, 0, -1], [-1, 0, 0], [0, 1, 0]]".to_owned(),
        "rotation = [0.5, 0.5, -0.5, -0.5]".to_owned(),
    ];
    for form in &forms {
        let site = load(&format!("{PROBE}image = \"p.png\"\n{form}\n"));
        let m = site.probes[0].pose.rotation;
        assert!((m * DVec3::Y).distance(DVec3::X) < 1e-9, "{form}: forward {}", m * DVec3::Y);
        assert!((m * DVec3::X).distance(DVec3::NEG_Y) < 1e-9, "{form}: right {}", m * DVec3::X);
        assert!((m * DVec3::Z).distance(DVec3::Z) < 1e-9, "{form}: up {}", m * DVec3::Z);
    }
    // the same numbers in a y-up model: no turn at all looks along −z, which is north
    let y_up = HEAD.replace("\"z\"", "\"y\"");
    for form in ["heading = 0", "rotation = [1, 0, 0, 0]", "look_at = [3, 2, -9]"] {
        let dir = folder(&format!("{y_up}{PROBE}image = \"p.png\"\n{form}\n"));
        let m = Site::load(dir.path()).unwrap().probes[0].pose.rotation;
        assert!((m * DVec3::Y).distance(DVec3::Y) < 1e-9 && (m * DVec3::X).distance(DVec3::X) < 1e-9, "{form}");
    }
    let pitched = load(&format!("{PROBE}image = \"p.png\"\nheading = 0\npitch = 45\n"));
    assert!((pitched.probes[0].pose.rotation * DVec3::Y).distance(DVec3::new(0.0, s, s)) < 1e-9);
}

#[test]
fn a_full_site_file_is_understood() {
    let site = load(&format!(
        "[environment]\nimage = \"p.png\"\nheading = 90\n[sun]\ndirection = [0, 0, 2]\nirradiance = [5, 4, 3]\n\
         [sun.under.\"10:00\"]\ndirection = [0, 3, 0]\nirradiance = [2, 1, 1]\n\
         {PROBE}gain = 2\nimage = {{ \"14:30\" = \"q.png\", \"10:00\" = \"p.png\" }}\n\
         [[probe]]\nname = \"b\"\nposition = [1, 1, 1]\nprojection = \"perspective\"\nfov_y = 90\nimage = {{ \"10:00\" = \"p.png\" }}\n\
         {VIEW}look_at = [0, 0, 0]\nfx = 30\ncx = 19\nk1 = 0.1\np2 = -0.01\nphoto = \"photo.png\"\n\
         [plan]\nclearance = 0.5\nkeep_out = [[[0, 0], [1, 0], [1, 1]]]\nfixed = [[2, 3]]\n",
    ));
    assert_eq!(site.lightings(), ["14:30", "10:00"]);
    assert_eq!(site.warnings.len(), 1, "{:?}", site.warnings);
    assert!(site.warnings.iter().any(|w| w.contains("“b” has no picture for “14:30”")));
    assert_eq!(site.probes[0].gain, Vec3::splat(2.0));
    assert!(
        matches!(site.probes[1].projection, Projection::Perspective { fov_y } if (fov_y - std::f64::consts::FRAC_PI_2).abs() < 1e-12)
    );
    assert!(matches!(&site.environment, Some(Environment::Image { rotation, .. })
        if (*rotation * DVec3::Y).distance(DVec3::X) < 1e-9));
    let suns = ["14:30", "10:00"].map(|lighting| site.sun_under(lighting).unwrap());
    assert_eq!(suns.map(|s| s.direction), [Vec3::Z, Vec3::Y]);
    assert_eq!(suns.map(|s| s.irradiance.x), [5.0, 2.0]);
    let camera = &site.views[0].camera;
    assert_eq!(
        (camera.width, camera.height, camera.focal, camera.centre),
        (40, 30, DVec2::splat(30.0), DVec2::new(19.0, 15.0))
    );
    assert_eq!((camera.distortion.k()[0], camera.distortion.p()[1]), (0.1, -0.01));
    assert_eq!((site.plan.clearance_m, site.plan.probe_height_m, site.plan.max_probes), (0.5, 1.6, 12));
    assert_eq!((site.plan.keep_out[0].len(), site.plan.fixed[0]), (3, DVec2::new(2.0, 3.0)));
}

#[test]
fn units_and_up_have_many_names() {
    let frame = |units: &str, up: &str| {
        let text = format!("[site]\nunits = {units}\nup = {up}\n[model]\npath = \"m.obj\"\n");
        Site::load(folder(&text).path()).unwrap().frame
    };
    assert_eq!(frame("\"feet\"", "\"Z\"").metres_per_unit, 0.3048);
    assert_eq!(frame("\"Meters\"", "\"+y\"").up, Up::Y);
    assert_eq!(frame("2", "[0, 0, 3]").up, Up::Z);
    for (up, model) in [("\"x\"", DVec3::X), ("\"-z\"", DVec3::NEG_Z), ("[0.1, 0, 0.99]", DVec3::new(0.1, 0.0, 0.99))] {
        assert!(frame("1", up).direction_in(model.normalize()).distance(DVec3::Z) < 1e-12, "{up}");
    }
}

#[test]
fn vertex_colours_are_linear_unless_said_otherwise() {
    let colour = |key: &str| {
        let dir = folder(&HEAD.replace("\"m.obj\"", &format!("\"c.obj\"{key}")));
        let corners = "v 0 0 0 0.5 1 0\nv 1 0 0 0.5 1 0\nv 0 1 0 0.5 1 0\nf 1 2 3\n";
        fs::write(dir.path().join("c.obj"), corners).unwrap();
        load_site(dir.path()).1.mesh.colours[0]
    };
    assert_eq!(colour(""), Vec3::new(0.5, 1.0, 0.0));
    assert_eq!(colour("\nvertex_colours = \"linear\""), colour(""));
    assert!(colour("\nvertex_colours = \"srgb\"").distance(Vec3::new(0.21404, 1.0, 0.0)) < 1e-4);
    assert_eq!(colour("\nvertex_colours = \"sRGB\""), colour("\nvertex_colours = \"srgb\""));
    let error = fault(&HEAD.replace("\"m.obj\"", "\"m.obj\"\nvertex_colours = \"srg\""));
    assert!(error.contains("model.vertex_colours") && error.contains("Did you mean `srgb`?"), "{error}");
}

#[test]
fn plan_points_are_the_models_horizontal_axes() {
    let text = format!("{}[plan]\nfixed = [[2, 3]]\n", HEAD.replace("\"z\"", "\"y\"").replace("\"m\"", "\"cm\""));
    let dir = folder(&text);
    let site = Site::load(dir.path()).unwrap();
    assert!(site.plan.fixed[0].distance(DVec2::new(0.02, -0.03)) < 1e-12);
}

#[test]
fn sibenik_and_room_load() {
    let Some(path) = shared("truth/sibenik") else { return };
    let site = Site::load(&path).unwrap();
    assert_eq!((site.probes.len(), site.views.len(), site.warnings.len()), (4, 4, 0));
    let mut health = Health::default();
    let scene = scene::load(&site, &mut health).unwrap();
    assert_eq!((health.triangles_read, scene.textures.len()), (72_526, 8));
    assert_eq!(health.triangles, 72_526 - health.zero_area - health.duplicates);
    let (_, scene) = load_site(&path.join("../room/site.toml"));
    assert_eq!(scene.mesh.triangles.len(), 42);
}

#[test]
fn check_tells_a_healthy_site_from_an_ill_one() {
    let healthy =
        folder(&format!("{HEAD}{PROBE}image = \"p.png\"\n{VIEW}look_at = [0, 0, 1]\nfov_y = 60\nsize = [64, 48]\n"));
    let check = |site: &TempDir, more: &[&str]| clerestory(&[&"check", &site.path()], more);
    let text = check(&healthy, &[]).text();
    assert!(text.contains("12 triangles, 6.00 × 5.00 × 4.00 m") && text.contains("Nothing is wrong."), "{text}");
    let line = text.lines().find(|l| l.trim_start().starts_with("volume")).expect("a line on the volume");
    assert!(line.contains("left out  every sampled point"), "{text}");
    let json = check(&healthy, &["--json"]).json();
    assert_eq!((&json["ok"], &json["model"]["triangles"]), (&true.into(), &12.into()));
    assert_eq!((&json["probes"][0]["name"], &json["edges"]["open"]), (&"a".into(), &0.into()));
    let needed = |stage: &str| {
        let stages = json["stages"].as_array().unwrap();
        stages.iter().find(|s| s["stage"] == stage).unwrap()["needed"].as_bool().unwrap()
    };
    assert!(needed("shoot") && needed("render"));
    assert!(!needed("textures") && !needed("merge") && !needed("volume") && !needed("audit") && !needed("simulate"));

    let ill = folder(&format!("{HEAD}{}image = \"p.png\"\n", PROBE.replace("1.6]", "-0.5]")));
    let text = check(&ill, &[]).text();
    assert!(text.contains("! There is no surface beneath it") && text.contains("mind the lines"), "{text}");
}

#[test]
fn check_exits_with_the_designs_codes() {
    let bad = folder(&format!("{HEAD}[plans]\n"));
    let told = clerestory(&[&"check", &bad.path()], &[]);
    assert_eq!(told.stdout, "");
    let err = told.error_line();
    assert!(err.starts_with("error: ") && err.contains("site.toml:7:"));
    assert_eq!(clerestory(&[], &["check"]).code, Some(2));
    assert_eq!(clerestory(&[], &["check", "--no-such-option", "."]).code, Some(2));
    let stl = folder("[model]\npath = \"m.stl\"\n");
    fs::write(stl.path().join("m.stl"), "solid room\nfacet normal 0 0 1\n").unwrap();
    let told = clerestory(&[&"check", &stl.path()], &[]);
    let expected = "expected an OBJ, PLY, glTF or E57 model, found an STL mesh";
    assert!(told.code == Some(1) && told.stderr.contains(expected), "{told:?}");
}

#[test]
fn a_model_in_place_of_a_site_file_gets_one_offered() {
    let dir = folder("");
    let says = |name: &str| {
        fs::write(dir.path().join(name), "v 0 0 0\n").unwrap();
        let told = clerestory(&[&"check", &dir.path().join(name)], &[]);
        assert_eq!(told.code, Some(1));
        told.stderr
    };
    let told = says("m.obj");
    assert!(told.contains("found a model") && told.contains("clerestory init ") && told.contains("m.obj"), "{told}");
    let told = says("hall.FBX");
    assert!(told.contains("FBX") && told.contains("glTF 2.0"), "{told}");
}

#[test]
fn all_faults_of_a_file_are_told_at_once() {
    let told = fault(&format!(
        "{HEAD}[[probe]]\nname = \"a\"\nposition = [1, 2, nan]\nimage = \"p.png\"\n\
         [[probe]]\nname = \"b\"\nposition = [1, 2, 3]\nimage = 'C:\\site\\Q.PNG'\n{VIEW}fov_y = 200\nsize = [8, 8]\n\
         [plan]\noverlap = 3\n"
    ));
    let lines: Vec<&str> = told.lines().collect();
    assert_eq!(lines.len(), 4, "{told}");
    for (line, part) in lines.iter().zip(["probe.a.position", "Did you mean “q.png”", "view.v.fov_y", "plan.overlap"])
    {
        assert!(line.contains("site.toml:") && line.contains(part), "{line}");
    }
    // unknown keys and wrong kinds beside what is wrong in their values; what a table lacks for them is not held against it
    let told = fault(&format!(
        "[site]\nunits = \"parsec\"\nnorht = 3\n[model]\npath = \"none.obj\"\n\
         [[probe]]\nname = \"a\"\nposition = [1, 2, 3]\nimage = 7\nheding = 1\n\
         [[probe]]\nname = \"b\"\nposition = [1, 2, 3]\nimage = \"none.png\"\n{VIEW}fov_y = 50\n"
    ));
    let lines: Vec<&str> = told.lines().collect();
    let parts =
        ["site.units", "site.norht", "model.path", "probe.a.image", "probe.a.heding", "probe.b.image", "view.v"];
    assert_eq!(lines.len(), parts.len(), "{told}");
    for (line, part) in lines.iter().zip(parts) {
        assert!(line.contains(part), "{line}");
    }
}

#[test]
fn a_view_never_takes_the_name_of_the_reports_own_files() {
    let site = load(
        &["study", "Plan-ground", "apse", "study-truth-apse-a", "study-photo"]
            .map(|n| format!("{VIEW}fov_y = 50\nsize = [8, 8]\n").replace("\"v\"", &format!("\"{n}\"")))
            .concat(),
    );
    let stems: Vec<String> = site.views.iter().map(clerestory::site::View::file_stem).collect();
    assert_eq!(stems, ["view-study", "view-Plan-ground", "apse", "view-study-truth-apse-a", "view-study-photo-view"]);
}

#[test]
fn a_materials_name_does_not_steer_the_terminal() {
    let dir = folder(&format!("{HEAD}{PROBE}image = \"p.png\"\n"));
    let model = fs::read_to_string(dir.path().join("m.obj")).unwrap();
    fs::write(dir.path().join("m.obj"), format!("{model}usemtl gold\u{1b}]0;owned\u{7}\u{9b}2J\nf 1 2 4\nf 1 2 3\n"))
        .unwrap();
    for more in [&[][..], &["--json"]] {
        let text = clerestory(&[&"check", &dir.path()], more).text();
        assert!(text.contains("\\u001b]0;owned"), "{text}");
        assert!(!text.contains(|c: char| c.is_control() && c != '\n'), "{text:?}");
    }
}

#[test]
fn a_project_is_read_and_its_fields_have_one_line() {
    let project = "[project]\ntitle = \"Survey of spring\"\ninstitution = \" Office \"\ndate = 2026-05-12\n";
    let site = load(project);
    let p = &site.project;
    assert_eq!(
        (p.title.as_str(), p.institution.as_str(), p.date.as_str()),
        ("Survey of spring", "Office", "2026-05-12")
    );
    assert!(p.author.is_empty() && p.rights.is_empty());
    assert_eq!(load("[project]\ndate = \"spring 2026\"\n").project.date, "spring 2026");
    let said = fault(&format!("{HEAD}[project]\nrights = \"two\\nlines\"\n"));
    assert!(said.contains("rights") && said.contains("one line"), "{said}");
}
