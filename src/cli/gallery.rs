//! `clerestory gallery FILE`.

use anyhow::{Context, anyhow};
use clap::Args;
use clerestory::plan::free_space::open_space::OpenSpace;
use clerestory::plan::free_space::polygon::Polygon;
use clerestory::plan::gallery::{Effort, Guards, guard};
use clerestory::report::{gallery_sheet, write_file};
use glam::DVec2;
use serde::{Deserialize, Serialize};
use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Duration;

use super::terminal::number::between;
use super::terminal::output::json;

/// Find the fewest guards that see all of a polygon with holes, and say how few could do.
#[derive(Args, Debug)]
#[command(after_help = "The file is JSON: {\"outer\": [[x, y], …], \"holes\": [[[x, y], …], …]}, in any unit.\n\
    The answer is JSON on stdout: {\"guards\": [[x, y], …], \"covered_fraction\": 1.0, \"lower_bound\": 3}.\n\n\
    Examples:\n  clerestory gallery museum.json --svg museum.svg\n  clerestory gallery museum.json --certify --time-limit 60")]
pub(crate) struct GalleryArgs {
    /// The polygon
    #[arg(value_hint = clap::ValueHint::FilePath)]
    file: PathBuf,
    /// Go on until no fewer guards are proved to do, or the time is over
    #[arg(long)]
    certify: bool,
    /// Seconds that --certify may take
    #[arg(long, value_name = "S", default_value_t = 60.0, requires = "certify", value_parser = between(f64::MIN_POSITIVE..=1e6, "more than 0 and at most 1000000 seconds"))]
    time_limit: f64,
    /// Draw the polygon, the guards and what each sees
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    svg: Option<PathBuf>,
    /// Print nothing but the JSON
    #[arg(long)]
    json: bool,
    /// The same
    #[arg(short, long)]
    quiet: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Input {
    outer: Vec<[f64; 2]>,
    #[serde(default)]
    holes: Vec<Vec<[f64; 2]>>,
}

#[derive(Serialize)]
struct Output<'a> {
    guards: Vec<[f64; 2]>,
    covered_fraction: f64,
    lower_bound: usize,
    proved: bool,
    warnings: &'a [&'a str],
}

/// Solves the file's polygon and writes the guards to `out`.
pub(crate) fn run(args: &GalleryArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let path = args.file.display();
    let bytes = std::fs::read(&args.file).with_context(|| format!("cannot read {path}"))?;
    let input: Input = serde_json::from_slice(&bytes)
        .map_err(|e| anyhow!("{path}: {e}; expected {{\"outer\": [[x, y], …], \"holes\": [[[x, y], …], …]}}"))?;
    let ring = |r: Vec<[f64; 2]>| r.into_iter().map(DVec2::from).collect::<Vec<_>>();
    let polygon = Polygon { outer: ring(input.outer), holes: input.holes.into_iter().map(ring).collect() };
    let open = OpenSpace::new(&[polygon]).with_context(|| path.to_string())?;
    let time_limit = Some(Duration::from_secs_f64(args.time_limit));
    let result = guard(&open, Effort { certify: args.certify, time_limit });
    let warnings: &[&str] = if open.altered() {
        &["rings cross or overlap: they were cut at their crossings, and their inside was taken"]
    } else {
        &[]
    };
    if let Some(file) = &args.svg {
        write_file(file, gallery_sheet(&open, &result).finish().as_bytes())?;
    }
    let guards = result.guards.iter().map(DVec2::to_array).collect();
    let Guards { covered_fraction, lower_bound, .. } = result;
    let output = Output { guards, covered_fraction, lower_bound, proved: result.proved(), warnings };
    json(&output, out)?;
    if !(args.json || args.quiet) {
        tell(&result, warnings)?;
    }
    Ok(())
}

/// The same in words, on stderr: stdout is for programs.
fn tell(result: &Guards, warnings: &[&str]) -> io::Result<()> {
    let mut err = io::stderr().lock();
    for warning in warnings {
        writeln!(err, "! {warning}")?;
    }
    let n = result.guards.len();
    let guards = if n == 1 { "guard" } else { "guards" };
    let proof = match result.lower_bound {
        bound if bound >= n => "no fewer can do".to_owned(),
        bound => format!("at least {bound} are needed"),
    };
    writeln!(err, "{n} {guards} see {:.4} % of the area; {proof}", result.covered_fraction * 100.0)
}
