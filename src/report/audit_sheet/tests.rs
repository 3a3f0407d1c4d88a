use super::sheet::audit_sheet;
use super::subject::AuditSheet;
use super::{marked, write_audit_sheets};
use crate::audit::{
    Audit, AuditedView, Finding, Kind, PoseCorrection, ProbeGain, Reason, Shares, Verdict, ViewSummary, What, testing,
};
use crate::panorama::Exposure;
use crate::report::Fingerprint;
use crate::scene::{self, Health, Scene};
use crate::site::Site;
use base64::{Engine, engine::general_purpose::STANDARD};
use glam::Vec3;
use sha2::Digest;
use std::collections::BTreeMap;
use std::fs;
use tempfile::TempDir;

/// A room of 6 × 5 × 4 m with one view and a probe.
pub(super) fn room() -> (TempDir, Site, Scene) {
    let dir = tempfile::tempdir().unwrap();
    let corners: String =
        (0..8).map(|i| format!("v {} {} {}\n", 6 * (i & 1), 5 * (i >> 1 & 1), 4 * (i >> 2 & 1))).collect();
    let faces = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n";
    fs::write(dir.path().join("m.obj"), format!("{corners}{faces}")).unwrap();
    image::RgbImage::new(64, 32).save(dir.path().join("p.png")).unwrap();
    let text = "[site]\nname = \"Room <1>\"\nunits = \"m\"\nup = \"z\"\nnorth = 30\n[model]\npath = \"m.obj\"\n\
                [[probe]]\nname = \"middle\"\nposition = [3, 2, 1.6]\nimage = \"p.png\"\n\
                [[view]]\nname = \"v\"\nposition = [2, 2, 1.6]\nheading = 60\nfov_y = 60\nsize = [60, 40]\n";
    fs::write(dir.path().join("site.toml"), text).unwrap();
    let site = Site::load(dir.path()).unwrap();
    let scene = scene::load(&site, &mut Health::default()).unwrap();
    (dir, site, scene)
}

fn finding(id: &str, kind: Kind, what: What, bbox: [u32; 4]) -> Finding {
    let moved = testing::finding(id, "v");
    let displacement = moved.displacement.filter(|_| kind == Kind::Geometry);
    let reason = if id.starts_with('D') { Reason::Usual } else { Reason::None };
    Finding { kind, what, bbox, displacement, reason, ..moved }
}

/// An audit of the room whose view has so many faults and doubts, a block of pixels each.
fn audit(faults: usize, doubts: usize) -> Audit {
    let (w, h) = (60, 40);
    let mut verdicts = vec![Verdict::Ok; w * h];
    verdicts[..w * 8].fill(Verdict::Untestable);
    let mut masks = Vec::new();
    let mut make = |list: &str, i: usize, verdict: Verdict| {
        let (x0, y0) = (4 + 9 * (i % 6), 10 + 9 * (i / 6));
        let mut mask = vec![false; w * h];
        for (x, y) in (y0..y0 + 6).flat_map(|y| (x0..x0 + 6).map(move |x| (x, y))) {
            mask[y * w + x] = true;
            verdicts[y * w + x] = verdict;
        }
        let id = format!("{list}{}", i + 1);
        masks.push((id.clone(), mask));
        (id, [x0 as u32, y0 as u32, x0 as u32 + 6, y0 as u32 + 6])
    };
    let findings = (0..faults).map(|i| {
        let (kind, what, verdict) = match i % 2 {
            0 => (Kind::Geometry, What::Moved, Verdict::Geometry),
            _ => (Kind::Texture, What::Rotated, Verdict::Texture),
        };
        let (id, bbox) = make("F", i, verdict);
        finding(&id, kind, what, bbox)
    });
    let findings = findings.collect();
    let doubts = (0..doubts).map(|i| {
        let (id, bbox) = make("D", i + 6, Verdict::Ambiguous);
        finding(&id, Kind::Texture, What::Changed, bbox)
    });
    let doubts = doubts.collect();
    let summary = ViewSummary {
        pose: PoseCorrection { refined: true, mean_px: 1.25, residual_px: 0.2, ..PoseCorrection::default() },
        probes: vec![ProbeGain { probe: "middle".into(), gain_ev: 0.0, sees: 0.8, difference: None, warning: None }],
        shares: Shares::of(&verdicts),
        reasons: BTreeMap::from([("unseen".to_owned(), 0.2)]),
        warnings: vec!["the light changed".into()],
        ..testing::summary("v", [60, 40])
    };
    let view = AuditedView { verdicts, masks, ..testing::view(summary) };
    Audit { doubts, ..testing::audit(view, findings) }
}

