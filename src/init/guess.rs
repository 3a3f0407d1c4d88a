//! The unit and the up axis of a model that does not say them, guessed from what interiors have in common.
//!
//! Which way is up: a floor is the largest level surface and lies at the foot, while walls stand in pairs and what is
//! overhead is vaulted, pitched or not scanned; furniture makes the lower half the fuller one; rooms are lower than wide.
//! How large a unit is: rooms have usual heights and breadths, modelled details a usual size, and what is raised above a
//! floor is a step, a seat, a table or a counter, whose heights are made for people. Cameras whose places are known tell
//! both better: people hold them upright, at eye height.
//!
//! Each cue is a log-likelihood; their widths were set by hand on the models of `docs/init.md`, which shows how well it does.

use glam::{DVec3, Vec3};

use crate::check::{length, log_normal};
use crate::scene::Mesh;
use crate::site::{UNITS, Unit, Up};
use crate::statistics::{median, quantile};

/// By how much the best axis, and the best unit, must be better than the next to be called sure, in natural logarithms.
const SURE_AXIS: f64 = 1.0;
const SURE_UNIT: f64 = 2.0;

/// Normals within 1 − this of an axis count as along it.
const LEVEL: f32 = 0.97;

/// What is known of a model beside its triangles.
#[derive(Clone, Debug)]
pub(super) struct Hints {
    /// The up axis by the format's own rules or habits, and by how much to believe it.
    pub(super) axis: (DVec3, f64),
    /// Metres in a unit by the file itself, and where it says so.
    pub(super) metres_per_unit: Option<(f64, &'static str)>,
    /// Where cameras stand, in the model's axes and units.
    pub(super) eyes: Vec<DVec3>,
    /// Which way their pictures' tops point, in the model's axes.
    pub(super) ups: Vec<DVec3>,
}

/// A value, how it was come by, and whether others would do.
#[derive(Clone, Debug)]
pub struct Guessed<T> {
    /// What is taken.
    pub value: T,
    /// What speaks for it, as part of a sentence.
    pub why: String,
    /// What would do nearly as well, where it is not sure.
    pub rival: Option<T>,
}

impl<T> Guessed<T> {
    /// Whether nothing else comes near.
    pub fn sure(&self) -> bool {
        self.rival.is_none()
    }
}

/// The frame of a model.
#[derive(Clone, Debug)]
pub struct Guess {
    /// What points up.
    pub up: Guessed<Up>,
    /// The unit of length.
    pub unit: Guessed<Unit>,
}

/// Guesses the frame of `mesh`, whose positions are in the model's own axes and units, `origin` off.
pub(super) fn guess(mesh: &Mesh, origin: DVec3, hints: &Hints) -> Guess {
    let facets = Facets::of(mesh);
    let mut standings: Vec<Standing> = candidates(&facets, hints).iter().map(|c| Standing::of(&facets, c)).collect();
    let scores: Vec<f64> = standings.iter().map(|s| s.log_likelihood(hints)).collect();
    let best = (0..scores.len()).fold(0, |best, i| if scores[i] > scores[best] { i } else { best });
    // the same direction may come from the axes and from the walls
    let others = (0..scores.len()).filter(|i| standings[*i].up.dot(standings[best].up) < 0.99);
    let next = others.reduce(|a, b| if scores[b] > scores[a] { b } else { a });
    let rival = next.filter(|n| scores[best] - scores[*n] < SURE_AXIS).and_then(|n| standings[n].axis());
    let standing = standings.swap_remove(best);
    let up = Guessed { value: standing.axis().unwrap_or(Up::Y), why: standing.reason(hints), rival };
    Guess { unit: unit(&standing, &facets, origin, hints), up }
}

/// The triangles, as far as guesses need them.
struct Facets<'a> {
    mesh: &'a Mesh,
    /// Centre, unit normal and area of each.
    all: Vec<(Vec3, Vec3, f32)>,
    area: f64,
    /// A tenth of all edges are shorter than this.
    detail: f64,
}

