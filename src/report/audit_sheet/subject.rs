//! What a sheet is about, and how what is found is drawn.

use crate::audit::{Audit, AuditedView, Finding, Kind, Reason, Verdict};
use crate::report::Fingerprint;
use crate::report::style::{BLACK, BLUE, GREY, Hatch, Pattern, VERMILION, WHITE, YELLOW};
use crate::scene::Scene;
use crate::site::Site;

/// What an audit sheet is made from.
#[derive(Clone, Copy)]
pub(super) struct AuditSheet<'a> {
    /// The site that was audited.
    pub(super) site: &'a Site,
    /// Its model.
    pub(super) scene: &'a Scene,
    /// The audit.
    pub(super) audit: &'a Audit,
    /// Which of the audit's views the sheet is about.
    pub(super) index: usize,
    /// When the photograph was taken, as its camera says; empty where that is not known.
    pub(super) surveyed: &'a str,
    /// When the audit was made.
    pub(super) audited: &'a str,
    /// The command line.
    pub(super) command: &'a str,
    /// Files the audit rests on.
    pub(super) inputs: &'a [Fingerprint],
}

impl AuditSheet<'_> {
    pub(super) fn view(&self) -> &AuditedView {
        &self.audit.views[self.index]
    }
}

/// The findings of a view, then its doubts, the surest first; and whether this view is the one that shows them best.
pub(super) fn listed<'a>(about: &AuditSheet<'a>) -> Vec<(&'a Finding, bool)> {
    let name = &about.audit.views[about.index].summary.view;
    let all = about.audit.findings.iter().chain(&about.audit.doubts);
    all.filter(|f| f.view == *name || f.also_in.contains(name)).map(|f| (f, f.view == *name)).collect()
}

/// How a verdict is drawn: wash, its opacity, and hatch; what agrees is left as it is.
pub(super) fn look(verdict: Verdict) -> Option<(&'static str, f64, Hatch)> {
    let hatch = |pattern, colour, spacing, weight| Hatch { pattern, colour, spacing, weight };
    match verdict {
        Verdict::Ok => None,
        Verdict::Geometry => Some((VERMILION, 0.35, hatch(Pattern::Lines(45), VERMILION, 1.5, 0.5))),
        Verdict::Texture => Some((BLUE, 0.25, hatch(Pattern::Cross(45), BLUE, 1.6, 0.35))),
        Verdict::Ambiguous => Some((YELLOW, 0.4, hatch(Pattern::Dots, BLACK, 1.4, 0.18))),
        Verdict::Untestable => Some((WHITE, 0.45, hatch(Pattern::Lines(0), GREY, 1.0, 0.18))),
    }
}

/// What a finding, or a doubt, says of its pixels.
pub(super) fn verdict_of(finding: &Finding) -> Verdict {
    match (finding.reason, finding.kind) {
        (Reason::None, Kind::Geometry) => Verdict::Geometry,
        (Reason::None, Kind::Texture) => Verdict::Texture,
        _ => Verdict::Ambiguous,
    }
}

/// The colour of a finding's outline.
pub(super) fn look_of(finding: &Finding) -> &'static str {
    match verdict_of(finding) {
        Verdict::Geometry => VERMILION,
        Verdict::Texture => BLUE,
        _ => BLACK,
    }
}
