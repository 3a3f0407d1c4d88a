//! Whole audits of sites whose pictures were made from another model than the one that is audited: several faults a
//! site, all its photographs, and the model as it is. What is counted is what a person would see: findings and their masks.

use clerestory::audit::{Audit, AuditedView, Finding, Kind, Reason, Settings, Verdict, audit};
use clerestory::scene::{Ray, Scene};
use clerestory::site::{Camera, View};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::Bench;
use crate::cases::Case;
use crate::fit::{self, Candidate};
use crate::measure::{average_precision, baselines, mean, median};
use crate::pictures;
use crate::plant::{Fault, plant};
use crate::truth::{astray, counted, true_place};

/// Fewer pixels of a fault than this in a photograph are not asked for.
const SHOWN_PX: usize = 150;

/// What the audits of one kind of case gave.
#[derive(Default)]
struct Tally {
    photographs: usize,
    asked: usize,
    found: usize,
    kind_right: usize,
    what_right: usize,
    false_findings: usize,
    precision: Vec<f64>,
    displacement: Vec<f64>,
    sign_right: usize,
    untestable: Vec<f64>,
    wrongly_ok: Vec<f64>,
    marked: Vec<f64>,
}

/// What an audit gave for a photograph that shows a fault.
struct Outcome {
    /// What the fault is planted in.
    of: Vec<String>,
    found: bool,
    /// Average precision of the audit, and of plain ways to compare pictures: difference, SSIM, FLIP.
    precision: [f64; 4],
}

/// What all audits gave.
#[derive(Default)]
struct Tallies {
    outcomes: Vec<Outcome>,
    rows: BTreeMap<String, Tally>,
    /// The probabilities of findings, and of doubts that are only too usual, and whether it was so.
    told: Vec<(f64, bool)>,
    /// Expected false alarms of all that was told of right models.
    alarms: Vec<f64>,
    /// All that was weighed, if it is to be written.
    candidates: Option<Vec<Candidate>>,
    /// Where to write pictures of what was found and what not.
    pictures: Option<PathBuf>,
}

/// Runs the benchmark on sites; `per` faults a site that show, of kinds that few photographs show so far, placed by the seed.
/// All that was weighed goes to `candidates`, pictures of what shows a fault to the folder `pictures`.
pub fn corpus(
    sites: &[String],
    per: usize,
    seed: u64,
    only: &dyn Fn(&str) -> bool,
    candidates: Option<&Path>,
    pictures: Option<PathBuf>,
) {
    let mut all = Tallies { candidates: candidates.map(|_| vec![]), pictures, ..Tallies::default() };
    for (number, path) in sites.iter().enumerate() {
        let bench = Bench::load(Path::new(path), 4096, 64);
        let folder = Path::new(path).parent().and_then(Path::file_name);
        let name = folder.map_or(path.clone(), |n| n.to_string_lossy().into_owned());
        let own = own_faults(&bench);
        if only("right") {
            run(&bench, &name, None, &bench.scene, &own, &mut all);
            all.write(candidates);
        }
        let mut cases = bench.cases(seed + number as u64, 1);
        cases.retain(|case| only(&case.fault.title()));
        let first = (seed as usize + number) % cases.len().max(1);
        cases.rotate_left(first);
        let mut planted = 0;
        while planted < per && !cases.is_empty() {
            let case = cases.remove(all.rarest(&cases));
            // two views may show one object best
            cases.retain(|c| c.object.is_none() || (c.fault, &c.object) != (case.fault, &case.object));
            let model = plant(&bench.scene, case.fault, &case.place, case.object.as_deref());
            planted += usize::from(run(&bench, &name, Some(&case), &model, &own, &mut all));
            all.write(candidates);
        }
    }
    let photographs = all.photographs();
    let Tallies { rows, told, alarms, outcomes, .. } = all;
    print(&rows, &told);
    print_outcomes(&outcomes);
    println!("\n| false alarms allowed | came, of {photographs} photographs of right models |\n|---|--:|");
    for allowed in [0.01, 0.1, 0.2, 0.3, 0.5, 1.0] {
        let came = alarms.iter().filter(|a| **a <= allowed).count();
        println!("| {allowed} | {:.3} |", came as f64 / photographs.max(1) as f64);
    }
}

impl Tallies {
    /// Photographs of right models.
    fn photographs(&self) -> usize {
        self.rows.get("right").map_or(0, |t| t.photographs)
    }

