//! Names that no two have.

/// A name that can name files, and that is not among `names` yet.
pub(super) fn unique(stem: &str, names: &mut Vec<String>) -> String {
    let safe: String =
        stem.chars().map(|c| if c.is_control() || "/\\:*?\"<>|".contains(c) { '_' } else { c }).collect();
    let safe: String = safe.trim_matches([' ', '.']).chars().take(60).collect();
    let base = if safe.is_empty() { "picture".to_owned() } else { safe };
    let taken = |name: &str, names: &[String]| names.iter().any(|n| n.to_lowercase() == name.to_lowercase());
    let numbered = (2..).map(|i| format!("{base}-{i}"));
    let name = std::iter::once(base.clone()).chain(numbered).find(|n| !taken(n, names)).unwrap_or(base);
    names.push(name.clone());
    name
}
