//! Whether the site file's unit and up axis can be those of the model.
//!
//! Nothing in a model says how large it is or which way it stands. What is known are people and rooms: cameras stand at
//! about eye height above a floor, all at nearly the same, under a ceiling that one can stand under; those who hold a
//! camera hold it nearly upright. Each such cue gives every hypothesis, a unit and an axis, a log-likelihood; what the
//! site file says is believed unless another hypothesis is far better.

use glam::{DVec3, Vec3};

use super::cause::{Cause, CauseKind};
use super::surroundings::BESIDE;
use crate::scene::{Ray, Scene};
use crate::site::{Frame, Site, UNITS, Unit, Up};
use crate::statistics::median;

/// By how much another unit or axis must explain the site better than the site file's, in natural logarithms.
const BELIEF: f64 = 5.0;

/// The usual height of a lens above its floor, metres, and the spread of its logarithm between sites.
const EYE_HEIGHT_M: f64 = 1.5;
const EYE_HEIGHT_SD: f64 = 0.3;

/// The least log-likelihood of a site's eye height: now and then probes hang from a crane.
const LEAST_EYE_HEIGHT: f64 = -15.0;

/// Spread of the logarithm of heights within a site: tripods and steps.
const HEIGHTS_SD: f64 = 0.15;

/// The share of eyes that stand above furniture, stairs or a hole, and the range of logarithms over which these spread.
const STRAY_SHARE: f64 = 0.15;
const STRAY_RANGE: f64 = 7.0;

/// Where rooms' measures usually lie, metres, and how fast they become unlikely beyond: the spread of the logarithm.
const HEADROOM_M: Usual = Usual { least: 2.0, most: 40.0, sd: 0.35 };
const BREADTH_M: Usual = Usual { least: 2.0, most: 400.0, sd: 0.7 };
const ELBOW_ROOM_M: Usual = Usual { least: 0.1, most: 15.0, sd: 0.5 };

/// How much the mean up direction of hand-held cameras counts.
const UPRIGHT: f64 = 10.0;

/// With fewer eyes than this no axis is doubted, and no unit that differs less than sixfold.
const FEW: usize = 3;
const SIXFOLD: f64 = 6.0;

/// The log-likelihood, but for a constant, of a ratio to what is usual, whose logarithm has this standard deviation.
pub(crate) fn log_normal(ratio: f64, sd: f64) -> f64 {
    let off = ratio.ln() / sd;
    -0.5 * off * off
}

/// A range within which all is equally likely.
struct Usual {
    least: f64,
    most: f64,
    sd: f64,
}

impl Usual {
    fn log_likelihood(&self, value: f64) -> f64 {
        log_normal((self.least / value).max(value / self.most).max(1.0), self.sd)
    }
}

/// What tells of units and axis, gathered once: lengths are metres by the site file's unit.
struct Cues {
    /// One for each axis that may point up; the site file's first.
    axes: Vec<Standing>,
    /// Diagonal of the model's bounds.
    breadth: f64,
    /// Median distance of the nearest surface from the eyes; `None` without eyes.
    elbow_room: Option<f64>,
    /// How many eyes there are.
    eyes: usize,
}

/// How all eyes stand if an axis points up.
struct Standing {
    /// In the program's axes.
    up: Vec3,
    /// Each eye's height above the surface beneath it, where there is one.
    heights: Vec<Option<f64>>,
    /// Median height above a floor: the surface beneath, or the model's lowest level area.
    height: Option<f64>,
    /// Median height of the ceiling above the floor, where eyes have both.
    headroom: Option<f64>,
    /// Log-likelihood of how cameras were held.
    held: f64,
}

/// The causes, if any, that lie in `site.up` and `site.units`. `nearest_m` are the distances of the nearest surface from
/// each probe and view.
pub(super) fn causes(site: &Site, scene: &Scene, nearest_m: &[f32]) -> Vec<Cause> {
    let cues = cues(site, scene, nearest_m);
    let likely = likeliest(&cues, site.frame.metres_per_unit);
    sentences(&site.frame, &cues, &likely)
}

/// A unit and an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hypothesis {
    /// Index into [`Cues::axes`]; 0 is what the site file says.
    axis: usize,
    /// True metres per metre by the site file's unit.
    scale: f64,
    /// `None` is what the site file says.
    unit: Option<Unit>,
}