    /// The case whose kind, and then whose fault, the fewest photographs show so far; the first of several.
    fn rarest(&self, cases: &[Case]) -> usize {
        let kind = |fault: Fault| self.outcomes.iter().filter(|o| o.of.iter().any(|of| of == fault.kind())).count();
        let seen = |fault: Fault| (kind(fault), self.rows.get(&fault.title()).map_or(0, |t| t.asked));
        (0..cases.len()).min_by_key(|i| seen(cases[*i].fault)).unwrap_or(0)
    }

    /// Writes what was weighed so far.
    fn write(&self, file: Option<&Path>) {
        if let (Some(file), Some(all)) = (file, &self.candidates) {
            fit::write(file, self.photographs(), all);
        }
    }
}

/// What is wrong in a photograph.
struct Wrong {
    /// Where it shows, which is asked for.
    shown: Vec<bool>,
    /// All that the fault changes: what is found there is not false.
    changed: Vec<bool>,
}

impl Wrong {
    /// `own` is wrong with the model without a fault: what is found there is not false.
    fn of(bench: &Bench, case: Option<&Case>, model: &Scene, view: usize, own: &[bool]) -> Self {
        let Some(case) = case else { return Self { shown: vec![false; own.len()], changed: own.to_vec() } };
        let here = Case { fault: case.fault, place: case.place, object: case.object.clone(), view };
        let truth = bench.truth(model, &here);
        let changed = truth.wrong.iter().zip(&truth.alike).zip(own).map(|((w, a), o)| *w || *a || *o).collect();
        // nobody could see that a surface is off its place by less than a pixel; what is not there at all, anybody can
        let displaced = matches!(case.fault, Fault::Displace(_) | Fault::Move(_));
        let shown = if displaced && truth.is_fine() { vec![false; own.len()] } else { truth.wrong };
        Self { shown, changed }
    }
}

/// Per photograph, what the model has elsewhere than the place without any fault that was planted.
fn own_faults(bench: &Bench) -> Vec<Vec<bool>> {
    let place = true_place(&bench.site);
    let of = |(view, camera): (&View, &Camera)| {
        let taken_by = place.as_ref().and_then(|(site, scene)| {
            let same =
                |v: &&View| v.name == view.name && [v.camera.width, v.camera.height] == [camera.width, camera.height];
            Some((scene, &site.views.iter().find(same)?.camera))
        });
        let size = camera.width as usize * camera.height as usize;
        taken_by.map_or(vec![false; size], |(scene, taken_by)| astray(&bench.scene, camera, scene, taken_by))
    };
    bench.site.views.iter().zip(&bench.cameras).map(of).collect()
}

