//! The report: made by the program as a user runs it, and held against the one in `reports/`.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "a test that cannot go on")]

use super::wrong_inputs::changed;
use crate::support::chapel;
use crate::support::program::{Done, clerestory};
use clerestory::report::style::FINE_PRINT;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn kept() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/chapel")
}

fn report(site: &str, out: &Path, more: &[&str]) -> Done {
    clerestory(&[&"report", &site, &"--out", &out], more)
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))).unwrap()
}

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap());
    entries.filter(|e| e.path().is_file()).map(|e| e.file_name().into_string().unwrap()).collect()
}

/// Times differ from run to run, and paths from place to place.
fn is_of_this_run(key: &str) -> bool {
    key.ends_with("_s") || ["peak_bytes", "file", "seconds", "photo", "version", "setup", "saved"].contains(&key)
}

/// Where two values differ by more than rounding.
fn differences(at: &str, a: &Value, b: &Value, found: &mut Vec<String>) {
    match (a, b) {
        (Value::Object(x), Value::Object(y)) => {
            let keys: BTreeSet<&String> = x.keys().chain(y.keys()).collect();
            for key in keys.into_iter().filter(|k| !is_of_this_run(k)) {
                let (p, q) = (x.get(key).unwrap_or(&Value::Null), y.get(key).unwrap_or(&Value::Null));
                differences(&format!("{at}.{key}"), p, q, found);
            }
        }
        (Value::Array(x), Value::Array(y)) if x.len() == y.len() => {
            for (i, (p, q)) in x.iter().zip(y).enumerate() {
                differences(&format!("{at}[{i}]"), p, q, found);
            }
        }
        (Value::Number(x), Value::Number(y)) => {
            let (x, y) = (x.as_f64().unwrap(), y.as_f64().unwrap());
            if (x - y).abs() > 1e-3 * x.abs().max(y.abs()) + 1e-6 {
                found.push(format!("{at}: {x} and {y}"));
            }
        }
        _ if a == b => {}
        _ => found.push(format!("{at}: {a} and {b}")),
    }
}

/// Mean difference of two pictures in steps of 255; a picture of it is left beside the new one where that is large.
fn apart(kept: &Path, made: &Path) -> f64 {
    let [a, b] = [kept, made].map(|p| image::open(p).unwrap().to_rgb8());
    assert_eq!(a.dimensions(), b.dimensions(), "{}", made.display());
    let sum: u64 = a.as_raw().iter().zip(b.as_raw()).map(|(x, y)| u64::from(x.abs_diff(*y))).sum();
    let mean = sum as f64 / a.as_raw().len() as f64;
    if mean > 0.5 {
        let difference = image::RgbImage::from_fn(a.width(), a.height(), |x, y| {
            let (p, q) = (a.get_pixel(x, y).0, b.get_pixel(x, y).0);
            image::Rgb(std::array::from_fn(|i| p[i].abs_diff(q[i]).saturating_mul(4)))
        });
        let path = std::env::temp_dir().join(format!("difference-{}", made.file_name().unwrap().to_string_lossy()));
        difference.save(&path).unwrap();
        println!("the difference is in {}", path.display());
    }
    mean
}

#[test]
fn the_kept_report_is_what_the_program_makes() {
    let kept = kept();
    let made = tempfile::tempdir().unwrap();
    assert_eq!(report("sites/chapel", made.path(), &["--without", "study", "-q"]).text(), "");
    let study = |name: &String| name.starts_with("study");
    let kept_out = |name: &String| [".exr", ".ply", ".pdf"].iter().any(|end| name.ends_with(end));
    let of_the_site = |name: &String| !study(name) && !kept_out(name);
    let wanted: BTreeSet<String> = names(&kept).into_iter().filter(of_the_site).collect();
    let found: BTreeSet<String> = names(made.path()).into_iter().filter(of_the_site).collect();
    assert_eq!(wanted, found, "the same files");
    for name in &wanted {
        let (kept, made) = (kept.join(name), made.path().join(name));
        if name.ends_with(".png") {
            let mean = apart(&kept, &made);
            assert!(
                mean <= 0.5,
                "{name}: {mean:.2} of 255 apart; run `clerestory report sites/chapel` if that is meant"
            );
        } else if name.ends_with(".json") && name != "manifest.json" {
            let mut found = Vec::new();
            differences(name, &json(&kept), &json(&made), &mut found);
            assert!(found.is_empty(), "{found:#?}");
        } else if name.ends_with(".svg") {
            let sheet = fs::read_to_string(&made).unwrap();
            let sheet = roxmltree::Document::parse(&sheet).unwrap();
            let letters = sheet.descendants().filter_map(|node| node.attribute("font-size"));
            let small = letters.map(|size| size.parse::<f64>().unwrap()).filter(|size| *size < FINE_PRINT);
            assert_eq!(small.count(), 0, "{name}: letters of less than seven points");
        }
    }
}

