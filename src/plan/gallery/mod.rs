//! The art gallery problem: the fewest guards that see all of a polygon with holes, and a proof of how few can do.
//!
//! Witnesses are points that must be seen. Guards enough for the witnesses alone are a lower bound for guards enough
//! for everything; and what such guards leave unseen yields new witnesses, until both numbers meet (Couto, de Rezende
//! and de Souza 2011; Tozoni, de Rezende and de Souza, *Algorithm 966: A practical iterative algorithm for the art
//! gallery problem using integer linear programming*, ACM TOMS 43(2), 2016).
//!
//! **Exactness.** Sight is decided exactly. A guard counts as seeing a witness when it lies within 10⁻¹⁰ of the extent
//! of the witness's region: that can only lower the lower bound. Everything is seen when no unseen face holds a circle
//! of 10⁻⁷ of the extent (0.01 mm in a house of 100 m).

mod arrangement;
mod crossings;
#[cfg(test)]
mod tests;
mod unseen;
mod witness_region;

use super::cover::coverage::Coverage;
use super::cover::exact::{SearchLimits, minimum};
use super::cover::greedy::{Goal, select};
use super::cover::reduce::maximal;
use super::free_space::open_space::OpenSpace;
use super::free_space::polygon::Polygon;
use super::free_space::predicates::orient;
use arrangement::Candidates;
use glam::DVec2;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};
use unseen::unseen;
use witness_region::WitnessRegion;

/// How hard to try.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effort {
    /// Go on until the fewest guards are proved, or the time is over.
    pub certify: bool,
    /// Stop then, with what is known; only with `certify`.
    pub time_limit: Option<Duration>,
}

/// Guards, and how good they are.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Guards {
    /// Where to stand, the widest view first.
    pub guards: Vec<DVec2>,
    /// The share of the area they see, 0 to 1.
    pub covered_fraction: f64,
    /// No fewer guards see everything.
    pub lower_bound: usize,
    /// Rounds of new witnesses that it took.
    pub rounds: usize,
    /// Witnesses at the end.
    pub witnesses: usize,
}

impl Guards {
    /// Whether no fewer guards can do.
    pub fn proved(&self) -> bool {
        self.lower_bound >= self.guards.len()
    }
}

/// The share of the open space that guards see, 0 to 1.
pub fn covered_fraction(open: &OpenSpace, guards: &[DVec2]) -> f64 {
    (1.0 - unseen(open, guards, 0.0).area / open.area()).clamp(0.0, 1.0)
}

/// What guards leave unseen; hair-thin slivers are left out.
pub fn unseen_polygons(open: &OpenSpace, guards: &[DVec2]) -> Vec<Polygon> {
    unseen(open, guards, open.extent() * 1e-7).faces.into_iter().map(|face| face.outline).collect()
}

/// Guards that see all of an open space, few or fewest.
///
/// Without `certify`, the result depends on nothing but the input; a run that meets its time limit does not.
pub fn guard(open: &OpenSpace, effort: Effort) -> Guards {
    let until = effort.time_limit.filter(|_| effort.certify).map(|t| Instant::now() + t);
    let mut search = Search::new(open, effort.certify, until);
    search.run();
    search.result()
}

/// In fast mode a search tree has at most so many nodes for each part of the problem, and there are at most so many
/// rounds: one, where witnesses are more than so many.
const FAST_NODES: usize = 20;
const FAST_ROUNDS: usize = 4;
const FAST_WITNESSES: usize = 2000;

struct Search<'a> {
    open: &'a OpenSpace,
    certify: bool,
    until: Option<Instant>,
    /// 10⁻¹⁰ of the extent.
    tolerance: f64,
    /// Of each witness.
    regions: Vec<WitnessRegion>,
    candidates: Candidates,
    /// Candidates that turned out not to see a witness, for all that rounding says.
    struck: BTreeSet<(u32, u32)>,
    /// The fewest guards so far that leave nothing but slivers unseen, and the area of these.
    best: Option<(Vec<DVec2>, f64)>,
    lower: usize,
    rounds: usize,
}

impl<'a> Search<'a> {
    fn new(open: &'a OpenSpace, certify: bool, until: Option<Instant>) -> Self {
        let mut search = Self {
            open,
            certify,
            until,
            tolerance: open.extent() * 1e-10,
            regions: Vec::new(),
            candidates: Candidates::new(open),
            struck: BTreeSet::new(),
            best: None,
            lower: 1,
            rounds: 0,
        };
        for w in first_witnesses(open) {
            search.add_witness(w);
        }
        search
    }

    fn add_witness(&mut self, w: DVec2) {
        self.regions.push(WitnessRegion::new(self.open, w, self.tolerance));
    }

    fn late(&self) -> bool {
        self.until.is_some_and(|t| Instant::now() >= t)
    }

    fn met(&self) -> bool {
        self.best.as_ref().is_some_and(|(guards, _)| guards.len() <= self.lower)
    }

