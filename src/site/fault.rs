//! What is wrong with a site file, and where: every fault names the file, the place, the key and the cure.

use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::numbers::CURE;

/// Why a site could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SiteError {
    /// The site file could not be read at all.
    #[error("{}: {why}. {help}", path.display())]
    Unreadable {
        /// The file or folder asked for.
        path: PathBuf,
        /// What happened.
        why: String,
        /// What to do about it.
        help: String,
    },
    /// Several things in the site file are at fault, a line each.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<SiteError>),
    /// Something in the site file is at fault.
    #[error("{}:{line}:{column}: {key}: {problem}. {help}", path.display())]
    Fault {
        /// The site file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// The key, such as `probe.nave.position`; probes and views go by their names.
        key: String,
        /// What was found and what was expected.
        problem: String,
        /// What to do about it.
        help: String,
    },
}

/// Faults gathered so that a person can mend them all at once.
#[derive(Default)]
pub(super) struct Faults(Vec<SiteError>);

impl Faults {
    /// The value of a result; its fault is kept.
    pub(super) fn keep<T>(&mut self, result: Result<T, SiteError>) -> Option<T> {
        result.map_err(|fault| self.0.push(fault)).ok()
    }

    /// Adds several.
    pub(super) fn add(&mut self, faults: impl IntoIterator<Item = SiteError>) {
        self.0.extend(faults);
    }

    /// How many.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// What was gathered, in the file's order.
    pub(super) fn into_error(mut self) -> Option<SiteError> {
        let line = |fault: &SiteError| match fault {
            SiteError::Fault { line, column, .. } => (*line, *column),
            SiteError::Unreadable { .. } | SiteError::Several(_) => (0, 0),
        };
        self.0.sort_by_key(line);
        match self.0.len() {
            0 | 1 => self.0.pop(),
            _ => Some(SiteError::Several(self.0)),
        }
    }
}

/// A site file's text, for telling where things are.
pub(super) struct Source<'a> {
    pub(super) path: &'a Path,
    pub(super) text: &'a str,
}

impl Source<'_> {
    /// A fault at a place in the text.
    pub(super) fn fault(&self, at: Range<usize>, problem: impl Into<String>, help: impl Into<String>) -> SiteError {
        let key = self.key_at(at.start).unwrap_or_else(|| "site file".to_owned());
        self.fault_of(key, at, problem.into(), help.into())
    }

    fn fault_of(&self, key: String, at: Range<usize>, problem: String, help: String) -> SiteError {
        let (line, column) = self.line_and_column(at.start);
        SiteError::Fault { path: self.path.to_owned(), line, column, key, problem, help }
    }

    /// What the file lacks as a whole.
    pub(super) fn without_model(&self) -> SiteError {
        let help = "Add a line [model], and below it path = \"…\"";
        self.fault_of("site file".to_owned(), 0..0, "the table `model` is missing".to_owned(), help.to_owned())
    }

    /// A parser's error in a person's words.
    pub(super) fn parse_fault(&self, error: &toml::de::Error) -> SiteError {
        let at = error.span().unwrap_or(0..0);
        let (problem, help) = explain(error.message());
        let (problem, help) = match help == NOT_TOML {
            true => untangled(&problem, self.text, at.start).unwrap_or((problem, help)),
            false => (problem, help),
        };
        self.fault(at, problem, help)
    }

    fn line_and_column(&self, offset: usize) -> (usize, usize) {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        let before = String::from_utf8_lossy(before);
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
    }

    /// The dotted key whose name or value stands at a place in the text.
    fn key_at(&self, offset: usize) -> Option<String> {
        let (tree, _) = DeTable::parse_recoverable(self.text);
        let mut best = None;
        search_table(tree.get_ref(), "", offset, &mut best);
        best.map(|(_, key)| key)
    }
}

/// The smallest key or value around `offset` so far: its length in bytes and its dotted name.
type Best = Option<(usize, String)>;

fn search_table(table: &DeTable, prefix: &str, offset: usize, best: &mut Best) {
    for (key, value) in table {
        let name = if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        offer(key.span(), &name, offset, best);
        search_value(value, &name, offset, best);
    }
}

fn search_value(value: &Spanned<DeValue>, name: &str, offset: usize, best: &mut Best) {
    offer(value.span(), name, offset, best);
    match value.get_ref() {
        DeValue::Table(table) => search_table(table, name, offset, best),
        DeValue::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                let title = item.get_ref().get("name").and_then(|n| n.get_ref().as_str());
                let name = match (item.get_ref().is_table(), title) {
                    (true, Some(title)) => format!("{name}.{title}"),
                    (true, None) => format!("{name}.#{}", i + 1),
                    (false, _) => name.to_owned(),
                };
                search_value(item, &name, offset, best);
            }
        }
        _ => {}
    }
}

