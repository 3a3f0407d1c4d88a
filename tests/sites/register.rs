//! The verb `register` from a site whose poses are wrong to one whose poses are right.

#![allow(clippy::unwrap_used, reason = "tests may panic")]

use crate::support::program::clerestory;
use crate::support::{Plan, chapel, copy, grey, sides, v};
use clerestory::register::{Subject, preview};
use clerestory::site::{Frame, Pose, Site};
use glam::{DMat3, DVec3};
use std::fs;
use std::path::Path;

/// A site with the chapel's model and probes, its only view where nothing can be told from, and “west” turned and moved.
fn disturbed(folder: &Path) -> String {
    for part in ["model", "probes"] {
        copy(&chapel().join(part), &folder.join(part));
    }
    let text = fs::read_to_string(chapel().join("site.toml")).unwrap();
    let (text, _) = text.split_once("# Views:").unwrap();
    let (head, rest) = text.split_once("# Light from outside.").unwrap();
    let (_, probes) = rest.split_once("# Probes:").unwrap();
    let right = "position = [3.6, 1.6, -0.3]\nheading = 90.0";
    let wrong = "position = [3.9, 1.7, 0.08]   # paced\nheading = 180.0";
    assert!(probes.contains(right));
    format!("{head}# Probes:{}", probes.replace(right, wrong))
}

#[test]
fn a_turned_and_moved_probe_is_put_right_in_a_copy() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path().join("site");
    let text = disturbed(&folder);
    let (file, copy, out) = (folder.join("site.toml"), folder.join("right.toml"), temporary.path().join("out"));
    fs::write(&file, &text).unwrap();
    let more = ["--only", "west", "--within", "0.6", "--tilt", "0", "--alone", "--json"];
    let json = clerestory(&[&"register", &file, &"--write", &copy, &"--out", &out], &more).json();
    let west = &json["pictures"][0];
    assert_eq!((&west["name"], &west["kind"], &west["verdict"]), (&"west".into(), &"probe".into(), &"found".into()));
    let number = |key: &str| west[key].as_f64().unwrap();
    assert!((number("moved_m") - 0.495).abs() < 0.03 && (number("turned_deg") - 90.0).abs() < 0.3, "{json}");
    assert!(number("fit") > number("fit_given") + 0.2 && number("sigma_m") > 0.0 && number("sigma_deg") > 0.0);
    assert!((number("heading") - 90.0).abs() < 0.3 && west["position"].as_array().unwrap().len() == 3);
    assert!(west["rival"].is_null() || west["rival"]["fit"].as_f64().unwrap() < number("fit"));

    let (before, after) = (Site::load(&file).unwrap(), Site::load(&copy).unwrap());
    let truth = Site::load(&chapel()).unwrap();
    let (got, want) = (after.probes[0].pose, truth.probes[0].pose);
    assert!(got.position.distance(want.position) < 0.03, "{}", got.position);
    assert!(clerestory::register::turn_deg(&got, &want) < 0.3);
    assert!(before.probes[0].pose.position.distance(want.position) > 0.4, "the original is as it was");
    assert_eq!(fs::read_to_string(&file).unwrap(), text);
    // only that probe's pose differs
    let told = fs::read_to_string(&copy).unwrap();
    let others = |t: &str| {
        t.split("[[probe]]").enumerate().filter(|(i, _)| *i != 1).map(|(_, t)| t.to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(others(&told), others(&text));
    assert!(told.contains("# paced") && told.contains("west_1430.exr"));
    for name in ["register-probe-west.svg", "register-probe-west.png"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    let sheet = fs::read_to_string(out.join("register-probe-west.svg")).unwrap();
    let groups = ["picture", "model", "before", "after", "numbers"];
    assert!(groups.iter().all(|g| sheet.contains(&format!("id=\"{g}\""))) && !sheet.contains("id=\"rival\""));
}

#[test]
fn a_probe_without_a_position_is_found_on_the_floor_and_refused_elsewhere() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path().join("site");
    let text = disturbed(&folder).replace("position = [3.9, 1.7, 0.08]   # paced\nheading = 180.0\n", "");
    let (file, copy, out) = (folder.join("site.toml"), folder.join("right.toml"), temporary.path().join("out"));
    fs::write(&file, &text).unwrap();
    for verb in ["check", "render", "audit"] {
        let said = clerestory(&[&verb, &file], &[]).error();
        assert!(said.contains("`position` is missing") && said.contains("clerestory register"), "{said}");
    }
    let said =
        clerestory(&[&"register", &file, &"--write", &copy, &"--out", &out], &["--only", "west", "--alone"]).text();
    assert!(said.contains("probe “west”: found, sure to ±"), "{said}");
    let (got, want) = (Site::load(&copy).unwrap().probes[0].pose, Site::load(&chapel()).unwrap().probes[0].pose);
    assert!(got.position.distance(want.position) < 0.03, "{}", got.position);
    assert!(clerestory::register::turn_deg(&got, &want) < 0.3);
    let sheet = fs::read_to_string(out.join("register-probe-west.svg")).unwrap();
    assert!(sheet.contains("id=\"after\"") && !sheet.contains("id=\"before\""));
}

#[test]
fn files_that_must_not_be_written_are_told_before_the_work() {
    let temporary = tempfile::tempdir().unwrap();
    let site = chapel();
    let refused = |file: &Path, word: &str| {
        let said = clerestory(&[&"register", &site, &"--write", &file], &[]).error_line();
        assert!(said.contains(word), "{said}");
    };
    let own = site.join("site.toml");
    let before = fs::read(&own).unwrap();
    refused(&own, "this is the site file itself");
    refused(&site.join("as_modelled.toml"), "there already");
    refused(&temporary.path().join("copy.toml"), "relative");
    refused(&temporary.path().join("none/copy.toml"), "no such folder");
    refused(&site, "found a folder");
    assert_eq!(fs::read(&own).unwrap(), before);
    let unknown = clerestory(&[&"register", &site], &["--only", "nave"]).error();
    assert!(unknown.contains("“nave”") && unknown.contains("west"), "{unknown}");
    let unknown = clerestory(&[&"register", &site], &["--lighting", "noon"]).error();
    assert!(unknown.contains("“noon”") && unknown.contains("14:30"), "{unknown}");
}

#[test]
fn a_copy_never_takes_the_place_of_the_sites_own_files() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path().join("site");
    let text = disturbed(&folder).replace("model/chapel.obj", "chapel.obj");
    let mut own = Vec::new();
    for entry in fs::read_dir(folder.join("model")).unwrap() {
        let path = entry.unwrap().path();
        let beside = folder.join(path.file_name().unwrap());
        own.push((beside.clone(), fs::read(&path).unwrap()));
        fs::rename(&path, &beside).unwrap();
    }
    fs::write(folder.join("site.toml"), text).unwrap();
    let out = temporary.path().join("out");
    // the site file names the model, the model names the rest
    for name in ["chapel.obj", "chapel.mtl", "brick.jpg"] {
        let more = ["--only", "west", "--overwrite"];
        let said =
            clerestory(&[&"register", &folder, &"--write", &folder.join(name), &"--out", &out], &more).error_line();
        assert!(said.contains("own model or picture") && said.contains(name), "{said}");
    }
    for (path, before) in own {
        assert!(fs::read(&path).unwrap() == before, "{} is as it was", path.display());
    }
}

