//! One fault is one finding, whichever views show it; what right models give as often is a doubt.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

use crate::audit::decide::assess::note;
use crate::audit::decide::assessed::{Assessed, Eye, Found};
use crate::audit::decide::background::Background;
use crate::audit::decide::false_alarms::{Field, expected_squares};
use crate::audit::decide::label;
use crate::audit::decide::lines_of_sight::{are_one_thing, support};
use crate::audit::decide::odds::{self, OUTLINE};
use crate::audit::decide::scores;
use crate::audit::finding::{Audit, AuditedView, Finding, Kind, Method, What};
use crate::audit::hypothesis::retextured;
use crate::audit::picture::FEWEST;
use crate::audit::picture::regions::mask_of;
use crate::audit::verdict::Reason;
use crate::audit::view::Settings;
use crate::site::Site;

/// Says of each region how likely it is a fault and how often a right model would give one like it; what it would give more often
/// than asked for is a doubt, and what is less likely than asked for is left out.
pub(crate) fn weigh(assessed: &mut [Assessed], settings: &Settings) {
    let fields: Vec<(&Field, &[Vec3])> = assessed.iter().map(|a| (&a.field, &a.eye.position[..])).collect();
    let squares = |v: usize, f: &Found| {
        let squares = (f.finding.kind == Kind::Texture).then(|| expected_squares(&fields, v, &f.pixels));
        squares.flatten().map(|n| n.max(1e-9).ln() as f32)
    };
    let squares: Vec<Vec<_>> =
        assessed.iter().enumerate().map(|(v, a)| a.found.par_iter().map(|f| squares(v, f)).collect()).collect();
    let outlines = outlines(assessed);
    for (a, squares) in assessed.iter_mut().zip(squares) {
        for (f, squares) in a.found.iter_mut().zip(squares) {
            if let Some(odds) = f.part.and_then(|(part, _)| outlines.get(&part)) {
                (f.log_odds, f.finding.evidence) = OUTLINE.weigh([*odds]);
            }
            if let Some(squares) = squares {
                odds::learn(&mut f.finding, &mut f.log_odds, squares);
            }
        }
    }
    for (test, usual, share) in odds::BACKGROUND {
        set_against_background(assessed, test, usual, share);
    }
    let supports = support(assessed);
    for (a, supports) in assessed.iter_mut().zip(supports) {
        for (f, support) in a.found.iter_mut().zip(supports) {
            if let Some(support) = support {
                odds::times(&mut f.finding, &mut f.log_odds, support.times);
                if support.is_theirs {
                    (f.finding.kind, f.finding.what) = (Kind::Geometry, What::Missing);
                }
            }
            f.finding.score = odds::probability(f.log_odds);
            f.finding.false_alarms = Some(odds::false_alarms(f.log_odds));
            f.finding.reason = odds::reason(f.log_odds, settings.false_alarms);
            f.finding.note = note(&f.finding);
        }
        a.found.retain(|f| f.finding.score >= settings.least_probability);
        let (findings, doubts): (Vec<_>, Vec<_>) = a.found.iter().partition(|f| f.finding.reason == Reason::None);
        for f in doubts.into_iter().chain(findings) {
            label::mark(&mut a.view.verdicts, &mut a.view.reasons, &f.pixels, f.finding.kind, f.finding.reason);
        }
        a.view.count();
    }
}

/// Sets each region that a test tells against how often others like it turn up in these photographs.
fn set_against_background(assessed: &mut [Assessed], test: &str, usual: f64, share: f32) {
    let photographs = assessed.len();
    let found = assessed.iter_mut().flat_map(|a| &mut a.found);
    let mut told: Vec<&mut Found> =
        found.filter(|f| f.finding.evidence.first().is_some_and(|e| e.test == test)).collect();
    let log_odds: Vec<f32> = told.iter().map(|f| f.log_odds).collect();
    let least = Settings::default().least_probability;
    for (f, background) in told.iter_mut().zip(Background::estimated(&log_odds, photographs, usual, least)) {
        let (says, evidence) = background.says(share);
        f.log_odds += says;
        f.finding.evidence.push(evidence);
    }
}

/// Logarithm of the odds that all photographs together give against a part's place, by its number: each sees it from elsewhere.
fn outlines(assessed: &[Assessed]) -> BTreeMap<u32, f32> {
    let mut sums = BTreeMap::new();
    for (part, odds) in assessed.iter().flat_map(|a| &a.found).filter_map(|f| f.part) {
        *sums.entry(part).or_default() += odds;
    }
    sums
}

/// One fault with all views that show it.
struct Fault {
    /// The view that shows it best.
    view: usize,
    finding: Finding,
    /// Its pixels in that view as that view alone tells them.
    pixels: Vec<usize>,
    normal: Vec3,
    /// Its pixels in each view that shows it, in order.
    shown: BTreeMap<usize, Vec<usize>>,
}

impl Fault {
    /// Whether another view's finding is of the same place.
    fn is_also(&self, other: &Found, metres: f64) -> bool {
        let (a, b) = (&self.finding, &other.finding);
        let apart = DVec3::from(a.position).distance(DVec3::from(b.position)) * metres;
        let shifted = by_texture(b) && a.what == What::Shifted;
        // a picture is on one plane; a thing has several sides
        let one_plane = a.kind == Kind::Geometry || self.normal.dot(other.normal) > 0.9;
        (a.kind == b.kind || shifted) && one_plane && a.material == b.material && apart < 0.6 * a.size_m.max(b.size_m)
    }

