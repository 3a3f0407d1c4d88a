//! One fault is one finding, whichever views show it; what right models give as often is a doubt.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use crate::audit::decide::assess::note;
use crate::audit::decide::assessed::{Assessed, Eye, Found};
use crate::audit::decide::background::Background;
use crate::audit::decide::false_alarms::{Field, expected_squares};
use crate::audit::decide::label;
use crate::audit::decide::lines_of_sight::are_one_thing;
use crate::audit::decide::odds::{self, OUTLINE};
use crate::audit::decide::scores;
use crate::audit::finding::{Audit, AuditedView, Finding, Kind, Method, What};
use crate::audit::hypothesis::laying::retextured;
use crate::audit::picture::regions::{MOST_PX, at_most, components, mask_of};
use crate::audit::picture::{FEWEST, ODDS, POSE_PX};
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
                let (log_odds, evidence) = OUTLINE.weigh([*odds]);
                (f.log_odds, f.finding.evidence) = (log_odds.max(f.log_odds), evidence);
            }
            if let Some(squares) = squares {
                odds::learn(&mut f.finding, &mut f.log_odds, squares);
            }
        }
    }
    let right_elsewhere = found_right_elsewhere(assessed);
    for (a, shares) in assessed.iter_mut().zip(right_elsewhere) {
        for (f, share) in a.found.iter_mut().zip(shares) {
            odds::found_right(&mut f.finding, &mut f.log_odds, share);
        }
    }
    for (test, usual, share) in odds::BACKGROUND {
        set_against_background(assessed, test, usual, share);
    }
    for a in assessed {
        for f in &mut a.found {
            f.finding.score = odds::told(f.log_odds);
            f.finding.false_alarms = Some(odds::false_alarms(f.log_odds));
            f.finding.reason = odds::reason(f.log_odds, settings.false_alarms);
        }
        // what is too unlikely to be told by itself may be a part of what is
        a.found.retain(|f| odds::probability(f.log_odds) >= settings.least_probability);
        let told = a.found.iter().map(|f| (&f.pixels[..], f.log_odds));
        a.view.suspicion = scores::suspicion(&a.own, a.eye.camera.width as usize, told, settings.least_probability);
        let AuditedView { verdicts, reasons, suspicion, .. } = &mut a.view;
        label::unmark_suspected(verdicts, reasons, suspicion, settings.least_probability);
        a.found = with_whole_things(std::mem::take(&mut a.found), &a.eye);
        a.found.iter_mut().for_each(|f| f.finding.note = note(&f.finding));
        let told = a.found.iter().filter(|f| f.finding.score >= settings.least_probability);
        let (findings, doubts): (Vec<_>, Vec<_>) = told.partition(|f| f.finding.is_sure());
        for f in doubts.into_iter().chain(findings) {
            label::mark(&mut a.view.verdicts, &mut a.view.reasons, &f.pixels, f.finding.kind, f.finding.reason);
        }
        a.view.count();
    }
}

