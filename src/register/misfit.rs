//! Pictures that were not taken where the site file says, and what is wrong with them.

use glam::Mat3;
use std::f32::consts::PI;

use super::eye::{Eye, JUDGED, Placed, SEARCHED, level};
use super::model::LocalPose;
use super::picture::Level;
use super::run::{FOLLOWED, apart, climbed, eyes, followed};
use super::search::{Candidate, Surveyed};
use super::verdict::{CLEARLY, Judge, better_by};
use super::{RegisterError, RegisterSettings, Subject, Verdict};
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

/// A pose that fits this well may be right without a search for a better one, if no other explanation speaks louder; and no other
/// explanation is believed that fits less.
const WELL: f64 = 0.45;

/// Poses nearer than this to the one given are no mistake of a person's: metres, degrees. What is left is for `register`.
const NEAR: (f32, f32) = (0.12, 2.5);

/// The same in the search's coarse steps.
const NEAR_COARSE: (f32, f32) = (0.4, 8.0);

/// Less than this off its place, a picture is only turned, metres.
const SAME_PLACE_M: f32 = 0.08;

/// How far round another picture's place to look, metres.
const ROUND_M: f32 = 0.35;

/// Pictures are tried at each other's places on sites with at most so many.
const MOST_EXCHANGED: usize = 9;

/// Finds the pictures that do not fit where the site file has them. A picture is named only if another explanation fits
/// clearly better, or if none fits at all where other pictures of the site do.
///
/// # Errors
///
/// As [`register`](super::register).
pub fn misfits(
    site: &Site,
    scene: &Scene,
    settings: &RegisterSettings,
) -> Result<Vec<(Subject, Misfit)>, RegisterError> {
    let eyes = eyes(site, scene, settings)?;
    let round = |e: &Eye| Surveyed::round(scene, e, ROUND_M);
    let exchanged: Vec<Surveyed> =
        if eyes.len() <= MOST_EXCHANGED { eyes.iter().map(round).collect() } else { Vec::new() };
    let of = |(i, eye): (usize, &Eye)| {
        let made = exchanged.is_empty().then(|| round(eye));
        let home = made.as_ref().unwrap_or_else(|| &exchanged[i]);
        // a place that two pictures share tells no exchange
        let others: Vec<(&str, &Surveyed)> = (0..exchanged.len())
            .filter(|&k| k != i && eyes[k].given.origin.distance(eye.given.origin) > 2.0 * ROUND_M)
            .filter(|&k| level(&eyes[k].levels, SEARCHED).raster.full == home.headings.raster.full)
            .map(|k| (eyes[k].subject.name(site), &exchanged[k]))
            .collect();
        let mirrored: Vec<Level> = eye.levels.iter().map(Level::mirrored).collect();
        misfit(scene, eye, &mirrored, home, &others, settings).map(|misfit| (eye.subject, misfit))
    };
    // one after the other, each on all cores: what the model shows around one takes tens of megabytes
    let mut all: Vec<(Subject, Misfit)> = eyes.iter().enumerate().filter(|(_, e)| e.wanted).filter_map(of).collect();
    // where no picture fits, the model shows too little to tell
    if all.len() == eyes.iter().filter(|e| e.wanted).count() {
        all.retain(|(_, misfit)| *misfit != Misfit::Nowhere);
    }
    Ok(all)
}

/// One way in which a picture may have been taken.
struct Explanation<'a> {
    what: Option<Misfit>,
    levels: &'a [Level],
    given: LocalPose,
    found: Vec<Candidate>,
}

fn misfit(
    scene: &Scene,
    eye: &Eye,
    mirrored: &[Level],
    home: &Surveyed,
    others: &[(&str, &Surveyed)],
    settings: &RegisterSettings,
) -> Option<Misfit> {
    let judged = level(&eye.levels, JUDGED);
    let near = climbed(scene, level(&eye.levels, SEARCHED), &eye.given, 5);
    let near = climbed(scene, judged, &near, 10);
    let stays = !apart(&near, &eye.given, NEAR);
    let as_given = Judge::new(judged).fit(scene, if stays { &near } else { &eye.given });
    let on_its_head = LocalPose { rotation: eye.given.rotation * Mat3::from_rotation_y(PI), ..eye.given };
    let explained = |what: Option<Misfit>, levels, given: LocalPose, at: &Surveyed| {
        let found = at.search(levels, &given.rotation, settings.tilt_deg);
        Explanation { what, levels, given, found }
    };
    let of_own = |at: &Surveyed| {
        let plain = explained(None, &*eye.levels, eye.given, at);
        let mirrored = explained(Some(Misfit::Mirrored), mirrored, eye.given, at);
        (plain, [mirrored, explained(Some(Misfit::UpsideDown), &*eye.levels, on_its_head, at)])
    };
    let of_others: Vec<Explanation> = others
        .iter()
        .map(|(name, at)| {
            let given = LocalPose { origin: at.origin, ..eye.given };
            explained(Some(Misfit::TakenAt((*name).to_owned())), &*eye.levels, given, at)
        })
        .collect();
    let top = |found: &[Candidate]| found.first().map_or(-1.0, |c| c.score);
    let at_home = |c: &&Candidate| !apart(&c.pose, &eye.given, NEAR_COARSE);
    let (plain, own) = of_own(home);
    let given = plain.found.iter().find(at_home).map_or(-1.0, |c| c.score);
    let loudest = own.iter().chain(&of_others).map(|w| top(&w.found)).fold(top(&plain.found), f32::max);
    if stays && as_given.iter().sum::<f64>() > WELL && given >= loudest {
        return None;
    }
    let here = Surveyed::round(scene, eye, settings.within_m);
    let (plain, own) = of_own(&here);
    let follow = |way: Explanation| {
        let poses = std::iter::once(way.given).chain(way.found.into_iter().map(|c| c.pose));
        (way.what, followed(scene, way.levels, poses, FOLLOWED, JUDGED))
    };
    // only what speaks louder than the pose given is worth following
    let ways: Vec<Explanation> = own.into_iter().chain(of_others).filter(|w| top(&w.found) > given).collect();
    let (_, plain) = follow(plain);
    let fits_better = |p: &Placed, than: &[f64]| better_by(&p.fit, than) > CLEARLY;
    let fits = |p: &Placed| p.correlation() > WELL && p.verdict != Verdict::NotFound;
    let best = ways
        .into_iter()
        .map(follow)
        .filter(|(_, p)| fits(p))
        .max_by(|a, b| a.1.correlation().total_cmp(&b.1.correlation()));
    if let Some((Some(what), placed)) = best
        && fits_better(&placed, &plain.fit)
        && fits_better(&placed, &as_given)
    {
        return Some(what);
    }
    if plain.verdict == Verdict::NotFound {
        return Some(Misfit::Nowhere);
    }
    if fits(&plain) && fits_better(&plain, &as_given) {
        let finer = level(&eye.levels, JUDGED + 1);
        return off(&eye.given, &climbed(scene, finer, &plain.pose, 12));
    }
    None
}

/// How a pose is off another one, if by more than `register` is there for.
fn off(given: &LocalPose, found: &LocalPose) -> Option<Misfit> {
    let (off_m, off_deg) = found.off(given);
    let what = match off_m {
        m if m < SAME_PLACE_M => Misfit::Turned(off_deg.into()),
        m => Misfit::Displaced(m.into(), off_deg.into()),
    };
    apart(found, given, NEAR).then_some(what)
}