    /// Whether another view's finding is of the same thing that the model lacks: it hides other surfaces there.
    fn is_thing(&self, other: &Found, own_eye: &Eye, eye: &Eye) -> bool {
        let (a, b) = (&self.finding, &other.finding);
        (a.what, b.what) == (What::Missing, What::Missing)
            && are_one_thing((own_eye, &self.pixels), (eye, &other.pixels))
    }

    /// Whether it is a fault of surfaces that the model has: those are wrong in whichever view shows them. What the model lacks stands
    /// before or behind its surfaces, elsewhere in each view.
    fn of_modelled_surfaces(&self) -> bool {
        self.finding.reason == Reason::None && self.finding.what != What::Missing
    }

    /// Whether a doubt of its kind lies mostly within it.
    fn explains(&self, doubt: &Self) -> bool {
        let (Some(own), Some(theirs)) = (self.shown.get(&doubt.view), doubt.shown.get(&doubt.view)) else {
            return false;
        };
        let within = theirs.iter().filter(|i| own.binary_search(i).is_ok()).count();
        self.finding.kind == doubt.finding.kind && 2 * within > theirs.len()
    }

    /// Adds what a view shows of it.
    fn show(&mut self, v: usize, view: &str, pixels: Vec<usize>) {
        if view != self.finding.view && !self.finding.also_in.iter().any(|v| v == view) {
            self.finding.also_in.push(view.to_owned());
        }
        let all = self.shown.entry(v).or_default();
        all.extend(pixels);
        all.sort_unstable();
        all.dedup();
    }

    /// The same, in the view's verdicts, too.
    fn mark(&mut self, v: usize, view: &mut AuditedView, pixels: Vec<usize>) {
        label::mark(&mut view.verdicts, &mut view.reasons, &pixels, self.finding.kind, Reason::None);
        view.count();
        self.show(v, &view.summary.view, pixels);
    }

    /// Marks it in the views that show its surfaces and found nothing there by themselves.
    fn mark_elsewhere(&mut self, assessed: &mut [Assessed]) {
        let others: Vec<usize> = (0..assessed.len()).filter(|w| !self.shown.contains_key(w)).collect();
        for w in others {
            let shown = assessed[w].eye.showing(&assessed[self.view].eye, &self.pixels);
            let view = &mut assessed[w].view;
            let usable = |i: usize| !matches!(view.reasons[i], Reason::Clipped | Reason::Dark | Reason::Masked);
            let pixels: Vec<usize> = (0..shown.len()).filter(|i| usable(*i) && shown[*i]).collect();
            if pixels.len() >= FEWEST {
                self.mark(w, view, pixels);
            }
        }
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
        let eye = |v: usize| &assessed[v].eye;
        let as_sure = |k: &Fault| (k.finding.reason == Reason::None) == (f.finding.reason == Reason::None);
        let same = |k: &&mut Fault| {
            k.view != v && as_sure(k) && (k.is_also(&f, metres) || k.is_thing(&f, eye(k.view), eye(v)))
        };
        match faults.iter_mut().find(same) {
            Some(fault) => {
                let k = &mut fault.finding;
                if k.kind != f.finding.kind {
                    assessed[v].view.call_texture(&f.pixels);
                }
                k.area_cm2 = k.area_cm2.max(f.finding.area_cm2);
                k.false_alarms = k.false_alarms.zip(f.finding.false_alarms).map(|(a, b)| a.min(b));
                fault.show(v, &f.finding.view, f.pixels);
            }
            None => {
                let shown = BTreeMap::from([(v, f.pixels.clone())]);
                faults.push(Fault { view: v, finding: f.finding, pixels: f.pixels, normal: f.normal, shown });
            }
        }
    }
    faults.iter_mut().filter(|f| f.of_modelled_surfaces()).for_each(|f| f.mark_elsewhere(&mut assessed));
    let (mut faults, doubts): (Vec<Fault>, _) = faults.into_iter().partition(|f| f.finding.reason == Reason::None);
    let mut left = Vec::new();
    for doubt in doubts {
        match faults.iter_mut().find(|f| f.explains(&doubt)) {
            Some(fault) => doubt.shown.into_iter().for_each(|(v, pixels)| fault.mark(v, &mut assessed[v].view, pixels)),
            None => left.push(doubt),
        }
    }
    faults.append(&mut left);
    faults.sort_by(|a, b| surest((a.view, &a.finding), (b.view, &b.finding)));
    let (mut findings, mut doubts) = (Vec::new(), Vec::new());
    for Fault { view: best, finding: mut f, shown, .. } in faults {
        (f.bbox, f.area_px) = assessed[best].view.in_photograph(&shown[&best]);
        let sure = f.reason == Reason::None;
        let list = if sure { &mut findings } else { &mut doubts };
        f.id = format!("{}{}", if sure { "F" } else { "D" }, list.len() + 1);
        for (v, pixels) in shown {
            let view = &mut assessed[v].view;
            let file = format!("mask-{}-{}.png", view.summary.view, f.id);
            f.masks.insert(view.summary.view.clone(), file);
            view.masks.push((f.id.clone(), mask_of(&pixels, view.verdicts.len())));
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
