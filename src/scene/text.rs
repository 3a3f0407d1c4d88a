//! Text of model files, which older programs write in Latin-1.

use std::borrow::Cow;

/// UTF-8, else Latin-1, so that names stay apart.
pub(super) fn of(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().copied().map(char::from).collect()),
    }
}

/// A whole file's text, each line for itself, without a byte order mark and with LF in place of CR LF and CR.
pub(super) fn lines(bytes: &[u8]) -> String {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut text = String::with_capacity(bytes.len() + 1);
    for line in bytes.split(|b| *b == b'\n') {
        for part in line.strip_suffix(b"\r").unwrap_or(line).split(|b| *b == b'\r') {
            text.push_str(&of(part));
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    #[test]
    fn lines_are_utf_8_or_latin_1_with_any_end() {
        assert_eq!(super::lines(b"\xef\xbb\xbfT\xc3\xbcr\r\nT\xf6r\rend"), "T\u{fc}r\nT\u{f6}r\nend\n");
        assert_eq!(super::lines(b"a\r\n\r\nb").lines().count(), 3);
    }
}
