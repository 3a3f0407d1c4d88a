//! From a site to an audit: every view with a photograph, and findings merged across views.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

use super::alarm::{Field, false_alarms};
use super::judge::{self, By, Judged};
use super::scores::{self, Scores};
use super::view::{Maps, Prepared, Settings, examine};
use super::{
    Audit, AuditError, AuditedView, Evidence, Finding, Kind, Method, Photo, ProbeGain, Reason, Shares, Verdict,
    ViewSummary, What, decision, relaid, verdict,
};
use crate::panorama::{self, Picture};
use crate::photograph::Photograph;
use crate::register::{self, Misfit};
use crate::render::{Options, prepare};
use crate::scene::Scene;
use crate::site::{Site, View};
use crate::statistics::median;
use crate::volume::{self, Volume};

/// How far an audit has come: what is being done, steps done, steps in all.
pub type Progress<'a> = &'a (dyn Fn(&str, usize, usize) + Sync);

/// Audits the views of a site that have a photograph; only those named, if any are.
///
/// # Errors
///
/// A picture that cannot be read or has another size than its view, a site without probes or photographs.
pub fn audit(
    site: &Site,
    scene: &Scene,
    lighting: &str,
    only: &[String],
    settings: &Settings,
    progress: Progress,
) -> Result<Audit, AuditError> {
    let views: Vec<&View> =
        site.views.iter().filter(|v| v.photo.is_some() && (only.is_empty() || only.contains(&v.name))).collect();
    if views.is_empty() {
        return Err(AuditError::NoPhotograph { site: site.file.display().to_string() });
    }
    let steps = views.len() + 2;
    progress("photographs", 0, steps);
    // read before the long work, so that a bad file is told at once
    let mut photographs = Vec::new();
    for read in views.par_iter().map(|view| Photograph::of(view)).collect::<Vec<_>>() {
        photographs.extend(read?.map(Photo::from));
    }
    progress("probes", 1, steps);
    let (fitting, left_out) = without_misfits(site, scene, lighting, settings)?;
    let site = &fitting;
    let mut pictures = Vec::new();
    for probe in site.probes.iter().take(settings.probes) {
        if let Some(lit) = probe.pictures.iter().find(|p| p.lighting == lighting) {
            pictures.push((probe, panorama::read(&lit.path)?));
        }
    }
    let cameras: Vec<_> = views.iter().map(|v| v.camera).collect();
    let options = Options {
        lightings: vec![lighting.to_owned()],
        probes: settings.probes,
        sun: true,
        volume: volume::Settings { cells: settings.cells, ..volume::Settings::default() },
        all_stages: true,
        volume_for_all: true,
    };
    let setup = prepare(site, scene, &cameras, &options)?;
    let light = &setup.lights[0].1;
    let volume = setup.transport_of[0].map(|t| Volume::new(scene, &setup.transports[t], light));
    let lit: Vec<_> = pictures.iter().map(|(probe, picture)| (*probe, picture)).collect();
    let prepared = Prepared::new(scene, light, volume.as_ref(), &lit);
    let mut seen = Vec::new();
    for (i, (view, photo)) in views.iter().zip(&photographs).enumerate() {
        progress(&view.name, i + 2, steps);
        let maps = examine(&prepared, &view.camera, photo, settings);
        seen.push(assess(site, &prepared, view, photo, &maps));
    }
    count_false_alarms(&mut seen, settings.false_alarms);
    progress("done", steps, steps);
    let mut audit = gathered(site, lighting, settings, seen);
    audit.warnings.splice(0..0, left_out);
    Ok(audit)
}

