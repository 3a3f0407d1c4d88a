//! Pictures that were not taken where the site file says, and what is wrong with them.

use glam::{Mat3, Vec3};
use std::f32::consts::PI;

use super::model::LocalPose;
use super::picture::{Level, Optics, pyramid};
use super::run::{Eye, JUDGED, Placed, SEARCHED, apart, ball, climbed, eyes, find_among, fit_at, level};
use super::search::{Headings, models};
use super::verdict::{CLEARLY, LEAST_FIT, better_by};
use super::{RegisterError, Settings, Subject, Verdict};
use crate::panorama::{self, Picture};
use crate::scene::Scene;
use crate::site::Site;

/// What is wrong with a picture's pose.
#[derive(Clone, Debug, PartialEq)]
pub enum Misfit {
    /// Left and right are exchanged.
    Mirrored,
    /// It stands on its head.
    UpsideDown,
    /// It was taken at another probe or view, by name.
    TakenAt(String),
    /// Only the direction is off, by so many degrees.
    Turned(f64),
    /// The place is off, by so many metres, and the direction by so many degrees.
    Displaced(f64, f64),
    /// It fits nowhere near.
    Nowhere,
}

impl Misfit {
    /// What is wrong, and what to do about it.
    pub fn sentence(&self) -> String {
        const REGISTER: &str = "`clerestory register` finds its pose";
        match self {
            Self::Mirrored => "Its picture fits the model only with left and right exchanged. Flip it, or stitch it \
                               anew as seen from inside."
                .to_owned(),
            Self::UpsideDown => "Its picture fits the model only standing on its head. Turn it by 180°, or give \
                                 roll = 180."
                .to_owned(),
            Self::TakenAt(name) => {
                format!("Its picture fits the model where “{name}” stands. Check whether two pictures are exchanged.")
            }
            Self::Turned(deg) => {
                format!("Its picture is turned by {deg:.0}° against the model. Correct its heading; {REGISTER}.")
            }
            Self::Displaced(m, deg) => {
                let turned = if *deg > 2.0 { format!(" and turned by {deg:.0}°") } else { String::new() };
                format!(
                    "Its picture was taken {m:.2} m from where the site file has it{turned}. Correct it; {REGISTER}."
                )
            }
            Self::Nowhere => "Its picture fits the model nowhere within 1 m of its place. Check that it shows this \
                              room, and its place."
                .to_owned(),
        }
    }
}

/// A pose that fits this well needs no search for a better one.
const WELL: f64 = 0.45;

/// Poses nearer than this to the one given are no mistake of a person's: metres, degrees. What is left is for `register`.
const NEAR: (f32, f32) = (0.12, 2.5);

/// Less than this off its place, a picture is only turned, metres.
const SAME_PLACE_M: f32 = 0.08;

/// How far round another picture's place to look, metres.
const ROUND_M: f32 = 0.35;

/// Finds the pictures that do not fit where the site file has them. A picture is named only if another explanation fits
/// clearly better, or if none fits at all and the model shows it enough to tell.
///
/// # Errors
///
/// As [`register`](super::register).
pub fn misfits(site: &Site, scene: &Scene, settings: &Settings) -> Result<Vec<(Subject, Misfit)>, RegisterError> {
    let eyes = eyes(site, scene, settings)?;
    let mut all = Vec::new();
    for eye in eyes.iter().filter(|e| e.wanted) {
        if let Some(misfit) = misfit(site, scene, &eyes, eye, settings)? {
            all.push((eye.subject, misfit));
        }
    }
    Ok(all)
}

