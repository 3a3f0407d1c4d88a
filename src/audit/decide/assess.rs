//! What is said of a view: its findings in words, its probes, its doubts about itself.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

use crate::audit::decide::assessed::{Assessed, Eye, Found};
use crate::audit::decide::judge::{self, Judgement};
use crate::audit::decide::judged::Judged;
use crate::audit::decide::label;
use crate::audit::finding::{AuditedView, Finding, ProbeGain, Shares, ViewSummary, What};
use crate::audit::observe::geometry_buffer::averaged_in;
use crate::audit::observe::photo::Photo;
use crate::audit::picture::colour::{chroma, colour_of};
use crate::audit::picture::regions::bounds;
use crate::audit::verdict::Reason;
use crate::audit::view::{AuditScene, Observations};
use crate::panorama::Picture;
use crate::site::{Site, View};
use crate::statistics::median;

/// Judges a view.
pub(crate) fn assess(
    site: &Site,
    prepared: &AuditScene,
    view: &View,
    photo: Photo,
    observed: Observations,
) -> Assessed {
    let Judgement { regions, field, own, .. } = judge::judge(prepared, &observed);
    let (verdicts, reasons) = label::verdicts(&observed, &own);
    let r = &observed.radiometry;
    let Photo { picture: mut photograph, .. } = photo;
    let (w, h, n) = (photograph.width, photograph.height, observed.reduced_by as usize);
    photograph.pixels.par_iter_mut().enumerate().for_each(|(i, p)| {
        *p *= r.at(observed.surfaces.radius2(averaged_in(i, w, n))).map(f32::exp);
    });
    let pixels = (0..verdicts.len()).into_par_iter().map(|i| in_neutral_light(&observed, i)).collect();
    let neutral = Picture { width: observed.surfaces.width, height: observed.surfaces.height, pixels };
    let mean = r.offset.element_sum() / 3.0;
    let warnings = warnings(&observed);
    let mut pose = observed.pose;
    let scale = f64::from(observed.reduced_by);
    (pose.mean_px, pose.max_px, pose.residual_px) =
        (pose.mean_px * scale, pose.max_px * scale, pose.residual_px * scale);
    let summary = ViewSummary {
        view: view.name.clone(),
        photo: view.photo.as_ref().map_or_else(String::new, |p| p.display().to_string()),
        size: [w as u32, h as u32],
        reduced_by: observed.reduced_by,
        exposure_ev: f64::from(mean / std::f32::consts::LN_2),
        white_balance: (r.offset - Vec3::splat(mean)).map(f32::exp).to_array().map(f64::from),
        vignetting_ev: f64::from(r.vignetting / std::f32::consts::LN_2),
        noise: f64::from(observed.photo.noise),
        pose,
        probes: gains(prepared, &observed),
        shares: Shares::default(),
        reasons: BTreeMap::new(),
        warnings,
    };
    let found = regions
        .into_par_iter()
        .map(|j| {
            let finding = finding(site, prepared, view, &observed, &j);
            let normal = j.region.pixels.iter().map(|i| observed.surfaces.normal[*i]).sum::<Vec3>().normalize_or_zero();
            Found { finding, pixels: j.region.pixels, normal, log_odds: j.log_odds, part: j.part }
        })
        .collect();
    let Observations { camera, render, surfaces, .. } = observed;
    let view = AuditedView {
        summary,
        photograph,
        render,
        neutral,
        verdicts,
        reasons,
        suspicion: Vec::new(),
        masks: Vec::new(),
    };
    let eye = Eye { camera, origin: prepared.scene.origin, position: surfaces.position, distance: surfaces.distance };
    Assessed { view, field, own, eye, found }
}

/// A surface's albedo, the darker the less squarely it faces the camera.
fn in_neutral_light(observed: &Observations, i: usize) -> Vec3 {
    /// How much of the light comes from all around.
    const AMBIENT: f32 = 0.5;
    let s = &observed.surfaces;
    let facing = s.normal[i].dot(s.ray[i]).abs();
    let light = AMBIENT + (1.0 - AMBIENT) * facing;
    if s.triangle[i] == u32::MAX || !light.is_finite() { Vec3::ZERO } else { observed.albedo[i] * light }
}