/// The site without probes whose pictures do not fit the model where the site file has them, and a sentence for each: what such a
/// probe says of a surface is another surface's light, and the model would be blamed for it.
fn without_misfits(
    site: &Site,
    scene: &Scene,
    lighting: &str,
    settings: &Settings,
) -> Result<(Site, Vec<String>), AuditError> {
    let mut fitting = site.clone();
    fitting.probes.truncate(settings.probes);
    if fitting.probes.is_empty() {
        return Ok((fitting, Vec::new()));
    }
    let probes = Site { views: Vec::new(), ..fitting.clone() };
    let settings = register::Settings {
        lighting: Some(lighting.to_owned()),
        tilt_deg: register::TRIPOD_TILT_DEG,
        ..register::Settings::default()
    };
    let mut misfits = register::misfits(&probes, scene, &settings)?;
    // a picture that fits nowhere may as well speak against the model
    misfits.retain(|(_, misfit)| *misfit != Misfit::Nowhere);
    let names: Vec<&str> = misfits.iter().map(|(subject, _)| subject.name(&probes)).collect();
    fitting.probes.retain(|p| !names.contains(&p.name.as_str()));
    let told = misfits.iter().map(|(subject, misfit)| {
        format!("probe “{}” is left out of this audit: {}", subject.name(&probes), misfit.sentence())
    });
    let told: Vec<String> = told.collect();
    if fitting.probes.is_empty() {
        return Err(AuditError::NoProbeFits { site: site.file.display().to_string(), why: told.join(" ") });
    }
    Ok((fitting, told))
}

/// A view with its findings and doubts, before they have numbers.
struct Assessed {
    view: AuditedView,
    field: Field,
    found: Vec<Found>,
}

/// A finding or doubt, its mask, its pixels at the audit's size and what it stands out by.
struct Found {
    finding: Finding,
    mask: Vec<bool>,
    pixels: Vec<usize>,
    /// Mean of the modelled surface's normals, of length 1.
    normal: Vec3,
    by: By,
}

/// Judges a view and brings everything to the photograph's size.
fn assess(site: &Site, prepared: &Prepared, view: &View, photo: &Photo, maps: &Maps) -> Assessed {
    let scores = Scores::of(maps);
    let (judged, field) = judge::judge(prepared, maps, &scores);
    let (small_verdicts, small_reasons) = verdict::verdicts(maps, &judged);
    let (w, h) = (photo.picture.width, photo.picture.height);
    let n = maps.reduced_by as usize;
    let small = |i: usize| (i / w / n) * maps.surfaces.width + i % w / n;
    let both = scores.both();
    let suspicion = (0..w * h).into_par_iter().map(|i| both[small(i)].min(1.0)).collect();
    let verdicts: Vec<Verdict> = (0..w * h).into_par_iter().map(|i| small_verdicts[small(i)]).collect();
    let reasons: Vec<Reason> = (0..w * h).into_par_iter().map(|i| small_reasons[small(i)]).collect();
    let r = &maps.radiometry;
    let gain = r.offset.map(f32::exp);
    let photograph = Picture {
        width: w,
        height: h,
        pixels: (0..w * h)
            .into_par_iter()
            .map(|i| photo.picture.pixels[i] * gain * (r.vignetting * maps.surfaces.radius2(small(i))).exp())
            .collect(),
    };
    let render: Vec<Vec3> = (0..w * h).into_par_iter().map(|i| maps.render.pixels[small(i)]).collect();
    let render = Picture { width: w, height: h, pixels: render };
    let mean = r.offset.element_sum() / 3.0;
    let warnings = warnings(maps);
    let mut pose = maps.pose;
    let scale = f64::from(maps.reduced_by);
    (pose.mean_px, pose.max_px, pose.residual_px) =
        (pose.mean_px * scale, pose.max_px * scale, pose.residual_px * scale);
    let summary = ViewSummary {
        view: view.name.clone(),
        photo: view.photo.as_ref().map_or_else(String::new, |p| p.display().to_string()),
        size: [w as u32, h as u32],
        reduced_by: maps.reduced_by,
        exposure_ev: f64::from(mean / std::f32::consts::LN_2),
        white_balance: (r.offset - Vec3::splat(mean)).map(f32::exp).to_array().map(f64::from),
        vignetting_ev: f64::from(r.vignetting / std::f32::consts::LN_2),
        noise: f64::from(maps.photo.noise),
        pose,
        probes: gains(prepared, maps),
        shares: Shares::default(),
        reasons: BTreeMap::new(),
        warnings,
    };
    let found = judged
        .into_par_iter()
        .map(|j| {
            let mut inside = vec![false; maps.surfaces.triangle.len()];
            j.region.pixels.iter().for_each(|&i| inside[i] = true);
            let mask: Vec<bool> = (0..w * h).map(|i| inside[small(i)]).collect();
            let finding = finding(site, prepared, view, maps, &j, &mask, w);
            let normal = j.region.pixels.iter().map(|i| maps.surfaces.normal[*i]).sum::<Vec3>().normalize_or_zero();
            Found { finding, mask, pixels: j.region.pixels, normal, by: j.by }
        })
        .collect();
    let view = AuditedView { summary, photograph, render, verdicts, reasons, suspicion, masks: Vec::new() };
    Assessed { view, field, found }
}

