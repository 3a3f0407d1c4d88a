//! A study from start to end: bounded in time, and taken up again where it stopped.

use crate::study::options::Options;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::clock::{Clock, Seconds, has_processor_time};
use super::measure::{Bench, Run, base};
use super::order::plan_order;
use super::state::{Study, begun, fingerprint};
use super::sweep::{Method, Setting, ladder, paper_sweep};
use super::truth::TruthView;
use super::truth::views::{note, photographed, referenced};
use super::{Curve, How, Metric, StudyError};
use crate::reference::{LightError, Lights};
use crate::scene::Scene;
use crate::site::{Site, View};

/// How far a study is.
#[derive(Clone, Debug)]
pub struct Progress {
    /// What is being done.
    pub doing: String,
    /// Settings measured.
    pub done: usize,
    /// Settings planned; path tracing counts every step of its ladder.
    pub planned: usize,
}

/// Studies a site, or goes on with the study in `folder`, writing `study.json` there after every step. With the model go the files
/// that it names, whose change begins a new study, and what reading it took: part of every method's set-up.
///
/// # Errors
/// See [`StudyError`]. What was measured before an error stays in `study.json`.
pub fn study(
    site: &Site,
    (scene, model_files, load): (&Scene, &[PathBuf], Seconds),
    options: &Options,
    folder: &Path,
    tell: &(dyn Fn(&Progress) + Sync),
) -> Result<Study, StudyError> {
    let start = Instant::now();
    let nothing = |what: String| StudyError::Nothing { file: site.file.clone(), what };
    let lighting = lighting(site, options).map_err(nothing)?;
    let views = views(site, options).map_err(nothing)?;
    let clock = Clock::start();
    let lit = Site { sun: site.sun_under(&lighting), ..site.clone() };
    let lights = match Lights::load(&lit, scene) {
        Ok(lights) => Some(lights),
        Err(LightError::Dark(_)) => None,
        Err(e) => return Err(e.into()),
    };
    let light_up = clock.read() + load;
    let photographs = !options.reference && views.iter().any(|v| v.photo.is_some());
    let views: Vec<&View> = views.into_iter().filter(|v| !photographs || v.photo.is_some()).collect();
    let mut notes = Vec::new();
    if lights.is_none() {
        notes.push("No path tracing: the site has no [environment], no [sun] and no material that shines.".to_owned());
    }
    let fingerprint = fingerprint(site, model_files, &views, &lighting, options, photographs)?;
    let file = folder.join("study.json");
    std::fs::create_dir_all(folder).map_err(|source| StudyError::Io { path: folder.to_owned(), source })?;
    let begun = begun(&file, &fingerprint, options.fresh, &mut notes)?;

    let truth = if photographs {
        photographed(&views, options.share)?
    } else {
        let Some(lights) = &lights else {
            return Err(StudyError::Nothing {
                file: site.file.clone(),
                what: "there is nothing to measure error against: no view has a photograph, and there is no \
                       [environment], [sun] or shining material to make a reference from"
                    .to_owned(),
            });
        };
        let doing = |view: &str| {
            tell(&Progress { doing: format!("reference of {view}"), done: 0, planned: 1 });
        };
        let known = begun.is_some();
        referenced(scene, lights, &views, options, folder, known, &doing)?
    };
    let blocks: Vec<usize> = truth.iter().map(TruthView::blocks).collect();
    if begun.as_ref().is_some_and(|study| !study.is_of(&blocks)) {
        return Err(StudyError::Begun {
            path: file,
            why: "its figures are of other blocks of the pictures".to_owned(),
        });
    }
    let base = base(site, &lighting)?;
    let order = plan_order(site, scene, &lighting);
    let mut study = begun.unwrap_or_else(|| Study {
        fingerprint,
        site: site.name.clone(),
        lighting: lighting.clone(),
        threads: rayon::current_num_threads(),
        processor_time: has_processor_time(),
        share: truth.iter().map(TruthView::share).sum::<f64>() / truth.len().max(1) as f64,
        truth: note(&truth, photographs, options),
        base,
        order: order.clone(),
        blocks,
        runs: Vec::new(),
        pending: Vec::new(),
        notes: Vec::new(),
        summary: None,
    });
    study.notes = notes;
    let bench = Bench {
        site,
        scene,
        lights: lights.as_ref(),
        lighting: &lighting,
        truth: &truth,
        order: &order,
        base,
        load,
        light_up,
        seed: options.seed,
    };
    let scratch = folder.join(format!(".study-{}", std::process::id()));
    std::fs::create_dir_all(&scratch).map_err(|source| StudyError::Io { path: scratch.clone(), source })?;
    let done = Driver { bench, options, start, file: &file, scratch: &scratch, tell, study: &mut study }.drive();
    // left over files do no harm
    let _ = std::fs::remove_dir_all(&scratch);
    done?;
    Ok(study)
}

struct Driver<'a> {
    bench: Bench<'a>,
    options: &'a Options,
    start: Instant,
    file: &'a Path,
    scratch: &'a Path,
    tell: &'a (dyn Fn(&Progress) + Sync),
    study: &'a mut Study,
}

