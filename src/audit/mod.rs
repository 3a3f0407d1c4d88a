//! Where the model is wrong, from photographs.
//!
//! Light divided by albedo and multiplied by it again would make a wrong texture cancel out, so there are two tests that
//! share nothing but the model's shape: `likelihood::photo_consistency` compares the photograph with what each probe saw of the
//! same surface, without albedo; `likelihood::appearance` compares it with albedo under irradiance gathered from all around.
//!
//! The folders stand in the order in which they are used: each imports only from those before it.

mod error;
mod verdict;

mod finding;
mod picture;

mod observe;

mod likelihood;

mod view;

mod hypothesis;

mod decide;

mod export;
mod run;
#[cfg(test)]
pub(crate) mod testing;

pub use decide::judge::Judgement;
pub use decide::judged::Judged;
pub use error::AuditError;
pub use export::sheet_stem;
pub use finding::{
    Audit, AuditedView, Displacement, Evidence, Finding, Kind, Method, PoseCorrection, ProbeGain, Shares, Shift,
    ViewSummary, What,
};
pub use observe::photo::Photo;
pub use run::{Progress, audit};
pub use verdict::{Reason, Verdict};
pub use view::{AuditScene, Observations, Settings, examine};

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    /// Names and values of the numbers that a file's code, but for its tests, sets by hand.
    fn constants(code: &str) -> impl Iterator<Item = (String, String)> {
        let code = code.split("#[cfg(test)]").next().unwrap_or_default().to_owned();
        let mut found = Vec::new();
        for (at, _) in code.match_indices("const ") {
            let rest = &code[at + 6..];
            let Some((name, rest)) = rest.split_once(':') else { continue };
            let Some((kind, rest)) = rest.split_once('=') else { continue };
            let Some((value, _)) = rest.split_once(";\n") else { continue };
            let number = !kind.contains(['{', '>']) && !kind.contains("str") && !kind.contains("Self");
            if number && name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_') {
                found.push((name.to_owned(), value.split_whitespace().collect::<Vec<_>>().join(" ")));
            }
        }
        found.into_iter()
    }

    /// A constant is set by hand, and somebody must be able to see all of them: none is added, changed or dropped without its row.
    #[test]
    fn every_constant_has_its_row() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut in_code = BTreeSet::new();
        let mut folders = vec![root.join("src/audit")];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                    continue;
                }
                let file = path.strip_prefix(root.join("src/audit")).unwrap().to_string_lossy().replace('\\', "/");
                let code = std::fs::read_to_string(&path).unwrap();
                in_code.extend(constants(&code).map(|(name, value)| (file.clone(), name, value)));
            }
        }
        let table = std::fs::read_to_string(root.join("docs/audit-constants.md")).unwrap();
        let rows = table.lines().filter(|l| l.starts_with("| `")).map(|line| {
            let mut cells = line.split('|').skip(1).map(|c| c.trim().trim_matches('`').to_owned());
            let mut next = || cells.next().unwrap_or_default();
            (next(), next(), next())
        });
        let in_table: BTreeSet<_> = rows.collect();
        let without: Vec<_> = in_code.difference(&in_table).collect();
        let stale: Vec<_> = in_table.difference(&in_code).collect();
        assert!(without.is_empty() && stale.is_empty(), "without a row: {without:?}; rows of nothing: {stale:?}");
        assert!(in_code.len() > 50, "only {} constants were read", in_code.len());
    }
}