impl<'a> Facets<'a> {
    fn of(mesh: &'a Mesh) -> Self {
        let count = mesh.triangles.len();
        let (mut all, mut edges) = (Vec::with_capacity(count), Vec::with_capacity(3 * count));
        for t in 0..count as u32 {
            let [a, b, c] = mesh.corners(t);
            all.push(((a + b + c) / 3.0, mesh.normal(t), mesh.area(t)));
            edges.extend([a.distance(b), b.distance(c), c.distance(a)]);
        }
        let area = all.iter().map(|f| f64::from(f.2)).sum::<f64>().max(f64::MIN_POSITIVE);
        Self { mesh, all, area, detail: f64::from(quantile(&mut edges, 0.1).unwrap_or(0.0)) }
    }

    /// The share of the area whose normal is within `cosine` of a direction or its opposite.
    fn facing(&self, direction: Vec3, cosine: f32) -> f64 {
        let facing = self.all.iter().filter(|(_, n, _)| n.dot(direction).abs() > cosine);
        facing.map(|f| f64::from(f.2)).sum::<f64>() / self.area
    }

    /// Where the model begins and ends along a direction, without the outermost 0.2 % of vertices: scans have strays.
    fn extent(&self, direction: Vec3) -> [f32; 2] {
        /// So many vertices tell enough.
        const ENOUGH: usize = 100_000;
        let step = (self.mesh.triangles.len() / ENOUGH).max(1);
        let mut along: Vec<f32> = Vec::new();
        for triangle in self.mesh.triangles.iter().step_by(step) {
            along.extend(triangle.iter().map(|i| self.mesh.positions[*i as usize].dot(direction)));
        }
        [0.002, 0.998].map(|share| quantile(&mut along, share).unwrap_or(0.0))
    }
}

/// An up direction to be judged, and two horizontal ones with it; and how likely it is before anything is measured.
struct Candidate {
    axes: [Vec3; 3],
    prior: f64,
}

/// The six axes; where walls and floors face none of them, the six directions that they do face, and the cameras' own up.
fn candidates(facets: &Facets, hints: &Hints) -> Vec<Candidate> {
    let all_six = |[a, b, c]: [Vec3; 3]| [[a, b, c], [b, c, a], [c, a, b], [-a, b, c], [-b, c, a], [-c, a, b]];
    let mut all: Vec<Candidate> =
        all_six(Vec3::AXES).into_iter().map(|axes| Candidate { axes, prior: prior(axes[0], hints) }).collect();
    let aligned = Vec3::AXES.iter().map(|axis| facets.facing(*axis, 0.99)).fold(0.0, f64::max);
    let frame = dominant_frame(facets);
    if facets.facing(frame[0], 0.99) > 2.0 * aligned {
        // programs that fuse scans take the first camera's axes, in which y points down
        let prior = |axes: [Vec3; 3]| Candidate { axes, prior: -1.0 - 0.5 * f64::from(axes[0].y) };
        all.extend(all_six(frame).map(prior));
    }
    if let Some(held) = mean_up(hints) {
        let near = all.iter().map(|c| c.axes[0].dot(held)).fold(-1.0, f32::max);
        if near < 0.995 {
            let up = settled(facets, held);
            let (a, b) = up.any_orthonormal_pair();
            all.push(Candidate { axes: [up, a, b], prior: -1.0 });
        }
    }
    all
}

/// How likely an axis points up before anything is measured: y and z are the two habits.
fn prior(up: Vec3, hints: &Hints) -> f64 {
    let habit = match up {
        Vec3::Y | Vec3::Z => 0.0,
        Vec3::NEG_Y => -1.5,
        _ => -2.0,
    };
    let (axis, weight) = hints.axis;
    habit + if axis.as_vec3() == up { weight } else { 0.0 }
}

/// The mean up direction of cameras, where they agree.
fn mean_up(hints: &Hints) -> Option<Vec3> {
    let mean = hints.ups.iter().sum::<DVec3>() / hints.ups.len().max(1) as f64;
    (hints.ups.len() > 3 && mean.length() > 0.7).then(|| mean.normalize().as_vec3())
}