#[test]
fn a_manifest_names_every_file_and_the_page_shows_only_what_is_there() {
    let made = tempfile::tempdir().unwrap();
    for earlier in ["report.pdf", "view-apse-findings.png"] {
        fs::write(made.path().join(earlier), "").unwrap();
    }
    let manifest = report("sites/chapel", made.path(), &["--without", "study,plan,audit", "--json"]).json();
    let files = |key: &str| {
        let all = manifest[key].as_array().unwrap().iter();
        all.map(|f| f["file"].as_str().unwrap().to_owned()).collect::<BTreeSet<_>>()
    };
    let mut there = names(made.path());
    assert!(there.remove("manifest.json"));
    assert!(!there.contains("report.pdf") && !there.contains("view-apse-findings.png"), "an earlier run's: {there:?}");
    assert_eq!(files("outputs"), there);
    let inputs = files("inputs");
    for input in ["site.toml", "model/chapel.obj", "model/chapel.mtl", "model/brick.jpg", "photos/apse.exr"] {
        assert!(inputs.contains(input), "{input} is missing in {inputs:?}");
    }
    let page = fs::read_to_string(made.path().join("index.html")).unwrap();
    for part in page.split(" src=\"").skip(1).filter_map(|rest| rest.split('"').next()) {
        assert!(there.contains(part), "the page shows {part}");
    }
    assert!(page.contains("not asked for"));
}

#[test]
fn a_report_that_came_to_no_end_has_no_manifest() {
    let made = tempfile::tempdir().unwrap();
    fs::write(made.path().join("manifest.json"), "{}").unwrap();
    // the page cannot take its place
    fs::create_dir(made.path().join("index.html")).unwrap();
    let failed = report("sites/chapel", made.path(), &["--without", "study,plan,audit,render", "-q"]);
    assert_eq!(failed.code, Some(1), "{failed:?}");
    assert!(made.path().join("check.json").is_file() && !made.path().join("manifest.json").exists());
}

#[test]
fn an_audit_without_rendering_binds_its_sheets() {
    // one view is enough of an audit
    let site = changed(&chapel(), &[]);
    let text = fs::read_to_string(site.path().join("site.toml")).unwrap();
    let (before, views) = text.split_once("[[view]]").unwrap();
    let first = views.split("[[view]]").next().unwrap();
    fs::write(site.path().join("site.toml"), format!("{before}[[view]]{first}")).unwrap();
    let made = tempfile::tempdir().unwrap();
    report(site.path().to_str().unwrap(), made.path(), &["--without", "study,plan,render", "-q"]).text();
    let page = fs::read_to_string(made.path().join("index.html")).unwrap();
    assert!(page.contains("was compared with") && page.contains("href=\"report.pdf\""));
    assert!(made.path().join("report.pdf").is_file());
}

#[test]
fn a_site_that_cannot_be_read_leaves_no_folder() {
    let made = tempfile::tempdir().unwrap();
    let out = made.path().join("report");
    let error = report("sites/nowhere", &out, &[]).error_line();
    assert!(error.starts_with("error: sites/nowhere"), "{error}");
    assert!(!out.exists());
}

#[test]
fn many_reports_come_to_one_table() {
    let made = tempfile::tempdir().unwrap();
    let copied = made.path().join("reports/one of <them>");
    fs::create_dir_all(&copied).unwrap();
    for name in ["manifest.json", "findings.json", "render.json", "plan.json", "check.json"] {
        fs::copy(kept().join(name), copied.join(name)).unwrap();
    }
    let out = made.path().join("reports");
    let rows = clerestory(&[&"summary", &copied, &"--out", &out, &"--json"], &[]).json();
    let render = json(&copied.join("render.json"));
    let flips: Vec<f64> =
        render["views"].as_array().unwrap().iter().map(|v| v["error"]["all"]["flip"].as_f64().unwrap()).collect();
    let mean = flips.iter().sum::<f64>() / flips.len() as f64;
    assert_eq!(rows[0]["site"], "Chapel");
    assert!((rows[0]["flip"].as_f64().unwrap() - mean).abs() < 1e-12 && rows[0]["failed"] == "");
    let csv = fs::read_to_string(out.join("summary.csv")).unwrap();
    assert_eq!(csv.lines().count(), 2, "{csv}");
    let page = fs::read_to_string(out.join("summary.html")).unwrap();
    assert!(page.contains("<a href=\"one%20of%20%3Cthem%3E/index.html\">Chapel</a>"), "{page}");
    let error = clerestory(&[&"summary", &made.path()], &[]).error_line();
    assert!(error.contains("no manifest.json"), "{error}");
}
