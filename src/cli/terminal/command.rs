//! What is typed and told on a command line, as text.

use anyhow::bail;
use std::ffi::OsString;
use std::path::Path;

/// A command line of this program (without its name) as a shell takes it.
pub(crate) fn command(line: &[impl AsRef<str>]) -> String {
    line.iter().fold("clerestory".to_owned(), |line, word| line + " " + &quoted(word.as_ref()))
}

/// A word as a shell takes it: in quotes only if need be.
pub(crate) fn quoted(word: &str) -> String {
    let plain = !word.is_empty() && word.chars().all(|c| c.is_alphanumeric() || "-_./:,=+@".contains(c));
    if plain { word.to_owned() } else { format!("'{}'", word.replace('\'', r"'\''")) }
}

/// The command line that this process was started with.
pub(crate) fn own_command() -> String {
    command(&std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned()).collect::<Vec<_>>())
}

/// Refuses words that are no UTF-8, which results in JSON and in HTML could not name.
pub(crate) fn readable(mut words: impl Iterator<Item = OsString>) -> anyhow::Result<()> {
    match words.find(|word| word.to_str().is_none()) {
        Some(word) => bail!("{}: the name is no UTF-8. Rename the file or folder, or give another", word.display()),
        None => Ok(()),
    }
}

/// A path as an argument that is not taken for an option.
pub(crate) fn as_argument(path: &Path) -> String {
    let path = path.to_string_lossy();
    if path.starts_with('-') { format!("./{path}") } else { path.into_owned() }
}

/// An error and its causes in one line; a cause that the line tells already is not told again.
pub(crate) fn in_words(error: &anyhow::Error) -> String {
    error
        .chain()
        .skip(1)
        .map(ToString::to_string)
        .fold(error.to_string(), |line, cause| if line.contains(&cause) { line } else { format!("{line}: {cause}") })
}
