//! Finding the files that a site or a material names.

use std::fs;
use std::path::{Component, Path, PathBuf};

/// Whether a path is really a URL.
pub(crate) fn is_url(text: &str) -> bool {
    let scheme = text.split_once("://").map(|(scheme, _)| scheme);
    scheme.is_some_and(|s| !s.is_empty() && s.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c)))
        || text.starts_with("data:")
        || text.starts_with("file:")
}

/// The file that `name` means in a folder where the name as written finds nothing: the same with `/` for `\`, and
/// any letter case.
pub(crate) fn find_loosely(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    let mut found = folder.to_owned();
    for part in Path::new(&name).components() {
        let next = found.join(part);
        found = match part {
            Component::Normal(wanted) if !next.exists() => {
                let wanted = wanted.to_string_lossy().to_lowercase();
                let mut names: Vec<_> = fs::read_dir(&found).ok()?.filter_map(|e| Some(e.ok()?.file_name())).collect();
                names.sort();
                found.join(names.into_iter().find(|n| n.to_string_lossy().to_lowercase() == wanted)?)
            }
            _ => next,
        };
    }
    found.is_file().then_some(found)
}