/// A direction turned to the mean of the normals around it, where there are any: cameras are held nearly upright, floors lie
/// level.
fn settled(facets: &Facets, near: Vec3) -> Vec3 {
    let mut direction = near;
    for cosine in [0.96, 0.985, 0.995, 0.995] {
        let mut sum = Vec3::ZERO;
        for (_, normal, area) in &facets.all {
            let along = normal.dot(direction);
            if along.abs() > cosine {
                sum += *normal * along.signum() * *area;
            }
        }
        direction = sum.try_normalize().unwrap_or(direction);
    }
    direction
}

/// Three directions at right angles: the one that most of the area faces, the one across it that most faces, and the third.
fn dominant_frame(facets: &Facets) -> [Vec3; 3] {
    /// Directions tried, and triangles that vote.
    const DIRECTIONS: usize = 600;
    const VOTERS: usize = 20_000;
    let step = (facets.all.len() / VOTERS).max(1);
    let votes = |direction: &Vec3| {
        let facing = facets.all.iter().step_by(step).filter(|(_, n, _)| n.dot(*direction).abs() > 0.98);
        facing.map(|f| f64::from(f.2)).sum::<f64>()
    };
    let mut all: Vec<(f64, Vec3)> = crate::sphere::sphere(DIRECTIONS).map(|d| (votes(&d), d)).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let first = settled(facets, all.first().map_or(Vec3::Y, |v| v.1));
    let across = all.iter().find(|(_, d)| d.dot(first).abs() < 0.15).map_or(first.any_orthonormal_vector(), |v| v.1);
    let second = settled(facets, across).reject_from(first).try_normalize().unwrap_or(first.any_orthonormal_vector());
    [first, second, first.cross(second)]
}

/// The model seen with one direction up. Lengths are model units.
struct Standing {
    up: Vec3,
    prior: f64,
    height: f64,
    /// Across, from corner to corner.
    breadth: f64,
    /// Height over breadth of a square of the same area.
    slenderness: f64,
    /// The share of all area that is level at one height, at most, in the lowest and in the highest fifth.
    level_share: [f64; 2],
    /// By how much the area, and the triangles, lie below the middle, as a share of the height.
    low: [f64; 2],
    /// Heights and shares of level areas, lowest first.
    levels: Vec<(f64, f64)>,
}

/// Level areas are told apart by this share of the height.
const BINS: usize = 1000;

impl Standing {
    fn of(facets: &Facets, candidate: &Candidate) -> Self {
        let [up, a, b] = candidate.axes;
        let [low, high] = facets.extent(up);
        let height = (high - low).max(f32::MIN_POSITIVE);
        let [wide, deep] =
            [a, b].map(|axis| facets.extent(axis)).map(|[l, h]| f64::from((h - l).max(f32::MIN_POSITIVE)));
        let (mut by_area, mut by_count) = (0.0, 0.0);
        let mut bins = vec![[0.0f64; 2]; BINS + 1];
        let mut level = 0.0;
        for (centre, normal, area) in &facets.all {
            let at = ((centre.dot(up) - low) / height).clamp(0.0, 1.0);
            by_area += f64::from(at * area);
            by_count += f64::from(at);
            if normal.dot(up).abs() > LEVEL {
                let bin = &mut bins[(at * BINS as f32).round() as usize];
                bin[0] += f64::from(*area);
                bin[1] += f64::from(*area) * f64::from(centre.dot(up));
                level += f64::from(*area);
            }
        }
        let fifth = BINS / 5;
        // neighbouring bins together: a floor may lie on the edge of one
        let peak = |bins: &[[f64; 2]]| {
            bins.windows(BINS / 50).map(|w| w.iter().map(|b| b[0]).sum::<f64>()).fold(0.0, f64::max) / facets.area
        };
        Self {
            up,
            prior: candidate.prior,
            height: f64::from(height),
            breadth: wide.hypot(deep),
            slenderness: f64::from(height) / (wide * deep).sqrt(),
            level_share: [peak(&bins[..fifth]), peak(&bins[BINS - fifth..])],
            low: [0.5 - by_area / facets.area, 0.5 - by_count / facets.all.len().max(1) as f64],
            levels: levels(&bins, level.max(f64::MIN_POSITIVE)),
        }
    }