/// The share of each region of each view whose surfaces some other view finds right: a fault is there in all photographs, but not what mirrors,
/// glares or is blurred in one.
fn found_right_elsewhere(assessed: &[Assessed]) -> Vec<Vec<f32>> {
    let right: Vec<Vec<bool>> = assessed.iter().map(Assessed::right).collect();
    let of_view = |(v, own): (usize, &Assessed)| -> Vec<f32> {
        let is_right = |i: &usize| {
            let mut others = (0..assessed.len()).filter(|u| *u != v);
            others.any(|u| own.eye.shows_inside(*i, &assessed[u].eye, &right[u]))
        };
        let share = |f: &Found| {
            let asked: Vec<usize> = at_most(&f.pixels, MOST_PX).collect();
            asked.iter().filter(|i| is_right(i)).count() as f32 / asked.len().max(1) as f32
        };
        own.found.par_iter().map(share).collect()
    };
    assessed.iter().enumerate().map(of_view).collect()
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

/// What a view shows of things that the model lacks, a finding each: parts that are no farther apart in the photograph than the windows
/// that they were told over are of one.
fn with_whole_things(found: Vec<Found>, eye: &Eye) -> Vec<Found> {
    let is_thing = |f: &Found| f.finding.what == What::Missing && f.finding.is_sure();
    let (mut parts, mut all): (Vec<Found>, Vec<Found>) = found.into_iter().partition(is_thing);
    let pixels: Vec<usize> = parts.iter().flat_map(|f| f.pixels.iter().copied()).collect();
    let near = eye.near(&pixels);
    let mut place = vec![0; near.len()];
    for (k, region) in components(&near, &near, eye.camera.width as usize, 1, |_, _| true).iter().enumerate() {
        region.pixels.iter().for_each(|i| place[*i] = k);
    }
    parts.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    let mut things: BTreeMap<usize, Found> = BTreeMap::new();
    for part in parts {
        match things.entry(place[part.pixels[0]]) {
            Entry::Vacant(entry) => _ = entry.insert(part),
            Entry::Occupied(entry) => entry.into_mut().join(part, eye),
        }
    }
    all.extend(things.into_values());
    all
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
        // a large doubt is no part of a small finding beside its middle
        let doubt_of_finding = a.is_sure() && !b.is_sure();
        let size_m = if doubt_of_finding { a.size_m.min(b.size_m) } else { a.size_m.max(b.size_m) };
        (a.kind == b.kind || shifted) && one_plane && a.material == b.material && apart < 0.6 * size_m
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
        self.finding.is_sure() && self.finding.what != What::Missing
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
            let pixels: Vec<usize> =
                (0..shown.len()).filter(|i| shown[*i] && view.reasons[*i] != Reason::Masked).collect();
            if pixels.len() >= FEWEST {
                self.mark(w, view, pixels);
            }
        }
    }
}

/// The doubts that no fault explains: one fault shows in several regions, so that a doubt of its kind, most of which is no farther from it than
/// the windows that both were told over, is a part of it.
fn unexplained(faults: &mut [Fault], doubts: Vec<Fault>, assessed: &mut [Assessed]) -> Vec<Fault> {
    let near = |(v, pixels): (&usize, &Vec<usize>)| (*v, assessed[*v].eye.near(pixels));
    let places: Vec<BTreeMap<usize, Vec<bool>>> = faults.iter().map(|f| f.shown.iter().map(near).collect()).collect();
    let mut left = Vec::new();
    for doubt in doubts {
        let own = &doubt.shown[&doubt.view];
        let within = |place: &Vec<bool>| 2 * own.iter().filter(|i| place[**i]).count() > own.len();
        let explains = |(fault, places): (&Fault, &BTreeMap<usize, Vec<bool>>)| {
            fault.finding.kind == doubt.finding.kind && places.get(&doubt.view).is_some_and(within)
        };
        match faults.iter().zip(&places).position(explains) {
            Some(k) => doubt.shown.into_iter().for_each(|(v, pixels)| faults[k].mark(v, &mut assessed[v].view, pixels)),
            None => left.push(doubt),
        }
    }
    left
}

/// What all views show, a fault each: what one view doubts is a part of what another is sure of.
fn faults(assessed: &mut [Assessed], metres_per_unit: f64) -> Vec<Fault> {
    let mut all: Vec<(usize, Found)> = Vec::new();
    for (v, a) in assessed.iter_mut().enumerate() {
        all.extend(std::mem::take(&mut a.found).into_iter().map(|f| (v, f)));
    }
    all.sort_by(|(v, a), (u, b)| {
        let (a, b) = (&a.finding, &b.finding);
        by_texture(a).cmp(&by_texture(b)).then_with(|| surest((*v, a), (*u, b)))
    });
    let mut faults: Vec<Fault> = Vec::new();
    for (v, f) in all {
        let doubted = !f.finding.is_sure();
        let same = |k: &&mut Fault| {
            let eyes = (&assessed[k.view].eye, &assessed[v].eye);
            k.view != v
                && (k.finding.is_sure() || doubted)
                && (k.is_also(&f, metres_per_unit) || k.is_thing(&f, eyes.0, eyes.1))
        };
        match faults.iter_mut().find(same) {
            Some(fault) => {
                let k = &mut fault.finding;
                k.area_cm2 = k.area_cm2.max(f.finding.area_cm2);
                k.false_alarms = k.false_alarms.zip(f.finding.false_alarms).map(|(a, b)| a.min(b));
                if fault.finding.is_sure() {
                    fault.mark(v, &mut assessed[v].view, f.pixels);
                } else {
                    fault.show(v, &f.finding.view, f.pixels);
                }
            }
            None => {
                let shown = BTreeMap::from([(v, f.pixels.clone())]);
                faults.push(Fault { view: v, finding: f.finding, pixels: f.pixels, normal: f.normal, shown });
            }
        }
    }
    faults
}

