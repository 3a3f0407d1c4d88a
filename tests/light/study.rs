//! `study` from the command line: a small room, measured, cut short, gone on with and repeated.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::program::{Done, clerestory};
use crate::support::{Built, HIGH, Plan, change, closed, grey, v};
use clerestory::panorama::Picture;
use glam::DVec3;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

/// A room with an open ceiling, one probe, whose picture is traced once, and one view.
fn room() -> Built {
    let mut quads = closed(DVec3::ZERO, HIGH, 0);
    quads.remove(1);
    let mut plan =
        Plan::new(quads, &[grey(0.6)]).probe(v(1.2, 1.4, 1.0), 64).view(v(3.6, 2.6, 1.4), v(0.5, 0.8, 0.6), 40);
    plan.more = "[environment]\nradiance = [1, 1.1, 1.3]".to_owned();
    static TRACED: OnceLock<Vec<Picture>> = OnceLock::new();
    let built = plan.build();
    let pictures = TRACED.get_or_init(|| built.traced(&plan, 64));
    built.with(pictures)
}

fn study(site: &Path, out: &Path, more: &[&str]) -> Done {
    let more = [&["--reference-samples", "256", "--most-samples", "16"][..], more].concat();
    clerestory(&[&"--threads", &"2", &"study", &site, &"--out", &out], &more)
}

fn csv(out: &Path) -> Vec<Vec<String>> {
    let text = fs::read_to_string(out.join("study.csv")).unwrap();
    text.lines().map(|l| l.split(',').map(str::to_owned).collect()).collect()
}

/// The columns that do not depend on the machine.
fn errors(rows: &[Vec<String>]) -> Vec<String> {
    let row = |r: &Vec<String>| format!("{} {} {:?}", r[0], r[1].split(';').next().unwrap(), &r[3..7]);
    rows[1..].iter().map(row).collect()
}

#[test]
fn a_study_is_cut_short_goes_on_and_repeats() {
    let built = room();
    let site = built.folder.path();
    let out = tempfile::tempdir().unwrap();
    let (first, second) = (out.path().join("a"), out.path().join("b"));

    let text = study(site, &first, &["--budget", "0.0001"]).text();
    assert!(text.contains("left undone by the budget"), "{text}");
    let before = csv(&first).len();

    let json = study(site, &first, &["--json"]).json();
    let rows = csv(&first);
    assert!(rows.len() > before);
    assert_eq!(rows[0][..6], ["method", "setting", "seconds", "rmse", "relmse", "flip"]);
    let first_of = |method: &str| rows.iter().find(|r| r[0] == method).unwrap();
    for method in ["ibs", "paper", "path tracing"] {
        assert!(first_of(method)[1].contains("set-up"), "{method}");
    }
    for row in &rows[1..] {
        let numbers: Vec<f64> = row[2..].iter().map(|n| n.parse().unwrap()).collect();
        assert!(numbers.iter().all(|n| n.is_finite()), "{row:?}");
    }
    // Monte Carlo: twice as near for four times the samples
    let orders = json["convergence"].as_array().unwrap();
    let order = orders.iter().find(|c| c["method"] == "path tracing" && c["metric"] == "rmse").unwrap();
    let order = order["order"]["value"].as_f64().unwrap();
    assert!((-0.7..-0.35).contains(&order), "{order}");
    assert!(json["recommended"]["snippet"].as_str().unwrap().starts_with("clerestory render"));
    assert!(json["losses"].as_array().is_some_and(|l| !l.is_empty()));

    // nothing is measured twice
    let stamp = fs::read_to_string(first.join("study.csv")).unwrap();
    assert_eq!(study(site, &first, &["-q"]).text(), "");
    assert_eq!(fs::read_to_string(first.join("study.csv")).unwrap(), stamp);

    // the same errors from scratch, where --share takes the whole of so small a picture
    study(site, &second, &["-q", "--fresh"]).text();
    assert_eq!(errors(&csv(&second)), errors(&rows));
    for name in ["study.svg", "study.png"] {
        assert!(fs::metadata(second.join(name)).unwrap().len() > 1000, "{name}");
    }
    let svg = fs::read_to_string(second.join("study.svg")).unwrap();
    roxmltree::Document::parse(&svg).unwrap();
    assert!(!svg.contains("NaN"));

    // other settings: the old study is moved aside
    let text = study(site, &second, &["--seed", "18446744073709551615", "--budget", "0.0001"]).text();
    assert!(text.contains("study.previous.json") && second.join("study.previous.json").exists(), "{text}");
}