fn likeliest(cues: &Cues, metres_per_unit: f64) -> Hypothesis {
    let declared = Hypothesis { axis: 0, scale: 1.0, unit: None };
    let mut best = (0.0, declared);
    for axis in 0..cues.axes.len() {
        let known = cues.axes[axis].height.map_or(0, |_| cues.eyes);
        let others = UNITS.map(|unit| (Some(unit), unit.metres / metres_per_unit));
        for (unit, scale) in std::iter::once((None, 1.0)).chain(others) {
            let fold = scale.max(1.0 / scale);
            let same = unit.is_some() && fold < 1.1;
            let unfounded = (fold < SIXFOLD && known < FEW && unit.is_some()) || (axis != 0 && cues.eyes < FEW);
            if same || unfounded {
                continue;
            }
            let hypothesis = Hypothesis { axis, scale, unit };
            let doubts = usize::from(axis != 0) + usize::from(unit.is_some());
            let odds = cues.log_odds(&hypothesis, &declared) - BELIEF * doubts as f64;
            if odds > best.0 {
                best = (odds, hypothesis);
            }
        }
    }
    best.1
}

impl Cues {
    /// How much better one hypothesis explains all cues than another.
    fn log_odds(&self, one: &Hypothesis, other: &Hypothesis) -> f64 {
        let (a, b) = (&self.axes[one.axis], &self.axes[other.axis]);
        self.sizes(one) - self.sizes(other) + a.held - b.held + a.evenness(b) - b.evenness(a)
    }

    /// Log-likelihood of sizes.
    fn sizes(&self, h: &Hypothesis) -> f64 {
        let standing = &self.axes[h.axis];
        let height = standing
            .height
            .map_or(0.0, |m| log_normal(m * h.scale / EYE_HEIGHT_M, EYE_HEIGHT_SD).max(LEAST_EYE_HEIGHT));
        let headroom = standing.headroom.map_or(0.0, |m| HEADROOM_M.log_likelihood(m * h.scale));
        let elbow_room = self.elbow_room.map_or(0.0, |m| ELBOW_ROOM_M.log_likelihood(m * h.scale));
        height + headroom + elbow_room + BREADTH_M.log_likelihood(self.breadth * h.scale)
    }
}

impl Standing {
    /// How well eyes stand at one height, whatever that is: each near the median, or stray. Only eyes count that have a
    /// surface beneath them along the `other` axis, too: scans have holes in floors, and none in the wall they show.
    fn evenness(&self, other: &Self) -> f64 {
        let both = self.heights.iter().zip(&other.heights).filter(|(_, other)| other.is_some());
        let heights: Vec<f64> = both.filter_map(|(own, _)| *own).collect();
        let Some(median) = median(heights.iter().copied()) else { return 0.0 };
        let stray = STRAY_SHARE / STRAY_RANGE;
        let peak = (1.0 - STRAY_SHARE) / (HEIGHTS_SD * (2.0 * std::f64::consts::PI).sqrt());
        let near = |h: &f64| (peak * log_normal(h / median, HEIGHTS_SD).exp() + stray).ln();
        heights.iter().map(near).sum()
    }
}

fn cues(site: &Site, scene: &Scene, nearest_m: &[f32]) -> Cues {
    let eyes = super::eyes(site, scene.origin, None);
    let ups = cameras_up(site);
    let axes = candidates(&site.frame).into_iter().map(|up| standing(scene, &eyes, &ups, up)).collect();
    let (low, high) = scene.mesh.bounds();
    Cues {
        axes,
        breadth: f64::from((high - low).length()),
        elbow_room: median(nearest_m.iter().filter(|d| d.is_finite()).map(|d| f64::from(d.max(1e-6)))),
        eyes: eyes.len(),
    }
}

/// The site file's up, then the model's axes that are not near it; in the program's axes.
fn candidates(frame: &Frame) -> Vec<Vec3> {
    let axes = [DVec3::Y, DVec3::Z, DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z, DVec3::NEG_X];
    let others = axes.map(|axis| frame.direction_in(axis).as_vec3()).into_iter().filter(|up| up.z < 0.8);
    std::iter::once(Vec3::Z).chain(others).collect()
}