/// Audits a model and adds up what comes; false if no photograph shows its fault.
fn run(bench: &Bench, site: &str, case: Option<&Case>, model: &Scene, own: &[Vec<bool>], all: &mut Tallies) -> bool {
    let title = case.map_or("right".to_owned(), |c| c.fault.title());
    let truths: Vec<Wrong> =
        own.iter().enumerate().map(|(view, own)| Wrong::of(bench, case, model, view, own)).collect();
    if case.is_some() && truths.iter().all(|t| t.shown.iter().filter(|w| **w).count() < SHOWN_PX) {
        println!("# {site} {title}: does not show");
        return false;
    }
    let planted = case.map_or_else(Vec::new, |case| planted_in(bench, case));
    let lighting = bench.site.lightings()[0].clone();
    // of right models as much is told as makes one false alarm a photograph
    let usual = if case.is_none() { Settings::allowing(1.0) } else { Settings::default() };
    let least = if all.candidates.is_some() { fit::LEAST } else { usual.least_probability };
    // what is said of pixels is compared with the truth of the photograph's
    let settings = Settings { least_probability: least, longest_px: u32::MAX, ..Settings::default() };
    let begun = std::time::Instant::now();
    let audited = match audit(&bench.site, model, &lighting, &[], &settings, &|_, _, _| {}) {
        Ok(a) => a,
        Err(e) => {
            println!("# {site} {title}: {e}");
            return false;
        }
    };
    let seconds = begun.elapsed().as_secs_f64();
    let tally = all.rows.entry(title.clone()).or_default();
    let mut line = String::new();
    for (v, view) in audited.views.iter().enumerate() {
        let truth = &truths[v].shown;
        let (w, h) = (view.photograph.width, view.photograph.height);
        let size = truth.iter().filter(|t| **t).count();
        tally.photographs += 1;
        tally.untestable.push(view.summary.shares.untestable);
        let marked = view.verdicts.iter().filter(|v| matches!(v, Verdict::Texture | Verdict::Geometry)).count();
        tally.marked.push(marked as f64 / (w * h) as f64);
        let grown = grown(&truths[v].changed, w, h, 6);
        let masks: Vec<(&Finding, &Vec<bool>)> = view
            .masks
            .iter()
            .filter_map(|(id, mask)| Some((audited.findings.iter().find(|f| f.id == *id)?, mask)))
            .collect();
        let mut union = vec![false; w * h];
        let mut votes: BTreeMap<&str, usize> = BTreeMap::new();
        let mut whats: Vec<(usize, &Finding)> = vec![];
        for (f, mask) in &masks {
            let area = mask.iter().filter(|m| **m).count();
            if touches(mask, &grown) {
                (0..w * h).filter(|i| mask[*i]).for_each(|i| union[i] = true);
                *votes.entry(f.kind.name()).or_default() += area;
                whats.push((area, f));
                line += &format!("\n#     true in {}: {} {:.2} {} px", f.view, f.what.name(), f.score, area);
                line += &evidence(f);
            } else if f.view == view.summary.view {
                tally.false_findings += 1;
                line +=
                    &format!("\n#     false in {}: {} {:.2} {} px, {}", f.view, f.what.name(), f.score, area, f.note);
                line += &evidence(f);
            }
        }
        if size < SHOWN_PX {
            continue;
        }
        let Some(case) = case else { continue };
        tally.asked += 1;
        let both = (0..w * h).filter(|i| union[*i] && truth[*i]).count();
        // where nothing is to be seen of a fault, it is neither right nor wrong to mark it
        let alike = |i: usize| truths[v].changed[i] && !truth[i];
        let any = (0..w * h).filter(|i| (union[*i] && !alike(*i)) || truth[*i]).count().max(1);
        let found = both as f64 >= 0.3 * any as f64;
        let expected = if case.fault.is_texture() { Kind::Texture } else { Kind::Geometry };
        let most = votes.iter().max_by_key(|v| v.1).map(|v| *v.0);
        whats.sort_by_key(|w| w.0);
        let what = whats.last().map(|w| w.1);
        if found {
            tally.found += 1;
            tally.kind_right += usize::from(most == Some(expected.name()));
            tally.what_right += usize::from(what.is_some_and(|f| case.fault.names().contains(&f.what.name())));
            if let (Fault::Displace(d), Some(m)) = (case.fault, what.and_then(|f| f.displacement)) {
                tally.displacement.push((m.metres + f64::from(d)).abs() / f64::from(d.abs()));
                tally.sign_right += usize::from(m.metres * f64::from(d) < 0.0);
            }
        }
        if let Some(folder) = &all.pictures {
            let drawn = truth.iter().map(|t| if *t { 1.0 } else { 0.0 }).collect();
            let verdicts = pictures::verdicts(&view.verdicts);
            let tiles = [pictures::tone(&view.photograph), pictures::tone(&view.neutral), drawn, verdicts];
            let name = format!("{site}-{title}-{}.png", view.summary.view).replace(' ', "-");
            std::fs::create_dir_all(folder).unwrap();
            pictures::write(&folder.join(name), w, h, &tiles);
        }
        let ok = (0..w * h).filter(|i| truth[*i] && view.verdicts[*i] == Verdict::Ok).count();
        tally.wrongly_ok.push(ok as f64 / size as f64);
        let mut counts = counted(truth, w, h);
        counts.iter_mut().enumerate().for_each(|(i, c)| *c &= !alike(i));
        let ap = average_precision(&ranks(&audited, v), truth, &counts);
        tally.precision.push(ap);
        let plain = baselines(&view.render, &view.photograph).map(|scores| average_precision(&scores, truth, &counts));
        all.outcomes.push(Outcome { of: planted.clone(), found, precision: [ap, plain[0], plain[1], plain[2]] });
        line += &format!(
            "\n#     {} {size} px: IoU {:.2}, {} {}, AP {ap:.2}, ok {:.2}",
            view.summary.view,
            both as f64 / any as f64,
            most.unwrap_or("-"),
            what.map_or("-", |f| f.what.name()),
            ok as f64 / size as f64
        );
        let doubted = |f: &&Finding| view.masks.iter().any(|m| m.0 == f.id && touches(&m.1, &grown));
        for f in audited.doubts.iter().filter(|_| !found).filter(doubted) {
            line += &format!(
                "\n#     doubted in {}, IoU {:.2}: {} {:.2} {}, {}",
                f.view,
                overlap(f, view, truth),
                f.what.name(),
                f.score,
                f.reason as u8,
                f.note
            );
            line += &evidence(f);
        }
    }
    for f in audited.findings.iter().chain(&audited.doubts) {
        let Some(v) = audited.views.iter().position(|a| a.summary.view == f.view) else { continue };
        let view = &audited.views[v];
        let Some((_, mask)) = view.masks.iter().find(|m| m.0 == f.id) else { continue };
        let near = grown(&truths[v].changed, view.photograph.width, view.photograph.height, 6);
        let right = touches(mask, &near);
        if matches!(f.reason, Reason::None | Reason::Usual) {
            all.told.push((f.score, right));
        }
        all.alarms.extend(f.false_alarms.filter(|_| case.is_none() && !right));
        if let Some(candidates) = &mut all.candidates {
            candidates.push(Candidate::new(site, case.is_none(), right, share(mask, &truths[v].changed), f));
        }
    }
    println!("# {site} {title}: {} findings, {seconds:.1} s{line}", audited.findings.len());
    true
}

