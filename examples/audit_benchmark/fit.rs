//! Fits the weights of the decision (`src/audit/decide/odds.rs`) to candidates whose truth is known: logistic regression with
//! a Gaussian prior around the weights as they are (Hosmer & Lemeshow, *Applied Logistic Regression*, 2013). How good they are is told by
//! weights that a candidate's own site had no part in.

use clerestory::audit::{Evidence, Finding};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::measure::median;

/// Candidates that are less likely than this, by the weights as they are, are not kept.
pub const LEAST: f64 = 0.003;

/// Precision of the prior on the bias, and on a weight, whose cue has a standard deviation of 1.
const PRIOR: [f64; 2] = [0.5, 5.0];

/// What touches a fault and has a smaller share of itself in it than this is neither fault nor none.
const WITHIN: f64 = 0.3;

/// What is known only when all photographs are adds to the odds as it does, and is not fitted.
const GIVEN: [&str; 2] = ["found right in other photographs", "regions like it elsewhere"];

/// What was weighed, and whether it is a fault.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Candidate {
    site: String,
    of_right_model: bool,
    fault: bool,
    /// Share of it that lies within the fault.
    within: f64,
    /// Logarithm of the odds where all cues speak neither way.
    bias: f64,
    /// The first one's name says what way it was found.
    cues: Vec<Cue>,
}

/// A cue of a candidate, and what it says by the weights as they are.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Cue {
    name: String,
    value: f64,
    even: f64,
    log_odds: f64,
}

impl Candidate {
    pub fn new(site: &str, of_right_model: bool, fault: bool, within: f64, finding: &Finding) -> Self {
        let cue = |e: &Evidence| Cue { name: e.test.clone(), value: e.value, even: e.threshold, log_odds: e.log_odds };
        let cues: Vec<Cue> = finding.evidence.iter().map(cue).collect();
        let told: f64 = cues.iter().map(|c| c.log_odds).sum();
        let bias = (finding.score / (1.0 - finding.score).max(1e-12)).ln() - told;
        Self { site: site.to_owned(), of_right_model, fault, within, bias, cues }
    }

    fn cue(&self, name: &str) -> Option<&Cue> {
        self.cues.iter().find(|cue| cue.name == name)
    }

    /// What is [`GIVEN`] adds to the logarithm of its odds.
    fn given(&self) -> f64 {
        GIVEN.iter().filter_map(|name| self.cue(name)).map(|cue| cue.log_odds).sum()
    }
}

/// Writes candidates, one a line, after the number of photographs of right models.
pub fn write(file: &Path, photographs: usize, all: &[Candidate]) {
    let lines: String = all.iter().map(|c| serde_json::to_string(c).unwrap() + "\n").collect();
    std::fs::write(file, format!("{photographs}\n{lines}")).unwrap();
}

fn read(file: &str) -> (usize, Vec<Candidate>) {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let photographs = lines.next().unwrap().parse().unwrap();
    (photographs, lines.map(|line| serde_json::from_str(line).unwrap()).collect())
}

/// The candidates of one way, as regression has them: a row each of 1 and the cues, whose standard deviation is 1.
struct Samples {
    names: Vec<String>,
    even: Vec<f64>,
    spread: Vec<f64>,
    rows: Vec<Vec<f64>>,
    /// What is [`GIVEN`] adds to the logarithm of the odds.
    given: Vec<f64>,
    faults: Vec<f64>,
    /// The weights as they are.
    now: Vec<f64>,
}

impl Samples {
    /// Takes of the candidates' cues those that all of them have, in the first one's order, but for some: versions differ in what they
    /// measure.
    fn new(all: &[Candidate], without: &[&str]) -> Self {
        let fitted = |name: &str| !GIVEN.contains(&name) && !without.contains(&name);
        let names = all[0].cues.iter().map(|cue| &cue.name);
        let names: Vec<String> =
            names.filter(|name| fitted(name) && all.iter().all(|c| c.cue(name).is_some())).cloned().collect();
        let cues: Vec<Vec<&Cue>> = all.iter().map(|c| names.iter().filter_map(|name| c.cue(name)).collect()).collect();
        let n = names.len();
        let off = |cues: &[&Cue], k: usize| cues[k].value - cues[k].even;
        let squares = |k: usize| cues.iter().map(|c| off(c, k).powi(2)).sum::<f64>() / all.len() as f64;
        let spread: Vec<f64> = (0..n).map(|k| squares(k).sqrt().max(1e-6)).collect();
        let weight = |k: usize| {
            let telling = cues.iter().filter(|c| off(c, k).abs() > 1e-3);
            middle(telling.map(|c| c[k].log_odds / off(c, k) * spread[k]).collect())
        };
        let row = |c: &Vec<&Cue>| std::iter::once(1.0).chain((0..n).map(|k| off(c, k) / spread[k])).collect();
        Self {
            names,
            even: cues[0].iter().map(|cue| cue.even).collect(),
            rows: cues.iter().map(row).collect(),
            given: all.iter().map(Candidate::given).collect(),
            faults: all.iter().map(|c| f64::from(u8::from(c.fault))).collect(),
            now: std::iter::once(middle(all.iter().map(|c| c.bias).collect())).chain((0..n).map(weight)).collect(),
            spread,
        }
    }