fn drawn(audit: &Audit) -> String {
    let (_dir, site, scene) = room();
    let hash = "0123456789abcdef".repeat(4);
    let inputs = ["site.toml", "v.jpg"].map(|f| Fingerprint { file: f.into(), bytes: 1, sha256: hash.clone() });
    let about = AuditSheet {
        site: &site,
        scene: &scene,
        audit,
        index: 0,
        surveyed: "2026-05-01 10:00:00",
        audited: "2026-06-01",
        command: "clerestory audit room",
        inputs: &inputs,
    };
    audit_sheet(&about).finish()
}

fn words(svg: &str) -> String {
    let document = roxmltree::Document::parse(svg).unwrap();
    let texts: Vec<&str> = document.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
    texts.join("\n")
}

#[test]
fn a_sheet_carries_all_that_an_archive_wants() {
    let svg = drawn(&audit(3, 2));
    let text = words(&svg);
    for part in [
        "Room <1> — audit of the view “v”",
        "Sheet 1 of 1",
        "photograph taken 2026-05-01 10:00:00 · audited 2026-06-01",
        "3 faults: F1 surface “stone & lime” off its place by 10.2 ± 1.1 cm (900 cm², 90 % sure)",
        "20 % of the picture could not be tested.",
        "10.2 ± 1.1 cm",
        "farther",
        "no probe sees it (20 %)",
        "surveyor's verdict",
        "Camera pose corrected by 1.25 ± 0.20 pixels",
        "! the light changed",
        "geometry mismatch 4",
        "clerestory 0: clerestory audit room",
        "site.toml",
        "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef",
        "N",
        "middle",
    ] {
        let flat = text.replace('\n', " ");
        assert!(flat.contains(part), "“{part}” expected in\n{text}");
    }
    let document = roxmltree::Document::parse(&svg).unwrap();
    let mut ids: Vec<&str> = document.descendants().filter_map(|n| n.attribute("id")).collect();
    for id in [
        "header",
        "photograph",
        "render",
        "classified",
        "classified-geometry",
        "legend",
        "key-plan",
        "findings",
        "method",
        "row-F1",
        "row-D8",
    ] {
        assert!(ids.contains(&id), "{id} is no id");
    }
    let count = ids.len();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), count, "an id is used twice");
    // each verdict has a hatch of its own beside its colour
    let hatches = document.descendants().filter(|n| n.has_tag_name("pattern")).count();
    assert_eq!(hatches, 4);
    assert!(super::super::png(&svg, 40.0).unwrap().len() > 1000);
    assert_eq!(svg, drawn(&audit(3, 2)), "the same bytes each time");
}

#[test]
fn sheets_are_written_with_the_inputs_fingerprints() {
    let (dir, site, scene) = room();
    let mut audit = audit(1, 0);
    audit.method.lighting = String::new();
    write_audit_sheets(&site, &scene, &audit, "clerestory audit x", dir.path()).unwrap();
    assert!(["audit-v.png", "audit-v.pdf"].iter().all(|file| dir.path().join(file).is_file()));
    let text = words(&fs::read_to_string(dir.path().join("audit-v.svg")).unwrap());
    let hash: String = sha2::Sha256::digest(fs::read(&site.file).unwrap()).iter().map(|b| format!("{b:02x}")).collect();
    assert!(
        text.contains(&hash) && text.contains("site.toml") && text.contains("m.obj") && text.contains("p.png"),
        "{text}"
    );
    fs::remove_file(&site.model).unwrap();
    let error = write_audit_sheets(&site, &scene, &audit, "", dir.path()).unwrap_err().to_string();
    assert!(error.contains("m.obj"), "{error}");
}

