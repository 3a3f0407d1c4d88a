//! Mistakes that people make in site files, planted in right sites: `check` names each first, and names none in a site
//! that is right.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use clerestory::audit;
use clerestory::check::{CauseKind, check};
use clerestory::register::{self, Misfit};
use clerestory::scene::{self, Health};
use clerestory::site::Site;
use std::fs;
use std::path::{Path, PathBuf};

fn chapel() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("sites/chapel")
}

fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// The site file in a folder with texts replaced, each of which must be there; its files stay where they are.
fn load(folder: &Path, changes: &[(&str, &str)]) -> Result<Site, String> {
    let mut text = fs::read_to_string(folder.join("site.toml")).unwrap();
    for (old, new) in changes {
        assert!(text.contains(old), "{old:?} is not in {}", folder.display());
        text = text.replacen(old, new, 1);
    }
    // paths become whole; a folder that is shared cannot be written to
    for name in ["model/", "probes/", "photos/", "sky.exr", "env_sky.exr"] {
        text = text.replace(&format!("\"{name}"), &format!("\"{}/{name}", folder.display()));
    }
    let made = tempfile::tempdir().unwrap();
    fs::write(made.path().join("site.toml"), text).unwrap();
    Site::load(made.path()).map_err(|e| e.to_string())
}

/// The first cause that `check` finds: its kind, subject and sentence.
fn first_cause(folder: &Path, changes: &[(&str, &str)]) -> Option<(CauseKind, String, String)> {
    let site = load(folder, changes).unwrap();
    check(&site).unwrap().causes.into_iter().next().map(|c| (c.kind, c.subject, c.sentence))
}

/// What to change in the site file, and what the first cause is then: its kind, its subject, a part of its sentence.
type Planted<'a> = (&'a str, &'a [(&'a str, &'a str)], CauseKind, &'a str, &'a str);

