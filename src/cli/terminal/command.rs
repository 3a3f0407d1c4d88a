//! What is typed and told on a command line, as text.

/// A command line of this program (without its name) as a shell takes it.
pub(crate) fn command(line: &[String]) -> String {
    std::iter::once("clerestory".to_owned()).chain(line.iter().map(|w| quoted(w))).collect::<Vec<_>>().join(" ")
}

/// A word as a shell takes it: in quotes only if need be.
pub(crate) fn quoted(word: &str) -> String {
    let plain = !word.is_empty() && word.chars().all(|c| c.is_alphanumeric() || "-_./:,=+@".contains(c));
    if plain { word.to_owned() } else { format!("'{}'", word.replace('\'', r"'\''")) }
}

/// The command line that this process was started with.
pub(crate) fn own_command() -> String {
    command(&std::env::args().skip(1).collect::<Vec<_>>())
}

/// An error and its causes in one line; a cause that the line tells already is not told again.
pub(crate) fn in_words(error: &anyhow::Error) -> String {
    error
        .chain()
        .skip(1)
        .map(ToString::to_string)
        .fold(error.to_string(), |line, cause| if line.contains(&cause) { line } else { format!("{line}: {cause}") })
}
