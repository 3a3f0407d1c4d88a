use super::*;
use crate::audit::{Audit, Finding, Kind, ViewSummary, testing};
use crate::check::{Check, ViewCheck};
use crate::plan::export::tables::{FloorJson, PlanJson, StationJson};
use crate::report::manifest::{Fingerprint, Run};
use crate::scene::{Edges, Health};

const VIEW: &str = "apse <1>";

fn finding(id: &str, kind: Kind) -> Finding {
    Finding { kind, material: "<stone>".into(), note: "5 cm & more".into(), ..testing::finding(id, VIEW) }
}

fn audit() -> Audit {
    let warnings = vec!["Dark <corner>".into()];
    let view = testing::view(ViewSummary { warnings, ..testing::summary(VIEW, [64, 48]) });
    let findings = vec![finding("F1", Kind::Geometry), finding("F2", Kind::Texture)];
    Audit { doubts: vec![finding("D1", Kind::Texture)], ..testing::audit(view, findings) }
}

fn plan() -> PlanJson {
    let station = StationJson {
        name: "P1".into(),
        position: [1.5, 0.25, -3.0],
        covers_m2: 9.0,
        adds_fraction: 0.9,
        adds_surface_fraction: None,
        fixed: false,
        tapes: vec![],
    };
    let floor = FloorJson {
        name: "Ground floor".into(),
        sheets: ["plan-ground floor".into(), "coverage-ground floor".into()],
        elevation: 0.0,
        area_m2: 10.0,
        stations: vec![station],
        existing: vec![],
        covered_fraction: 0.9,
        lower_bound: 1,
        stations_for_plan: 1,
        curve: vec![0.9],
        existing_fraction: 0.0,
        unreachable_m2: 0.0,
        left_out_m2: 0.0,
        wall_fraction: 0.9,
        surface: None,
        walk: vec![],
        walk_m: 0.0,
        groups: 1,
        candidates: 1,
        witnesses: 1,
    };
    PlanJson { site: String::new(), floors: vec![floor], warnings: vec![] }
}

fn archive() -> Archive {
    Archive {
        site: "St “Ann” & <Co>".into(),
        plan: Some(plan()),
        views: vec![ViewPictures {
            name: VIEW.into(),
            size: [64, 48],
            photo: Some("view-apse <1>-photo.png".into()),
            render: "view-apse <1>-relit.png".into(),
            findings: Some("f.png".into()),
            sheet: Some("audit-apse".into()),
        }],
        audit: Some(audit()),
        runs: vec![Run { verb: "study".into(), note: "not asked for".into(), ..Run::default() }],
        inputs: vec![Fingerprint { file: "site.toml".into(), bytes: 12, sha256: "ab".repeat(32) }],
        ..Archive::default()
    }
}

/// Attribute values of the page, by a search that is good enough for our own HTML.
fn attributes<'a>(html: &'a str, name: &str) -> Vec<&'a str> {
    html.split(&format!(" {name}=\"")).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn nothing_comes_from_outside() {
    let html = page(&archive());
    for address in attributes(&html, "src").into_iter().chain(attributes(&html, "href")) {
        assert!(!address.contains(':') && !address.starts_with("//") && !address.starts_with('/'), "{address}");
    }
    assert!(!html.contains("@import") && !html.contains("url("), "no style from elsewhere");
}

#[test]
fn what_a_person_wrote_is_escaped() {
    let html = page(&archive());
    assert!(html.contains("<h1>St “Ann” &amp; &lt;Co&gt;</h1>"));
    assert!(["<Co>", VIEW, "<corner>", "<stone>"].iter().all(|raw| !html.contains(raw)));
    assert!(html.contains("plan-ground%20floor.svg"), "addresses are percent-encoded");
}

#[test]
fn every_control_and_picture_has_a_name_for_those_who_cannot_see_it() {
    let html = page(&archive());
    assert_eq!(html.matches("<img ").count(), attributes(&html, "alt").len());
    assert!(attributes(&html, "alt").iter().all(|alt| !alt.is_empty()));
    let range = html.split("<input type=\"range\"").nth(1).unwrap();
    assert!(range.split('>').next().unwrap().contains("aria-label"));
    let ids = attributes(&html, "id");
    let mut unique = ids.clone();
    unique.sort_unstable();
    unique.dedup();
    assert_eq!(ids.len(), unique.len(), "ids are unique: {ids:?}");
    for target in attributes(&html, "href").iter().filter_map(|h| h.strip_prefix('#')) {
        assert!(ids.contains(&target), "the link to #{target} leads somewhere");
    }
}

#[test]
fn a_views_warning_is_part_of_the_sites_health() {
    let view = ViewCheck {
        name: "apse".into(),
        source: "site file",
        size: [64, 48],
        position: [0.0; 3],
        bearings_deg: [0.0; 3],
        fov_y_deg: 50.0,
        focal_px: 50.0,
        residuals_px: vec![],
        rms_px: None,
        uncertainty: None,
        photograph: None,
        warnings: vec!["Most of its photograph is clipped.".into()],
    };
    let check = Check {
        site: String::new(),
        ok: false,
        causes: vec![],
        warnings: vec![],
        model: Health::default(),
        edges: Edges::default(),
        edge_warnings: vec![],
        probes: vec![],
        views: vec![view],
        unseen_share: None,
        stages: vec![],
    };
    let html = page(&Archive { check: Some(check), ..Archive::default() });
    assert!(html.contains("View apse: Most of its photograph is clipped.") && !html.contains("Nothing is wrong"));
}

#[test]
fn an_audit_without_rendered_views_was_a_comparison_and_links_to_none() {
    let html = page(&Archive { views: vec![], ..archive() });
    assert!(html.contains("was compared with 1 photograph.") && !html.contains("not compared"));
    assert!(!html.contains("href=\"#view-") && page(&archive()).contains("href=\"#view-"));
}

#[test]
fn an_empty_archive_is_a_page_too() {
    let html = page(&Archive { site: "Empty".into(), ..Archive::default() });
    assert!(html.contains("In short") && !html.contains("Findings</h2>"));
}
