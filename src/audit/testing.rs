//! Audits for tests.

use glam::Vec3;
use std::collections::BTreeMap;

use super::{
    Audit, AuditedView, Displacement, Finding, Kind, Method, PoseCorrection, Reason, Shares, Verdict, ViewSummary, What,
};
use crate::panorama::Picture;

/// A surface off its place, as a view of this name shows it.
pub(crate) fn finding(id: &str, view: &str) -> Finding {
    let mask = format!("mask-{view}-{id}.png");
    Finding {
        id: id.into(),
        view: view.into(),
        also_in: vec![],
        kind: Kind::Geometry,
        what: What::Moved,
        score: 0.9,
        bbox: [0, 1, 3, 3],
        area_px: 2,
        masks: BTreeMap::from([(view.to_owned(), mask.clone())]),
        mask,
        false_alarms: None,
        position: [5.0, 4.0, 1.0],
        size_m: 0.4,
        area_cm2: 900.0,
        material: "stone & lime".into(),
        displacement: Some(Displacement { metres: -0.102, uncertainty_m: 0.011 }),
        shift: None,
        reason: Reason::None,
        evidence: vec![],
        note: "the surface is off its place".into(),
    }
}

/// A view of this name and size that nothing is said of.
pub(crate) fn summary(view: &str, size: [u32; 2]) -> ViewSummary {
    ViewSummary {
        view: view.into(),
        photo: format!("{view}.jpg"),
        size,
        reduced_by: 1,
        exposure_ev: 0.5,
        white_balance: [1.0; 3],
        vignetting_ev: 0.1,
        noise: 0.012,
        pose: PoseCorrection::default(),
        probes: vec![],
        shares: Shares::default(),
        reasons: BTreeMap::new(),
        warnings: vec![],
    }
}

/// A view whose pictures are of one grey and whose pixels are all right.
pub(crate) fn view(summary: ViewSummary) -> AuditedView {
    let grey = |[width, height]: [u32; 2]| {
        let (width, height) = (width as usize, height as usize);
        Picture { width, height, pixels: vec![Vec3::splat(0.3); width * height] }
    };
    let map = grey(summary.size.map(|side| side.div_ceil(summary.reduced_by)));
    let pixels = map.pixels.len();
    AuditedView {
        photograph: grey(summary.size),
        summary,
        render: map.clone(),
        neutral: map,
        verdicts: vec![Verdict::Ok; pixels],
        reasons: vec![Reason::None; pixels],
        suspicion: vec![],
        masks: vec![],
    }
}

/// An audit of one view without doubts.
pub(crate) fn audit(view: AuditedView, findings: Vec<Finding>) -> Audit {
    let thresholds = BTreeMap::from([("geometry_mismatch".to_owned(), 4.0)]);
    let method = Method { version: "0".into(), lighting: "10:00".into(), thresholds };
    Audit { findings, doubts: vec![], views: vec![view], method, warnings: vec![] }
}