/// A region as a finding.
fn finding(site: &Site, prepared: &AuditScene, view: &View, observed: &Observations, j: &Judged) -> Finding {
    let s = &observed.surfaces;
    let scene = prepared.scene;
    let (mut centre, mut area, mut low, mut high) = (DVec3::ZERO, 0.0, DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut materials: BTreeMap<u32, f64> = BTreeMap::new();
    for &i in &j.region.pixels {
        // an opening has the place of the surface that goes on over it, and where that is seen edge-on or not at all, of its rim
        let on = j.rim.unwrap_or(i);
        let Some((p, a)) = s.on_plane(on, i).or_else(|| s.on_plane(on, on)) else { continue };
        let p = p.as_dvec3();
        centre += p * a;
        area += a;
        (low, high) = (low.min(p), high.max(p));
        *materials.entry(s.material[on]).or_default() += a;
    }
    let centre = if area > 0.0 { centre / area } else { DVec3::ZERO };
    let material = materials.iter().max_by(|a, b| a.1.total_cmp(b.1)).map(|(m, _)| *m);
    let material = material.map_or_else(String::new, |m| scene.materials[m as usize].name.clone());
    let size_m = if area > 0.0 { (high - low).max_element() } else { 0.0 };
    // how sure it is, and in words, is said when all views are known, and so is how far it reaches in the photograph
    Finding {
        id: String::new(),
        view: view.name.clone(),
        also_in: Vec::new(),
        kind: j.kind,
        what: j.what,
        score: 0.0,
        bbox: bounds(&j.region.pixels, s.width).map(|side| side as u32),
        area_px: 0,
        mask: String::new(),
        masks: BTreeMap::new(),
        false_alarms: None,
        position: site.frame.point_out(centre + scene.origin).to_array(),
        size_m,
        area_cm2: area * 1e4,
        material,
        displacement: j.displacement,
        shift: j.shift,
        reason: Reason::None,
        evidence: j.evidence.clone(),
        note: String::new(),
    }
}

/// A finding in a sentence.
pub(crate) fn note(f: &Finding) -> String {
    let on = if f.material.is_empty() { String::new() } else { format!(" on “{}”", f.material) };
    let size = if f.size_m < 1.0 { format!("{:.0} cm", f.size_m * 100.0) } else { format!("{:.1} m", f.size_m) };
    let what = match f.what {
        What::Rotated => "the texture is turned",
        What::Mirrored => "the texture is mirrored",
        What::Shifted => "the texture is shifted",
        What::Scaled => "the texture has another scale",
        What::Recoloured => "the structure fits but the colour does not",
        What::Changed => "the photograph shows another picture than the model",
        What::Missing => "the model lacks what is there",
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
        text +=
            &format!("; it stands {:.0} cm {side} of where the model has it, as “{}” sees it", metres * 100.0, f.view);
    }
    if !f.is_sure() {
        text += &format!("; not sure, because {}", f.reason.words());
    }
    text
}

fn gains(prepared: &AuditScene, observed: &Observations) -> Vec<ProbeGain> {
    let r = &observed.radiometry;
    let surfaces = observed.surfaces.triangle.iter().filter(|t| **t != u32::MAX).count().max(1);
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
                sees: observed.sights.of[k].iter().flatten().count() as f64 / surfaces as f64,
                difference: r.spread[k].map(f64::from),
                warning: (!why.is_empty()).then(|| format!("probe “{}”: {}", probe.name, why.join("; "))),
            }
        })
        .collect()
}

fn warnings(observed: &Observations) -> Vec<String> {
    let mut all = Vec::new();
    if !observed.pose.refined && observed.settings.refine_pose {
        all.push(
            "the camera's pose could not be refined: the photograph does not fit the model closely enough".to_owned(),
        );
    }
    let white_balance = colour_of(chroma(observed.texture.offset));
    if white_balance > judge::WHITE {
        all.push(format!(
            "all surfaces together differ in colour from the model by ΔE00 {white_balance:.0}: either all albedos are off, or it is a \
             white balance; this cannot be told"
        ));
    }
    all
}

impl AuditedView {
    /// Width and height of its maps.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.render.width as u32, self.render.height as u32]
    }

    /// The box around pixels in the photograph, left, top, and one past right and bottom, and of how many of the photograph's they are.
    pub(crate) fn in_photograph(&self, pixels: &[usize]) -> ([u32; 4], u64) {
        let (by, width, [w, h]) = (self.summary.reduced_by as usize, self.render.width, self.summary.size);
        let (w, h) = (w as usize, h as usize);
        let [left, top, right, bottom] = bounds(pixels, width);
        let area = |i: &usize| by.min(w - i % width * by) * by.min(h - i / width * by);
        let bbox = [left * by, top * by, w.min(right * by), h.min(bottom * by)];
        (bbox.map(|side| side as u32), pixels.iter().map(area).sum::<usize>() as u64)
    }

    /// What one of the view's maps says of each pixel of the photograph.
    pub(crate) fn enlarged<T: Copy>(&self, map: &[T]) -> Vec<T> {
        let (by, [w, h]) = (self.summary.reduced_by as usize, self.summary.size.map(|side| side as usize));
        (0..w * h).map(|i| map[averaged_in(i, w, by)]).collect()
    }

    /// Counts verdicts and reasons anew.
    pub(crate) fn count(&mut self) {
        self.summary.shares = Shares::of(&self.verdicts);
        let mut counts: BTreeMap<Reason, usize> = BTreeMap::new();
        for run in self.reasons.chunk_by(|a, b| a == b).filter(|run| run[0] != Reason::None) {
            *counts.entry(run[0]).or_default() += run.len();
        }
        let all = self.reasons.len().max(1) as f64;
        self.summary.reasons = counts.iter().map(|(r, n)| (r.name().to_owned(), *n as f64 / all)).collect();
    }
}

#[cfg(test)]
mod tests {
    use crate::audit::testing;
    use crate::audit::{AuditedView, ViewSummary};

    #[test]
    fn what_is_told_of_averaged_pixels_is_told_of_those_of_the_photograph() {
        let summary = ViewSummary { reduced_by: 2, ..testing::summary("v", [5, 3]) };
        let view: AuditedView = testing::view(summary);
        assert_eq!((view.size(), view.verdicts.len()), ([3, 2], 6));
        // the last column and row hold half as many
        assert_eq!(view.in_photograph(&[0]), ([0, 0, 2, 2], 4));
        assert_eq!(view.in_photograph(&[1, 2, 5]), ([2, 0, 5, 3], 4 + 2 + 1));
        assert_eq!(view.enlarged(&[0, 1, 2, 3, 4, 5]), [0, 0, 1, 1, 2, 0, 0, 1, 1, 2, 3, 3, 4, 4, 5]);
    }
}