fn misfit(
    site: &Site,
    scene: &Scene,
    eyes: &[Eye],
    eye: &Eye,
    settings: &Settings,
) -> Result<Option<Misfit>, RegisterError> {
    let judged = level(&eye.levels, JUDGED);
    let near = climbed(scene, level(&eye.levels, SEARCHED), &eye.given, 5);
    let near = climbed(scene, judged, &near, 10);
    let stays = !apart(&near, &eye.given, NEAR);
    let as_given = fit_at(scene, judged, if stays { &near } else { &eye.given });
    if stays && as_given.iter().sum::<f64>() > WELL {
        return Ok(None);
    }
    let headings = &Headings::of(level(&eye.levels, SEARCHED));
    let places = ball(eye.given.origin, settings.within_m);
    let here = (places.as_slice(), &*models(scene, headings, &places));
    let within =
        |levels: &[Level], given: &LocalPose| find_among(scene, headings, levels, given, here, settings.tilt_deg);
    let plain = within(&eye.levels, &eye.given);
    let fits_better = |p: &Placed, than: &[f64]| better_by(&p.fit, than) > CLEARLY;
    if plain.correlation() > WELL {
        return Ok(fits_better(&plain, &as_given).then(|| off(&eye.given, &plain.pose)).flatten());
    }
    let turned = LocalPose { rotation: eye.given.rotation * Mat3::from_rotation_y(PI), ..eye.given };
    let mirrored = pyramid_mirrored(site, eye, settings)?;
    let mut others: Vec<(Misfit, Placed)> =
        vec![(Misfit::Mirrored, within(&mirrored, &eye.given)), (Misfit::UpsideDown, within(&eye.levels, &turned))];
    for other in eyes.iter().filter(|o| apart(&o.given, &eye.given, (2.0 * ROUND_M, 400.0))) {
        let places = ball(other.given.origin, ROUND_M);
        let models = models(scene, headings, &places);
        let given = LocalPose { origin: other.given.origin, ..eye.given };
        let placed = find_among(scene, headings, &eye.levels, &given, (&places, &models), settings.tilt_deg);
        others.push((Misfit::TakenAt(other.subject.name(site).to_owned()), placed));
    }
    let fits = |p: &Placed| p.correlation() > LEAST_FIT && p.verdict != Verdict::NotFound;
    let best = others.into_iter().filter(|o| fits(&o.1)).max_by(|a, b| a.1.correlation().total_cmp(&b.1.correlation()));
    if let Some((what, placed)) = best
        && fits_better(&placed, &plain.fit)
        && fits_better(&placed, &as_given)
    {
        return Ok(Some(what));
    }
    if plain.verdict == Verdict::NotFound {
        return Ok(Some(Misfit::Nowhere));
    }
    Ok(fits_better(&plain, &as_given).then(|| off(&eye.given, &plain.pose)).flatten())
}

/// How a pose is off another one, if by more than `register` is there for.
fn off(given: &LocalPose, found: &LocalPose) -> Option<Misfit> {
    if !apart(found, given, NEAR) {
        return None;
    }
    let off_m = found.origin.distance(given.origin);
    let turn = glam::Quat::from_mat3(&(found.rotation.transpose() * given.rotation));
    let off_deg = f64::from((2.0 * turn.xyz().length().atan2(turn.w.abs())).to_degrees());
    Some(if off_m < SAME_PLACE_M { Misfit::Turned(off_deg) } else { Misfit::Displaced(f64::from(off_m), off_deg) })
}

/// The levels of an eye's picture with left and right exchanged.
fn pyramid_mirrored(site: &Site, eye: &Eye, settings: &Settings) -> Result<Vec<Level>, RegisterError> {
    let (picture, optics) = match eye.subject {
        Subject::Probe(i) => {
            let probe = &site.probes[i];
            (panorama::read(&probe.pictures[0].path)?, Optics::Projection(probe.projection))
        }
        Subject::View(i) => {
            let view = &site.views[i];
            let Some(photo) = crate::photograph::Photograph::of(view)? else { return Ok(Vec::new()) };
            (photo.picture, Optics::Camera(view.camera))
        }
    };
    let (width, height) = (picture.width, picture.height);
    let pixels: Vec<Vec3> = picture.pixels.chunks(width.max(1)).flat_map(|row| row.iter().rev().copied()).collect();
    Ok(pyramid(&Picture { width, height, pixels }, &|_| true, &optics, settings.finest))
}
