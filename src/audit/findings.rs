//! What the audit found, as values and as `findings.json` and `findings.csv`.

use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;

use super::{AuditError, Reason, Verdict};
use crate::panorama::Picture;

/// What sort of fault it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The surface is right, its picture is not.
    Texture,
    /// The surface is not where it should be.
    Geometry,
}

impl Kind {
    /// The name in the machine-readable outputs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Texture => "texture",
            Self::Geometry => "geometry",
        }
    }
}

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum What {
    /// The texture is turned.
    Rotated,
    /// The texture is mirrored.
    Mirrored,
    /// The texture is shifted.
    Shifted,
    /// The texture is too large or too small.
    Scaled,
    /// The structure is right, the colour is not.
    Recoloured,
    /// The picture is another one.
    Changed,
    /// Something stands in front of the modelled surface, or a recess is behind it, that is not modelled.
    Missing,
    /// The model has something that is not there.
    Extra,
    /// The surface is some way off its place.
    Moved,
    /// The geometry is wrong in a way that cannot be told further.
    Different,
}

impl What {
    /// The name in the machine-readable outputs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rotated => "rotated",
            Self::Mirrored => "mirrored",
            Self::Shifted => "shifted",
            Self::Scaled => "scaled",
            Self::Recoloured => "recoloured",
            Self::Changed => "changed",
            Self::Missing => "missing",
            Self::Extra => "extra",
            Self::Moved => "moved",
            Self::Different => "different",
        }
    }
}

/// How far the real surface is from the modelled one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Displacement {
    /// Metres along the modelled surface's normal, positive towards the camera's side.
    pub metres: f64,
    /// One standard deviation, metres.
    pub uncertainty_m: f64,
}

/// One figure that speaks for a finding.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evidence {
    /// What was measured, such as `geometry mismatch` or `colour difference`.
    pub test: String,
    /// The figure.
    pub value: f64,
    /// What it would have to stay below for the model to pass.
    pub threshold: f64,
    /// The figure's unit, such as `× noise`, `ΔE00` or `correlation`.
    pub unit: String,
}

/// One fault of the model, as one view shows it best.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// `F1`, `F2`, … over all views, the surest first; `D1`, … for doubts.
    pub id: String,
    /// The view that shows it best.
    pub view: String,
    /// Other views that show the same.
    pub also_in: Vec<String>,
    /// Texture or geometry.
    pub kind: Kind,
    /// What is wrong.
    pub what: What,
    /// Confidence, 0..=1.
    pub score: f64,
    /// Pixels of the photograph: left, top, and one past right and bottom.
    pub bbox: [u32; 4],
    /// Pixels of the photograph.
    pub area_px: u64,
    /// File name of the 8-bit mask (255 inside), of the photograph's size, beside `findings.json`.
    pub mask: String,
    /// Centre of the region on the modelled surface, in the model's own axes and units.
    pub position: [f64; 3],
    /// The region's greatest extent on the modelled surface, metres.
    pub size_m: f64,
    /// Area of the modelled surface in the region, cm².
    pub area_cm2: f64,
    /// The model's material that most of the region is made of.
    pub material: String,
    /// How far the surface is off, where that could be measured.
    pub displacement: Option<Displacement>,
    /// Why it cannot be told for sure; [`Reason::None`] for all but doubts.
    pub reason: Reason,
    /// The figures behind it.
    pub evidence: Vec<Evidence>,
    /// A sentence for people.
    pub note: String,
}

/// What was found out about a probe on the way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProbeGain {
    /// The probe's name.
    pub probe: String,
    /// Its exposure against the mean of all probes, in stops.
    pub gain_ev: f64,
    /// Share of the view's surface pixels that it sees well enough to test.
    pub sees: f64,
    /// Median relative difference between its light and the photograph's where it sees; `None` where it sees too little.
    pub difference: Option<f64>,
    /// A sentence if it disagrees with the others.
    pub warning: Option<String>,
}

/// How the camera was moved to fit the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PoseCorrection {
    /// Whether the pose was refined; if not, the site's pose was kept.
    pub refined: bool,
    /// Mean shift of the picture, pixels of the photograph.
    pub mean_px: f64,
    /// Greatest shift of the picture, pixels of the photograph.
    pub max_px: f64,
    /// What the fit leaves open, pixels of the photograph (one standard deviation, as far as the fit can tell).
    pub residual_px: f64,
    /// Angle that the camera was turned by, degrees.
    pub rotation_deg: f64,
    /// Distance that the camera was moved by, metres.
    pub translation_m: f64,
}