#[test]
fn nothing_found_is_said_with_what_was_not_tested() {
    let text = words(&drawn(&audit(0, 0)));
    assert!(text.contains("No fault found in the 80 % of the picture that could be tested. 20 % could not be tested"));
    assert!(text.contains("Nothing was found wrong in what could be tested."));
}

#[test]
fn more_findings_than_rows_are_counted() {
    let text = words(&drawn(&audit(12, 0)));
    assert!(text.contains("more in findings.csv"), "{text}");
    let many = drawn(&audit(12, 6));
    assert!(!many.contains("NaN") && roxmltree::Document::parse(&many).is_ok());
}

#[test]
fn a_wrong_picture_and_what_is_not_there_are_shown_in_neutral_light_and_a_wrong_shape_relit() {
    let mut audit = audit(3, 0);
    audit.findings[2].what = What::Extra;
    let [relit, own] = [0.0, 1.0];
    audit.views[0].render.pixels.fill(Vec3::splat(relit));
    audit.views[0].neutral.pixels.fill(Vec3::splat(own));
    let svg = drawn(&audit);
    let document = roxmltree::Document::parse(&svg).unwrap();
    let brightness = |title: &str| {
        let image = document
            .descendants()
            .find(|n| n.has_tag_name("image") && n.descendants().any(|t| t.text() == Some(title)));
        let href =
            image.unwrap_or_else(|| panic!("no picture of the {title}")).attributes().find(|a| a.name() == "href");
        let bytes = STANDARD.decode(href.unwrap().value().split_once(',').unwrap().1).unwrap();
        image::load_from_memory(&bytes).unwrap().to_rgb8().get_pixel(0, 0).0[0]
    };
    assert_eq!(brightness("F1 in the model"), 0);
    assert_eq!(brightness("F2 in the model, in neutral light"), 255);
    assert_eq!(brightness("F3 in the model, in neutral light"), 255);
}

#[test]
fn the_sheet_of_another_view_shows_a_finding_as_its_own_photograph_does() {
    let mut audit = audit(1, 0);
    let finding = &mut audit.findings[0];
    (finding.view, finding.also_in) = ("w".into(), vec!["v".into()]);
    finding.shift = Some(crate::audit::Shift { right_m: 0.08, down_m: 0.0 });
    let svg = drawn(&audit);
    assert!(svg.contains("F1 in the photograph") && svg.contains("F1 in the model"));
    let text = words(&svg).replace('\n', " ");
    assert!(text.contains("(best seen in “w”)") && text.contains("8 cm to the right in “w”"), "{text}");
}

#[test]
fn a_photograph_is_marked_as_its_sheet_is() {
    let audit = audit(2, 1);
    let photo = &audit.views[0].photograph;
    let exposure = Exposure::of(photo);
    let bytes = marked(&audit, "v", photo, exposure).unwrap().unwrap();
    let picture = image::load_from_memory(&bytes).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (60, 40));
    let [mut red, mut blue] = [0, 0];
    for image::Rgb([r, _, b]) in picture.pixels() {
        red += u32::from(*r > b.saturating_add(15));
        blue += u32::from(*b > r.saturating_add(15));
    }
    assert!(red > 5 && blue > 5, "geometry and texture in their colours: {red} and {blue} pixels");
    let [r, g, b] = picture.get_pixel(30, 39).0;
    assert!(r == g && g == b, "elsewhere the photograph is grey");
    assert!(marked(&audit, "another", photo, exposure).unwrap().is_none());
}
