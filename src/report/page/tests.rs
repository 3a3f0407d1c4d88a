use super::*;
use crate::report::Fingerprint;

fn archive() -> Archive {
    let finding = |id: &str, kind: &str| Finding {
        id: id.into(),
        view: "apse <1>".into(),
        kind: kind.into(),
        what: "moved".into(),
        score: 0.9,
        bbox: [1.0, 2.0, 30.0, 40.0],
        position: [1.0, -2.5, 3.0],
        displacement: Some(Displacement { metres: -0.051, uncertainty_m: 0.004 }),
        note: "5 cm & more".into(),
        ..Finding::default()
    };
    Archive {
        site: "St “Ann” & <Co>".into(),
        software: "clerestory 9.9.9".into(),
        check: Some(Check { warnings: vec!["A warning.".into()], ..Check::default() }),
        plan: Some(Plan {
            floors: vec![Floor {
                name: "Ground floor".into(),
                stations: vec![Station { name: "P1".into(), position: [1.5, 0.25, -3.0], ..Station::default() }],
                sheets: vec!["plan-ground floor".into()],
                ..Floor::default()
            }],
        }),
        views: vec![ViewPictures {
            name: "apse <1>".into(),
            size: [64, 48],
            photo: Some("view-apse <1>-photo.png".into()),
            render: "view-apse <1>-relit.png".into(),
            findings: Some("f.png".into()),
            sheet: Some("audit-apse".into()),
        }],
        audit: Some(Audit {
            findings: vec![finding("F1", "geometry"), finding("F2", "texture")],
            doubts: vec![finding("D1", "texture")],
            views: vec![AuditedView { view: "apse <1>".into(), ..AuditedView::default() }],
            warnings: vec![],
        }),
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
    assert!(!html.contains("<Co>") && !html.contains("apse <1>"));
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
fn an_empty_archive_is_a_page_too() {
    let html = page(&Archive { site: "Empty".into(), ..Archive::default() });
    assert!(html.contains("In short") && !html.contains("Findings</h2>"));
}