/// The surest first; ties by view and place, so that the order is always the same.
fn surest((v, a): (usize, &Finding), (u, b): (usize, &Finding)) -> Ordering {
    b.score.total_cmp(&a.score).then(v.cmp(&u)).then(a.bbox.cmp(&b.bbox))
}

/// Merges what several views show of one fault, numbers findings and doubts, and names their masks.
pub(crate) fn gathered(site: &Site, lighting: &str, settings: &Settings, mut assessed: Vec<Assessed>) -> Audit {
    let mut faults = faults(&mut assessed, site.frame.metres_per_unit);
    faults.iter_mut().filter(|f| f.of_modelled_surfaces()).for_each(|f| f.mark_elsewhere(&mut assessed));
    let (mut faults, doubts): (Vec<Fault>, _) = faults.into_iter().partition(|fault| fault.finding.is_sure());
    let left = unexplained(&mut faults, doubts, &mut assessed);
    faults.extend(left.into_iter().filter(|doubt| doubt.finding.score >= settings.least_probability));
    faults.sort_by(|a, b| surest((a.view, &a.finding), (b.view, &b.finding)));
    let (mut findings, mut doubts) = (Vec::new(), Vec::new());
    for Fault { view: best, finding: mut f, shown, .. } in faults {
        (f.bbox, f.area_px) = assessed[best].view.in_photograph(&shown[&best]);
        let sure = f.is_sure();
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
        ("displacement_pixels", POSE_PX),
        ("sensitivity", label::SENSITIVITY),
        ("structure_log_odds", ODDS),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::testing;
    use crate::audit::verdict::Verdict;
    use crate::site::{Camera, Pose};

    const SIDE: usize = 160;

    /// An eye before a wall 4 m off, 5 cm a pixel.
    fn eye() -> Eye {
        let camera = Camera::with_fov(Pose::look_at(DVec3::ZERO, DVec3::Y), SIDE as u32, SIDE as u32, 90.0);
        let position = |i: usize| Vec3::new(0.05 * (i % SIDE) as f32, 4.0, 0.05 * (i / SIDE) as f32);
        let position = (0..SIDE * SIDE).map(position).collect();
        Eye { camera, origin: DVec3::ZERO, position, distance: vec![4.0; SIDE * SIDE] }
    }

    /// An eye that shows in each pixel what is there: a wall 4 m off.
    fn looking() -> Eye {
        let eye = eye();
        let at = |i: usize| {
            let d = eye.camera.direction((i % SIDE) as f64 + 0.5, (i / SIDE) as f64 + 0.5);
            (d * (4.0 / d.y)).as_vec3()
        };
        let position: Vec<Vec3> = (0..SIDE * SIDE).map(at).collect();
        let distance = position.iter().map(|p| p.length()).collect();
        Eye { position, distance, ..eye }
    }

    /// Ten by twenty pixels.
    fn part(what: What, reason: Reason, log_odds: f32, left: usize) -> Found {
        Found {
            finding: Finding { what, reason, position: [left as f64, 0.0, 0.0], ..testing::finding("", "v") },
            pixels: (20..40).flat_map(|y| (left..left + 10).map(move |x| y * SIDE + x)).collect(),
            normal: Vec3::NEG_Y,
            log_odds,
            part: None,
        }
    }

    #[test]
    fn doubts_beside_a_fault_are_parts_of_it() {
        let fault = |Found { finding, pixels, normal, .. }: Found| {
            let shown = BTreeMap::from([(0, pixels.clone())]);
            Fault { view: 0, finding, pixels, normal, shown }
        };
        let view = testing::view(testing::summary("v", [SIDE as u32; 2]));
        let field = Field::new(SIDE, vec![0.0; SIDE * SIDE]);
        let mut assessed = [Assessed { view, field, own: vec![], eye: eye(), found: vec![] }];
        let mut faults = [fault(part(What::Moved, Reason::None, 3.0, 60))];
        let mut doubts = [30, 44, 80, 90].map(|left| fault(part(What::Missing, Reason::Usual, -1.0, left)));
        doubts[2].finding.kind = Kind::Texture;
        let left = unexplained(&mut faults, doubts.into(), &mut assessed);
        assert_eq!(left.iter().map(|d| d.pixels[0] % SIDE).collect::<Vec<_>>(), [30, 80, 90]);
        assert_eq!(faults[0].shown[&0].len(), 400);
        let verdict = |x: usize| assessed[0].view.verdicts[30 * SIDE + x];
        assert_eq!((verdict(46), verdict(30)), (Verdict::Geometry, Verdict::Ok));
    }

    #[test]
    fn what_one_view_doubts_is_a_part_of_what_another_is_sure_of() {
        let of_view = |name: &str, found: Vec<Found>| Assessed {
            view: testing::view(testing::summary(name, [SIDE as u32; 2])),
            field: Field::new(SIDE, vec![0.0; SIDE * SIDE]),
            own: vec![],
            eye: eye(),
            found,
        };
        let at = |reason: Reason, log_odds: f32, left: usize, x: f64| {
            let mut part = part(What::Moved, reason, log_odds, left);
            (part.finding.position, part.finding.score) = ([x, 0.0, 0.0], odds::probability(log_odds));
            part
        };
        let sure = vec![at(Reason::None, 3.0, 60, 1.0)];
        let mut large = at(Reason::Usual, -1.0, 10, 1.5);
        large.finding.size_m = 3.0;
        let doubts = vec![at(Reason::Usual, -1.0, 70, 1.1), large];
        let mut assessed = [of_view("a", sure), of_view("b", doubts)];
        let all = faults(&mut assessed, 1.0);
        assert_eq!(all.iter().map(|f| f.finding.is_sure()).collect::<Vec<_>>(), [true, false]);
        assert_eq!((&all[0].finding.also_in[..], all[0].shown.len()), (&["b".to_owned()][..], 2));
        let verdict = |x: usize| assessed[1].view.verdicts[30 * SIDE + x];
        assert_eq!((verdict(75), verdict(15)), (Verdict::Geometry, Verdict::Ok));
    }

    #[test]
    fn what_another_view_finds_right_is_no_fault_there() {
        let of_view = |found: Vec<Found>| Assessed {
            view: testing::view(testing::summary("v", [SIDE as u32; 2])),
            field: Field::new(SIDE, vec![0.0; SIDE * SIDE]),
            own: vec![],
            eye: looking(),
            found,
        };
        let told = |left| part(What::Recoloured, Reason::None, 1.0, left);
        let mut views = [of_view(vec![told(60), told(100)]), of_view(vec![told(65)])];
        // half of a place is told in both views, all of another in one
        assert_eq!(found_right_elsewhere(&views), [vec![0.5, 1.0], vec![0.5]]);
        // what was not tested, or is seen in no other view, is not found right
        views[1].view.verdicts.fill(Verdict::Untestable);
        assert_eq!(found_right_elsewhere(&views), [vec![0.0, 0.0], vec![0.5]]);
        assert_eq!(found_right_elsewhere(&views[..1]), [vec![0.0, 0.0]]);
    }

    #[test]
    fn near_parts_of_what_the_model_lacks_are_one_finding() {
        let eye = eye();
        let (lacks, sure) = (What::Missing, Reason::None);
        let alone = vec![
            part(What::Moved, sure, 5.0, 10),
            part(lacks, Reason::Usual, -1.0, 40),
            part(lacks, sure, 2.0, 10),
            part(lacks, sure, 1.0, 120),
        ];
        let lefts = |found: &[Found]| -> Vec<usize> { found.iter().map(|f| f.pixels[0] % SIDE).collect() };
        assert_eq!(lefts(&with_whole_things(alone, &eye)), [10, 40, 10, 120]);
        let parts = vec![part(lacks, sure, 2.0, 10), part(lacks, sure, 3.0, 40), part(lacks, sure, 1.0, 120)];
        let things = with_whole_things(parts, &eye);
        assert_eq!((lefts(&things), things[0].pixels.len()), (vec![10, 120], 400));
        let Found { finding, log_odds, .. } = &things[0];
        assert_eq!((*log_odds, finding.position[0], finding.area_cm2), (3.0, 25.0, 1800.0));
        assert!((finding.size_m - 39.0 * 0.05).abs() < 1e-3, "{}", finding.size_m);
    }
}
