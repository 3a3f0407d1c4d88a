//! Whether pictures were taken where the site file says.

use super::{Cause, CauseKind};
use crate::register::{self, Misfit, RegisterError, RegisterSettings, Subject, TRIPOD_TILT_DEG};
use crate::scene::Scene;
use crate::site::Site;

/// Names each probe's and view's picture that does not fit the model from where the site file has it, but for those whose
/// place is known to be wrong.
pub(super) fn causes(site: &Site, scene: &Scene, known: &[Cause]) -> Result<Vec<Cause>, RegisterError> {
    let probes = (0..site.probes.len()).filter(|&i| !site.probes[i].pictures.is_empty()).map(Subject::Probe);
    let views = (0..site.views.len()).filter(|&i| site.views[i].photo.is_some()).map(Subject::View);
    let placed = |s: &Subject| !known.iter().any(|c| c.kind == CauseKind::Place && c.subject == s.key(site));
    let only: Vec<String> = probes.chain(views).filter(placed).map(|s| s.name(site).to_owned()).collect();
    if only.is_empty() {
        return Ok(Vec::new());
    }
    let settings = RegisterSettings { only, tilt_deg: TRIPOD_TILT_DEG, ..RegisterSettings::default() };
    let misfits = register::misfits(site, scene, &settings)?;
    Ok(misfits
        .into_iter()
        // a view may share a probe's name
        .filter(|(subject, _)| placed(subject))
        .map(|(subject, misfit)| {
            let kind = match misfit {
                Misfit::Mirrored | Misfit::UpsideDown | Misfit::TakenAt(_) => CauseKind::Picture,
                Misfit::Turned(_) | Misfit::Displaced(..) | Misfit::Nowhere => CauseKind::Pose,
            };
            Cause::of(kind, subject.kind(), subject.name(site), &misfit.sentence())
        })
        .collect())
}
