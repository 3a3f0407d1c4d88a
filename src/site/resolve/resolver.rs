//! What all tables are checked with.

use std::path::PathBuf;
use toml::Spanned;

use crate::site::fault::{SiteError, Source};
use crate::site::frame::Frame;
use crate::site::site::{Pictures, Places};

/// What every table is resolved against.
pub(super) struct Resolver<'a> {
    pub(super) source: Source<'a>,
    pub(super) folder: PathBuf,
    pub(super) frame: Frame,
    pub(super) pictures: Pictures,
    pub(super) places: Places,
}

impl Resolver<'_> {
    pub(super) fn field_of_view(&self, fov: &Spanned<f64>) -> Result<f64, SiteError> {
        self.number(fov, |v| v > 0.0 && v < 180.0, "a field of view between 0 and 180 degrees")
    }

    pub(super) fn number(
        &self,
        key: &Spanned<f64>,
        ok: impl Fn(f64) -> bool,
        expected: &str,
    ) -> Result<f64, SiteError> {
        let v = *key.get_ref();
        if v.is_finite() && ok(v) {
            return Ok(v);
        }
        Err(self.source.fault(key.span(), format!("expected {expected}, found {v}"), "Correct the number"))
    }
}
