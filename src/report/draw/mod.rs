//! What sheets are drawn with: SVG and its styles, pictures and PDF of it, title blocks, axes.

pub(super) mod a3;
pub(super) mod imprint;
pub(super) mod lengths;
pub(super) mod loglog;
pub(super) mod pdf;
pub(super) mod png;
pub mod style;
pub(super) mod svg;
#[cfg(test)]
mod tests;