fn assert_named(folder: &Path, table: &[Planted]) {
    let mut wrong = Vec::new();
    for (mistake, changes, kind, subject, part) in table {
        match first_cause(folder, changes) {
            Some((k, s, sentence)) if k == *kind && s == *subject && sentence.contains(part) => {}
            other => wrong.push(format!("{mistake}: {other:?}")),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A model in metres of which the site file says something else is as one in that unit declared in metres: sizes are off
/// by the same factor. A number stands for units whose names the file cannot take the wrong way round.
const UNITS: [(&str, &str, &str); 6] = [
    ("cm as m", "100", "site.units = \"m\""),
    ("mm as m", "1000", "site.units = \"m\""),
    ("feet as m", "3.280839895", "site.units = \"m\""),
    ("m as cm", "\"cm\"", "site.units = \"m\""),
    ("m as mm", "\"mm\"", "site.units = \"m\""),
    ("m as feet", "\"ft\"", "site.units = \"m\""),
];

fn wrong_units_are_named(folder: &Path) {
    for (mistake, units, part) in UNITS {
        let said = format!("units = {units}");
        let table: [Planted; 1] = [(mistake, &[("units = \"m\"", &said)], CauseKind::Units, "site.units", part)];
        assert_named(folder, &table);
    }
}

#[test]
fn mistakes_in_the_chapel_are_named_first() {
    wrong_units_are_named(&chapel());
    let west = "position = [3.6, 1.6, -0.3]";
    let apse = "position = [5.5, 1.65, 0.1]";
    assert_named(
        &chapel(),
        &[
            ("y-up as z-up", &[("up = \"y\"", "up = \"z\"")], CauseKind::UpAxis, "site.up", "likely y, not z"),
            ("y-up as x-up", &[("up = \"y\"", "up = \"x\"")], CauseKind::UpAxis, "site.up", "likely y, not x"),
            ("upside down", &[("up = \"y\"", "up = \"-y\"")], CauseKind::UpAxis, "site.up", "likely y, not -y"),
            (
                "probe in a wall",
                &[(west, "position = [2.0, 1.6, 3.3]")],
                CauseKind::Place,
                "probe.west",
                "inside a wall",
            ),
            (
                "probe below the floor",
                &[(west, "position = [3.6, -0.1, -0.3]")],
                CauseKind::Place,
                "probe.west",
                "floor",
            ),
            (
                "view in a wall",
                &[(apse, "position = [5.0, 1.65, -5.7]")],
                CauseKind::Place,
                "view.apse",
                "inside a wall",
            ),
            ("view below the floor", &[(apse, "position = [5.5, -0.15, 0.1]")], CauseKind::Place, "view.apse", "floor"),
        ],
    );
}

#[test]
fn decimal_commas_are_an_error_that_says_so() {
    let error = load(&chapel(), &[("position = [3.6, 1.6, -0.3]", "position = [3,6, 1,6, 0,3]")]).unwrap_err();
    assert!(error.contains("probe.west.position") && error.contains("Did you mean [3.6, 1.6, 0.3]?"), "{error}");
}

#[test]
fn right_sites_have_no_cause_of_any_kind() {
    assert_eq!(first_cause(&chapel(), &[]), None);
    let twin = check(&Site::load(&chapel().join("as_modelled.toml")).unwrap()).unwrap();
    assert_eq!(twin.causes, []);
}

#[test]
fn mistakes_in_sibenik_are_named_first() {
    let Some(folder) = shared("truth/sibenik") else { return };
    assert_eq!(first_cause(&folder, &[]), None);
    wrong_units_are_named(&folder);
    let z_up = [("up = \"y\"", "up = \"z\"")];
    assert_named(&folder, &[("y-up as z-up", &z_up, CauseKind::UpAxis, "site.up", "likely y, not z")]);
}

/// The chapel with two probes and no view.
fn two_probes() -> Site {
    let mut site = Site::load(&chapel()).unwrap();
    site.views.clear();
    site.probes.truncate(2);
    site
}

fn turned(site: &Site, degrees: f64) -> Site {
    let mut site = site.clone();
    let pose = &mut site.probes[0].pose;
    pose.rotation = glam::DMat3::from_rotation_z(degrees.to_radians()) * pose.rotation;
    site
}

#[test]
fn pictures_that_do_not_fit_are_told_by_what_is_wrong_with_them() {
    let right = two_probes();
    let scene = scene::load(&right, &mut Health::default()).unwrap();
    // places near by, so that the test is quick
    let settings = register::Settings { within_m: 0.3, tilt_deg: 0.0, finest: 256, ..register::Settings::default() };
    let misfits = |site: &Site| {
        let found = register::misfits(site, &scene, &settings).unwrap();
        found.into_iter().map(|(s, m)| (s.name(site).to_owned(), m)).collect::<Vec<_>>()
    };
    assert_eq!(misfits(&right), []);
    for degrees in [90.0, 7.0] {
        match &misfits(&turned(&right, degrees))[..] {
            [(name, Misfit::Turned(off))] if name == "west" && (off - degrees).abs() < 0.5 => {}
            other => panic!("turned by {degrees}°: {other:?}"),
        }
    }
    let mut moved = right.clone();
    moved.probes[0].pose.position.y += 0.2;
    match &misfits(&moved)[..] {
        [(name, Misfit::Displaced(off, _))] if name == "west" && (off - 0.2).abs() < 0.03 => {}
        other => panic!("moved by 20 cm: {other:?}"),
    }
    let mut exchanged = right.clone();
    exchanged.probes[0].pictures = right.probes[1].pictures.clone();
    exchanged.probes[1].pictures = right.probes[0].pictures.clone();
    let at = |name: &str| Misfit::TakenAt(name.to_owned());
    assert_eq!(misfits(&exchanged), [("west".to_owned(), at("east")), ("east".to_owned(), at("west"))]);
}

#[test]
fn an_audit_leaves_out_a_probe_that_is_turned_and_does_not_blame_the_model() {
    let site = turned(&Site::load(&chapel()).unwrap(), 90.0);
    let scene = scene::load(&site, &mut Health::default()).unwrap();
    let settings = audit::Settings { cells: 12, ..audit::Settings::default() };
    let found = audit::audit(&site, &scene, "10:00", &["panels".to_owned()], &settings, &|_, _, _| {}).unwrap();
    assert!(found.findings.is_empty(), "{:?}", found.findings);
    let told = found.warnings.first().unwrap();
    assert!(told.contains("“west” is left out") && told.contains("turned by 90°"), "{told}");
    assert_eq!(found.views[0].summary.probes.len(), 2);
}