/// Intersection over union of what a view shows of a finding and the truth.
fn overlap(f: &Finding, view: &AuditedView, truth: &[bool]) -> f64 {
    let Some((_, mask)) = view.masks.iter().find(|m| m.0 == f.id) else { return 0.0 };
    let count = |of: &dyn Fn(bool, bool) -> bool| mask.iter().zip(truth).filter(|(m, t)| of(**m, **t)).count();
    count(&|m, t| m && t) as f64 / count(&|m, t| m || t).max(1) as f64
}

/// What speaks for a finding, behind its line.
fn evidence(f: &Finding) -> String {
    f.evidence.iter().map(|e| format!("; {} {:.2}", e.test, e.value)).collect()
}

/// Whether a tenth of a mask or more lies within another.
fn touches(mask: &[bool], within: &[bool]) -> bool {
    share(mask, within) >= 0.1
}

/// The share of a mask that lies within another.
fn share(mask: &[bool], within: &[bool]) -> f64 {
    let both = mask.iter().zip(within).filter(|m| *m.0 && *m.1).count();
    both as f64 / mask.iter().filter(|m| **m).count().max(1) as f64
}

/// How much each pixel is suspected, those of findings before the rest.
fn ranks(audited: &Audit, v: usize) -> Vec<f32> {
    let view = &audited.views[v];
    let mut ranks = view.suspicion.clone();
    for (_, mask) in view.masks.iter().filter(|(id, _)| audited.findings.iter().any(|f| f.id == *id)) {
        let found = (0..ranks.len()).filter(|i| mask[*i]);
        found.for_each(|i| ranks[i] = 1.0 + view.suspicion[i]);
    }
    ranks
}

/// A mask and all within `by` pixels of it.
fn grown(mask: &[bool], w: usize, h: usize, by: usize) -> Vec<bool> {
    let pass = |from: &[bool], step: usize, line: &dyn Fn(usize) -> (usize, usize)| -> Vec<bool> {
        (0..w * h)
            .map(|i| {
                let (at, length) = line(i);
                (at.saturating_sub(by)..(at + by + 1).min(length)).any(|k| from[i + k * step - at * step])
            })
            .collect()
    };
    let across = pass(mask, 1, &|i| (i % w, w));
    pass(&across, w, &|i| (i / w, h))
}

