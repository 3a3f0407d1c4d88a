//! Files that appear whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes beside the wanted file, then renames: a reader never sees half a file, and a failure leaves nothing. `io`
/// makes an error of the caller's own kind.
pub(crate) fn write_whole<E>(
    path: &Path,
    io: impl Fn(io::Error) -> E,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), E> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let write = || {
        let mut file = BufWriter::new(File::create(&part).map_err(&io)?);
        fill(&mut file)?;
        file.flush().map_err(&io)
    };
    let done = write().and_then(|()| fs::rename(&part, path).map_err(&io));
    if done.is_err() {
        // the first error is the one to tell
        let _ = fs::remove_file(&part);
    }
    done
}
