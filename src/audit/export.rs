//! `findings.json`, `findings.csv` and the masks.

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Write;
use std::path::Path;

use crate::atomic_write::write_atomically;
use crate::audit::error::AuditError;
use crate::audit::finding::{Audit, Finding, Method, ViewSummary};
use crate::csv::Table;

/// What `findings.json` holds.
#[derive(Serialize)]
struct Document<'a> {
    findings: &'a [Finding],
    doubts: &'a [Finding],
    views: Vec<&'a ViewSummary>,
    method: &'a Method,
    warnings: &'a [String],
}

impl Audit {
    /// The text of `findings.json`: the same bytes for the same audit.
    ///
    /// # Errors
    ///
    /// [`AuditError::Unwritable`] if a figure cannot be written as JSON.
    pub fn json(&self) -> Result<String, AuditError> {
        let document = Document {
            findings: &self.findings,
            doubts: &self.doubts,
            views: self.views.iter().map(|v| &v.summary).collect(),
            method: &self.method,
            warnings: &self.warnings,
        };
        let mut text = serde_json::to_string_pretty(&document)
            .map_err(|e| AuditError::Unwritable { path: "findings.json".into(), why: e.to_string() })?;
        text.push('\n');
        Ok(text)
    }

    /// The text of `findings.csv`: a row a finding, then a row a doubt, fields quoted where they need it (RFC 4180).
    pub fn csv(&self) -> String {
        let columns = "id kind what score view also_in x y z size_m area_cm2 area_px displacement_m uncertainty_m material bbox mask \
                       reason note shift_right_m shift_down_m";
        let mut table = Table::new(columns.split_whitespace());
        for f in self.findings.iter().chain(&self.doubts) {
            let number = |v: f64, digits: usize| format!("{v:.digits$}");
            let [x, y, z] = f.position;
            let fields = [
                f.id.clone(),
                f.kind.name().to_owned(),
                f.what.name().to_owned(),
                number(f.score, 3),
                f.view.clone(),
                f.also_in.join(" "),
                number(x, 3),
                number(y, 3),
                number(z, 3),
                number(f.size_m, 3),
                number(f.area_cm2, 0),
                f.area_px.to_string(),
                f.displacement.map_or(String::new(), |d| number(d.metres, 4)),
                f.displacement.map_or(String::new(), |d| number(d.uncertainty_m, 4)),
                f.material.clone(),
                f.bbox.map(|v| v.to_string()).join(" "),
                f.mask.clone(),
                if f.is_sure() { String::new() } else { f.reason.name().to_owned() },
                f.note.clone(),
                f.shift.map_or(String::new(), |s| number(s.right_m, 4)),
                f.shift.map_or(String::new(), |s| number(s.down_m, 4)),
            ];
            table.row(fields);
        }
        table.finish()
    }

    /// Writes `findings.json`, `findings.csv` and the masks into a folder that exists. Each file appears whole or not at
    /// all. Masks of an earlier audit there that this one has no finding for are removed, and sheets of views that are not in
    /// this one: findings are numbered anew.
    ///
    /// # Errors
    ///
    /// [`AuditError::Unwritable`] names the file that could not be written.
    pub fn write(&self, folder: &Path) -> Result<(), AuditError> {
        let all: Vec<&Finding> = self.findings.iter().chain(&self.doubts).collect();
        let mut stale = files_named(&folder.join("findings.json"));
        for view in &self.views {
            for (id, mask) in &view.masks {
                let Some(finding) = all.iter().find(|f| f.id == *id) else { continue };
                let Some(file) = finding.masks.get(&view.summary.view) else { continue };
                let png = mask_png(&view.enlarged(mask), view.summary.size)
                    .map_err(|why| AuditError::Unwritable { path: folder.join(file), why })?;
                put(&folder.join(file), &png)?;
            }
        }
        put(&folder.join("findings.csv"), self.csv().as_bytes())?;
        put(&folder.join("findings.json"), self.json()?.as_bytes())?;
        // a view's name may differ in letter case alone, which some file systems do not tell apart
        let masks = all.iter().flat_map(|f| f.masks.values()).map(|own| own.to_lowercase());
        let sheets = self.views.iter().flat_map(|v| sheets(&v.summary.view)).map(|own| own.to_lowercase());
        let now: BTreeSet<String> = masks.chain(sheets).collect();
        stale.retain(|file| !now.contains(&file.to_lowercase()));
        for path in stale.iter().map(|file| folder.join(file)).filter(|p| p.is_file()) {
            fs::remove_file(&path).map_err(|e| AuditError::Unwritable { path, why: e.to_string() })?;
        }
        Ok(())
    }
}

