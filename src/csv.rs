//! Tables as CSV (RFC 4180), safe to open in a spreadsheet.
//!
//! ```
//! use clerestory::csv::Table;
//!
//! let mut table = Table::new(["view", "note"]);
//! table.row(["apse", "=1+1"]);
//! let text = table.finish();
//! assert_eq!(text, "view,note\napse,'=1+1\n");
//! ```

use std::borrow::Cow;

/// The text of a table: one line a row, cells quoted where they need it, [defused](inert) all of them.
#[derive(Debug)]
pub struct Table(::csv::Writer<Vec<u8>>);

impl Table {
    /// A table with these columns.
    pub fn new<'a>(columns: impl IntoIterator<Item = &'a str>) -> Self {
        let mut table = Self(::csv::WriterBuilder::new().flexible(true).from_writer(Vec::new()));
        table.row(columns);
        table
    }

    /// Adds a row.
    pub fn row<S: AsRef<str>>(&mut self, cells: impl IntoIterator<Item = S>) {
        // memory takes everything, and rows may differ in length
        let _ = self.0.write_record(cells.into_iter().map(|cell| inert(cell.as_ref()).into_owned()));
    }

    /// The text, with `\n` at the end of each line.
    pub fn finish(self) -> String {
        String::from_utf8(self.0.into_inner().unwrap_or_default()).unwrap_or_default()
    }
}

/// A cell that no spreadsheet takes for a formula: one that begins with `=`, `+`, `-`, `@`, a tab or a carriage return
/// and is no number gets an apostrophe before it (OWASP, *CSV Injection*).
pub fn inert(cell: &str) -> Cow<'_, str> {
    if cell.starts_with(['=', '+', '-', '@', '\t', '\r']) && cell.parse::<f64>().is_err() {
        Cow::Owned(format!("'{cell}"))
    } else {
        Cow::Borrowed(cell)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_formula_becomes_text_and_a_number_stays_one() {
        for formula in ["=1+1", "+A1", "-A1", "@SUM(A1)", "\t=1", "\r=1", "-1+cmd|' /C calc'!A0"] {
            assert_eq!(inert(formula), format!("'{formula}"));
        }
        for harmless in ["-1.5", "+3", "-1e-9", "", "a=b", "P-1", "ö"] {
            assert_eq!(inert(harmless), harmless);
        }
    }

    #[test]
    fn cells_are_quoted_and_defused() {
        let mut table = Table::new(["name", "note"]);
        table.row(["a, b", "says “\"x\"”\nand goes on"]);
        table.row(["=cmd()", "-2.5"]);
        let text = table.finish();
        assert_eq!(text, "name,note\n\"a, b\",\"says “\"\"x\"\"”\nand goes on\"\n'=cmd(),-2.5\n");
    }
}
