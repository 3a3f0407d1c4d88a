//! `render` and `bake` from the command line: files, exposures and what is refused.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::{Built, Plan, closed, grey, options, v};
use assert_cmd::Command;
use assert_cmd::assert::Assert;
use clerestory::bake::{self, bake};
use clerestory::panorama::{Layer, Picture, write_exr};
use clerestory::render::Options;
use clerestory::site::Site;
use glam::{DVec3, Vec3};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A closed room, two probes and a view, without pictures.
fn room() -> Plan {
    Plan::new(closed(DVec3::ZERO, v(4.0, 3.0, 2.5), 0), &[grey(0.6)])
        .probe(v(1.0, 1.4, 1.0), 32)
        .probe(v(3.0, 1.9, 1.3), 32)
        .view(v(3.6, 2.5, 1.7), v(1.0, 1.0, 0.4), 24)
}

/// The room with a picture for each probe.
fn lit() -> Built {
    let plan = room();
    plan.build().paint(&plan, |_, s| s.map_or(Vec3::ZERO, |s| Vec3::splat(s.position.x.exp())))
}

/// Puts other pictures in the place of the probes' own into the site file.
fn with_pictures(folder: &Path, pictures: [&str; 2]) {
    let file = folder.join("site.toml");
    let mut text = fs::read_to_string(&file).unwrap();
    for (i, picture) in pictures.iter().enumerate() {
        let own = format!("image = \"p{i}.exr\"");
        assert!(text.contains(&own));
        text = text.replace(&own, &format!("image = {picture}"));
    }
    fs::write(file, text).unwrap();
}

/// The room by day and by night, when it is darker and lit from elsewhere.
fn day_and_night() -> Built {
    let built = room().build();
    let folder = built.folder.path();
    for i in 0..2 {
        for (name, scale, slope) in [("night", 0.01_f32, -1.0_f32), ("day", 1.0, 1.0)] {
            let radiance = |x: f32| Vec3::splat(scale * (slope * x).exp());
            let picture = built.look(i, 32, |s| s.map_or(Vec3::ZERO, |s| radiance(s.position.x)));
            let file = folder.join(format!("{name}{i}.exr"));
            write_exr(&file, picture.width, picture.height, &[Layer::rgb("", &picture)], None).unwrap();
        }
    }
    let both = [0, 1].map(|i| format!("{{ night = \"night{i}.exr\", day = \"day{i}.exr\" }}"));
    with_pictures(folder, [&both[0], &both[1]]);
    built
}

/// The room under numbered pictures: hardly any light, some, and twice that.
fn numbered() -> Built {
    let built = room().build();
    let folder = built.folder.path();
    for probe in 0..2 {
        for (n, radiance) in [0.01, 1.0, 2.0].into_iter().enumerate() {
            let mut picture = Picture::new(32, 16);
            picture.pixels.fill(Vec3::splat(radiance));
            let file = folder.join(format!("p{probe}_{:03}.exr", n + 1));
            write_exr(&file, picture.width, picture.height, &[Layer::rgb("", &picture)], None).unwrap();
        }
    }
    with_pictures(folder, ["\"p0_###.exr\"", "\"p1_###.exr\""]);
    built
}

/// Writes a walk of three frames.
fn walk(folder: &Path) {
    let keys = "[[key]]\nposition = [3.6, 2.5, 1.7]\nlook_at = [1, 1, 0.4]\n[[key]]\nposition = [2.6, 2.5, 1.7]\nlook_at = [1, 1, 0.4]\n";
    fs::write(folder.join("walk.toml"), format!("[path]\nframes = 3\nsize = [24, 16]\n{keys}")).unwrap();
}

/// Runs a verb on a site, its results going to the folder `out` there.
fn run(verb: &str, site: &Path, out: &str, more: &[&str]) -> Assert {
    let mut command = Command::cargo_bin("clerestory").unwrap();
    command.args(["--threads", "2", verb]).arg(site).arg("--out").arg(site.join(out)).arg("--json");
    command.args(["--cells", "8", "--vertices", "2000"]).args(more).assert()
}

fn json(done: Assert) -> Value {
    serde_json::from_slice(&done.success().get_output().stdout).unwrap()
}

/// The line that tells why it does not go.
fn told(done: Assert) -> String {
    String::from_utf8(done.failure().get_output().stderr.clone()).unwrap()
}

fn files(folder: &Path) -> Vec<String> {
    let mut all: Vec<String> =
        fs::read_dir(folder).unwrap().map(|f| f.unwrap().file_name().to_string_lossy().into_owned()).collect();
    all.sort();
    all
}

