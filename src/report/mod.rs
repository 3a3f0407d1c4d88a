//! Drawing: sheets in SVG and PNG, and the report's page with its manifest.
//!
//! A sheet is an [`Svg`] in millimetres, made by one function per kind of sheet from that stage's typed result; [`png()`]
//! draws a picture of it. What is computed elsewhere is only shown here.
//!
//! ```
//! use clerestory::report::{Svg, png};
//!
//! let sheet = Svg::new(60.0, 30.0, "A sheet", "Nothing is on it yet"); // millimetres
//! let picture = png(&sheet.finish(), 96.0)?;
//! assert!(picture.starts_with(b"\x89PNG"));
//! # Ok::<(), clerestory::report::ReportError>(())
//! ```

mod audit_sheet;
mod draw;
mod error;
mod files;
mod floors;
mod manifest;
mod markers;
mod overview;
pub mod page;
mod register_sheet;
mod rendered;
mod study;

pub use audit_sheet::{marked, write_audit_sheets};
pub(crate) use draw::imprint::SOFTWARE;
pub use draw::pdf::pdf;
pub use draw::png::{png, text_width, wrap};
pub use draw::style;
pub use draw::svg::{Anchor, Point, Svg, Text, escape};
pub use error::ReportError;
pub use files::{remove_earlier, write_file, write_json, write_sheet};
pub use floors::{gallery_sheet, write_plan};
pub use manifest::{Fingerprint, Manifest, Run, fingerprints};
pub use markers::write_markers;
pub use overview::{Overview, overview, overview_csv, overview_page};
pub use register_sheet::{RegisterSheet, register_sheet, register_stem, register_words};
pub use rendered::{BakedFrames, NotDone, Rendered, RenderedView, VideoTimes};
pub use study::write_study;
