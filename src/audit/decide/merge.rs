//! One fault is one finding, whichever views show it; what right models give as often is a doubt.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

use crate::audit::decide::assess::note;
use crate::audit::decide::assessed::{Assessed, Found};
use crate::audit::decide::decision;
use crate::audit::decide::false_alarms::{Field, false_alarms};
use crate::audit::decide::judged::By;
use crate::audit::decide::label;
use crate::audit::decide::scores;
use crate::audit::finding::{Audit, Evidence, Finding, Kind, Method, What};
use crate::audit::hypothesis::retextured;
use crate::audit::verdict::{Reason, Verdict};
use crate::audit::view::Settings;
use crate::site::Site;

/// Expected false alarms at which a finding is as likely false as true.
const EVEN: f64 = 0.1;

/// Says of each finding how often a right model would give one like it; what it would give more often than asked for is a doubt.
pub(crate) fn count_false_alarms(assessed: &mut [Assessed], allowed: f64) {
    let fields: Vec<&Field> = assessed.iter().map(|a| &a.field).collect();
    let expected = |view: usize, f: &Found| match f.by {
        By::Figure(log_odds) => Some(decision::false_alarms(log_odds)),
        By::Structure => false_alarms(&fields, view, &f.pixels),
        By::Fit => None,
    };
    let alarms: Vec<Vec<Option<f64>>> =
        assessed.iter().enumerate().map(|(v, a)| a.found.par_iter().map(|f| expected(v, f)).collect()).collect();
    for (a, alarms) in assessed.iter_mut().zip(alarms) {
        for (f, alarm) in a.found.iter_mut().zip(alarms) {
            let Some(expected) = alarm else { continue };
            f.finding.false_alarms = alarm;
            if f.by == By::Structure {
                f.finding.score = f.finding.score.min(1.0 / (1.0 + expected / EVEN));
            }
            f.finding.evidence.push(Evidence::new("expected false alarms", expected, allowed, "a photograph"));
            if expected > allowed && f.finding.reason == Reason::None {
                f.finding.reason = Reason::Usual;
                f.finding.note = note(&f.finding);
            }
        }
        let sure = |f: &&Found| f.finding.reason == Reason::None;
        for f in a.found.iter().filter(|f| f.finding.reason == Reason::Usual) {
            for i in (0..f.mask.len()).filter(|i| f.mask[*i]) {
                if !a.found.iter().filter(sure).any(|s| s.mask[i]) {
                    (a.view.verdicts[i], a.view.reasons[i]) = (Verdict::Ambiguous, Reason::Usual);
                }
            }
        }
        a.view.count();
    }
}

/// One fault with all views that show it.
struct Fault {
    /// The view that shows it best.
    view: usize,
    finding: Finding,
    normal: Vec3,
    /// Its mask in each view that shows it.
    masks: BTreeMap<usize, Vec<bool>>,
}

impl Fault {
    /// Whether another view's finding is of the same place.
    fn is_also(&self, other: &Found, metres: f64) -> bool {
        let (a, b) = (&self.finding, &other.finding);
        let apart = DVec3::from(a.position).distance(DVec3::from(b.position)) * metres;
        let shifted = by_texture(b) && a.what == What::Shifted;
        // a picture is on one plane; a thing has several sides
        let one_plane = a.kind == Kind::Geometry || self.normal.dot(other.normal) > 0.9;
        (a.kind == b.kind || shifted)
            && one_plane
            && (a.reason == Reason::None) == (b.reason == Reason::None)
            && a.material == b.material
            && apart < 0.6 * a.size_m.max(b.size_m)
    }
}

/// Merges what several views show of one fault, numbers findings and doubts, and names their masks.
pub(crate) fn gathered(site: &Site, lighting: &str, settings: &Settings, mut assessed: Vec<Assessed>) -> Audit {
    let mut all: Vec<(usize, Found)> = Vec::new();
    for (v, a) in assessed.iter_mut().enumerate() {
        all.extend(std::mem::take(&mut a.found).into_iter().map(|f| (v, f)));
    }
    // the surest first; ties by view and place, so that the order is always the same
    let surest = |(v, a): (usize, &Finding), (u, b): (usize, &Finding)| {
        b.score.total_cmp(&a.score).then(v.cmp(&u)).then(a.bbox.cmp(&b.bbox))
    };
    all.sort_by(|(v, a), (u, b)| {
        let (a, b) = (&a.finding, &b.finding);
        by_texture(a).cmp(&by_texture(b)).then_with(|| surest((*v, a), (*u, b)))
    });
    let mut faults: Vec<Fault> = Vec::new();
    for (v, f) in all {
        let metres = site.frame.metres_per_unit;
        match faults.iter_mut().find(|k| k.view != v && k.is_also(&f, metres)) {
            Some(fault) => {
                let k = &mut fault.finding;
                if k.kind != f.finding.kind {
                    assessed[v].view.call_texture(&f.mask);
                }
                k.area_cm2 = k.area_cm2.max(f.finding.area_cm2);
                k.false_alarms = k.false_alarms.zip(f.finding.false_alarms).map(|(a, b)| a.min(b));
                if !k.also_in.contains(&f.finding.view) {
                    k.also_in.push(f.finding.view);
                }
                let mask = fault.masks.entry(v).or_insert_with(|| vec![false; f.mask.len()]);
                mask.iter_mut().zip(&f.mask).for_each(|(all, here)| *all |= here);
            }
            None => {
                let masks = BTreeMap::from([(v, f.mask)]);
                faults.push(Fault { view: v, finding: f.finding, normal: f.normal, masks });
            }
        }
    }
    faults.sort_by(|a, b| surest((a.view, &a.finding), (b.view, &b.finding)));
    let (mut findings, mut doubts) = (Vec::new(), Vec::new());
    for Fault { finding: mut f, masks, .. } in faults {
        let sure = f.reason == Reason::None;
        let list = if sure { &mut findings } else { &mut doubts };
        f.id = format!("{}{}", if sure { "F" } else { "D" }, list.len() + 1);
        for (v, mask) in masks {
            let view = &mut assessed[v].view;
            let file = format!("mask-{}-{}.png", view.summary.view, f.id);
            f.masks.insert(view.summary.view.clone(), file);
            view.masks.push((f.id.clone(), mask));
        }
        f.mask = f.masks[&f.view].clone();
        list.push(f);
    }
    let thresholds = [
        ("geometry_mismatch_variances", scores::MISMATCH),
        ("displacement_pixels", scores::PIXELS_OFF),
        ("sensitivity", label::SENSITIVITY),
        ("structure_log_odds", scores::ODDS),
        ("colour_delta_e00", scores::COLOUR),
        ("false_alarms_a_photograph", settings.false_alarms as f32),
    ];
    let method = Method {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        lighting: lighting.to_owned(),
        thresholds: thresholds.map(|(n, v)| (n.to_owned(), (f64::from(v) * 1e4).round() / 1e4)).into(),
    };
    let views = assessed.into_iter().map(|a| a.view).collect();
    Audit { findings, doubts, views, method, warnings: site.warnings.clone() }
}

/// Whether a surface is told to be off its place by where its texture lies. In one photograph a shifted texture may look the
/// same; where another view tells that it is shifted, it is.
fn by_texture(f: &Finding) -> bool {
    f.what == What::Moved && f.evidence.iter().any(|e| e.test == retextured::EVIDENCE)
}
