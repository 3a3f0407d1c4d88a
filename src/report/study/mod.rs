//! The study of error against run time: its sheet and its table.

mod sheet;
mod table;
mod write;

pub use write::write_study;
pub(super) use write::{columns, study_rows};
