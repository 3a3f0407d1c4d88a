//! Writing the sheets of a whole audit.

use sha2::{Digest, Sha256};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use super::{AuditSheet, audit_sheet};
use crate::audit::Audit;
use crate::panorama::Exif;
use crate::report::{ReportError, write_sheet};
use crate::scene::Scene;
use crate::site::Site;

/// Writes `audit-<view>.svg` and `.png` of each view of an audit, with today's date (UTC); gives the files. `command` is
/// the command line.
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
) -> Result<Vec<PathBuf>, ReportError> {
    let mut files = Vec::new();
    let audited = today();
    let shared = fingerprints(site, shared_inputs(site, audit))?;
    for (index, audited_view) in audit.views.iter().enumerate() {
        let name = &audited_view.summary.view;
        let Some(view) = site.views.iter().find(|v| v.name == *name) else { continue };
        let own: Vec<PathBuf> = view.photo.iter().chain(&view.mask).cloned().collect();
        let surveyed = view.photo.as_deref().map(Exif::read).and_then(|e| e.taken).unwrap_or_default();
        let mut inputs = fingerprints(site, own)?;
        inputs.extend(shared.iter().cloned());
        let about =
            AuditSheet { site, scene, audit, index, surveyed: &surveyed, audited: &audited, command, inputs: &inputs };
        files.extend(write_sheet(&audit_sheet(&about), folder, &format!("audit-{name}"))?);
    }
    Ok(files)
}

/// The files that every sheet rests on: site, model, and the probes of the lighting.
fn shared_inputs(site: &Site, audit: &Audit) -> Vec<PathBuf> {
    let lighting = &audit.method.lighting;
    let probes = site.probes.iter().filter_map(|p| p.pictures.iter().find(|l| l.lighting == *lighting));
    let mut files = vec![site.file.clone(), site.model.clone()];
    files.extend(probes.map(|l| l.path.clone()));
    files
}

/// Names from the site's folder, and SHA-256 in hexadecimal digits.
fn fingerprints(site: &Site, files: Vec<PathBuf>) -> Result<Vec<(String, String)>, ReportError> {
    let folder = site.file.parent().unwrap_or(Path::new(""));
    let one = |path: PathBuf| {
        let inside = path.strip_prefix(folder).unwrap_or(&path).display().to_string();
        let hash = sha256(&path).map_err(|source| ReportError::Io { path: path.clone(), source })?;
        Ok((inside, hash))
    };
    files.into_iter().map(one).collect()
}

fn sha256(path: &Path) -> std::io::Result<String> {
    let (mut file, mut hash, mut buffer) = (std::fs::File::open(path)?, Sha256::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect()),
            n => hash.update(&buffer[..n]),
        }
    }
}

/// Today's date in UTC, `YYYY-MM-DD`.
fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let [year, month, day] = civil((seconds / 86_400) as i64);
    format!("{year:04}-{month:02}-{day:02}")
}

/// Year, month and day of a day since 1970-01-01 (Hinnant, *chrono-Compatible Low-Level Date Algorithms*, 2013).
fn civil(days: i64) -> [i64; 3] {
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let doe = z.rem_euclid(146_097);
    let yoe = (doe - doe / 1460 + doe / 36_524 - doe / 146_096) / 365;
    let doy = doe - (365 * yoe + yoe / 4 - yoe / 100);
    let mp = (5 * doy + 2) / 153;
    let day = doy - (153 * mp + 2) / 5 + 1;
    let month = if mp < 10 { mp + 3 } else { mp - 9 };
    [yoe + era * 400 + i64::from(month <= 2), month, day]
}

#[cfg(test)]
mod tests {
    use super::civil;

    #[test]
    fn days_are_dates() {
        assert_eq!(
            [civil(0), civil(59), civil(19_782), civil(11_016)],
            [[1970, 1, 1], [1970, 3, 1], [2024, 2, 29], [2000, 2, 29]]
        );
    }
}