/// The up directions, in the program's axes, of cameras that are not level: a level one stands as the site file's own up
/// axis has it, and tells nothing of it.
fn cameras_up(site: &Site) -> Vec<Vec3> {
    let photographs = site.probes.iter().filter(|p| p.projection.is_photograph()).map(|p| p.pose);
    let poses = photographs.chain(site.views.iter().map(|v| v.camera.pose));
    poses.filter(|pose| pose.rotation.x_axis.z.abs() > 1e-6).map(|pose| pose.rotation.z_axis.as_vec3()).collect()
}

fn standing(scene: &Scene, eyes: &[Vec3], ups: &[Vec3], up: Vec3) -> Standing {
    let (right, ahead) = up.any_orthonormal_pair();
    let along = |eye: Vec3, sign: f32| {
        BESIDE.into_iter().find_map(|(x, y)| {
            let direction = (up * sign + right * x + ahead * y).normalize();
            scene.tracer.closest(&Ray { origin: eye, direction }, 0.0).map(|hit| f64::from(hit.t.max(1e-6)))
        })
    };
    let beneath: Vec<Option<f64>> = eyes.iter().map(|eye| along(*eye, -1.0)).collect();
    let above = eyes.iter().map(|eye| along(*eye, 1.0));
    let headrooms = beneath.iter().zip(above).filter_map(|(below, above)| Some((*below)? + above?));
    let headroom = median(headrooms);
    let lowest = lowest_level(scene, up);
    let above_lowest = |eye: Vec3| Some(f64::from(eye.dot(up) - lowest?)).filter(|h| *h > 1e-6);
    let height = median(beneath.iter().zip(eyes).filter_map(|(below, eye)| below.or_else(|| above_lowest(*eye))));
    let mean = ups.iter().sum::<Vec3>() / ups.len().max(1) as f32;
    let weight = UPRIGHT * (ups.len() as f64 / (FEW + 1) as f64).min(1.0);
    Standing { up, heights: beneath, height, headroom, held: weight * f64::from(mean.dot(up)) }
}

/// The height along `up` below which a twentieth of the level area lies; `None` without any.
fn lowest_level(scene: &Scene, up: Vec3) -> Option<f32> {
    let mesh = &scene.mesh;
    let mut level: Vec<(f32, f64)> = Vec::new();
    for t in 0..mesh.triangles.len() as u32 {
        if mesh.normal(t).dot(up).abs() > 0.9 {
            let [a, b, c] = mesh.corners(t);
            level.push(((a + b + c).dot(up) / 3.0, f64::from(mesh.area(t))));
        }
    }
    level.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = level.iter().map(|l| l.1).sum();
    let mut sum = 0.0;
    level
        .into_iter()
        .find(|(_, area)| {
            sum += area;
            sum >= 0.05 * all
        })
        .map(|(height, _)| height)
}

fn sentences(frame: &Frame, cues: &Cues, likely: &Hypothesis) -> Vec<Cause> {
    let mut causes = Vec::new();
    let standing = &cues.axes[likely.axis];
    if likely.axis != 0 {
        let up = frame.direction_out(standing.up.as_dvec3());
        let name = Up::along(up).map_or_else(String::new, |up| up.name());
        let declared = frame.up.name();
        let count = standing.heights.iter().flatten().count();
        let why = if standing.held > cues.axes[0].held + BELIEF {
            format!("cameras were held with {name} up, as far as one holds a camera upright")
        } else {
            format!("along it {count} of {} probes and views stand at nearly one height above a floor", cues.eyes)
        };
        causes.push(Cause {
            kind: CauseKind::UpAxis,
            subject: "site.up".to_owned(),
            sentence: format!("The model's up axis is likely {name}, not {declared}: {why}. Set site.up = \"{name}\"."),
        });
    }
    if let Some(Unit { key, name, .. }) = likely.unit {
        let is = |unit: &&Unit| (unit.metres / frame.metres_per_unit - 1.0).abs() < 1e-6;
        let declared = UNITS
            .iter()
            .find(is)
            .map_or_else(|| format!("{} m a unit", frame.metres_per_unit), |unit| unit.name.to_owned());
        let sizes = |scale: f64| {
            let breadth = length(cues.breadth * scale);
            match standing.height {
                Some(height) => {
                    format!("its cameras stand {} above the floor and it is {breadth} across", length(height * scale))
                }
                None => format!("it is {breadth} across"),
            }
        };
        causes.push(Cause {
            kind: CauseKind::Units,
            subject: "site.units".to_owned(),
            sentence: format!(
                "The model's unit is likely {name}, not {declared}: as the site file has it, {}; in {name}, {}. Set \
                 site.units = \"{key}\".",
                sizes(1.0),
                sizes(likely.scale)
            ),
        });
    }
    causes
}

