//! All pictures of a site, one after the other and then together.

use glam::DMat3;
use rayon::prelude::*;

use super::anywhere::on_floors;
use super::eye::{Eye, JUDGED, Placed, level};
use super::model::{LocalPose, template};
use super::picture::{Level, pyramid};
use super::refine::{Equations, Matrix, Residuals, moved};
use super::search::Surveyed;
use super::together::{Witness, seen_by_others};
use super::verdict::{self, CLEARLY, Judge, LEAST_FIT, better_by};
use super::{RegisterError, RegisterSettings, Registered, Rival, Subject, Verdict};
use crate::panorama;
use crate::photograph::{Fitness, Photograph};
use crate::scene::Scene;
use crate::site::{Pose, Site};

/// Candidates that are followed from a search on the whole floor.
const FOLLOWED_ANYWHERE: usize = 64;

/// Candidates that are followed from the search on; and at each level from the coarsest so many steps at most, keeping so many.
pub(super) const FOLLOWED: usize = 16;
const LEVELS: [(usize, usize); 3] = [(5, 6), (10, 2), (12, 1)];
const LAST_STEPS: usize = 12;

/// So many second-best places are compared with the best, each after so many steps more.
const RIVALS: usize = 3;
const SETTLING: usize = 15;

/// Rounds in which pictures speak for each other.
const ROUNDS: usize = 3;

/// Poses nearer than this are one: metres, degrees.
const APART: (f32, f32) = (0.15, 4.0);

/// Finds the pose of every probe and view that has a picture. `progress` is told what is being done, how many pictures are done and how
/// many there are. The result has the site's order, probes first.
///
/// # Errors
///
/// A picture that cannot be read, or a name in [`RegisterSettings::only`] that nothing has.
pub fn register(
    site: &Site,
    scene: &Scene,
    settings: &RegisterSettings,
    progress: &(dyn Fn(&str, usize, usize) + Sync),
) -> Result<Vec<Registered>, RegisterError> {
    let eyes = eyes(site, scene, settings)?;
    let all = eyes.iter().filter(|e| e.wanted).count();
    let lost: Vec<&Eye> = eyes.iter().filter(|e| e.wanted && e.anywhere).collect();
    if !lost.is_empty() {
        progress("all floors", 0, all + 1);
    }
    let mut on_floors = if lost.is_empty() { Vec::new() } else { on_floors(site, scene, &lost) }.into_iter();
    let mut placed = Vec::new();
    for eye in &eyes {
        progress(eye.subject.name(site), placed.len(), all + 1);
        placed.push(match eye {
            Eye { wanted: false, .. } => as_given(scene, eye),
            Eye { anywhere: true, .. } => match on_floors.next().filter(|found| !found.is_empty()) {
                Some(found) => followed(scene, &eye.levels, found, FOLLOWED_ANYWHERE, FOLLOWED_TO),
                None => Placed { verdict: Verdict::NotFound, ..as_given(scene, eye) },
            },
            _ => find(scene, eye, settings),
        });
    }
    progress("together", all, all + 1);
    let covariances = refine_together(scene, &eyes, &mut placed, settings.together);
    let done = eyes.iter().zip(placed).zip(covariances).filter(|((eye, _), _)| eye.wanted);
    Ok(done.map(|((eye, placed), covariance)| registered(site, scene, eye, placed, covariance)).collect())
}

/// Reads the pictures.
pub(super) fn eyes(site: &Site, scene: &Scene, settings: &RegisterSettings) -> Result<Vec<Eye>, RegisterError> {
    let file = || site.file.display().to_string();
    let lighting = settings.lighting.clone().or_else(|| site.lightings().first().cloned()).unwrap_or_default();
    let wanted = |name: &str| settings.only.is_empty() || settings.only.iter().any(|n| n == name);
    let mut eyes = Vec::new();
    for (i, probe) in site.probes.iter().enumerate() {
        let Some(lit) = probe.picture(&lighting).or(probe.pictures.first()) else {
            continue;
        };
        let picture = panorama::read(&lit.path)?;
        let subject = Subject::Probe(i);
        let levels = pyramid(&picture, &|_| true, &subject.projection(site), settings.finest);
        let anywhere = settings.anywhere || !probe.placed;
        eyes.push(Eye { subject, levels, given: local(scene, &probe.pose), anywhere, wanted: wanted(&probe.name) });
    }
    for (i, view) in site.views.iter().enumerate() {
        let Some(photo) = Photograph::of(view)? else { continue };
        let usable = |k: usize| !matches!(photo.fitness[k], Fitness::Invalid | Fitness::Masked);
        let (subject, anywhere) = (Subject::View(i), settings.anywhere);
        let levels = pyramid(&photo.picture, &usable, &subject.projection(site), settings.finest);
        let given = local(scene, &view.camera.pose);
        eyes.push(Eye { subject, levels, given, anywhere, wanted: wanted(&view.name) });
    }
    // what nobody placed and nobody asks for tells nothing
    eyes.retain(|e| e.wanted || e.placed(site));
    if eyes.is_empty() {
        return Err(RegisterError::NoPicture { site: file() });
    }
    if let Some(name) = settings.only.iter().find(|n| !eyes.iter().any(|e| e.subject.name(site) == *n)) {
        let known: Vec<&str> = eyes.iter().map(|e| e.subject.name(site)).collect();
        return Err(RegisterError::NoSuch { site: file(), name: name.clone(), known: known.join(", ") });
    }
    Ok(eyes)
}

