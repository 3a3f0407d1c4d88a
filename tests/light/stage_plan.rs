//! What a site does not need is left out, told, and changes no picture.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::program::clerestory;
use crate::support::{Built, HIGH, Paint, Plan, Quad, closed, grey, v};
use glam::DVec3;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A closed room with a panel, a sealed chest with something in it, and a house next door that nobody sees, both with the
/// only picture; two lightings.
fn crowded() -> Built {
    let mut quads = closed(DVec3::ZERO, HIGH, 0);
    quads.push(Quad(v(2.8, 0.8, 0.6), DVec3::Y * 1.2, DVec3::Z * 1.2, 0));
    quads.extend(closed(v(0.5, 2.0, 0.1), v(1.0, 2.5, 0.6), 0));
    quads.push(Quad(v(0.6, 2.1, 0.3), DVec3::X * 0.2, DVec3::Y * 0.2, 1));
    quads.extend(closed(v(9.0, 0.0, 0.0), v(12.0, 3.0, 5.0), 1));
    let plan = Plan::new(quads, &[grey(0.6), Paint { checker: true, ..grey(0.3) }]).probe(v(1.7, 1.4, 1.3), 64).view(
        v(3.7, 2.6, 1.75),
        v(1.5, 0.5, 0.75),
        32,
    );
    let built = plan
        .build()
        .paint(&plan, |_, s| glam::Vec3::splat(s.map_or(0.0, |s| 1.0 + s.position.x.abs() + 0.5 * s.position.z.abs())));
    fs::copy(built.folder.path().join("p0.exr"), built.folder.path().join("p1.exr")).unwrap();
    built.change(&[("\"p0.exr\"", "{ morning = \"p0.exr\", evening = \"p1.exr\" }")]);
    built
}

fn json(args: &[&str], site: &Path) -> Value {
    clerestory(&[&"--threads", &"2", &args[0], &site, &"--json"], &args[1..]).json()
}

fn stages(json: &Value) -> Vec<&str> {
    json["left_out"].as_array().unwrap().iter().map(|l| l["stage"].as_str().unwrap()).collect()
}

#[test]
fn pictures_are_the_same_with_and_without() {
    let built = crowded();
    let site = built.folder.path();
    let (lean, full) = (site.join("lean"), site.join("full"));
    let without = json(&["render", "--out", lean.to_str().unwrap(), "--layers"], site);
    let with = json(&["render", "--out", full.to_str().unwrap(), "--layers", "--all-stages"], site);
    assert_eq!(stages(&without), ["merge", "unreached", "lightings"]);
    assert!(!stages(&with).contains(&"unreached") && !stages(&with).contains(&"lightings"), "{with}");
    assert!(without["views"][0]["covered_fraction"].as_f64().unwrap() < 1.0, "the volume has to play a part");
    let of = |stage: &str| {
        without["left_out"].as_array().unwrap().iter().find(|l| l["stage"] == stage).unwrap()["saves"].clone()
    };
    assert!(of("lightings")["bytes"].as_u64() == Some(64 * 32 * 12), "{without}");
    assert!(of("unreached")["bytes"].as_u64().unwrap() > 64 * 64 * 4, "the picture's texels and the triangles");
    let read = |folder: &Path| fs::read(folder.join("v0.exr")).unwrap();
    assert!(read(&lean) == read(&full), "the same bytes");

    // left out is left out: nobody looks into the picture that nobody sees
    let checker = site.join("checker.png");
    let head = fs::read(&checker).unwrap()[..60].to_vec();
    fs::write(&checker, head).unwrap();
    json(&["render", "--out", lean.to_str().unwrap()], site);
    let failed = clerestory(&[&"render", &"--all-stages", &"--out", &full, &site], &[]);
    assert_eq!(failed.code, Some(1), "{failed:?}");
}

#[test]
fn check_tells_what_is_saved() {
    let built = crowded();
    let told = json(&["check"], built.folder.path());
    let of = |stage: &str| told["stages"].as_array().unwrap().iter().find(|s| s["stage"] == stage).unwrap().clone();
    let unreached = of("unreached");
    assert_eq!(unreached["needed"], false);
    // what lies in the chest, and the house next door: 2 and 12 triangles
    assert!(unreached["why"].as_str().unwrap().starts_with("14 triangles"), "{unreached}");
    assert!(unreached["saves"]["bytes"].as_u64().unwrap() > 0);
    assert_eq!(of("floors")["needed"], true, "the house next door is 5 m high");
    assert_eq!(of("audit")["needed"], false);
    assert_eq!(of("volume")["needed"], true);
    assert_eq!(of("lightings")["saves"]["bytes"], 64 * 32 * 12);
}