/// Shares of a view's pixels under each verdict; they sum to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Shares {
    /// See [`Verdict::Ok`].
    pub ok: f64,
    /// See [`Verdict::Texture`].
    pub texture: f64,
    /// See [`Verdict::Geometry`].
    pub geometry: f64,
    /// See [`Verdict::Ambiguous`].
    pub ambiguous: f64,
    /// See [`Verdict::Untestable`].
    pub untestable: f64,
}

/// How one view was audited.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ViewSummary {
    /// The view's name.
    pub view: String,
    /// The photograph's file.
    pub photo: String,
    /// The photograph's width and height in pixels.
    pub size: [u32; 2],
    /// Pixels of the photograph, along a side, that were averaged to one for the audit.
    pub reduced_by: u32,
    /// The probes' exposure over the photograph's, in stops.
    pub exposure_ev: f64,
    /// What the photograph's channels were multiplied by on top of the exposure; their product is 1.
    pub white_balance: [f64; 3],
    /// Loss of light in the picture's corners, in stops.
    pub vignetting_ev: f64,
    /// The photograph's noise, relative to its light: robust standard deviation in its smooth parts.
    pub noise: f64,
    /// How the camera was moved.
    pub pose: PoseCorrection,
    /// What was found out about the probes.
    pub probes: Vec<ProbeGain>,
    /// Shares of the pixels.
    pub shares: Shares,
    /// Shares of all pixels that are ambiguous or untestable, by reason.
    pub reasons: BTreeMap<String, f64>,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
}

/// Everything the audit says of one view; all maps have the photograph's size.
pub struct AuditedView {
    /// Figures, for the machine-readable output.
    pub summary: ViewSummary,
    /// The photograph with exposure and white balance of the probes.
    pub photograph: Picture,
    /// The model in the probes' light, radiance.
    pub render: Picture,
    /// What is said of each pixel.
    pub verdicts: Vec<Verdict>,
    /// Why no more is said of it.
    pub reasons: Vec<Reason>,
    /// For each finding or doubt whose best view this is: its id and the pixels it covers.
    pub masks: Vec<(String, Vec<bool>)>,
}

/// The thresholds that regions were judged by.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Method {
    /// The program's version.
    pub version: String,
    /// The lighting whose probes were used; empty where the site has only one.
    pub lighting: String,
    /// Names of thresholds and their values.
    pub thresholds: BTreeMap<String, f64>,
}

/// Everything the audit says of a site.
pub struct Audit {
    /// Faults, the surest first.
    pub findings: Vec<Finding>,
    /// Where something disagrees but what it is cannot be told, the surest first.
    pub doubts: Vec<Finding>,
    /// The views, in the site's order.
    pub views: Vec<AuditedView>,
    /// How it was judged.
    pub method: Method,
    /// What is odd about the site, a sentence each.
    pub warnings: Vec<String>,
}

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
        let mut text = "id,kind,what,score,view,also_in,x,y,z,size_m,area_cm2,area_px,displacement_m,uncertainty_m,\
                        material,bbox,mask,reason,note\n"
            .to_owned();
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
                if f.reason == Reason::None { String::new() } else { f.reason.name().to_owned() },
                f.note.clone(),
            ];
            text += &fields.map(|v| quoted(&v)).join(",");
            text.push('\n');
        }
        text
    }

    /// Writes `findings.json`, `findings.csv` and the masks into a folder that exists. Each file appears whole or not at
    /// all.
    ///
    /// # Errors
    ///
    /// [`AuditError::Unwritable`] names the file that could not be written.
    pub fn write(&self, folder: &Path) -> Result<(), AuditError> {
        let all: Vec<&Finding> = self.findings.iter().chain(&self.doubts).collect();
        for view in &self.views {
            for (id, mask) in &view.masks {
                let Some(finding) = all.iter().find(|f| f.id == *id) else { continue };
                let png = mask_png(mask, view.summary.size)
                    .map_err(|why| AuditError::Unwritable { path: folder.join(&finding.mask), why })?;
                put(&folder.join(&finding.mask), &png)?;
            }
        }
        put(&folder.join("findings.csv"), self.csv().as_bytes())?;
        put(&folder.join("findings.json"), self.json()?.as_bytes())
    }
}

/// A field of a CSV file, quoted if it holds a comma, a quote or a line's end.
fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
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

/// Writes beside the wanted file, then renames.
fn put(path: &Path, bytes: &[u8]) -> Result<(), AuditError> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let written = fs::File::create(&part)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.flush()))
        .and_then(|()| fs::rename(&part, path));
    written.map_err(|e| {
        // the first error is the one to tell
        let _ = fs::remove_file(&part);
        AuditError::Unwritable { path: path.to_owned(), why: e.to_string() }
    })
}