fn local(scene: &Scene, pose: &Pose) -> LocalPose {
    LocalPose { origin: scene.local(pose.position), rotation: pose.rotation.as_mat3() }
}

/// The level down to which a pose is followed before pictures speak for each other.
const FOLLOWED_TO: usize = 2;

fn as_given(scene: &Scene, eye: &Eye) -> Placed {
    let fit = Judge::new(level(&eye.levels, JUDGED)).fit(scene, &eye.given);
    Placed { pose: eye.given, fit, rival: None, verdict: Verdict::Found }
}

/// Searches places, headings and tilts around the pose given, and follows the best candidates from coarse to fine.
fn find(scene: &Scene, eye: &Eye, settings: &RegisterSettings) -> Placed {
    let surveyed = Surveyed::round(scene, eye, settings.within_m);
    let found = surveyed.search(&eye.levels, &eye.given.rotation, settings.tilt_deg);
    let poses = std::iter::once(eye.given).chain(found.into_iter().map(|c| c.pose));
    followed(scene, &eye.levels, poses, FOLLOWED, FOLLOWED_TO)
}

/// Follows the first poses, but for those that are next to each other, from coarse to fine down to level `last`, and says which
/// is best and how sure that is. There must be one.
pub(super) fn followed(
    scene: &Scene,
    levels: &[Level],
    candidates: impl IntoIterator<Item = LocalPose>,
    most: usize,
    last: usize,
) -> Placed {
    let mut poses: Vec<LocalPose> = Vec::new();
    for candidate in candidates {
        if poses.iter().all(|p| apart(p, &candidate, (0.3, 8.0))) {
            poses.push(candidate);
        }
        if poses.len() == most {
            break;
        }
    }
    let mut judged: Vec<(Vec<f64>, LocalPose)> = Vec::new();
    for (finer, (steps, keep)) in LEVELS.into_iter().enumerate().take(last + 1) {
        let level = level(levels, finer);
        let judge = Judge::new(level);
        let mut fits: Vec<(Vec<f64>, LocalPose)> = poses
            .par_iter()
            .map(|p| {
                let p = climbed(scene, level, p, steps);
                (judge.fit(scene, &p), p)
            })
            .collect();
        fits.sort_by(|a, b| b.0.iter().sum::<f64>().total_cmp(&a.0.iter().sum()));
        let mut kept: Vec<(Vec<f64>, LocalPose)> = Vec::new();
        for fit in fits {
            if kept.len() < keep.max(RIVALS) && kept.iter().all(|k| apart(&k.1, &fit.1, APART)) {
                kept.push(fit);
            }
        }
        poses = kept.iter().take(keep).map(|k| k.1).collect();
        if finer == JUDGED {
            judged = kept;
        }
    }
    let pose = poses[0];
    let level = level(levels, JUDGED);
    let judge = Judge::new(level);
    let fit = judge.fit(scene, &pose);
    let others: Vec<(LocalPose, Vec<f64>)> = judged
        .par_iter()
        .filter(|(_, p)| apart(p, &pose, APART))
        // what has not stood still yet may be on its way to the same place
        .map(|(_, p)| climbed(scene, level, p, SETTLING))
        .filter(|p| apart(p, &pose, APART))
        .map(|p| (p, judge.fit(scene, &p)))
        .collect();
    let rival = others.into_iter().reduce(|a, b| if b.1.iter().sum::<f64>() > a.1.iter().sum() { b } else { a });
    let verdict = if fit.iter().sum::<f64>() < LEAST_FIT {
        Verdict::NotFound
    } else if rival.as_ref().is_some_and(|(_, other)| better_by(&fit, other) < CLEARLY) {
        Verdict::Ambiguous
    } else {
        Verdict::Found
    };
    Placed { pose, fit, rival, verdict }
}

