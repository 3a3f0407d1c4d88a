//! Fits the weights of the decision (`src/audit/decide/odds.rs`) to candidates whose truth is known: logistic regression with
//! a Gaussian prior on the weights (Hosmer & Lemeshow, *Applied Logistic Regression*, 2013). How often right models give candidates of
//! some odds, and how many of them are faults, is told by weights that a candidate's own site had no part in.

use clerestory::audit::Finding;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Candidates that are less likely than this, by the weights as they are, are not kept.
pub const LEAST: f64 = 0.003;

/// Precision of the prior on a weight, whose cue has a standard deviation of 1.
const PRIOR: f64 = 5.0;

/// What was weighed, and whether it is a fault.
#[derive(Clone, Debug)]
pub struct Candidate {
    case: String,
    of_right_model: bool,
    fault: bool,
    /// Names and values of the cues, and where they speak neither way; the first name says what way it was found.
    cues: Vec<(String, f64, f64)>,
}

impl Candidate {
    pub fn new(case: &str, of_right_model: bool, fault: bool, finding: &Finding) -> Self {
        let cues = finding.evidence.iter().map(|e| (e.test.clone(), e.value, e.threshold)).collect();
        Self { case: case.to_owned(), of_right_model, fault, cues }
    }

    fn site(&self) -> &str {
        self.case.split(' ').next().unwrap_or_default()
    }
}

/// A candidate's cues after a 1, and whether it is a fault.
type Sample = (Vec<f64>, f64);

/// Writes candidates, one a line, after the number of photographs of right models.
pub fn write(file: &Path, photographs: usize, all: &[Candidate]) {
    let line = |c: &Candidate| {
        let cues: Vec<String> = c.cues.iter().map(|(name, value, even)| format!("{name}\t{value}\t{even}")).collect();
        format!("{}\t{}\t{}\t{}\n", c.case, u8::from(c.of_right_model), u8::from(c.fault), cues.join("\t"))
    };
    std::fs::write(file, format!("{photographs}\n") + &all.iter().map(line).collect::<String>()).unwrap();
}

fn read(file: &str) -> (usize, Vec<Candidate>) {
    let text = std::fs::read_to_string(file).unwrap();
    let of_line = |line: &str| {
        let fields: Vec<&str> = line.split('\t').collect();
        let cues = fields[3..].chunks(3);
        let cues = cues.map(|c| (c[0].to_owned(), c[1].parse().unwrap(), c[2].parse().unwrap())).collect();
        Candidate { case: fields[0].to_owned(), of_right_model: fields[1] == "1", fault: fields[2] == "1", cues }
    };
    let mut lines = text.lines();
    (lines.next().unwrap().parse().unwrap(), lines.map(of_line).collect())
}

/// Prints the weights that suit the candidates of these files best.
pub fn fit(files: &[String]) {
    let mut ways: BTreeMap<String, Vec<Candidate>> = BTreeMap::new();
    let mut photographs = 0;
    for file in files {
        let (right, all) = read(file);
        photographs += right;
        for c in all {
            ways.entry(c.cues[0].0.clone()).or_default().push(c);
        }
    }
    // logarithms of odds of candidates, by weights that their site had no part in, with what they are
    let mut weighed: Vec<(f64, bool, bool)> = vec![];
    for (way, all) in &ways {
        let names: Vec<&str> = all[0].cues.iter().map(|c| c.0.as_str()).collect();
        let n = names.len();
        let off = |c: &Candidate, k: usize| c.cues[k].1 - c.cues[k].2;
        let spread: Vec<f64> = (0..n)
            .map(|k| (all.iter().map(|c| off(c, k).powi(2)).sum::<f64>() / all.len() as f64).sqrt().max(1e-6))
            .collect();
        let sample = |c: &Candidate| -> Sample {
            (std::iter::once(1.0).chain((0..n).map(|k| off(c, k) / spread[k])).collect(), f64::from(u8::from(c.fault)))
        };
        let samples: Vec<Sample> = all.iter().map(sample).collect();
        let weights = regression(&samples.iter().collect::<Vec<_>>());
        // what is said of a site's candidates by the others'
        for site in all.iter().map(Candidate::site).collect::<BTreeSet<_>>() {
            let (own, others): (Vec<usize>, Vec<usize>) = (0..all.len()).partition(|i| all[*i].site() == site);
            if others.is_empty() {
                continue;
            }
            let without = regression(&others.into_iter().map(|i| &samples[i]).collect::<Vec<_>>());
            weighed
                .extend(own.into_iter().map(|i| (dot(&samples[i].0, &without), all[i].of_right_model, all[i].fault)));
        }
        let faults = all.iter().filter(|c| c.fault).count();
        println!("{way}: {} candidates, {faults} faults; bias {:.2}", all.len(), weights[0]);
        for k in 0..n {
            let even = all[0].cues[k].2;
            let mut values: Vec<f64> = all.iter().map(|c| c.cues[k].1).collect();
            values.sort_by(f64::total_cmp);
            let (low, high) = (values[0], values[values.len() - 1]);
            let weight = weights[k + 1] / spread[k];
            println!("    {:46} even {even:6.2}  weight {weight:7.3}  seen: {low:.2} to {high:.2}", names[k]);
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

/// Weights of a logistic regression, by Newton's method; the first column is 1. The prior on that is one fault and one that is none
/// where all cues speak neither way (Laplace's rule of succession).
fn regression(samples: &[&Sample]) -> Vec<f64> {
    let n = samples[0].0.len();
    let even = [1.0, 0.0].map(|t| ((0..n).map(|k| if k == 0 { 1.0 } else { 0.0 }).collect(), t));
    let mut weights = vec![0.0; n];
    for _ in 0..30 {
        let mut gradient: Vec<f64> = (0..n).map(|k| if k == 0 { 0.0 } else { -PRIOR * weights[k] }).collect();
        let mut hessian = vec![vec![0.0; n]; n];
        for (k, row) in hessian.iter_mut().enumerate() {
            row[k] = if k == 0 { 1e-9 } else { PRIOR };
        }
        for (row, t) in samples.iter().copied().chain(&even) {
            let p = 1.0 / (1.0 + (-dot(row, &weights)).exp());
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