    /// Weights by Newton's method, from those candidates that count.
    fn fit(&self, counts: impl Fn(usize) -> bool) -> Vec<f64> {
        let n = self.now.len();
        let prior = |k: usize| PRIOR[usize::from(k > 0)];
        let mut weights = self.now.clone();
        for _ in 0..30 {
            let mut gradient: Vec<f64> = (0..n).map(|k| prior(k) * (self.now[k] - weights[k])).collect();
            let mut hessian = vec![vec![0.0; n]; n];
            (0..n).for_each(|k| hessian[k][k] = prior(k));
            for (i, (row, t)) in self.rows.iter().zip(&self.faults).enumerate().filter(|(i, _)| counts(*i)) {
                let p = 1.0 / (1.0 + (-dot(row, &weights) - self.given[i]).exp());
                for a in 0..n {
                    gradient[a] += (t - p) * row[a];
                    for b in 0..n {
                        hessian[a][b] += p * (1.0 - p) * row[a] * row[b];
                    }
                }
            }
            let step = solved(hessian, gradient);
            weights.iter_mut().zip(&step).for_each(|(w, s)| *w += s);
        }
        weights
    }

    /// Logarithm of a candidate's odds by some weights.
    fn odds(&self, i: usize, weights: &[f64]) -> f64 {
        dot(&self.rows[i], weights) + self.given[i]
    }

    /// Mean logarithmic loss of some logarithms of odds.
    fn loss(&self, odds: &[f64]) -> f64 {
        let of = |(z, t): (&f64, &f64)| z.exp().ln_1p() - t * z;
        odds.iter().zip(&self.faults).map(of).sum::<f64>() / odds.len() as f64
    }
}

/// Prints the weights that suit the candidates of these files best, if cues of some names are left out.
pub fn fit(files: &[String], without: &[&str]) {
    let mut ways: BTreeMap<String, Vec<Candidate>> = BTreeMap::new();
    let mut photographs = 0;
    for file in files {
        let (right, all) = read(file);
        photographs += right;
        for c in all.into_iter().filter(|c| !c.fault || c.within >= WITHIN) {
            ways.entry(c.cues[0].name.clone()).or_default().push(c);
        }
    }
    // logarithms of odds of candidates, by weights that their site had no part in, with what they are
    let mut weighed: Vec<(f64, bool, bool)> = vec![];
    for (way, all) in &ways {
        let samples = Samples::new(all, without);
        let mut odds = vec![0.0; all.len()];
        for site in all.iter().map(|c| &c.site).collect::<BTreeSet<_>>() {
            let weights = samples.fit(|i| all[i].site != *site);
            let own = (0..all.len()).filter(|i| all[*i].site == *site);
            own.for_each(|i| odds[i] = samples.odds(i, &weights));
        }
        weighed.extend(odds.iter().zip(all).map(|(z, c)| (*z, c.of_right_model, c.fault)));
        let now: Vec<f64> = (0..all.len()).map(|i| samples.odds(i, &samples.now)).collect();
        let weights = samples.fit(|_| true);
        println!(
            "{way}: {} candidates, {} faults; loss now {:.4}, by others' weights {:.4}; bias {:.2}, now {:.2}",
            all.len(),
            samples.faults.iter().sum::<f64>(),
            samples.loss(&now),
            samples.loss(&odds),
            weights[0],
            samples.now[0]
        );
        for (k, name) in samples.names.iter().enumerate() {
            let [new, now] = [weights[k + 1], samples.now[k + 1]].map(|w| w / samples.spread[k]);
            println!("    {name:46} even {:6.2}  weight {new:7.3}, now {now:7.3}", samples.even[k]);
        }
    }
    report(&weighed, photographs);
}

/// Prints how many candidates of at least some odds right models give, and how sure is what was told.
fn report(weighed: &[(f64, bool, bool)], photographs: usize) {
    println!(
        "log odds: false alarms a photograph of {photographs}; candidates from there to the next, share of faults"
    );
    for k in -6..=12 {
        let from = f64::from(k) * 0.5;
        let alarms = weighed.iter().filter(|w| w.1 && w.0 >= from).count();
        let here: Vec<bool> = weighed.iter().filter(|w| w.0 >= from && w.0 < from + 0.5).map(|w| w.2).collect();
        let right = here.iter().filter(|r| **r).count() as f64 / here.len().max(1) as f64;
        println!(
            "{from:5.1}  {:.3}  {:5}  {right:.2} (even: {:.2})",
            alarms as f64 / photographs as f64,
            here.len(),
            1.0 / (1.0 + (-from - 0.25).exp())
        );
    }
}

/// The median; 0 of none.
fn middle(mut values: Vec<f64>) -> f64 {
    if values.is_empty() { 0.0 } else { median(&mut values) }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Solves a positive definite system by elimination.
fn solved(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        for r in k + 1..n {
            let f = a[r][k] / a[k][k];
            let row = a[k].clone();
            a[r].iter_mut().zip(&row).for_each(|(x, y)| *x -= f * y);
            b[r] -= f * b[k];
        }
    }
    for k in (0..n).rev() {
        let rest: f64 = (k + 1..n).map(|c| a[k][c] * b[c]).sum();
        b[k] = (b[k] - rest) / a[k][k];
    }
    b
}