/// What the files of a view's sheet are called, without their endings.
pub fn sheet_stem(view: &str) -> String {
    format!("audit-{view}")
}

/// The files of a view's sheet.
fn sheets(view: &str) -> [String; 3] {
    ["svg", "png", "pdf"].map(|kind| format!("{}.{kind}", sheet_stem(view)))
}

/// The masks that an earlier `findings.json` names, if there is one, and its views' sheets: files in its own folder.
fn files_named(file: &Path) -> BTreeSet<String> {
    #[derive(Deserialize)]
    struct Earlier {
        findings: Vec<Masked>,
        doubts: Vec<Masked>,
        #[serde(default)]
        views: Vec<Seen>,
    }
    #[derive(Deserialize)]
    struct Seen {
        view: String,
    }
    #[derive(Deserialize)]
    struct Masked {
        masks: BTreeMap<String, String>,
    }
    let Some(earlier) = fs::read(file).ok().and_then(|text| serde_json::from_slice::<Earlier>(&text).ok()) else {
        return BTreeSet::new();
    };
    let masks = earlier.findings.into_iter().chain(earlier.doubts).flat_map(|f| f.masks.into_values());
    let masks = masks.filter(|name| name.starts_with("mask-") && name.ends_with(".png"));
    let all = masks.chain(earlier.views.iter().flat_map(|v| sheets(&v.view)));
    all.filter(|name| !name.contains(['/', '\\'])).collect()
}

