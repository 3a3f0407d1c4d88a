//! Names that no two have.

use crate::site::files::as_file_name;

/// A name that can name files, and that is not among `names` yet.
pub(super) fn unique(stem: &str, names: &mut Vec<String>) -> String {
    let safe: String = as_file_name(stem).chars().take(60).collect();
    let base = if safe.is_empty() { "picture".to_owned() } else { safe };
    let taken = |name: &str, names: &[String]| names.iter().any(|n| n.to_lowercase() == name.to_lowercase());
    let numbered = (2..).map(|i| format!("{base}-{i}"));
    let name = std::iter::once(base.clone()).chain(numbered).find(|n| !taken(n, names)).unwrap_or(base);
    names.push(name.clone());
    name
}