impl Driver<'_> {
    fn drive(mut self) -> Result<(), StudyError> {
        self.study.pending.clear();
        let first = Setting::plain(Method::Ibs);
        self.try_one(first, 0)?;
        let volume = self.run(&first).is_none_or(|r| r.volume);
        let mut queue: Vec<Setting> = Vec::new();
        let (early, late): (Vec<_>, Vec<_>) = ladder(self.options.most_samples).partition(|s| s.value <= 16.0);
        if self.bench.lights.is_some() {
            queue.extend(early);
        }
        queue.push(Setting::plain(Method::Paper));
        queue.extend(self.bench.base.sweep(volume));
        queue.extend(paper_sweep(&self.bench.base));
        if self.bench.lights.is_some() {
            queue.extend(late);
        }
        let planned = queue.len() + 1;
        for setting in queue {
            if setting.method == Method::PathTracing && self.caught_up() {
                break;
            }
            self.try_one(setting, planned)?;
        }
        self.save()
    }

    /// Whether path tracing errs no more than image-based shooting already.
    fn caught_up(&self) -> bool {
        let flip = |r: &Run| Metric::Flip.over(&r.blocks(), &vec![1.0; r.blocks().len()]);
        let Some(ours) = self.study.runs.iter().find(|r| r.is_plain_ibs()).map(flip) else { return false };
        let whole = |r: &&Run| r.setting.method == Method::PathTracing && r.views.len() == self.bench.truth.len();
        let theirs = self.study.runs.iter().filter(whole).map(|r| (r.frame().cpu_s, flip(r)));
        Curve::new(theirs).time_at(ours).is_some_and(|t| matches!(t.1, How::Measured | How::First))
    }

    fn run(&self, setting: &Setting) -> Option<&Run> {
        self.study.runs.iter().find(|r| r.setting == *setting)
    }

    fn try_one(&mut self, setting: Setting, planned: usize) -> Result<(), StudyError> {
        let doing = format!("{}, {}", setting.method.name(), setting.label());
        (self.tell)(&Progress { doing: doing.clone(), done: self.study.runs.len(), planned });
        let paper = self.run(&Setting::plain(Method::Paper)).and_then(|r| r.radius_m);
        match setting.method {
            _ if self.complete(&setting) => {}
            Method::PathTracing => self.trace_one(setting, &doing)?,
            method if !self.fits(self.like(method)) => self.study.pending.push(doing),
            Method::Ibs => self.keep(self.bench.ibs(setting, self.scratch)?)?,
            Method::Paper => self.keep(self.bench.paper(setting, paper)?)?,
        }
        Ok(())
    }

    /// Whether a setting has been measured in all views.
    fn complete(&self, setting: &Setting) -> bool {
        self.run(setting).is_some_and(|r| r.views.len() == self.bench.truth.len())
    }

    /// What the last run of a method took; nothing is known before the first.
    fn like(&self, method: Method) -> f64 {
        self.study.runs.iter().rev().find(|r| r.setting.method == method).map_or(0.0, |r| r.spent_s)
    }

    fn fits(&self, seconds: f64) -> bool {
        self.start.elapsed().as_secs_f64() + seconds <= self.options.budget_s
    }

    /// Path tracing goes view by view, so that a long step can be taken in several sittings.
    fn trace_one(&mut self, setting: Setting, doing: &str) -> Result<(), StudyError> {
        let Some(lights) = self.bench.lights else { return Ok(()) };
        let samples = setting.value as u32;
        if self.run(&setting).is_none() {
            let (setup, views) = (self.bench.light_up, Vec::new());
            self.study.runs.push(Run { setting, setup, views, volume: false, radius_m: None, spent_s: 0.0 });
        }
        let rate = self.rate();
        for k in self.run(&setting).map_or(0, |r| r.views.len())..self.bench.truth.len() {
            let truth = &self.bench.truth[k];
            let foreseen = rate * f64::from(samples.max(2));
            let clock = Clock::start();
            let deadline = || self.fits(0.0);
            let traced = match self.fits(foreseen) {
                true => self.bench.traced(samples, truth, lights, &deadline),
                false => None,
            };
            let Some(view) = traced else {
                self.study.pending.push(doing.to_owned());
                break;
            };
            if let Some(run) = self.study.runs.iter_mut().find(|r| r.setting == setting) {
                run.views.push(view);
                run.spent_s += clock.read().wall_s;
            }
            self.save()?;
        }
        self.study.runs.retain(|r| !r.views.is_empty());
        Ok(())
    }

    /// Wall seconds that path tracing takes a view and sample, from its longest step so far.
    fn rate(&self) -> f64 {
        let steps = self.study.runs.iter().filter(|r| r.setting.method == Method::PathTracing && !r.views.is_empty());
        let rate = |r: &Run| r.spent_s / (r.views.len() as f64 * r.setting.value.max(2.0));
        steps.max_by(|a, b| a.setting.value.total_cmp(&b.setting.value)).map_or(0.0, rate)
    }

    fn keep(&mut self, run: Run) -> Result<(), StudyError> {
        self.study.runs.push(run);
        self.save()
    }

    fn save(&self) -> Result<(), StudyError> {
        self.study.save(self.file)
    }
}

fn lighting(site: &Site, options: &Options) -> Result<String, String> {
    if site.probes.is_empty() {
        return Err(
            "the site has no probe, so there is nothing to study. Add a [[probe]]; `clerestory simulate` makes \
                    rehearsal probes"
                .to_owned(),
        );
    }
    site.lighting(options.lighting.as_deref()).map_err(|e| e.to_string())
}

fn views<'a>(site: &'a Site, options: &Options) -> Result<Vec<&'a View>, String> {
    if site.views.is_empty() {
        return Err("the site has no view to study. Add a [[view]]".to_owned());
    }
    site.views_named(&options.views).map_err(|e| e.to_string())
}