    fn run(&mut self) {
        loop {
            self.rounds += 1;
            let arranged = self.regions.len();
            let whole = self.candidates.arrange(self.open, &self.regions, self.until);
            let all: Vec<usize> = (0..self.candidates.points.len()).collect();
            // a place where no more witnesses are seen from than from another need not be tried
            let kept = maximal(&self.coverage(&all, arranged, false));
            let coverage = self.coverage(&kept, arranged, false);
            let nodes = (!self.certify).then_some(FAST_NODES);
            let least = minimum(&coverage, SearchLimits { until: self.until, nodes });
            if whole {
                self.lower = self.lower.max(least.at_least);
            }
            if self.met() {
                return;
            }
            let selection = least.chosen.into_iter().map(|k| kept[k]).collect();
            self.cover_all(kept, selection);
            let enough = !self.certify && (self.rounds >= FAST_ROUNDS || self.regions.len() > FAST_WITNESSES);
            if enough || self.met() || self.late() || self.regions.len() == arranged {
                return;
            }
        }
    }

    /// Adds witnesses until guards among the candidates leave nothing unseen.
    ///
    /// Candidates are those that see most of the first witnesses, and all corners: these see everything.
    fn cover_all(&mut self, mut kept: Vec<usize>, mut selection: Vec<usize>) {
        kept.extend(0..self.open.corners().len());
        kept.sort_unstable();
        kept.dedup();
        let clearance = self.tolerance * 1e3;
        loop {
            let points: Vec<DVec2> = selection.iter().map(|&c| self.candidates.points[c]).collect();
            let mut left = unseen(self.open, &points, clearance);
            if left.faces.is_empty() {
                self.keep(points, left.area);
                return;
            }
            let first = self.regions.len();
            left.faces.sort_by(|a, b| {
                let by_place = || a.middle.x.total_cmp(&b.middle.x).then(a.middle.y.total_cmp(&b.middle.y));
                b.area.total_cmp(&a.area).then_with(by_place)
            });
            for face in &left.faces {
                self.add_witness(face.middle);
            }
            self.candidates.ask(self.open, &self.regions);
            for &c in &selection {
                let claims = self.candidates.sees[c].iter().filter(|&&w| w as usize >= first);
                self.struck.extend(claims.map(|&w| (c as u32, w)));
            }
            let late = self.late();
            let coverage = self.coverage(&kept, self.regions.len(), true);
            let next = if late {
                select(&coverage, &Goal::default()).chosen
            } else {
                let nodes = if self.certify { 20_000 } else { FAST_NODES };
                minimum(&coverage, SearchLimits { until: self.until, nodes: Some(nodes) }).chosen
            };
            selection = next.into_iter().map(|k| kept[k]).collect();
            // no cover of these witnesses can be better than the best
            let best = self.best.as_ref().map_or(usize::MAX, |b| b.0.len());
            if selection.len() >= best && (late || self.rounds > 1) {
                return;
            }
        }
    }

    fn keep(&mut self, guards: Vec<DVec2>, unseen: f64) {
        if self.best.as_ref().is_none_or(|(best, _)| guards.len() < best.len()) {
            self.best = Some((guards, unseen));
        }
    }

    /// Which of these candidates sees which of the first `upto` witnesses; with `strict`, less what was struck out.
    fn coverage(&self, among: &[usize], upto: usize, strict: bool) -> Coverage {
        let list = |&c: &usize| {
            let of = self.candidates.sees[c].iter().copied();
            of.filter(move |&w| (w as usize) < upto && !(strict && self.struck.contains(&(c as u32, w))))
        };
        Coverage::new(vec![1.0; upto], among.iter().map(list))
    }

    fn result(self) -> Guards {
        let (guards, unseen) = self.best.unwrap_or_default();
        let open = self.open;
        let view = |g: DVec2| open.visibility(g).map_or(0.0, |v| v.area());
        let mut views: Vec<(f64, DVec2)> =
            guards.into_iter().map(|g| open.pulled_in(g).unwrap_or(g)).map(|g| (view(g), g)).collect();
        views.sort_by(|a, b| b.0.total_cmp(&a.0));
        let guards = views.into_iter().map(|(_, g)| g).collect();
        let covered_fraction = (1.0 - unseen / open.area()).clamp(0.0, 1.0);
        let (rounds, witnesses) = (self.rounds, self.regions.len());
        Guards { guards, covered_fraction, lower_bound: self.lower, rounds, witnesses }
    }
}

/// Corners that turn outwards, and middles of walls between corners that turn inwards: seeing them sees most (Chwa et
/// al., *Guarding art galleries by guarding witnesses*, 2006).
fn first_witnesses(open: &OpenSpace) -> Vec<DVec2> {
    let mut witnesses = Vec::new();
    for polygon in open.polygons() {
        for (ring, inside_left) in polygon.sided_rings() {
            let n = ring.len();
            let reflex = |i: usize| {
                let turn = orient(ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]);
                if inside_left { turn <= 0.0 } else { turn >= 0.0 }
            };
            for i in 0..n {
                match (reflex(i), reflex((i + 1) % n)) {
                    (false, _) => witnesses.push(ring[i]),
                    (true, true) => witnesses.extend(open.pulled_in((ring[i] + ring[(i + 1) % n]) / 2.0)),
                    (true, false) => {}
                }
            }
        }
    }
    witnesses
}
