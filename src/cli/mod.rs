//! The command line: one file per verb; parses, calls the library and prints.

pub(crate) mod check;
pub(crate) mod simulate;
