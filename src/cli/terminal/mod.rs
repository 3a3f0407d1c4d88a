//! What verbs share: where output goes, progress, and text made safe for a terminal.

pub(crate) mod command;
pub(crate) mod model;
pub(crate) mod number;
pub(crate) mod output;
mod progress;
pub(crate) mod visible;