    fn axis(&self) -> Option<Up> {
        // a direction that was measured is as good as an axis that it all but is
        let up = self.up.as_dvec3();
        let axis = [DVec3::X, DVec3::Y, DVec3::Z].map(|a| a * a.dot(up).signum());
        Up::along(axis.into_iter().find(|a| a.dot(up) > 0.99999).unwrap_or(up))
    }

    /// How likely this direction points up.
    fn log_likelihood(&self, hints: &Hints) -> f64 {
        /// How much a floor that outweighs what is overhead tells, a fuller lower half, more things in it, and cameras.
        const FLOOR: f64 = 1.0;
        const FULLER: [f64; 2] = [8.0, 3.0];
        const HELD: f64 = 10.0;
        /// Usual height over breadth, and the spread of its logarithm.
        const SLENDER: (f64, f64) = (0.6, 0.6);
        let [foot, top] = self.level_share.map(|share| share + 0.01);
        let floor = FLOOR * (foot / top).ln().clamp(-2.0, 2.0);
        let fuller = FULLER[0] * self.low[0] + FULLER[1] * self.low[1];
        let slender = log_normal(self.slenderness / SLENDER.0, SLENDER.1);
        let held = mean_up(hints).map_or(0.0, |held| HELD * f64::from(held.dot(self.up)));
        self.prior + floor + fuller + slender + held
    }

    /// What speaks for this direction.
    fn reason(&self, hints: &Hints) -> String {
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let [foot, top] = self.level_share.map(percent);
        let held = if mean_up(hints).is_some() { "cameras were held so, and " } else { "" };
        format!("{held}{foot} of its area lies level at the foot and {top} at the top")
    }

    /// How high cameras stand above the floor beneath them, model units: the highest level below that is at least half as large
    /// as any.
    fn eye_height(&self, origin: DVec3, hints: &Hints) -> Option<f64> {
        let eye = median(hints.eyes.iter().map(|eye| (*eye - origin).dot(self.up.as_dvec3())))?;
        let below = || self.levels.iter().filter(|l| l.0 < eye);
        let largest = below().map(|l| l.1).fold(0.0, f64::max);
        below().filter(|l| l.1 >= 0.5 * largest).map(|l| eye - l.0).reduce(f64::min)
    }
}

/// Heights that hold a hundredth of the level area or more, each with its share: runs of bins that are not empty.
fn levels(bins: &[[f64; 2]], level: f64) -> Vec<(f64, f64)> {
    /// Below this share of the level area a bin parts two heights.
    const EMPTY: f64 = 4e-4;
    let runs = bins.split(|bin| bin[0] <= EMPTY * level);
    let sums = runs.map(|run| run.iter().fold([0.0; 2], |sum, bin| [sum[0] + bin[0], sum[1] + bin[1]]));
    sums.filter(|sum| sum[0] > 0.01 * level).map(|sum| (sum[1] / sum[0], sum[0] / level)).collect()
}

/// What people make things' heights by: name, metres, spread of the logarithm, and how often.
const RAISED: [(&str, f64, f64, f64); 4] = [
    ("a step", 0.16, 0.15, 0.35),
    ("a seat", 0.45, 0.12, 0.25),
    ("a table", 0.75, 0.08, 0.15),
    ("a counter or railing", 1.0, 0.15, 0.1),
];