#[test]
fn another_paint_begins_anew_and_another_truth_picture_is_traced_again() {
    let built = room();
    let site = built.folder.path();
    let out = tempfile::tempdir().unwrap();
    let begun = || -> serde_json::Value {
        study(site, out.path(), &["--budget", "0.0001", "-q"]).text();
        serde_json::from_str(&fs::read_to_string(out.path().join("study.json")).unwrap()).unwrap()
    };
    let first = begun();
    let half = out.path().join("study-truth-v0-a.exr");
    let traced = fs::read(&half).unwrap();
    fs::copy(site.join("p0.exr"), &half).unwrap();
    assert_eq!(begun()["truth"], first["truth"]);
    assert_eq!(fs::read(&half).unwrap(), traced, "a picture of another size is no truth of this view");

    change(&site.join("model.mtl"), &[("Kd 0.6 0.6 0.6", "Kd 0.2 0.2 0.2")]);
    assert!(begun()["truth"] != first["truth"]);
    assert!(out.path().join("study.previous.json").exists());
}

#[test]
fn probes_without_the_lighting_take_no_part() {
    let built = room();
    let site = built.folder.path();
    let file = site.join("site.toml");
    let text = fs::read_to_string(&file).unwrap();
    let (before, probe) = text.split_once("[[probe]]").unwrap();
    let probe = probe.split_once("\n[").map_or(probe, |(probe, _)| probe);
    let of = |name: &str, pictures: &str| {
        let lines = probe.lines().filter(|l| !l.starts_with("image") && !l.starts_with("name"));
        let lines = lines.collect::<Vec<_>>().join("\n");
        format!("[[probe]]\nname = \"{name}\"\nimage = {pictures}\n{lines}\n")
    };
    let rest = &text[before.len() + "[[probe]]".len() + probe.len()..];
    let probes = of("a", "{ \"14:30\" = \"p0.exr\" }") + &of("b", "{ \"14:30\" = \"p0.exr\", \"10:00\" = \"p0.exr\" }");
    fs::write(&file, format!("{before}{probes}{rest}")).unwrap();
    let out = tempfile::tempdir().unwrap();
    study(site, out.path(), &["--lighting", "10:00", "--budget", "0.0001", "-q"]).text();
    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.path().join("study.json")).unwrap()).unwrap();
    let order = json["order"].as_array().unwrap();
    assert_eq!((order.len(), order[0]["name"].as_str(), json["base"]["probes"].as_u64()), (1, Some("b"), Some(1)));
}

#[test]
fn what_cannot_be_studied_is_one_line() {
    let plan =
        Plan::new(closed(DVec3::ZERO, v(2.0, 2.0, 2.0), 0), &[grey(0.5)]).view(v(1.5, 1.5, 1.0), v(0.0, 0.0, 1.0), 16);
    let out = tempfile::tempdir().unwrap();
    let bare = plan.build();
    let one_line = |done: Done, needle: &str| {
        let text = done.error_line();
        assert!(text.contains(needle), "{text}");
    };
    one_line(study(bare.folder.path(), out.path(), &[]), "no probe");
    let dark = plan.clone().probe(v(1.0, 1.0, 1.0), 16);
    let built = dark.build().furnace(&dark, 1.0);
    one_line(study(built.folder.path(), out.path(), &[]), "nothing to measure error against");
    one_line(study(built.folder.path(), out.path(), &["--view", "none"]), "v0");
    fs::write(out.path().join("bad.json"), "{\"rows\": []}").unwrap();
    let bad = out.path().join("bad.json");
    one_line(study(built.folder.path(), out.path(), &["--outside", bad.to_str().unwrap()]), "bad.json");
}
