//! Writing the sheets of a whole audit.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::sheet::audit_sheet;
use super::subject::AuditSheet;
use crate::audit::{Audit, sheet_stem};
use crate::panorama::Exif;
use crate::report::{ReportError, fingerprints, write_sheet};
use crate::scene::Scene;
use crate::site::Site;

/// Writes `audit-<view>.svg`, `.png` and `.pdf` of each view of an audit, with today's date (UTC). `command` is the command
/// line.
///
/// # Errors
///
/// An input that cannot be read again for its fingerprint, or a sheet that cannot be drawn or written.
pub fn write_audit_sheets(
    site: &Site,
    scene: &Scene,
    audit: &Audit,
    command: &str,
    folder: &Path,
) -> Result<(), ReportError> {
    let now = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
    let audited = now.split('T').next().unwrap_or_default(); // YYYY-MM-DD
    let home = site.file.parent().unwrap_or(Path::new(""));
    let shared = fingerprints(&shared_inputs(site, audit), home)?;
    for (index, audited_view) in audit.views.iter().enumerate() {
        let name = &audited_view.summary.view;
        let Some(view) = site.views.iter().find(|v| v.name == *name) else { continue };
        let own: Vec<PathBuf> = view.photo.iter().chain(&view.mask).cloned().collect();
        let surveyed = view.photo.as_deref().map(Exif::read).and_then(|e| e.taken).unwrap_or_default();
        let mut inputs = fingerprints(&own, home)?;
        inputs.extend(shared.iter().cloned());
        let about = AuditSheet { site, scene, audit, index, surveyed: &surveyed, audited, command, inputs: &inputs };
        write_sheet(&audit_sheet(&about), folder, &sheet_stem(name))?;
    }
    Ok(())
}

/// The files that every sheet rests on: site, model, and the probes of the lighting.
fn shared_inputs(site: &Site, audit: &Audit) -> Vec<PathBuf> {
    let lighting = &audit.method.lighting;
    let probes = site.probes.iter().filter_map(|p| p.pictures.iter().find(|l| l.lighting == *lighting));
    let mut files = vec![site.file.clone(), site.model.clone()];
    files.extend(probes.map(|l| l.path.clone()));
    files
}