/// The log-likelihood of a height above a floor, metres, and the same height with what it most likely is.
fn raised(height: f64) -> (f64, Option<(f64, &'static str)>) {
    /// Anything else, over a range of logarithms.
    const OTHER: f64 = 0.15 / 5.0;
    let density = |&(_, usual, sd, often): &(&str, f64, f64, f64)| {
        often * log_normal(height / usual, sd).exp() / (sd * (2.0 * std::f64::consts::PI).sqrt())
    };
    let sum: f64 = RAISED.iter().map(density).sum::<f64>() + OTHER;
    let likely = RAISED.iter().find(|r| density(r) > 0.5 * sum).map(|r| (height, r.0));
    (sum.ln(), likely)
}

/// How likely a unit of so many metres is, by the sizes that it makes of the model, and these as part of a sentence: how large it
/// is, and what in it is of a size that people know.
fn sized(standing: &Standing, facets: &Facets, eye_height: Option<f64>, metres: f64) -> (f64, String) {
    /// Usual values in metres, and the spread of their logarithms: of heights of interiors, breadths, and details of models
    /// that were drawn; cameras above floors.
    const HEIGHT: (f64, f64) = (6.0, 0.8);
    const BREADTH: (f64, f64) = (18.0, 0.9);
    const DETAIL: (f64, f64) = (0.03, 1.0);
    const EYES: (f64, f64) = (1.5, 0.3);
    /// Scans have edges of a size of their own.
    const SCANNED: usize = 200_000;
    /// The share of the level area that makes a level a floor; the range of heights above it that are told; and how many.
    const FLOOR: f64 = 0.12;
    const ABOVE_M: std::ops::Range<f64> = 0.04..1.4;
    const TOLD: usize = 3;
    let usual = |value: f64, (usual, sd): (f64, f64)| log_normal(value.max(1e-12) * metres / usual, sd);
    let detail = if facets.all.len() < SCANNED { usual(facets.detail, DETAIL) } else { 0.0 };
    let eyes = eye_height.map_or(0.0, |h| usual(h, EYES).max(-15.0));
    let mut things = Vec::new();
    for floor in standing.levels.iter().filter(|l| l.1 > FLOOR) {
        let above = standing.levels.iter().map(|l| (l.0 - floor.0) * metres).filter(|h| ABOVE_M.contains(h));
        things.extend(above.take(TOLD).map(raised));
    }
    let best = things.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a });
    let (told, thing) = best.unwrap_or((-1.0, None));
    let log_likelihood = usual(standing.height, HEIGHT) + usual(standing.breadth, BREADTH) + detail + eyes + told;
    let cameras = eye_height.map_or_else(String::new, |h| format!(", cameras {} above its floor", length(h * metres)));
    let thing = thing.map_or_else(String::new, |(h, what)| format!(", {what} {} high in it", length(h)));
    let [high, across] = [standing.height, standing.breadth].map(|v| length(v * metres));
    (log_likelihood, format!("it is then {high} high and {across} across{cameras}{thing}"))
}

fn unit(standing: &Standing, facets: &Facets, origin: DVec3, hints: &Hints) -> Guessed<Unit> {
    /// How often people model in each of [`UNITS`].
    const USE: [f64; 5] = [0.5, 0.2, 0.13, 0.08, 0.09];
    let eye_height = standing.eye_height(origin, hints);
    // the likeliest first: score, unit, and what speaks for it
    let mut all: Vec<(f64, Unit, String)> = UNITS
        .into_iter()
        .zip(USE)
        .map(|(unit, often)| {
            let (log_likelihood, why) = sized(standing, facets, eye_height, unit.metres);
            (often.ln() + log_likelihood, unit, why)
        })
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let told = hints.metres_per_unit.and_then(|(metres, says)| {
        let is = |(_, unit, _): &&(f64, Unit, String)| (unit.metres / metres - 1.0).abs() < 1e-6;
        all.iter().find(is).map(|found| (found, says))
    });
    let (best, next) = (&all[0], &all[1]);
    match told {
        // exporters forget to scale
        Some(((score, unit, why), says)) => {
            let sure = best.0 - score < 3.0 * SURE_UNIT;
            Guessed { value: *unit, why: format!("{says}; {why}"), rival: (!sure).then_some(best.1) }
        }
        None => {
            let sure = best.0 - next.0 >= SURE_UNIT;
            Guessed { value: best.1, why: best.2.clone(), rival: (!sure).then_some(next.1) }
        }
    }
}
