//! What fuzzing needs beside the readers themselves: a target for libFuzzer, and mutations that need no nightly compiler.

#[path = "../../tests/support/readers.rs"]
mod readers;

pub mod formats;
pub mod mutate;

use std::path::Path;

/// The readers' names.
pub const READERS: &[&str] = &readers::READERS;

/// How much decoding one picture may take here: what needs more is refused, which keeps executions quick.
pub const MEMORY: u64 = 4 << 20;

/// Gives bytes to a reader, as a file in `folder`, which is its own; what it warns of.
///
/// # Errors
///
/// Why it refused them, in its own words.
pub fn read(reader: &str, bytes: &[u8], folder: &Path) -> Result<String, String> {
    readers::read(reader, bytes, folder)
}

/// A folder in memory where the system has one.
///
/// # Errors
///
/// What the system said.
pub fn folder() -> std::io::Result<tempfile::TempDir> {
    let memory = Path::new("/dev/shm");
    if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() }
}

/// A libFuzzer target of one reader.
#[macro_export]
macro_rules! target {
    ($reader:literal) => {
        static FOLDER: std::sync::OnceLock<tempfile::TempDir> = std::sync::OnceLock::new();

        libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
            let folder = FOLDER.get_or_init(|| {
                clerestory::memory::set_limit($crate::MEMORY);
                $crate::folder().expect("a folder can be made")
            });
            let _ = $crate::read($reader, bytes, folder.path());
        });
    };
}