/// A lighting's files have its name, whichever other lightings are baked with it.
#[test]
fn lightings_baked_one_by_one_keep_their_files() {
    let built = day_and_night();
    let site = built.folder.path();
    run("bake", site, "one", &["--lighting", "day"]).success();
    run("bake", site, "one", &["--lighting", "night", "--lighting", "night"]).success();
    run("bake", site, "both", &[]).success();
    assert_eq!(files(&site.join("one")), ["test-day.glb", "test-day.ply", "test-night.glb", "test-night.ply"]);
    assert_eq!(files(&site.join("one")), files(&site.join("both")));
}

/// A vertex names its probe by the place in the site, though other probes lack the lighting.
#[test]
fn a_vertex_names_its_probe_among_all_of_the_site() {
    let built = lit();
    let folder = built.folder.path();
    fs::copy(folder.join("p1.exr"), folder.join("d1.exr")).unwrap();
    with_pictures(folder, ["{ night = \"p0.exr\" }", "{ night = \"p1.exr\", day = \"d1.exr\" }"]);
    let site = Site::load(folder).unwrap();
    let options = Options { lightings: vec!["day".to_owned()], ..options(8) };
    let settings = bake::BakeSettings { vertices: 2_000, views: false, ..bake::BakeSettings::default() };
    let baked = bake(&site, &built.scene, &options, &settings, &|_| ()).unwrap().baked;
    assert!(baked.vertices.iter().all(|v| v.probe.is_none_or(|p| p == 1)));
    assert!(baked.vertices.iter().any(|v| v.probe == Some(1)));
}

/// The PNGs of a walk are exposed for the mixture that they show.
#[test]
fn a_walk_is_exposed_for_what_it_shows() {
    let built = day_and_night();
    let site = built.folder.path();
    walk(site);
    let path = site.join("walk.toml");
    let along = |out: &str, more: &[&str]| {
        let more = [more, &["--path", path.to_str().unwrap()]].concat();
        run("render", site, out, &more).success();
        [1, 2, 3].map(|n| fs::read(site.join(out).join(format!("frame_{n:04}.png"))).unwrap())
    };
    let mixed = along("mixed", &["--lighting", "night", "--blend", "day", "--share", "1"]);
    assert!(mixed == along("day", &["--lighting", "day"]));
}

/// Numbered pictures that begin in the dark are not exposed for that; the frames that tell how count nowhere.
#[test]
fn numbered_pictures_are_exposed_for_all_of_them() {
    let built = numbered();
    let site = built.folder.path();
    walk(site);
    let path = site.join("walk.toml");
    let along = vec!["--path", path.to_str().unwrap()];
    for (out, name, more) in [("views", "v0", Vec::new()), ("walk", "frame", along)] {
        let told = json(run("render", site, out, &more));
        assert_eq!(told["baked"]["video"]["frames"], 3);
        for n in 1..=3 {
            let picture = image::open(site.join(out).join(format!("{name}_{n:04}.png"))).unwrap().to_rgb8();
            assert!(picture.as_raw().iter().any(|v| *v < 255), "{name} {n}: white");
            assert!(picture.as_raw().iter().any(|v| *v > 0), "{name} {n}: black");
        }
    }
}

#[test]
fn what_cannot_be_compared_is_told() {
    let numbered = numbered();
    let why = told(run("render", numbered.folder.path(), "out", &["--compare"]));
    assert!(why.contains("numbered pictures") && why.contains("Leave out --compare"), "{why}");
    let built = lit();
    let warned = |more: &[&str]| {
        let all = json(run("render", built.folder.path(), "out", more))["warnings"].clone();
        all.as_array().unwrap().iter().any(|w| w.as_str().unwrap().contains("nothing to compare with"))
    };
    assert!(warned(&["--compare"]));
    assert!(!warned(&[]));
}

#[test]
fn the_paper_s_method_refuses_volume_only() {
    let built = lit();
    let why = told(run("render", built.folder.path(), "out", &["--method", "paper", "--volume-only"]));
    assert!(why.contains("--volume-only"), "{why}");
}

/// Probes that are not used are not fitted.
#[test]
fn gains_are_fitted_to_the_probes_in_use() {
    let built = lit();
    for (probes, fitted) in [("1", 1), ("2", 2)] {
        let told = json(run("render", built.folder.path(), "out", &["--fit-gains", "--probes", probes]));
        assert_eq!(told["gains"]["pictures"].as_array().unwrap().len(), fitted);
    }
}
