//! Findings as points that other programs show beside the model: locators in Maya, labels in CloudCompare.

use std::fmt::Write;
use std::path::Path;

use super::error::ReportError;
use super::files::write_file;
use crate::audit::{Audit, Finding};
use crate::site::Site;
use crate::site::edit::number;

/// Writes an audit's findings, then its doubts, into a folder as `findings.ma` and `findings-cloudcompare.txt`; what cannot
/// be placed is left out.
///
/// # Errors
/// If the file system refuses.
pub fn write_markers(audit: &Audit, site: &Site, folder: &Path) -> Result<(), ReportError> {
    write_file(&folder.join("findings.ma"), maya(audit, site.frame.metres_per_unit).as_bytes())?;
    write_file(&folder.join("findings-cloudcompare.txt"), cloud_compare(audit).as_bytes())
}

/// A Maya ASCII scene with a locator a finding under one group, to import beside the model: its numbers are the model's,
/// as Maya takes those of an OBJ file. Each locator has the sentence as its attribute `note`, for scripts, and among its notes, which the attribute editor shows.
fn maya(audit: &Audit, metres_per_unit: f64) -> String {
    let mut text = "//Maya ASCII 2018 scene\n//Codeset: UTF-8\nrequires maya \"2018\";\ncurrentUnit -l centimeter -a degree -t film;\n\
                    createNode transform -n \"clerestory_findings\";\n"
        .to_owned();
    for f in placed(audit) {
        let name = node_name(&label(f));
        let [x, y, z] = f.position.map(|v| number(v, 6));
        let size = f.size_m / metres_per_unit;
        let size = number(if size > 0.0 && size.is_finite() { 0.5 * size } else { 1.0 }, 6);
        let note = quoted(&f.note);
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
fn cloud_compare(audit: &Audit) -> String {
    let mut text = "//X;Y;Z;Label\n".to_owned();
    for f in placed(audit) {
        let [x, y, z] = f.position.map(|v| number(v, 6));
        let label: String = label(f).chars().map(|c| if c == ';' || c.is_control() { ' ' } else { c }).collect();
        let _ = writeln!(text, "{x};{y};{z};{label}");
    }
    text
}

fn placed(audit: &Audit) -> impl Iterator<Item = &Finding> {
    audit.findings.iter().chain(&audit.doubts).filter(|f| f.position.iter().all(|v| v.is_finite()))
}

/// What it is, such as `F1 geometry moved`.
fn label(f: &Finding) -> String {
    format!("{} {} {}", f.id, f.kind.name(), f.what.name())
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
    use crate::audit::testing;

    fn audit() -> Audit {
        let finding = |id: &str, position| {
            let note = "5 cm; \"out\"\\\nsystem(\"x\")".into();
            Finding { position, note, ..testing::finding(id, "v") }
        };
        let view = testing::view(testing::summary("v", [1, 1]));
        let findings = vec![finding("F1", [1.5, -2.25, 3.0]), finding("F3", [f64::NAN, 0.0, 0.0])];
        Audit { doubts: vec![finding("1;x", [0.0, 0.0, 0.5])], ..testing::audit(view, findings) }
    }

    #[test]
    fn each_finding_is_a_locator_where_it_is() {
        let text = maya(&audit(), 0.01);
        assert!(text.starts_with("//Maya ASCII 2018 scene\n//Codeset: UTF-8\n"));
        assert_eq!(text.matches("createNode locator").count(), 2, "a place that is not finite is left out");
        assert!(text.contains("createNode transform -n \"F1_geometry_moved\" -p \"clerestory_findings\";"));
        assert!(text.contains("setAttr \".t\" -type \"double3\" 1.5 -2.25 3.0 ;"));
        assert!(text.contains("setAttr \".los\" -type \"double3\" 20.0 20.0 20.0 ;"), "half of 40 cm");
        assert!(text.contains("-n \"_1_x_geometry_moved\""));
        // nothing in a sentence ends its string
        assert!(text.contains(r#""5 cm; \"out\"\\ system(\"x\")";"#), "{text}");
    }

    #[test]
    fn cloud_compare_gets_three_numbers_and_a_label_a_line() {
        let text = cloud_compare(&audit());
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines, ["//X;Y;Z;Label", "1.5;-2.25;3.0;F1 geometry moved", "0.0;0.0;0.5;1 x geometry moved"]);
    }
}
