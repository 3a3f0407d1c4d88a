//! An audit in words: the headline, the method, and how the photograph was fitted.

use super::subject::{AuditSheet, listed};
use crate::audit::{Displacement, Finding, Reason, ViewSummary, What};

const REASONS: [Reason; 10] = [
    Reason::Clipped,
    Reason::Dark,
    Reason::Masked,
    Reason::NoSurface,
    Reason::Unseen,
    Reason::NoParallax,
    Reason::NoTexture,
    Reason::BlackAlbedo,
    Reason::Grazing,
    Reason::Usual,
];

/// How a finding is named in a headline.
fn short(f: &Finding) -> String {
    let on = if f.material.is_empty() { " a surface".to_owned() } else { format!(" “{}”", f.material) };
    let what = match f.what {
        What::Rotated => format!("texture of{on} turned"),
        What::Mirrored => format!("texture of{on} mirrored"),
        What::Shifted => format!("texture of{on} shifted"),
        What::Scaled => format!("texture of{on} of another scale"),
        What::Recoloured => format!("colour of{on} wrong"),
        What::Changed => format!("another picture on{on}"),
        What::Missing => format!("something at{on} not modelled"),
        What::Extra => format!("modelled{on} that is not there"),
        What::Moved => format!("surface{on} off its place"),
    };
    // how far something stands off is not how large the fault is, but for a surface off its place
    let by = match &f.displacement {
        Some(d) if f.what == What::Moved => format!(" by {}", centimetres(d)),
        _ => String::new(),
    };
    format!("{} {what}{by} ({}, {:.0} % sure)", f.id, area(f.area_cm2), 100.0 * f.score)
}

/// A displacement's size with its uncertainty.
pub(super) fn centimetres(d: &Displacement) -> String {
    format!("{:.1} ± {:.1} cm", 100.0 * d.metres.abs(), 100.0 * d.uncertainty_m)
}

/// The one sentence that matters most.
pub(super) fn headline(about: &AuditSheet) -> String {
    let s = &about.view().summary;
    let untestable = format!("{:.0} %", 100.0 * s.shares.untestable);
    let found: Vec<&Finding> = listed(about).into_iter().map(|(f, _)| f).filter(|f| f.id.starts_with('F')).collect();
    if found.is_empty() {
        let tested = 100.0 * (1.0 - s.shares.untestable);
        return format!(
            "No fault found in the {tested:.0} % of the picture that could be tested. {untestable} could not be tested{}.",
            reasons(s, 1).first().map_or(String::new(), |r| format!(", mostly because {r}"))
        );
    }
    let count = if found.len() == 1 { "1 fault".to_owned() } else { format!("{} faults", found.len()) };
    let named = found.iter().take(3).map(|f| short(f)).collect::<Vec<_>>().join("; ");
    let more = if found.len() > 3 { "; and others" } else { "" };
    format!("{count}: {named}{more}. {untestable} of the picture could not be tested.")
}

/// Why pixels are untestable or ambiguous, the commonest first, with their share.
pub(super) fn reasons(s: &ViewSummary, most: usize) -> Vec<String> {
    let mut all: Vec<(&String, f64)> = s.reasons.iter().map(|(r, share)| (r, *share)).collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(b.0)));
    let named = |(name, share): &(&String, f64)| {
        let reason = REASONS.iter().find(|r| r.name() == *name).map_or(name.as_str(), |r| r.words());
        format!("{reason} ({:.0} %)", 100.0 * share)
    };
    all.iter().filter(|(_, share)| *share >= 0.005).take(most).map(named).collect()
}

/// How the photograph was brought to the probes' light and the camera to the model; what the audit rests on.
pub(super) fn fitted(s: &ViewSummary) -> Vec<String> {
    let pose = if s.pose.refined {
        format!(
            "Camera pose corrected by {:.2} ± {:.2} pixels in the mean (at most {:.2}): turned by {:.3}°, moved by {:.1} cm.",
            s.pose.mean_px,
            s.pose.residual_px,
            s.pose.max_px,
            s.pose.rotation_deg,
            100.0 * s.pose.translation_m
        )
    } else {
        "Camera pose taken as given.".to_owned()
    };
    let [r, g, b] = s.white_balance;
    let mut lines = vec![
        pose,
        format!(
            "Photograph {} stops to the probes' exposure, white balance × {r:.2}, {g:.2}, {b:.2}, corners {} stops; \
             its noise {:.1} %{}.",
            signed(s.exposure_ev),
            signed(s.vignetting_ev),
            100.0 * s.noise,
            if s.reduced_by > 1 { format!("; {0} × {0} pixels averaged to one", s.reduced_by) } else { String::new() }
        ),
    ];
    for p in &s.probes {
        let differs =
            p.difference.map_or(String::new(), |d| format!(", differs from the photograph by {:.1} %", 100.0 * d));
        lines.push(format!(
            "Probe {}: gain {} stops, sees {:.0} %{differs}.",
            p.probe,
            signed(p.gain_ev),
            100.0 * p.sees
        ));
    }
    lines
}

/// With two decimals and a sign, but zero without a minus.
fn signed(x: f64) -> String {
    format!("{:+.2}", (100.0 * x).round() / 100.0 + 0.0)
}

/// What the two tests are, and what no test can tell.
pub(super) const METHOD: &str = "Geometry: what each probe saw of a surface, carried into the camera, is compared with \
    the photograph, in units of what most of this photograph differs by; then the surface is moved, left out or goes on \
    over an opening. \
    Texture: the photograph over the model's albedo under smoothed light. Light that a smooth surface may mirror is no \
    difference. A surface moved by a whole period of its pattern, and everything recoloured at once, are not found.";

/// Square centimetres as people say them.
pub(super) fn area(cm2: f64) -> String {
    if cm2 >= 5e3 { format!("{:.1} m²", cm2 * 1e-4) } else { format!("{cm2:.0} cm²") }
}
