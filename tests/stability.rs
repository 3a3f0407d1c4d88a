//! Numerical stability on stiff and extreme cases, as a suite and as the table `docs/stability.md`.
//!
//! `UPDATE_GOLDEN=1 cargo test --test stability` writes the table anew; without it the table must say what is seen, but
//! for the last digits of errors.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

#[path = "stability/fits.rs"]
mod fits;
#[path = "stability/light.rs"]
mod light;
#[path = "stability/numbers.rs"]
mod numbers;
#[path = "stability/rooms.rs"]
mod rooms;
mod support;
#[path = "stability/ulp.rs"]
mod ulp;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// One case: what is computed, what must come out, how far off it is and may be.
pub(crate) struct Row {
    pub(crate) case: &'static str,
    pub(crate) computed: &'static str,
    pub(crate) expected: &'static str,
    pub(crate) error: f64,
    pub(crate) bound: f64,
    pub(crate) amplification: Ulp,
}

/// What a unit in the last place of every input does to the result.
#[derive(Clone, Copy)]
pub(crate) enum Ulp {
    /// Not told yet; no row may stay so.
    Unsaid,
    /// Relative change of the result over that of the input, and the most it may be.
    Amplified(f64, f64),
    /// The result counts things: it is no continuous function of the input.
    Count,
}

impl Row {
    pub(crate) fn new(case: &'static str, computed: &'static str, expected: &'static str) -> Self {
        Self { case, computed, expected, error: f64::NAN, bound: 0.0, amplification: Ulp::Unsaid }
    }

    pub(crate) fn off(self, by: impl Into<f64>, most: f64) -> Self {
        Self { error: by.into(), bound: most, ..self }
    }

    pub(crate) fn amplified(self, by: f64) -> Self {
        self.amplified_within(by, 1e4)
    }

    pub(crate) fn amplified_within(self, by: f64, most: f64) -> Self {
        Self { amplification: Ulp::Amplified(by, most), ..self }
    }

    pub(crate) fn counted(self) -> Self {
        Self { amplification: Ulp::Count, ..self }
    }

    fn line(&self) -> String {
        let Self { case, computed, expected, error, bound, amplification } = self;
        let amplification = match amplification {
            Ulp::Unsaid => "?".to_owned(),
            Ulp::Amplified(by, _) => format!("{by:.1}"),
            Ulp::Count => "not continuous".to_owned(),
        };
        format!("| {case} | {computed} | {expected} | {error:.1e} | {bound:.0e} | {amplification} |")
    }
}

/// The greatest relative difference from what is expected; NaN if a value is.
pub(crate) fn worst(values: impl IntoIterator<Item = f32>, expected: f32) -> f64 {
    values.into_iter().map(|v| f64::from((v / expected - 1.0).abs())).max_by(f64::total_cmp).unwrap_or(0.0)
}

const HEAD: &str = "# Numerical stability

Made by `UPDATE_GOLDEN=1 cargo test --test stability`, which holds every row to its bound.

Error is relative to what is expected unless the row says otherwise; 0 is “to the last bit”. The last column perturbs
every input (the pixels of the probes, unless the row is about another one) by one unit in the last place, up or down by
turns, and tells how many times that the result moves: 1 passes the perturbation on, less swallows it; a result that
counts things is no continuous function of its input. Expected values are closed forms, double-precision quadrature or a
brute-force reference, never an earlier run. Where a result converges with a setting, each step has a row and a bound of
its own.

| case | what is computed | expected | error seen | bound | one ulp in, ulps out |
|---|---|---|---:|---:|---:|
";

#[test]
fn every_row_is_within_its_bound_and_the_table_says_so() {
    let mut rows = rooms::rows();
    rows.extend(light::rows());
    rows.extend(numbers::rows());
    rows.extend(fits::rows());
    let mut text = HEAD.to_owned();
    for row in &rows {
        println!("{}", row.line());
        writeln!(text, "{}", row.line()).unwrap();
    }
    for row in &rows {
        assert!(row.error.is_finite() && row.error <= row.bound, "{}: {} > {}", row.case, row.error, row.bound);
        let told = match row.amplification {
            Ulp::Unsaid => false,
            Ulp::Amplified(by, most) => by.is_finite() && by < most,
            Ulp::Count => true,
        };
        assert!(told, "{}: {}", row.case, row.line());
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/stability.md");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        fs::write(&file, &text).unwrap();
    }
    let kept = fs::read_to_string(&file).unwrap();
    let lines = |t: &str| t.lines().map(str::to_owned).collect::<Vec<_>>();
    let (kept, seen) = (lines(&kept), lines(&text));
    assert_eq!(kept.len(), seen.len(), "rows are missing: run with UPDATE_GOLDEN=1");
    for (kept, seen) in kept.iter().zip(&seen) {
        assert!(alike(kept, seen), "docs/stability.md says\n{kept}\nbut seen is\n{seen}\nRun with UPDATE_GOLDEN=1");
    }
}

/// Equal but for errors and amplifications that differ by rounding: by less than a third, or both under 10⁻⁵.
fn alike(kept: &str, seen: &str) -> bool {
    let cells = |t: &str| t.split('|').map(|c| c.trim().to_owned()).collect::<Vec<_>>();
    let (kept, seen) = (cells(kept), cells(seen));
    let near = |a: &str, b: &str, slack: f64| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= 0.35 * a.max(b) + slack || (a < 1e-5 && b < 1e-5),
        _ => a == b,
    };
    kept.len() == seen.len()
        && kept.iter().zip(&seen).enumerate().all(|(i, (a, b))| match i {
            4 => near(a, b, 0.0),
            6 => near(a, b, 0.1),
            _ => a == b,
        })
}

#[test]
fn tables_differ_by_more_than_rounding_or_not_at_all() {
    let row = "| a | b | c | 1.0e-3 | 1e-2 | 1.0 |";
    assert!(alike(row, "| a | b | c | 1.2e-3 | 1e-2 | 1.1 |"));
    assert!(!alike(row, "| a | b | c | 2.0e-3 | 1e-2 | 1.0 |"));
    assert!(!alike(row, "| a | b | d | 1.0e-3 | 1e-2 | 1.0 |"));
    assert!(alike("| a | b | c | 0.0e0 | 1e-2 | x |", "| a | b | c | 3.0e-7 | 1e-2 | x |"));
}
