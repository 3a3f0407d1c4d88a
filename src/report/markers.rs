//! Findings as points that other programs show beside the model: locators in Maya, labels in CloudCompare.

use std::fmt::Write;
use std::path::Path;

use super::error::ReportError;
use super::files::write_file;
use crate::audit::{Audit, Finding};
use crate::site::Site;
use crate::site::edit::number;

/// A place to show.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    /// Short and unique, such as `F1`.
    pub name: String,
    /// What it is, such as `geometry moved`.
    pub kind: String,
    /// In the model's own axes and units.
    pub position: [f64; 3],
    /// About how large it is, in the model's units.
    pub size: f64,
    /// A sentence.
    pub note: String,
}

/// An audit's findings, then its doubts, as points.
pub fn markers(audit: &Audit, site: &Site) -> Vec<Marker> {
    let marker = |f: &Finding| Marker {
        name: f.id.clone(),
        kind: format!("{} {}", f.kind.name(), f.what.name()),
        position: f.position,
        size: f.size_m / site.frame.metres_per_unit,
        note: f.note.clone(),
    };
    audit.findings.iter().chain(&audit.doubts).map(marker).collect()
}

/// Writes `findings.ma` and `findings-cloudcompare.txt` into a folder; what cannot be placed is left out.
///
/// # Errors
/// If the file system refuses.
pub fn write_markers(markers: &[Marker], folder: &Path) -> Result<(), ReportError> {
    write_file(&folder.join("findings.ma"), maya(markers).as_bytes())?;
    write_file(&folder.join("findings-cloudcompare.txt"), cloud_compare(markers).as_bytes())
}

/// A Maya ASCII scene with a locator a marker under one group, to import beside the model: its numbers are the model's,
/// as Maya takes those of an OBJ file. Each locator has the sentence as its attribute `note`, for scripts, and among its notes, which the attribute editor shows.
pub fn maya(markers: &[Marker]) -> String {
    let mut text = "//Maya ASCII 2018 scene\n//Codeset: UTF-8\nrequires maya \"2018\";\ncurrentUnit -l centimeter -a degree -t film;\n\
                    createNode transform -n \"clerestory_findings\";\n"
        .to_owned();
    for m in placed(markers) {
        let name = node_name(&format!("{} {}", m.name, m.kind));
        let [x, y, z] = m.position.map(|v| number(v, 6));
        let size = number(if m.size > 0.0 && m.size.is_finite() { 0.5 * m.size } else { 1.0 }, 6);
        let note = quoted(&m.note);
        // writing to a String cannot fail
        let _ = write!(
            text,
            "createNode transform -n \"{name}\" -p \"clerestory_findings\";\n\
             \taddAttr -ci true -sn \"note\" -ln \"note\" -dt \"string\";\n\
             \taddAttr -ci true -sn \"nts\" -ln \"notes\" -dt \"string\";\n\
             \tsetAttr \".t\" -type \"double3\" {x} {y} {z} ;\n\
             \tsetAttr -k on \".note\" -type \"string\" \"{note}\";\n\
             \tsetAttr \".nts\" -type \"string\" \"{note}\";\n\
             createNode locator -n \"{name}Shape\" -p \"{name}\";\n\
             \tsetAttr \".los\" -type \"double3\" {size} {size} {size} ;\n"
        );
    }
    text + "// End of findings.ma\n"
}

/// A table of points with semicolons between, which CloudCompare opens as a cloud: take the columns as X, Y, Z and Label,
/// and skip the first line.
pub fn cloud_compare(markers: &[Marker]) -> String {
    let mut text = "//X;Y;Z;Label\n".to_owned();
    for m in placed(markers) {
        let [x, y, z] = m.position.map(|v| number(v, 6));
        let label: String = format!("{} {}", m.name, m.kind)
            .chars()
            .map(|c| if c == ';' || c.is_control() { ' ' } else { c })
            .collect();
        let _ = writeln!(text, "{x};{y};{z};{label}");
    }
    text
}

fn placed(markers: &[Marker]) -> impl Iterator<Item = &Marker> {
    markers.iter().filter(|m| m.position.iter().all(|v| v.is_finite()))
}

/// A name that Maya takes: letters, digits and underscores, no digit first.
fn node_name(name: &str) -> String {
    let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if plain.starts_with(|c: char| c.is_ascii_digit()) { format!("_{plain}") } else { plain }
}

/// Text inside a MEL string: it can neither end the string nor be run.
fn quoted(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn markers() -> Vec<Marker> {
        let marker = |name: &str, position| Marker {
            name: name.into(),
            kind: "geometry moved".into(),
            position,
            size: 0.4,
            note: "5 cm; \"out\"\\\nsystem(\"x\")".into(),
        };
        vec![marker("F1", [1.5, -2.25, 3.0]), marker("1;x", [0.0, 0.0, 0.5]), marker("F3", [f64::NAN, 0.0, 0.0])]
    }

    #[test]
    fn each_finding_is_a_locator_where_it_is() {
        let text = maya(&markers());
        assert!(text.starts_with("//Maya ASCII 2018 scene\n//Codeset: UTF-8\n"));
        assert_eq!(text.matches("createNode locator").count(), 2, "a place that is not finite is left out");
        assert!(text.contains("createNode transform -n \"F1_geometry_moved\" -p \"clerestory_findings\";"));
        assert!(text.contains("setAttr \".t\" -type \"double3\" 1.5 -2.25 3.0 ;"));
        assert!(text.contains("-n \"_1_x_geometry_moved\""));
        // nothing in a sentence ends its string
        assert!(text.contains(r#""5 cm; \"out\"\\ system(\"x\")";"#), "{text}");
    }

    #[test]
    fn cloud_compare_gets_three_numbers_and_a_label_a_line() {
        let text = cloud_compare(&markers());
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines, ["//X;Y;Z;Label", "1.5;-2.25;3.0;F1 geometry moved", "0.0;0.0;0.5;1 x geometry moved"]);
    }
}
