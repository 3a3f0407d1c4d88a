//! The audit sheet: what is wrong with the model as one photograph shows it, where, how large and how sure.

mod key_plan;
mod labels;
mod outline;
mod pictures;
mod sheet;
mod subject;
mod table;
mod words;
mod write;

#[cfg(test)]
mod tests;

pub use pictures::marked;
pub(super) use pictures::{png as picture_png, reduced};
pub use write::write_audit_sheets;
