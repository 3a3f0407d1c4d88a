//! `render` and `bake` from the command line: files, exposures and what is refused.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::program::{Done, clerestory};
use crate::support::{Built, HIGH, Plan, change, closed, files, grey, options, v, write_picture};
use clerestory::bake::{self, bake};
use clerestory::panorama::Picture;
use clerestory::render::Options;
use clerestory::site::Site;
use glam::{DVec3, Vec3};
use std::fs;
use std::path::{Path, PathBuf};

/// A closed room, two probes and a view, without pictures.
fn room() -> Plan {
    Plan::new(closed(DVec3::ZERO, HIGH, 0), &[grey(0.6)]).probe(v(1.0, 1.4, 1.0), 32).probe(v(3.0, 1.9, 1.3), 32).view(
        v(3.6, 2.5, 1.7),
        v(1.0, 1.0, 0.4),
        24,
    )
}

/// The room with a picture for each probe.
fn lit() -> Built {
    let plan = room();
    plan.build().paint(&plan, |_, s| s.map_or(Vec3::ZERO, |s| Vec3::splat(s.position.x.exp())))
}

/// Puts other pictures in the place of the probes' own into the site file.
fn with_pictures(folder: &Path, pictures: [&str; 2]) {
    change(&folder.join("site.toml"), &[("\"p0.exr\"", pictures[0]), ("\"p1.exr\"", pictures[1])]);
}

/// The room by day and by night, when it is darker and lit from elsewhere.
fn day_and_night() -> Built {
    let built = room().build();
    let folder = built.folder.path();
    for i in 0..2 {
        for (name, scale, slope) in [("night", 0.01_f32, -1.0_f32), ("day", 1.0, 1.0)] {
            let radiance = |x: f32| Vec3::splat(scale * (slope * x).exp());
            let picture = built.look(i, 32, |s| s.map_or(Vec3::ZERO, |s| radiance(s.position.x)));
            write_picture(&folder.join(format!("{name}{i}.exr")), &picture);
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
            write_picture(&folder.join(format!("p{probe}_{:03}.exr", n + 1)), &picture);
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
fn run(verb: &str, site: &Path, out: &str, more: &[&str]) -> Done {
    let more = [&["--json", "--cells", "8", "--vertices", "2000"][..], more].concat();
    clerestory(&[&"--threads", &"2", &verb, &site, &"--out", &site.join(out)], &more)
}

/// A lighting's files have its name, whichever other lightings are baked with it.
#[test]
fn lightings_baked_one_by_one_keep_their_files() {
    let built = day_and_night();
    let site = built.folder.path();
    run("bake", site, "one", &["--lighting", "day"]).text();
    run("bake", site, "one", &["--lighting", "night", "--lighting", "night"]).text();
    run("bake", site, "both", &[]).text();
    let expected = ["test-day.glb", "test-day.ply", "test-night.glb", "test-night.ply"].map(PathBuf::from);
    assert_eq!(files(&site.join("one")), expected);
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
        run("render", site, out, &more).text();
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
        let told = run("render", site, out, &more).json();
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
    let why = run("render", numbered.folder.path(), "out", &["--compare"]).error();
    assert!(why.contains("numbered pictures") && why.contains("Leave out --compare"), "{why}");
    let built = lit();
    let warned = |more: &[&str]| {
        let told = run("render", built.folder.path(), "out", more).json();
        told["warnings"].as_array().unwrap().iter().any(|w| w.as_str().unwrap().contains("nothing to compare with"))
    };
    assert!(warned(&["--compare"]));
    assert!(!warned(&[]));
}

#[test]
fn the_paper_s_method_refuses_volume_only() {
    let built = lit();
    let why = run("render", built.folder.path(), "out", &["--method", "paper", "--volume-only"]).error();
    assert!(why.contains("--volume-only"), "{why}");
}

/// Probes that are not used are not fitted.
#[test]
fn gains_are_fitted_to_the_probes_in_use() {
    let built = lit();
    for (probes, fitted) in [("1", 1), ("2", 2)] {
        let told = run("render", built.folder.path(), "out", &["--fit-gains", "--probes", probes]).json();
        assert_eq!(told["gains"]["pictures"].as_array().unwrap().len(), fitted);
    }
}
