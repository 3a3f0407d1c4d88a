//! An OBJ file's statements: continued lines joined, any bytes decoded, lines counted so that an error can name one.

use std::io::{self, BufRead, BufReader, Read};

/// Longer lines are not text.
const LONGEST_LINE: usize = 64 << 20;

/// Why reading stopped.
pub(super) enum Fault {
    /// The file could not be read.
    Io(io::Error),
    /// The file is of another kind.
    NotObj(String),
    /// The current statement makes no sense.
    Line(String),
}

/// A file, statement by statement.
pub(super) struct Statements<R> {
    lines: Lines<R>,
    text: String,
    /// The first line of the current statement, from 1.
    pub(super) line: usize,
}

impl<R: Read> Statements<R> {
    pub(super) fn new(file: R) -> Self {
        let bytes = BufReader::with_capacity(1 << 18, file);
        let lines = Lines { bytes, number: 0, line: Vec::new(), after_cr: false };
        Self { lines, text: String::new(), line: 0 }
    }

    /// One line, or several that end in `\`; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<&str>, Fault> {
        self.text.clear();
        if !self.lines.next()? {
            return Ok(None);
        }
        self.line = self.lines.number;
        if self.line == 1 {
            self.look_at_first_line()?;
        }
        loop {
            let line = String::from_utf8_lossy(&self.lines.line);
            let continued = line.trim_end().strip_suffix('\\');
            self.text.push_str(continued.unwrap_or(&line));
            if continued.is_none() || !self.lines.next()? {
                return Ok(Some(self.text.trim_start()));
            }
            self.text.push(' ');
        }
    }

    /// Tells other kinds of file apart, so that the message can say what it is.
    fn look_at_first_line(&mut self) -> Result<(), Fault> {
        let line = &mut self.lines.line;
        if line.starts_with(b"\xef\xbb\xbf") {
            line.drain(..3);
        }
        let kinds: [(&[u8], &str); 6] = [
            (b"solid ", "an STL file"),
            (b"Kaydara FBX", "an FBX file"),
            (b"<?xml", "an XML file, such as COLLADA"),
            (b"PK\x03\x04", "a ZIP archive"),
            (b"\xff\xfe", "text in UTF-16, which has to be saved as UTF-8"),
            (b"\xfe\xff", "text in UTF-16, which has to be saved as UTF-8"),
        ];
        let kind = kinds.iter().find(|(magic, _)| line.starts_with(magic)).map(|(_, kind)| *kind);
        match kind.or(line.contains(&0).then_some("a binary file")) {
            Some(kind) => Err(Fault::NotObj(kind.to_owned())),
            None => Ok(()),
        }
    }
}

/// The start of a text, for a message.
pub(super) fn shorten(text: &str) -> String {
    let text = text.trim();
    let start: String = text.chars().take(60).collect();
    if start.len() < text.len() { start + "…" } else { start }
}

/// Lines that end in LF, CR LF or CR, counted.
struct Lines<R> {
    bytes: BufReader<R>,
    number: usize,
    line: Vec<u8>,
    after_cr: bool,
}

impl<R: Read> Lines<R> {
    /// Reads the next line into `line`, without its end; `false` at the end of the file.
    fn next(&mut self) -> Result<bool, Fault> {
        self.line.clear();
        let mut begun = false;
        loop {
            let ready = self.bytes.fill_buf().map_err(Fault::Io)?;
            if ready.is_empty() {
                self.number += usize::from(begun);
                return Ok(begun);
            }
            if std::mem::take(&mut self.after_cr) && ready[0] == b'\n' {
                self.bytes.consume(1);
                continue;
            }
            begun = true;
            let end = ready.iter().position(|b| matches!(b, b'\n' | b'\r'));
            self.line.extend_from_slice(&ready[..end.unwrap_or(ready.len())]);
            if self.line.len() > LONGEST_LINE {
                return Err(Fault::NotObj("a line of more than 64 MiB".to_owned()));
            }
            match end {
                Some(end) => {
                    self.after_cr = ready[end] == b'\r';
                    self.bytes.consume(end + 1);
                    self.number += 1;
                    return Ok(true);
                }
                None => {
                    let n = ready.len();
                    self.bytes.consume(n);
                }
            }
        }
    }
}