/// What a fault is, and is planted in: the material, whether that mirrors, whether the model is a scan, and what is said of the sun.
fn planted_in(bench: &Bench, case: &Case) -> Vec<String> {
    let mesh = &bench.scene.mesh;
    let on_it = || {
        let from = case.place.middle + case.place.normal * 0.3;
        let hit = bench.scene.tracer.closest(&Ray { origin: from, direction: -case.place.normal }, 0.0)?;
        Some(hit.triangle as usize)
    };
    let triangle = case.object.as_ref().map_or_else(on_it, |o| o.iter().position(|o| *o));
    let material = triangle.map_or("-", |t| &bench.scene.materials[mesh.materials[t] as usize].name);
    let model = if mesh.colours.is_empty() { "model" } else { "scan" };
    let file = bench.site.file.parent().map(|f| f.join("truth.json"));
    let truth: serde_json::Value = file
        .and_then(|f| std::fs::read_to_string(f).ok())
        .and_then(|text| serde_json::from_str(&text).ok())
        .unwrap_or_default();
    let sun = match (truth["sun"].is_object(), truth["sun_is_named"].as_bool()) {
        (true, Some(true)) => "sun that the site names",
        (true, _) => "sun that nobody names",
        _ => "no sun",
    };
    // of a scan nobody knows which surface is of which
    let surface = match &truth["gloss"] {
        serde_json::Value::Object(gloss) if model == "model" => {
            if gloss.contains_key(material) {
                "glossy surface"
            } else {
                "matt surface"
            }
        }
        _ => "surface of unknown gloss",
    };
    vec!["all".into(), model.into(), sun.into(), surface.into(), format!("of {material}"), case.fault.kind().into()]
}

fn print_outcomes(all: &[Outcome]) {
    println!(
        "\n| planted in | shows in | found | AP | of differences | of SSIM | of FLIP |\n|---|--:|--:|--:|--:|--:|--:|"
    );
    let names: BTreeSet<&String> = all.iter().flat_map(|o| &o.of).collect();
    for name in names {
        let these: Vec<&Outcome> = all.iter().filter(|o| o.of.contains(name)).collect();
        let found = these.iter().filter(|o| o.found).count();
        let of = |k: usize| mean(&these.iter().map(|o| o.precision[k]).collect::<Vec<_>>());
        println!("| {name} | {} | {found} | {:.2} | {:.2} | {:.2} | {:.2} |", these.len(), of(0), of(1), of(2), of(3));
    }
}

fn print(rows: &BTreeMap<String, Tally>, told: &[(f64, bool)]) {
    println!(
        "\n| model | photographs | shows in | found | kind | what | false | F1 | AP | displacement off | sign | marked | \
         untestable | called ok |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
    );
    let mut all = Tally::default();
    for t in rows.values() {
        for (sum, n) in [
            (&mut all.photographs, t.photographs),
            (&mut all.asked, t.asked),
            (&mut all.found, t.found),
            (&mut all.kind_right, t.kind_right),
            (&mut all.what_right, t.what_right),
            (&mut all.false_findings, t.false_findings),
            (&mut all.sign_right, t.sign_right),
        ] {
            *sum += n;
        }
        for (sum, of) in [
            (&mut all.precision, &t.precision),
            (&mut all.displacement, &t.displacement),
            (&mut all.untestable, &t.untestable),
            (&mut all.wrongly_ok, &t.wrongly_ok),
            (&mut all.marked, &t.marked),
        ] {
            sum.extend(of);
        }
    }
    let total = ("**all**".to_owned(), all);
    for (name, t) in rows.iter().chain(std::iter::once((&total.0, &total.1))) {
        let f1 = 2.0 * t.found as f64 / (t.asked + t.found + t.false_findings).max(1) as f64;
        let off = median(&mut t.displacement.clone());
        println!(
            "| {name} | {} | {} | {} | {} | {} | {} | {f1:.2} | {:.2} | {} | {}/{} | {:.1} % | {:.0} % | {:.1} % |",
            t.photographs,
            t.asked,
            t.found,
            t.kind_right,
            t.what_right,
            t.false_findings,
            mean(&t.precision),
            if t.displacement.is_empty() { "–".into() } else { format!("{:.0} %", 100.0 * off) },
            t.sign_right,
            t.displacement.len(),
            100.0 * mean(&t.marked),
            100.0 * mean(&t.untestable),
            100.0 * mean(&t.wrongly_ok),
        );
    }
    println!("\n| printed | findings and doubts | right |\n|---|--:|--:|");
    for k in 0..10 {
        let (low, high) = (0.1 * f64::from(k), 0.1 * f64::from(k + 1));
        let within: Vec<&(f64, bool)> = told.iter().filter(|t| t.0 >= low && (t.0 < high || k == 9)).collect();
        let right = within.iter().filter(|t| t.1).count();
        if !within.is_empty() {
            println!("| {low:.1}–{high:.1} | {} | {:.2} |", within.len(), right as f64 / within.len() as f64);
        }
    }
}
