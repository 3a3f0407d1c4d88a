//! Text from files, such as names of materials, made safe for a terminal.

use std::borrow::Cow;
use std::io::{self, Write};

/// Text in which characters that steer a terminal or turn the direction of writing are written as `\u001b`: they can be
/// seen, do nothing, and inside JSON mean the same as before.
pub(crate) fn visible(text: &str) -> Cow<'_, str> {
    let steers =
        |c: char| c.is_control() && c != '\n' || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    text.chars().map(|c| if steers(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() }).collect()
}

/// Passes on what is written to it, made [`visible`]. Characters must come whole.
pub(crate) struct Visible<W: Write>(pub(crate) W);

impl<W: Write> Write for Visible<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write_all(visible(&String::from_utf8_lossy(bytes)).as_bytes())?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn nothing_steers_the_terminal_and_json_means_the_same() {
        let name = "gold\u{1b}]0;owned\u{7}\r\u{9b}2J\u{7f}\u{202e}ö";
        let mut out = Visible(Vec::new());
        writeln!(out, "{name}").unwrap();
        serde_json::to_writer(&mut out, &name).unwrap();
        let text = String::from_utf8(out.0).unwrap();
        let (words, json) = text.split_once('\n').unwrap();
        assert_eq!(words, "gold\\u001b]0;owned\\u0007\\u000d\\u009b2J\\u007f\\u202eö");
        assert!(!json.contains(|c: char| c.is_control()));
        assert_eq!(serde_json::from_str::<String>(json).unwrap(), name);
    }
}