impl Shares {
    /// Counts a view's verdicts.
    pub fn of(verdicts: &[Verdict]) -> Self {
        let share = |v: Verdict| verdicts.iter().filter(|w| **w == v).count() as f64 / verdicts.len().max(1) as f64;
        Self {
            ok: share(Verdict::Ok),
            texture: share(Verdict::Texture),
            geometry: share(Verdict::Geometry),
            ambiguous: share(Verdict::Ambiguous),
            untestable: share(Verdict::Untestable),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(id: &str) -> Finding {
        Finding {
            id: id.to_owned(),
            view: "nave".to_owned(),
            also_in: vec!["aisle".to_owned()],
            kind: Kind::Geometry,
            what: What::Moved,
            score: 0.93,
            bbox: [0, 1, 3, 3],
            area_px: 2,
            mask: format!("mask-nave-{id}.png"),
            position: [1.0, 2.5, -3.0],
            size_m: 0.5,
            area_cm2: 120.0,
            material: "stone, grey".to_owned(),
            displacement: Some(Displacement { metres: -0.05, uncertainty_m: 0.01 }),
            reason: Reason::None,
            evidence: vec![],
            note: "the \"wall\" stands 5 cm back".to_owned(),
        }
    }

    fn audit() -> Audit {
        let summary = ViewSummary {
            view: "nave".to_owned(),
            photo: "photos/nave.exr".to_owned(),
            size: [3, 3],
            reduced_by: 1,
            exposure_ev: 0.0,
            white_balance: [1.0; 3],
            vignetting_ev: 0.0,
            noise: 0.01,
            pose: PoseCorrection::default(),
            probes: vec![],
            shares: Shares::of(&[Verdict::Ok, Verdict::Geometry, Verdict::Untestable, Verdict::Ok]),
            reasons: BTreeMap::from([("unseen".to_owned(), 0.25)]),
            warnings: vec![],
        };
        let mut mask = vec![false; 9];
        mask[4] = true;
        let view = AuditedView {
            summary,
            photograph: Picture::new(3, 3),
            render: Picture::new(3, 3),
            verdicts: vec![Verdict::Ok; 9],
            reasons: vec![Reason::None; 9],
            masks: vec![("F1".to_owned(), mask)],
        };
        let method = Method { version: "0".to_owned(), lighting: String::new(), thresholds: BTreeMap::new() };
        let findings = vec![finding("F1")];
        Audit { findings, doubts: vec![], views: vec![view], method, warnings: vec![] }
    }

    #[test]
    fn json_has_the_names_that_scripts_rely_on() {
        let value: serde_json::Value = serde_json::from_str(&audit().json().unwrap()).unwrap();
        let f = &value["findings"][0];
        for name in ["id", "view", "kind", "what", "score", "bbox", "area_px", "mask", "position", "size_m", "note"] {
            assert!(!f[name].is_null(), "{name} is absent");
        }
        assert_eq!((f["kind"].as_str(), f["what"].as_str()), (Some("geometry"), Some("moved")));
        assert_eq!(f["displacement"]["metres"].as_f64(), Some(-0.05));
        assert_eq!(value["views"][0]["shares"]["untestable"].as_f64(), Some(0.25));
        assert!(value["doubts"].as_array().unwrap().is_empty());
    }

    #[test]
    fn names_are_what_serde_writes() {
        for verdict in Verdict::ALL {
            assert_eq!(serde_json::to_value(verdict).unwrap(), verdict.name());
        }
        for reason in [Reason::None, Reason::NoParallax, Reason::ProbesDisagree, Reason::WhiteBalance] {
            assert_eq!(serde_json::to_value(reason).unwrap(), reason.name());
        }
        for what in [What::Rotated, What::Recoloured, What::Different] {
            assert_eq!(serde_json::to_value(what).unwrap(), what.name());
        }
    }

    #[test]
    fn csv_quotes_commas_and_quotes() {
        let csv = audit().csv();
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines.len(), 2);
        assert!(lines[1].contains("\"stone, grey\"") && lines[1].ends_with("\"the \"\"wall\"\" stands 5 cm back\""));
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
    fn a_folder_that_is_not_there_is_named() {
        let error = audit().write(Path::new("/nowhere/at/all")).unwrap_err();
        assert!(error.to_string().contains("/nowhere/at/all/mask-nave-F1.png"), "{error}");
    }
}
