//! Files that appear whole or not at all, even if the program is stopped while it writes.
//!
//! ```
//! let folder = std::env::temp_dir();
//! let path = folder.join(format!("clerestory-whole-{}", std::process::id()));
//! clerestory::atomic_write::write_atomically(&path, |e| e, |file| std::io::Write::write_all(file, b"all of it"))?;
//! assert_eq!(std::fs::read(&path)?, b"all of it");
//! # std::fs::remove_file(&path)?;
//! # Ok::<(), std::io::Error>(())
//! ```

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What is being written now; the one thing that a program that is told to stop must know from outside.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // a set of paths is whole between calls, whoever panicked
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file or folder under a temporary name; it is removed when this is dropped, or by [`remove_unfinished`], unless it
/// has been renamed before.
#[derive(Debug)]
pub struct Unfinished(PathBuf);

impl Unfinished {
    /// Says that `path`, a temporary name, is about to be made.
    pub fn new(path: PathBuf) -> Self {
        unfinished().insert(path.clone());
        Self(path)
    }

    /// The temporary name.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        remove(&self.0);
        unfinished().remove(&self.0);
    }
}

/// Removes whatever is half-written, for a program that is being stopped. Whoever was writing fails or goes on in vain,
/// so the program must end right after.
pub fn remove_unfinished() {
    // keeps the lock, so that nothing new is begun or renamed meanwhile
    for path in unfinished().iter() {
        remove(path);
    }
}

fn remove(path: &Path) {
    // most often it has been renamed, and is not there; there is nobody to tell of anything else
    let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
}

/// Writes beside the wanted file, then renames: a reader never sees half a file, and a failure leaves nothing. `io`
/// makes an error of the caller's own kind.
///
/// # Errors
/// What `io` made of the file system's refusal, or what `fill` gave.
pub fn write_atomically<E>(
    path: &Path,
    io: impl Fn(io::Error) -> E,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), E> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.part", std::process::id()));
    let part = Unfinished::new(path.with_file_name(name));
    let mut file = BufWriter::new(File::create(part.path()).map_err(&io)?);
    fill(&mut file)?;
    file.flush().map_err(&io)?;
    drop(file);
    fs::rename(part.path(), path).map_err(&io)
}

/// The folder that a file lies in.
pub fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
