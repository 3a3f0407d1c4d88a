//! Names of probes, views and lightings.

use std::collections::BTreeSet;
use toml::Spanned;

use super::super::fault::{SiteError, Source};
use super::super::files::is_unfit_in_names;

pub(super) fn unique<'a>(
    source: &Source,
    what: &str,
    names: impl Iterator<Item = &'a Spanned<String>>,
) -> Result<(), SiteError> {
    let mut seen = BTreeSet::new();
    for name in names {
        // file systems may not tell letter case
        if !seen.insert(name.get_ref().to_lowercase()) {
            return Err(source.fault(
                name.span(),
                format!("there are two {what}s named “{}”", name.get_ref()),
                "Give each its own name; letter case alone does not count",
            ));
        }
    }
    Ok(())
}

/// Names become file names, on any system.
pub(super) fn safe_name(source: &Source, name: &Spanned<String>, what: &str) -> Result<(), SiteError> {
    let n = name.get_ref();
    let stem = n.split('.').next().unwrap_or(n).to_ascii_uppercase();
    let device = matches!(stem.as_str(), "CON" | "PRN" | "AUX" | "NUL")
        || (stem.len() == 4
            && (stem.starts_with("COM") || stem.starts_with("LPT"))
            && stem.ends_with(|c: char| c.is_ascii_digit()));
    let problem = if n.trim().is_empty() {
        "it is empty".to_owned()
    } else if let Some(c) = n.chars().find(|c| is_unfit_in_names(*c)) {
        format!("it holds {c:?}")
    } else if n.starts_with([' ', '.']) || n.ends_with([' ', '.']) {
        "it begins or ends with a blank or a dot".to_owned()
    } else if device {
        "the name is reserved on some systems".to_owned()
    } else if n.len() > 100 {
        "it is longer than 100 bytes".to_owned()
    } else {
        return Ok(());
    };
    Err(source.fault(
        name.span(),
        format!("the name “{n}” cannot name this {what}'s files: {problem}"),
        "Use letters, digits, blanks inside, - and _",
    ))
}

pub(super) fn lighting_name(source: &Source, name: &Spanned<String>) -> Result<String, SiteError> {
    let n = name.get_ref();
    if !n.trim().is_empty() && !n.chars().any(|c| c.is_control() || c == '/' || c == '\\') {
        return Ok(n.clone());
    }
    Err(source.fault(
        name.span(),
        format!("“{n}” cannot name a lighting"),
        "Use a time such as \"10:00\" or a word; not empty, and without / and \\",
    ))
}