/// A length for people.
pub(crate) fn length(metres: f64) -> String {
    match metres {
        ..0.01 => format!("{:.1} mm", 1000.0 * metres),
        ..1.0 => format!("{:.0} cm", 100.0 * metres),
        ..20.0 => format!("{metres:.1} m"),
        _ => format!("{metres:.0} m"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eyes at these heights along the site file's axis, and at others along one other axis, in a hall.
    fn hall(own: &[f64], other: &[f64], held: [f64; 2]) -> Cues {
        let standing = |up, heights: &[f64], held| Standing {
            up,
            heights: heights.iter().map(|h| Some(*h)).collect(),
            height: median(heights.to_vec()),
            headroom: Some(6.0),
            held,
        };
        let axes = vec![standing(Vec3::Z, own, held[0]), standing(Vec3::Y, other, held[1])];
        Cues { axes, breadth: 20.0, elbow_room: Some(1.0), eyes: own.len() }
    }

    fn scaled(mut cues: Cues, by: f64) -> Cues {
        for standing in &mut cues.axes {
            standing.heights.iter_mut().flatten().for_each(|h| *h *= by);
            standing.height = standing.height.map(|h| h * by);
            standing.headroom = standing.headroom.map(|h| h * by);
        }
        Cues { breadth: cues.breadth * by, elbow_room: cues.elbow_room.map(|m| m * by), ..cues }
    }

    const EVEN: [f64; 5] = [1.6, 1.6, 1.65, 1.7, 1.5];
    const SPREAD: [f64; 5] = [5.0, 2.0, 9.0, 3.3, 7.0];
    const RIGHT: Hypothesis = Hypothesis { axis: 0, scale: 1.0, unit: None };

    #[test]
    fn each_unit_is_found_from_how_cameras_stand() {
        for own in UNITS {
            let metres = own.metres;
            // as the site file should have it
            assert_eq!(likeliest(&hall(&EVEN, &SPREAD, [0.0; 2]), metres), RIGHT);
            // inches taken for centimetres are not told: cameras do stand 63 cm above a floor
            let told = |d: f64| (d / metres).max(metres / d) > 3.0;
            for declared in UNITS.map(|unit| unit.metres).into_iter().filter(|d| told(*d)) {
                let wrong = scaled(hall(&EVEN, &SPREAD, [0.0; 2]), declared / metres);
                let found = likeliest(&wrong, declared);
                assert_eq!((found.axis, found.unit), (0, Some(own)), "{metres} declared as {declared}");
            }
        }
    }

    #[test]
    fn right_sites_of_many_kinds_are_believed() {
        for height in [0.6, 0.9, 1.2, 2.0, 2.6, 3.3] {
            let heights = EVEN.map(|h| h / 1.6 * height);
            assert_eq!(likeliest(&hall(&heights, &SPREAD, [0.0; 2]), 1.0), RIGHT, "{height} m");
        }
        // handheld, on stairs and galleries
        assert_eq!(likeliest(&hall(&[0.8, 1.2, 1.7, 2.3, 4.1], &SPREAD, [0.0; 2]), 1.0), RIGHT);
        // along a wall, all at one distance from it
        assert_eq!(likeliest(&hall(&EVEN, &[2.0; 5], [0.0; 2]), 1.0), RIGHT);
        // one probe that hangs high
        assert_eq!(likeliest(&hall(&[6.0], &[1.5], [0.0; 2]), 1.0), RIGHT);
        assert_eq!(likeliest(&hall(&[], &[], [0.0; 2]), 1.0), RIGHT);
    }

    #[test]
    fn the_axis_along_which_heights_are_even_or_cameras_upright_is_up() {
        let turned = Hypothesis { axis: 1, ..RIGHT };
        assert_eq!(likeliest(&hall(&SPREAD, &EVEN, [0.0; 2]), 1.0), turned);
        assert_eq!(likeliest(&hall(&[2.6, 2.5, 2.8], &[1.4, 1.5, 1.3], [-2.0, 8.0]), 1.0), turned);
        let both = scaled(hall(&SPREAD, &EVEN, [0.0; 2]), 100.0);
        assert_eq!(likeliest(&both, 1.0), Hypothesis { axis: 1, scale: 0.01, unit: Some(UNITS[1]) });
    }
}