/// An 8-bit grey PNG, 255 where the mask is set.
fn mask_png(mask: &[bool], [width, height]: [u32; 2]) -> Result<Vec<u8>, String> {
    use image::ImageEncoder;
    let pixels: Vec<u8> = mask.iter().map(|&m| if m { 255 } else { 0 }).collect();
    let mut png = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut png);
    encoder.write_image(&pixels, width, height, image::ExtendedColorType::L8).map_err(|e| e.to_string())?;
    Ok(png)
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), AuditError> {
    let io = |e: std::io::Error| AuditError::Unwritable { path: path.to_owned(), why: e.to_string() };
    write_atomically(path, io, |file| file.write_all(bytes).map_err(io))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::finding::{AuditedView, Shares, What};
    use crate::audit::testing;
    use crate::audit::verdict::{Reason, Verdict};

    fn audit() -> Audit {
        let (material, note) = ("stone, grey".to_owned(), "the \"wall\" stands 5 cm back".to_owned());
        let moved = Finding { material, note, ..testing::finding("F1", "nave") };
        let shares = Shares::of(&[Verdict::Ok, Verdict::Geometry, Verdict::Untestable, Verdict::Ok]);
        let view = testing::view(ViewSummary { shares, ..testing::summary("nave", [3, 3]) });
        let masks = vec![("F1".to_owned(), (0..9).map(|i| i == 4).collect())];
        testing::audit(AuditedView { masks, ..view }, vec![moved])
    }

    #[test]
    fn json_has_the_names_that_scripts_rely_on() {
        let value: serde_json::Value = serde_json::from_str(&audit().json().unwrap()).unwrap();
        let f = &value["findings"][0];
        for name in ["id", "view", "kind", "what", "score", "bbox", "area_px", "mask", "position", "size_m", "note"] {
            assert!(!f[name].is_null(), "{name} is absent");
        }
        assert_eq!((f["kind"].as_str(), f["what"].as_str()), (Some("geometry"), Some("moved")));
        assert_eq!(f["displacement"]["metres"].as_f64(), Some(-0.102));
        assert_eq!(value["views"][0]["shares"]["untestable"].as_f64(), Some(0.25));
        assert!(value["doubts"].as_array().unwrap().is_empty());
    }

    #[test]
    fn names_are_what_serde_writes() {
        for verdict in Verdict::ALL {
            assert_eq!(serde_json::to_value(verdict).unwrap(), verdict.name());
        }
        for reason in [Reason::None, Reason::NoParallax, Reason::Usual] {
            assert_eq!(serde_json::to_value(reason).unwrap(), reason.name());
        }
        for what in [What::Rotated, What::Recoloured, What::Moved] {
            assert_eq!(serde_json::to_value(what).unwrap(), what.name());
        }
    }

    #[test]
    fn csv_quotes_commas_and_quotes() {
        let csv = audit().csv();
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines.len(), 2);
        assert!(lines[1].contains("\"stone, grey\"") && lines[1].ends_with("\"the \"\"wall\"\" stands 5 cm back\",,"));
        // quoted fields hold one comma in all
        assert_eq!(lines[0].matches(',').count() + 1, lines[1].matches(',').count());
    }

    #[test]
    fn masks_read_back_and_nothing_else_is_left() {
        let dir = tempfile::tempdir().unwrap();
        audit().write(dir.path()).unwrap();
        let mask = image::open(dir.path().join("mask-nave-F1.png")).unwrap();
        assert_eq!(mask.color(), image::ColorType::L8);
        let mask = mask.into_luma8();
        assert_eq!(mask.dimensions(), (3, 3));
        assert!(mask.enumerate_pixels().all(|(x, y, p)| p.0[0] == if (x, y) == (1, 1) { 255 } else { 0 }));
        let mut names: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["findings.csv", "findings.json", "mask-nave-F1.png"]);
    }

    #[test]
    fn masks_of_an_earlier_audit_are_removed_and_no_other_file() {
        let dir = tempfile::tempdir().unwrap();
        audit().write(dir.path()).unwrap();
        fs::write(dir.path().join("mask-by-hand.png"), "a surveyor's own").unwrap();
        let mut right = audit();
        right.findings.clear();
        right.write(dir.path()).unwrap();
        let mut names: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["findings.csv", "findings.json", "mask-by-hand.png"]);
    }

    #[test]
    fn sheets_of_views_that_are_no_longer_audited_are_removed_and_no_other_file() {
        let dir = tempfile::tempdir().unwrap();
        audit().write(dir.path()).unwrap();
        let files = ["audit-by-hand.svg", "audit-nave.pdf", "audit-nave.png", "audit-nave.svg"];
        files.iter().for_each(|name| fs::write(dir.path().join(name), "").unwrap());
        let there = || files.iter().filter(|name| dir.path().join(name).is_file()).count();
        let of = |view: &str| testing::audit(testing::view(testing::summary(view, [3, 3])), vec![]);
        // on some file systems this is the same file
        of("Nave").write(dir.path()).unwrap();
        assert_eq!(there(), 4);
        audit().write(dir.path()).unwrap();
        of("choir").write(dir.path()).unwrap();
        assert_eq!(there(), 1);
        assert!(dir.path().join(files[0]).is_file());
        // a name that leads elsewhere is no file of this folder
        let inner = dir.path().join("audit-x");
        fs::create_dir(&inner).unwrap();
        fs::write(inner.join("y.svg"), "").unwrap();
        let earlier = r#"{"findings": [], "doubts": [], "views": [{"view": "x/y"}]}"#;
        fs::write(dir.path().join("findings.json"), earlier).unwrap();
        of("choir").write(dir.path()).unwrap();
        assert!(inner.join("y.svg").is_file());
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let error = audit().write(Path::new("/nowhere/at/all")).unwrap_err();
        assert!(error.to_string().contains("/nowhere/at/all/mask-nave-F1.png"), "{error}");
    }
}
