//! The folder of real data that some tests use; the project is whole without it.

use std::path::{Path, PathBuf};

/// A file or folder in it; `None`, and said, where it is not there.
pub(crate) fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}
