//! Mistakes that people make in site files, planted in right sites: `check` names each first, and names none in a site
//! that is right.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use crate::support::data::shared;
use crate::support::program::clerestory;
use crate::support::{chapel, write_picture};
use clerestory::audit;
use clerestory::check::{CauseKind, check};
use clerestory::panorama::{self, Picture};
use clerestory::register::{self, Misfit};
use clerestory::scene::{self, Health};
use clerestory::site::Site;
use std::fs;
use std::path::Path;

/// The site file in a folder with texts replaced, each of which must be there, in a folder of its own; its files stay where
/// they are.
pub(crate) fn changed(folder: &Path, changes: &[(&str, &str)]) -> tempfile::TempDir {
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
    made
}

fn load(folder: &Path, changes: &[(&str, &str)]) -> Result<Site, String> {
    Site::load(changed(folder, changes).path()).map_err(|e| e.to_string())
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

/// The first probe's picture with left and right exchanged.
fn mirrored(site: &Site, folder: &Path) -> Site {
    let mut site = site.clone();
    for lit in &mut site.probes[0].pictures {
        let picture = panorama::read(&lit.path).unwrap();
        let (width, height) = (picture.width, picture.height);
        let pixels = picture.pixels.chunks(width).flat_map(|row| row.iter().rev().copied()).collect();
        lit.path = folder.join(lit.path.file_name().unwrap());
        write_picture(&lit.path, &Picture { width, height, pixels });
    }
    site
}

#[test]
fn pictures_that_do_not_fit_are_told_by_what_is_wrong_with_them() {
    let right = two_probes();
    let scene = scene::load(&right, &mut Health::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let moved = |metres: f64| {
        let mut site = right.clone();
        site.probes[0].pose.position.y += metres;
        site
    };
    let mut exchanged = right.clone();
    exchanged.probes[0].pictures = right.probes[1].pictures.clone();
    exchanged.probes[1].pictures = right.probes[0].pictures.clone();
    let mut on_its_head = right.clone();
    on_its_head.probes[0].pose.rotation *= glam::DMat3::from_rotation_y(std::f64::consts::PI);
    type Told = Box<dyn Fn(&[(String, Misfit)]) -> bool>;
    let by = |degrees: f64| -> Told {
        Box::new(move |told| matches!(told, [(w, Misfit::Turned(d))] if w == "west" && (d - degrees).abs() < 0.5))
    };
    let off = |metres: f64| -> Told {
        Box::new(move |told| matches!(told, [(w, Misfit::Displaced(m, _))] if w == "west" && (m - metres).abs() < 0.03))
    };
    let mirror: Told = Box::new(|told| matches!(told, [(w, Misfit::Mirrored)] if w == "west"));
    let head: Told = Box::new(|told| matches!(told, [(w, Misfit::UpsideDown)] if w == "west"));
    let exchange: Told = Box::new(
        |told| matches!(told, [(a, Misfit::TakenAt(b)), (c, Misfit::TakenAt(d))] if a == d && b == c && a != b),
    );
    let table: [(&str, Site, Told); 9] = [
        ("nothing", right.clone(), Box::new(|told| told.is_empty())),
        ("turned by 90°", turned(&right, 90.0), by(90.0)),
        ("turned by 180°", turned(&right, 180.0), by(180.0)),
        ("turned by 7°", turned(&right, 7.0), by(7.0)),
        ("20 cm off", moved(0.2), off(0.2)),
        ("1 m off", moved(1.0), off(1.0)),
        ("mirrored", mirrored(&right, folder.path()), mirror),
        ("upside down", on_its_head, head),
        ("exchanged", exchanged, exchange),
    ];
    let mut wrong = Vec::new();
    for (mistake, site, expected) in &table {
        // no farther than it needs, so that the test is quick
        let within_m = if *mistake == "1 m off" { 1.1 } else { 0.3 };
        let settings = register::RegisterSettings {
            within_m,
            tilt_deg: 0.0,
            finest: 128,
            ..register::RegisterSettings::default()
        };
        let found = register::misfits(site, &scene, &settings).unwrap();
        let told: Vec<(String, Misfit)> = found.into_iter().map(|(s, m)| (s.name(site).to_owned(), m)).collect();
        if !expected(&told) {
            wrong.push(format!("{mistake}: {told:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_picture_that_does_not_fit_is_told_by_its_name() {
    let causes = check(&turned(&two_probes(), 90.0)).unwrap().causes;
    let told: Vec<&str> = causes.iter().map(|c| c.sentence.as_str()).collect();
    assert!(told.first().is_some_and(|t| t.starts_with("Probe “west”: its picture is turned by 90°")), "{told:?}");
}

#[test]
fn a_probe_in_a_wrong_place_is_not_compared_for_a_view_of_its_name() {
    let west = "position = [3.6, 1.6, -0.3]";
    let mut site = load(&chapel(), &[(west, "position = [3.6, -0.1, -0.3]")]).unwrap();
    site.views.retain(|v| v.name == "apse");
    site.views[0].name = "west".to_owned();
    let causes = check(&site).unwrap().causes;
    let kinds: Vec<CauseKind> = causes.iter().filter(|c| c.subject == "probe.west").map(|c| c.kind).collect();
    assert!(!kinds.is_empty() && kinds.iter().all(|k| *k == CauseKind::Place), "{causes:?}");
}

#[test]
fn an_audit_without_a_lit_probe_tells_why_before_it_makes_its_folder() {
    let first = "image = { \"10:00\" = \"probes/west_1000.exr\" }";
    let both = "image = { \"10:00\" = \"probes/west_1000.exr\", \"14:30\" = \"probes/west_1430.exr\" }";
    let site = changed(&chapel(), &[(both, first)]);
    let out = site.path().join("out");
    let refused = |more: &[&str]| clerestory(&[&"audit", &site.path(), &"--out", &out], more).error_line();
    let few = refused(&["--probes", "1", "--lighting", "14:30"]);
    let why = "none of the first 1 probes has a picture for the lighting “14:30”: give more with --probes";
    assert!(few.contains(why), "{few}");
    let unknown = refused(&["--lighting", "noon"]);
    assert!(unknown.contains("there is no lighting “noon”"), "{unknown}");
    assert!(!out.exists());
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