/// Says of each finding how often a right model would give one like it; what it would give more often than asked for is a doubt.
fn count_false_alarms(assessed: &mut [Assessed], allowed: f64) {
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

/// A region as a finding.
fn finding(
    site: &Site,
    prepared: &Prepared,
    view: &View,
    maps: &Maps,
    j: &Judged,
    mask: &[bool],
    width: usize,
) -> Finding {
    let s = &maps.surfaces;
    let scene = prepared.scene;
    let mut bbox = [u32::MAX, u32::MAX, 0, 0];
    for i in (0..mask.len()).filter(|i| mask[*i]) {
        let (x, y) = ((i % width) as u32, (i / width) as u32);
        bbox = [bbox[0].min(x), bbox[1].min(y), bbox[2].max(x + 1), bbox[3].max(y + 1)];
    }
    let (mut centre, mut area, mut low, mut high) = (DVec3::ZERO, 0.0, DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut materials: BTreeMap<u32, f64> = BTreeMap::new();
    for &i in &j.region.pixels {
        if s.material[i] == u32::MAX {
            continue;
        }
        let p = s.position[i].as_dvec3();
        let a = s.area(i);
        centre += p * a;
        area += a;
        (low, high) = (low.min(p), high.max(p));
        *materials.entry(s.material[i]).or_default() += a;
    }
    let centre = if area > 0.0 { centre / area } else { DVec3::ZERO };
    let material = materials.iter().max_by(|a, b| a.1.total_cmp(b.1)).map(|(m, _)| *m);
    let material = material.map_or_else(String::new, |m| scene.materials[m as usize].name.clone());
    let size_m = if area > 0.0 { (high - low).max_element() } else { 0.0 };
    let mut finding = Finding {
        id: String::new(),
        view: view.name.clone(),
        also_in: Vec::new(),
        kind: j.kind,
        what: j.what,
        score: j.score,
        bbox,
        area_px: mask.iter().filter(|m| **m).count() as u64,
        mask: String::new(),
        masks: BTreeMap::new(),
        false_alarms: None,
        position: site.frame.point_out(centre + scene.origin).to_array(),
        size_m,
        area_cm2: area * 1e4,
        material,
        displacement: j.displacement,
        shift: j.shift,
        reason: j.reason,
        evidence: j.evidence.clone(),
        note: String::new(),
    };
    finding.note = note(&finding);
    finding
}

/// A finding in a sentence.
fn note(f: &Finding) -> String {
    let on = if f.material.is_empty() { String::new() } else { format!(" on “{}”", f.material) };
    let size = if f.size_m < 1.0 { format!("{:.0} cm", f.size_m * 100.0) } else { format!("{:.1} m", f.size_m) };
    let what = match f.what {
        What::Rotated => "the texture is turned",
        What::Mirrored => "the texture is mirrored",
        What::Shifted => "the texture is shifted",
        What::Scaled => "the texture has another scale",
        What::Recoloured => "the structure fits but the colour does not",
        What::Changed => "the photograph shows another picture than the model",
        What::Missing => "something is there that is not modelled",
        What::Extra => "the model has something that is not there",
        What::Moved => "the surface is off its place",
    };
    let mut text = format!("{what}{on}, {size} across");
    if let Some(d) = &f.displacement {
        let side = if d.metres >= 0.0 { "nearer to" } else { "farther from" };
        text += &format!(
            "; the real surface is {:.1} ± {:.1} cm {side} the camera's side",
            d.metres.abs() * 100.0,
            d.uncertainty_m * 100.0
        );
    }
    if let Some((side, metres)) = f.shift.map(|s| s.words()) {
        text += &format!(
            "; it stands {:.0} cm {side} of where the model has it, as the photograph sees it",
            metres * 100.0
        );
    }
    if f.reason != Reason::None {
        text += &format!("; not sure, because {}", f.reason.words());
    }
    text
}

fn gains(prepared: &Prepared, maps: &Maps) -> Vec<ProbeGain> {
    let r = &maps.radiometry;
    let surfaces = maps.surfaces.triangle.iter().filter(|t| **t != u32::MAX).count().max(1);
    let usual = median(r.spread.iter().flatten().copied()).unwrap_or(0.0);
    prepared
        .probes
        .iter()
        .enumerate()
        .map(|(k, probe)| {
            let gain = r.gains[k].element_sum() / 3.0 / std::f32::consts::LN_2;
            let mut why = Vec::new();
            if gain.abs() > 0.15 {
                why.push(format!("its exposure is {gain:+.2} stops off the others'"));
            }
            if r.spread[k].is_some_and(|s| s > 3.0 * usual.max(0.05)) {
                why.push("what it sees differs from the photograph".to_owned());
            }
            ProbeGain {
                probe: probe.name.clone(),
                gain_ev: f64::from(gain),
                sees: maps.sights.of[k].iter().flatten().count() as f64 / surfaces as f64,
                difference: r.spread[k].map(f64::from),
                warning: (!why.is_empty()).then(|| format!("probe “{}”: {}", probe.name, why.join("; "))),
            }
        })
        .collect()
}

fn warnings(maps: &Maps) -> Vec<String> {
    let mut all = Vec::new();
    if !maps.pose.refined && maps.refine_asked {
        all.push(
            "the camera's pose could not be refined: the photograph does not fit the model closely enough".to_owned(),
        );
    }
    if maps.texture.white_balance > judge::WHITE {
        all.push(format!(
            "all surfaces together differ in colour from the model by ΔE00 {:.0}: either all albedos are off, or it is a \
             white balance; this cannot be told",
            maps.texture.white_balance
        ));
    }
    all
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
fn gathered(site: &Site, lighting: &str, settings: &Settings, mut assessed: Vec<Assessed>) -> Audit {
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
        ("sensitivity", verdict::SENSITIVITY),
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
    f.what == What::Moved && f.evidence.iter().any(|e| e.test == relaid::EVIDENCE)
}

impl AuditedView {
    /// Turns what was taken for a fault of shape under a mask into one of texture.
    fn call_texture(&mut self, mask: &[bool]) {
        for (verdict, _) in self.verdicts.iter_mut().zip(mask).filter(|(v, m)| **m && **v == Verdict::Geometry) {
            *verdict = Verdict::Texture;
        }
        self.count();
    }

    /// Counts verdicts and reasons anew.
    fn count(&mut self) {
        self.summary.shares = Shares::of(&self.verdicts);
        let mut counts: BTreeMap<Reason, usize> = BTreeMap::new();
        for run in self.reasons.chunk_by(|a, b| a == b).filter(|run| run[0] != Reason::None) {
            *counts.entry(run[0]).or_default() += run.len();
        }
        let all = self.reasons.len().max(1) as f64;
        self.summary.reasons = counts.iter().map(|(r, n)| (r.name().to_owned(), *n as f64 / all)).collect();
    }
}
