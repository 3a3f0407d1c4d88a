//! Whether pictures were taken where the site file says.

use super::{Cause, CauseKind};
use crate::register::{self, Misfit, RegisterError, Settings};
use crate::scene::Scene;
use crate::site::Site;

/// Names each probe's and view's picture that does not fit the model from where the site file has it.
pub(super) fn causes(site: &Site, scene: &Scene) -> Result<Vec<Cause>, RegisterError> {
    if site.probes.iter().all(|p| p.pictures.is_empty()) && site.views.iter().all(|v| v.photo.is_none()) {
        return Ok(Vec::new());
    }
    let misfits = register::misfits(site, scene, &Settings::default())?;
    Ok(misfits
        .into_iter()
        .map(|(subject, misfit)| Cause {
            kind: match misfit {
                Misfit::Mirrored | Misfit::UpsideDown | Misfit::TakenAt(_) => CauseKind::Picture,
                Misfit::Turned(_) | Misfit::Displaced(..) | Misfit::Nowhere => CauseKind::Pose,
            },
            subject: subject.key(site),
            sentence: misfit.sentence(),
        })
        .collect())
}