fn offer(span: Range<usize>, name: &str, offset: usize, best: &mut Best) {
    let smaller = best.as_ref().is_none_or(|(length, _)| span.len() <= *length);
    if span.contains(&offset) && smaller {
        *best = Some((span.len(), name.to_owned()));
    }
}

/// What to do where the parser cannot go on.
const NOT_TOML: &str = "Correct the file so that it is valid TOML";

/// Problem and cure of what people often write, by the parser's message and the text where it stopped.
fn untangled(message: &str, text: &str, offset: usize) -> Option<(String, String)> {
    const COMMA: &str = "Put a comma between the two";
    let told = |problem: &str, help: &str| Some((problem.to_owned(), help.to_owned()));
    if message.contains("escape") || message.contains("unicode") {
        let help = "Write / between folders, or put the path in single quotes";
        return told("in double quotes \\ begins a special character", help);
    }
    if message.starts_with("missing comma") {
        return told("a comma is missing before this", COMMA);
    }
    if message.starts_with("string values must be quoted") {
        let bare = text.get(offset..).unwrap_or("").split([',', ']', '}', '#', '\n']).next().unwrap_or("").trim();
        let words: Vec<&str> = bare.split_whitespace().collect();
        let numbers = words.len() > 1 && words.iter().all(|word| word.parse::<f64>().is_ok());
        return match numbers {
            true => Some((format!("a comma is missing between {} and {}", words[0], words[1]), COMMA.to_owned())),
            false => Some((
                format!("expected a number or text in quotes, found {bare}"),
                "Put text in quotes; a number stands alone".to_owned(),
            )),
        };
    }
    if message.starts_with("unclosed") {
        return told(message, "Close it");
    }
    let help = "Decimals take a point, not a comma: write 1.6 for 1,6";
    torn_at_comma(text, offset).then(|| (message.to_owned(), help.to_owned()))
}

/// Whether digits, a comma and digits stand around a place in the text without a blank.
fn torn_at_comma(text: &str, offset: usize) -> bool {
    let bytes = text.as_bytes();
    let part = |b: &u8| b.is_ascii_digit() || *b == b',';
    let offset = offset.min(bytes.len());
    let before = bytes[..offset].iter().rev().take_while(|b| part(b)).count();
    let after = bytes[offset..].iter().take_while(|b| part(b)).count();
    let digits: Vec<_> = bytes[offset - before..offset + after].split(|b| *b == b',').collect();
    digits.windows(2).any(|sides| sides.iter().all(|side| !side.is_empty()))
}

/// The parser's message as problem and cure.
fn explain(message: &str) -> (String, String) {
    if let Some((problem, cure)) = message.split_once(CURE) {
        return (problem.to_owned(), cure.to_owned());
    }
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let first_line = message.lines().next().unwrap_or(message);
    if let ["unknown", kind @ ("field" | "variant"), ..] = first_line.split(' ').collect::<Vec<_>>()[..]
        && let [unknown, known @ ..] = &quoted[..]
    {
        let kind = if kind == "field" { "key" } else { "value" };
        let list = known.join(", ");
        let help = match nearest(unknown, known) {
            Some(near) => format!("Did you mean `{near}`? Known here: {list}"),
            None => format!("Known here: {list}"),
        };
        return (format!("unknown {kind} `{unknown}`"), help);
    }
    if let Some(field) = first_line.strip_prefix("missing field ") {
        return (format!("the key {field} is missing"), format!("Add {field} to this table"));
    }
    if let Some((found, expected)) = first_line.split_once(", expected ")
        && let Some(found) =
            ["invalid type: ", "invalid value: ", "invalid "].iter().find_map(|p| found.strip_prefix(p))
    {
        return (format!("expected {}, found {found}", plain(expected)), "Correct the value".to_owned());
    }
    (first_line.to_owned(), NOT_TOML.to_owned())
}

/// Rust's names of types, for people.
fn plain(expected: &str) -> String {
    match expected {
        "f64" => "a number".to_owned(),
        "u32" => "a whole number, zero or greater".to_owned(),
        "a string" => "text in quotes".to_owned(),
        "a sequence" => "a list in brackets".to_owned(),
        _ if expected.starts_with("struct ") => "a table".to_owned(),
        _ => expected.to_owned(),
    }
}

/// The known word that differs least from `word`, where one is near.
pub(crate) fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let limit = (word.chars().count() / 3).max(2);
    known.iter().map(|k| (distance(word, k), *k)).filter(|(d, _)| *d <= limit).min_by_key(|(d, _)| *d).map(|(_, k)| k)
}

/// Levenshtein's edit distance.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
