//! `clerestory simulate` on a small site written here.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::program::{Done, clerestory};
use clerestory::panorama;
use std::fs;
use std::path::Path;

const SITE: &str = r#"
[site]
name = "Box"
units = "m"
up = "z"

[model]
path = "box.obj"

[[probe]]
name = "middle"
position = [0, 0, 0]
heading = 0
gain = 2.0
image = { "10:00" = "probes/ten.exr", "14:30" = "probes/half-past-two.exr" }

[[view]]
name = "north"
position = [0, 0, 0]
heading = 0
fov_y = 60
size = [24, 16]
photo = "photos/north.exr"

[[view]]
name = "unphotographed"
position = [0, 0, 0]
heading = 90
fov_y = 60
size = [8, 8]
"#;

/// A furnace: radiance is 1 / (1 − 0.5) = 2 everywhere.
fn write_site(folder: &Path, emission: f32, more: &str) {
    let corners = (0..8).map(|i| {
        let side = |bit: i32| if i >> bit & 1 == 1 { 2 } else { -2 };
        format!("v {} {} {}\n", side(0), side(1), side(2))
    });
    let faces = "usemtl glow\nf 1 2 4 3\nf 5 6 8 7\nf 1 2 6 5\nf 3 4 8 7\nf 1 3 7 5\nf 2 4 8 6\n";
    fs::write(folder.join("box.obj"), format!("mtllib box.mtl\n{}{faces}", corners.collect::<String>())).unwrap();
    let material = format!("newmtl glow\nKd 0.5 0.5 0.5\nKe {emission} {emission} {emission}\n");
    fs::write(folder.join("box.mtl"), material).unwrap();
    fs::write(folder.join("site.toml"), format!("{SITE}{more}")).unwrap();
}

fn simulate(folder: &Path, arguments: &[&str]) -> Done {
    clerestory(&[&"simulate", &folder], arguments)
}

#[test]
fn pictures_appear_where_the_site_file_says_and_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    write_site(folder.path(), 1.0, "");
    let result = simulate(folder.path(), &["--size", "32", "--samples", "64", "--json"]).json();
    assert_eq!(result["pictures"].as_array().unwrap().len(), 2, "{result}");
    assert_eq!(result["left_out"][0]["name"], "unphotographed");
    let noise = result["pictures"][0]["noise"]["median"].as_f64().unwrap();
    assert!(noise > 0.0 && noise < 0.1, "{noise}");

    let probe = panorama::read(&folder.path().join("probes/ten.exr")).unwrap();
    assert_eq!((probe.width, probe.height), (32, 16));
    let mean = |p: &panorama::Picture| p.pixels.iter().map(|v| v.x).sum::<f32>() / p.pixels.len() as f32;
    // radiance 2, two of it a stored value
    assert!((mean(&probe) - 1.0).abs() < 0.02, "{}", mean(&probe));
    let photo = panorama::read(&folder.path().join("photos/north.exr")).unwrap();
    assert_eq!((photo.width, photo.height), (24, 16));
    assert!((mean(&photo) - 2.0).abs() < 0.04, "{}", mean(&photo));
    assert!(!folder.path().join("probes/half-past-two.exr").exists());

    // kept, then written over, the same bytes on one thread or two
    let file = folder.path().join("photos/north.exr");
    let bytes = fs::read(&file).unwrap();
    fs::write(&file, &bytes).unwrap();
    let text = simulate(folder.path(), &["--views=north", "--samples", "2"]).text();
    assert!(text.contains("kept"), "{text}");
    assert_eq!(fs::read(&file).unwrap(), bytes);
    simulate(folder.path(), &["--views=north", "--samples", "64", "--force"]).text();
    assert_eq!(fs::read(&file).unwrap(), bytes);
    let names: Vec<_> = fs::read_dir(folder.path().join("photos")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["north.exr"], "nothing temporary stays");
}

#[test]
fn a_lighting_a_noise_target_and_a_folder_can_be_chosen() {
    let folder = tempfile::tempdir().unwrap();
    write_site(folder.path(), 1.0, "");
    let out = folder.path().join("elsewhere");
    let given = ["--out", out.to_str().unwrap(), "--lighting", "14:30", "--noise", "3", "--size", "16", "--json"];
    let result = simulate(folder.path(), &given).json();
    assert_eq!(result["pictures"].as_array().unwrap().len(), 1, "views are left out: {result}");
    assert!(result["pictures"][0]["noise"]["median"].as_f64().unwrap() <= 0.03);
    assert!(out.join("probes/middle@14-30.exr").is_file());
}

#[test]
fn one_lighting_for_all_probes_whatever_their_order_of_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let more = "[[probe]]\nname = \"beside\"\nposition = [1, 0, 0]\nheading = 0\n\
                image = { \"14:30\" = \"probes/b14.exr\", \"10:00\" = \"probes/b10.exr\" }\n\
                [[probe]]\nname = \"late\"\nposition = [0, 1, 0]\nheading = 0\nimage = { \"14:30\" = \"probes/c14.exr\" }\n";
    write_site(folder.path(), 1.0, more);
    let text = simulate(folder.path(), &["--probes", "--size", "8", "--samples", "2"]).text();
    let made = ["ten.exr", "b10.exr", "half-past-two.exr", "b14.exr", "c14.exr"];
    let made = made.map(|name| folder.path().join("probes").join(name).exists());
    assert_eq!(made, [true, true, false, false, false]);
    assert!(text.contains("left out late: it has no picture for the lighting “10:00”"), "{text}");
}

#[test]
fn faults_are_said_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    write_site(folder.path(), 0.0, "");
    for (arguments, words) in [
        (&["--size", "8"][..], "nothing gives light"),
        (&["--probes=nave"][..], "no probe “nave”; the site has: middle"),
        (&["--lighting", "noon"][..], "no lighting “noon”. The site's lightings: 10:00, 14:30"),
    ] {
        let error = simulate(folder.path(), arguments).error_line();
        assert!(error.contains(words), "{error}");
    }
    assert_eq!(simulate(folder.path(), &["--sun", "up"]).code, Some(2));
    // the same box under a sun of the command line's is lit, though no light gets in
    let text = simulate(folder.path(), &["--sun", "0,0,1:9,9,9", "--size", "4", "--samples", "2"]).text();
    assert!(text.contains("probe middle: 4 × 2"), "{text}");
}