pub(super) fn apart(a: &LocalPose, b: &LocalPose, (metres, degrees): (f32, f32)) -> bool {
    let (off_m, off_deg) = a.off(b);
    off_m > metres || off_deg > degrees
}

/// Gauss–Newton at one level until a step is a small part of a cell.
pub(super) fn climbed(scene: &Scene, level: &Level, pose: &LocalPose, steps: usize) -> LocalPose {
    let mut pose = *pose;
    for _ in 0..steps {
        let Some(change) = equations(&Witness::at(scene, level, pose), &[]).solve(DAMPING) else { break };
        pose = moved(&pose, &change);
        if small(&change, level) {
            break;
        }
    }
    pose
}

/// Levenberg's share of the diagonal.
const DAMPING: f64 = 1e-3;

/// Whether a change moves the picture by less than a fiftieth of a cell, at surfaces two metres away.
fn small(change: &[f64; 6], level: &Level) -> bool {
    let length = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
    length(&change[..3]) / 2.0 + length(&change[3..]) < 0.02 * f64::from(level.raster.cell_angle())
}

/// Refines all poses at the finest level, each against the model and, with `together`, against what the others saw.
fn refine_together(scene: &Scene, eyes: &[Eye], placed: &mut [Placed], together: bool) -> Vec<Matrix> {
    let mut witnesses: Vec<Witness> =
        eyes.iter().zip(placed.iter()).map(|(eye, placed)| Witness::at(scene, &eye.levels[0], placed.pose)).collect();
    let rounds = if together && eyes.len() > 1 { ROUNDS } else { 0 };
    let mut covariances = vec![[[0.0; 6]; 6]; eyes.len()];
    for round in 0..=rounds {
        for i in 0..eyes.len() {
            if !eyes[i].wanted || placed[i].verdict == Verdict::NotFound {
                continue;
            }
            let steps = if round == 0 { LAST_STEPS } else { 2 };
            for _ in 0..steps {
                let speaks = |k: &usize| round > 0 && *k != i && placed[*k].verdict == Verdict::Found;
                let others: Vec<&Witness> = (0..eyes.len()).filter(speaks).map(|k| &witnesses[k]).collect();
                let equations = equations(&witnesses[i], &others);
                if let Some(c) = verdict::covariance(&equations, witnesses[i].level, &witnesses[i].buffer) {
                    covariances[i] = c;
                }
                let Some(change) = equations.solve(DAMPING) else { break };
                let w = &mut witnesses[i];
                *w = Witness::at(scene, w.level, moved(&w.pose, &change));
                if small(&change, w.level) {
                    break;
                }
            }
            placed[i].pose = witnesses[i].pose;
        }
    }
    covariances
}

/// What the model says of an eye's pose, and what others saw.
fn equations(eye: &Witness, others: &[&Witness]) -> Equations {
    let surfaces = eye.buffer.surfaces(&eye.level.raster);
    let told = |detail: &[f32]| {
        let template = template(&surfaces, eye.level, detail);
        Residuals::new(eye.level, &template).equations(eye.level, &eye.buffer)
    };
    let mut all = told(&eye.buffer.log_albedo);
    if !others.is_empty() {
        let seen = seen_by_others(eye, others);
        if seen.iter().any(|v| v.is_finite()) {
            all.add(&told(&seen), 0);
        }
    }
    all
}

fn registered(site: &Site, scene: &Scene, eye: &Eye, placed: Placed, covariance: Matrix) -> Registered {
    let pose = |p: &LocalPose| Pose {
        position: p.origin.as_dvec3() + scene.origin,
        rotation: DMat3::from_quat(glam::DQuat::from_mat3(&p.rotation.as_dmat3()).normalize()),
    };
    let given = eye.placed(site).then(|| eye.subject.pose(site));
    let fit_given = given.map(|_| Judge::new(level(&eye.levels, JUDGED)).fit(scene, &eye.given).iter().sum());
    let rival = placed.rival.as_ref().map(|(p, fit)| Rival {
        pose: pose(p),
        fit: fit.iter().sum(),
        best: placed.fit.iter().sum(),
        worse: better_by(&placed.fit, fit),
    });
    Registered {
        subject: eye.subject,
        given,
        pose: given.filter(|_| placed.verdict == Verdict::NotFound).unwrap_or_else(|| pose(&placed.pose)),
        verdict: placed.verdict,
        fit: placed.fit.iter().sum(),
        fit_given,
        covariance,
        rival,
    }
}