#[test]
fn a_tilt_has_no_meaning_where_a_picture_has_no_place() {
    let said = clerestory(&[&"register", &chapel()], &["--anywhere", "--tilt", "5"]).error();
    assert!(said.contains("--anywhere") && said.contains("--tilt") && said.contains("cannot be used"), "{said}");
}

#[test]
fn a_preview_shows_a_rooms_corners_where_they_are() {
    let plan = Plan::new(sides(DVec3::ZERO, v(4.0, 4.0, 4.0), [0; 6]), &[grey(0.5)]).probe(v(2.0, 2.0, 2.0), 64);
    let built = plan.build();
    let subject = Subject::Probe(0);
    let frame = Frame { metres_per_unit: 1.0, up: clerestory::site::Up::Z, north_deg: 0.0 };
    let level = Pose { position: v(2.0, 2.0, 2.0), rotation: DMat3::IDENTITY };
    let turned = Pose { rotation: frame.rotation(45.0, 0.0, 0.0), ..level };
    let (w, h) = (256, 128);
    for (pose, offset) in [(level, 0.0), (turned, 45.0f64)] {
        let shown = preview(&built.site, &built.scene, subject, &pose, [64, 32], [w, h]);
        assert_eq!((shown.width, shown.height, shown.edge.len()), (w, h, w * h));
        // along the horizon edges are the four upright corners, between pixels
        let middle = &shown.edge[h / 2 * w..][..w];
        let at: Vec<usize> = (0..w).filter(|&x| middle[x]).collect();
        let corners: Vec<usize> = [-135.0, -45.0, 45.0, 135.0]
            .iter()
            .map(|a: &f64| ((a - offset + 180.0).rem_euclid(360.0) / 360.0 * w as f64).round() as usize)
            .filter(|x| *x > 0)
            .map(|x| x - 1)
            .collect();
        let mut sorted = corners.clone();
        sorted.sort_unstable();
        assert_eq!(at, sorted);
        // a wall seen straight on is as light as its albedo
        let ahead = ((180.0 - offset).rem_euclid(90.0) / 360.0 * w as f64).round() as usize;
        assert!((shown.shade[h / 2 * w + ahead].unwrap() - 0.5).abs() < 0.01);
        assert!(shown.shade.iter().all(|s| s.is_some_and(|s| (0.17..=0.51).contains(&s))));
    }
}
